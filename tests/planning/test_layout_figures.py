"""What a layout comes to, against predictions of sites from which each reflector is taken away in turn."""

from dataclasses import replace

import numpy as np
import pytest

from commission.planning.error_budget import predict_errors
from commission.planning.layout_figures import LayoutFigures, compared, layout_figures
from commission.planning.route_prediction import plan_route, predict_route
from commission.site.parameters import Parameters, SupervisorParameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from tests.planning.sites import reflectors_at, room

PLACES = [(1.0, 0.2), (5.0, 7.8), (9.0, 0.2), (13.0, 7.8), (17.0, 0.2)]


def hall(**changes) -> Project:
    route = Route("Through", (Segment(control_points=np.array([[2.0, 4.0], [16.0, 4.0]]), degree=1),), 1.0)
    given = {"reflectors": reflectors_at(PLACES), "stations": (Station(name="Dock", x=9.0, y=4.0),), **changes}
    scanner = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=9.0, rate=5.0)
    return Project(floor_map=room(18.0, 8.0), scanners=(scanner,), routes=(route,), **given)


def of(site: Project) -> LayoutFigures:
    return layout_figures(site, site.reflectors, ("Through",))


def two_sigma(site: Project) -> tuple[np.ndarray, np.ndarray, bool]:
    """(K, 3) from when the vehicle sets off, (K,) whether it is at the station, and whether it is stopped."""
    planned = plan_route(site, "Through")
    prediction = predict_route(planned)
    pairs = (prediction.covariances, predict_errors(planned, prediction).squares)
    sigmas = 2.0 * np.sqrt(np.maximum(*(np.diagonal(pair, axis1=1, axis2=2) for pair in pairs)))
    moving = slice(planned.drive.sets_off, None)
    there = np.hypot(*(planned.drive.poses[moving, :2] - (9.0, 4.0)).T) <= 0.2
    return sigmas[moving], there, bool(prediction.over_limit()[moving].any())


def test_figures_are_those_of_predictions_without_each_reflector_in_turn() -> None:
    site, found = hall(), of(hall())
    every = site.reflectors.reflectors
    intact, there, _ = two_sigma(site)
    failing = intact
    for i in range(len(every)):
        failing = np.maximum(failing, two_sigma(replace(site, reflectors=ReflectorMap(every[:i] + every[i + 1 :])))[0])
    (route,), (dock,) = found.routes, found.stations
    assert (found.reflectors, route.name, dock.name, found.places) == (5, "Through", "Dock", 2)
    assert route.intact.position == pytest.approx(intact[:, :2].max(), rel=1e-9)
    assert route.intact.heading == pytest.approx(intact[:, 2].max(), rel=1e-9)
    assert route.failing.position == pytest.approx(failing[:, :2].max(), rel=1e-9)
    assert route.failing.heading == pytest.approx(failing[:, 2].max(), rel=1e-9)
    assert dock.intact == pytest.approx(intact[there, :2].max(), rel=1e-9)
    assert dock.failing == pytest.approx(failing[there, :2].max(), rel=1e-9)
    assert route.visible == plan_route(site, "Through").visible.counts().min()


def test_a_reflector_counts_as_stopping_where_its_failing_alone_passes_the_supervisors_limit() -> None:
    every = hall().reflectors.reflectors
    worst = [
        two_sigma(hall(reflectors=ReflectorMap(every[:i] + every[i + 1 :])))[0][:, :2].max() for i in range(len(every))
    ]
    intact = two_sigma(hall())[0][:, :2].max()
    assert intact < max(worst)
    for limit in (1.01 * max(worst), 0.5 * (intact + max(worst))):
        strict = Parameters(supervisor=SupervisorParameters(position_limit=limit, heading_limit=1.0))
        site = hall(parameters=strict)
        assert not two_sigma(site)[2]
        left = [replace(site, reflectors=ReflectorMap(every[:i] + every[i + 1 :])) for i in range(len(every))]
        assert of(site).stopping == sum(two_sigma(each)[2] for each in left)
    assert of(site).stopping > 0


def test_a_site_without_reflectors_has_figures_and_can_be_compared() -> None:
    nothing, something = of(hall(reflectors=ReflectorMap())), of(hall())
    assert (nothing.reflectors, nothing.routes[0].visible, nothing.ambiguous) == (0, 0, 2)
    assert nothing.routes[0].intact.position > something.routes[0].intact.position
    lines = dict(compared(nothing, something))
    assert lines["Reflectors"] == "0 -> 5"
    assert lines["Stop if failing"].startswith("0 -> ")
    before, after = (1e3 * each.stations[0].intact for each in (nothing, something))
    assert lines["Dock"].startswith(f"2-sigma {before:.1f} -> {after:.1f} mm of 100 mm")
