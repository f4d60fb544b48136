"""Placement: demands hold in independent predictions and searches for rivals. How few: `test_placement_small_cases`."""

from dataclasses import replace

import numpy as np
import pytest

from commission.errors import JobCancelled, UsageError
from commission.planning.ambiguity import ambiguous_poses
from commission.planning.error_budget import predict_errors
from commission.planning.placement import Demands, PlacementOptions, place
from commission.planning.route_prediction import PredictionOptions, plan_route, predict_route
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.site.layout_brief import CandidateOptions
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from tests.planning.driven import EXACT
from tests.planning.sites import open_field, reflectors_at, room

SCANNER = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=8.0, rate=5.0)
"""Five scans a second keep the enumeration of all layouts short."""


def hall(**changes) -> Project:
    route = Route("Through", (Segment(control_points=np.array([[2.0, 4.0], [16.0, 4.0]]), degree=1),), 1.0)
    return Project(floor_map=room(18.0, 8.0), scanners=(SCANNER,), routes=(route,), **changes)


def holds(project: Project, reflectors: ReflectorMap, demands: Demands) -> bool:
    """Whether a layout meets the demands: sites without each of its reflectors, planned and predicted anew."""
    planned = plan_route(replace(project, reflectors=reflectors), project.routes[0].name)
    if planned.visible.counts().min() < demands.visible + demands.survive_failure:
        return False
    limit = demands.position_limit or project.parameters.supervisor.position_limit
    heading = demands.heading_limit or project.parameters.supervisor.heading_limit
    limits = np.tile((limit, limit, heading), (len(planned.drive), 1))
    for station in project.stations:
        there = np.hypot(*(planned.drive.poses[:, :2] - (station.x, station.y)).T) <= 0.2
        limits[there, :2] = np.minimum(limits[there, :2], station.required_accuracy)
    # While the vehicle rests at the start, its pose is as sure as was assumed.
    limits[: np.flatnonzero(planned.drive.metres == 0.0).max()] = np.inf
    layouts = [reflectors, *(without_each(reflectors) if demands.survive_failure else ())]
    return all(bool(np.all(said_and_true(replace(project, reflectors=layout)) <= limits)) for layout in layouts)


def said_and_true(site: Project) -> np.ndarray:
    """(K, 3) 2-sigma that the filter will say, or of its error where that is larger."""
    planned = plan_route(site, site.routes[0].name)
    prediction = predict_route(planned)
    said, true = prediction.covariances, predict_errors(planned, prediction).squares
    return 2.0 * np.sqrt(np.maximum(*(np.diagonal(each, axis1=1, axis2=2) for each in (said, true))))


def test_a_suggested_layout_meets_its_demands_and_its_spacing():
    project, demands = hall(), Demands(visible=2, spacing=1.0)
    found = place(project, options=PlacementOptions(demands=demands))
    assert found.unmet == ()
    assert found.at_least <= found.added == len(found.reflectors) <= found.at_least + 2
    assert holds(project, found.reflectors, demands)
    centers = found.reflectors.centers
    apart = np.hypot(*(centers[:, np.newaxis] - centers).transpose(2, 0, 1))[np.triu_indices(len(centers), 1)]
    assert apart.min() >= 1.0
    # On the free side of the walls, and off the vehicle's way.
    assert not project.floor_map.occupancy().is_occupied(centers).any()
    assert np.abs(centers[:, 1] - 4.0).min() > 0.6


POOR = Parameters(odometry=OdometryParameters(heading_per_sqrt_m=0.05, forward_per_sqrt_m=0.05))
"""So poor odometry that two distant reflectors do not hold the pose."""


def test_tight_limits_ask_for_more_reflectors_than_sight_alone():
    project = hall(parameters=POOR)
    loose, tight = (
        Demands(visible=1, survive_failure=False),
        Demands(visible=1, survive_failure=False, position_limit=0.03),
    )
    few, more = (place(project, options=PlacementOptions(demands=demands)) for demands in (loose, tight))
    assert few.added < more.added
    assert more.unmet == ()
    assert holds(project, more.reflectors, tight)


def test_limits_hold_without_any_single_reflector_where_that_is_demanded():
    demands = Demands(visible=1, position_limit=0.05)
    fragile = place(hall(parameters=POOR), options=PlacementOptions(demands=replace(demands, survive_failure=False)))
    sturdy = place(hall(parameters=POOR), options=PlacementOptions(demands=demands))
    assert sturdy.unmet == ()
    assert holds(hall(parameters=POOR), sturdy.reflectors, demands)
    # Two in sight everywhere are not enough of a reason: the limit asks for more.
    by_sight = place(hall(parameters=POOR), options=PlacementOptions(demands=replace(demands, position_limit=1.0)))
    assert not holds(hall(parameters=POOR), by_sight.reflectors, demands)
    assert fragile.added < sturdy.added


def test_a_station_gets_the_accuracy_that_it_requires():
    station = Station(name="Dock", x=9.0, y=4.0, required_accuracy=0.02)
    demands = Demands(visible=1, survive_failure=False)
    without, with_dock = (
        place(hall(parameters=POOR, stations=stations), options=PlacementOptions(demands=demands))
        for stations in ((), (station,))
    )
    assert with_dock.unmet == ()
    assert holds(hall(parameters=POOR, stations=(station,)), with_dock.reflectors, demands)
    assert not holds(hall(parameters=POOR, stations=(station,)), without.reflectors, demands)


def test_extending_keeps_what_there_is_and_adds_fewer():
    project, demands = hall(), Demands(visible=2)
    empty = place(project, options=PlacementOptions(demands=demands))
    half = ReflectorMap(empty.reflectors.reflectors[::2])
    extended = place(replace(project, reflectors=half), options=PlacementOptions(demands=demands))
    assert extended.reflectors.reflectors[: len(half)] == half.reflectors
    assert extended.added < empty.added
    assert extended.unmet == ()
    ids = [reflector.id for reflector in extended.reflectors.reflectors]
    assert len(set(ids)) == len(ids)


def test_what_cannot_be_met_is_named_by_route_and_metre():
    far = Project(floor_map=room(18.0, 8.0), scanners=(replace(SCANNER, reflector_range=2.0),), routes=hall().routes)
    found = place(far, options=PlacementOptions(demands=Demands(visible=2)))
    assert {(unmet.route, unmet.reason) for unmet in found.unmet} >= {("Through", "visible")}
    # In the middle of the hall no wall is within two metres.
    assert 7 in next(unmet for unmet in found.unmet if unmet.reason == "visible").metres


def test_a_search_that_has_predicted_enough_ends_and_says_so_and_what_does_not_hold(monkeypatch):
    demands = Demands(visible=2, position_limit=0.03)
    options = PlacementOptions(demands=demands)
    whole = place(hall(parameters=POOR), options=options)
    assert not whole.was_ended
    monkeypatch.setattr("commission.planning.layout_search.MOST_SIGHTINGS", 1)
    ended = place(hall(parameters=POOR), options=options)
    assert ended.was_ended
    # It has only seen to visibility: what it lacks is named, and by no fewer than hold.
    assert not holds(hall(parameters=POOR), ended.reflectors, demands)
    assert {unmet.reason for unmet in ended.unmet} == {"uncertainty"}


def test_an_open_field_has_no_candidates():
    found = place(open_field([(3.0, 2.0)]))
    assert found.added == 0
    assert len(found.candidates) == 0
    assert found.unmet


def test_an_unknown_route_is_refused():
    with pytest.raises(UsageError, match="no route is called 'Loop'"):
        place(hall(), ("Loop",))


def test_progress_never_falls_and_may_cancel():
    fractions = []
    place(hall(), options=PlacementOptions(demands=Demands(visible=1)), progress=lambda done, _: fractions.append(done))
    assert fractions == sorted(fractions)

    def stop(fraction, what):
        if what == "predicting":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        place(hall(), options=PlacementOptions(demands=Demands(visible=1)), progress=stop)


def test_the_same_seed_gives_the_same_layout():
    first, second = (place(hall(), options=PlacementOptions(demands=Demands(visible=2))) for _ in range(2))
    assert first.reflectors == second.reflectors


CORNERS = ((0.2, 0.2), (11.8, 0.2), (11.8, 7.8), (0.2, 7.8))
"""A hall of 12 x 8 m looks the same after half a turn."""


def symmetric_hall(scanner=None, **changes) -> Project:
    route = Route("Across", (Segment(control_points=np.array([[3.0, 2.5], [9.0, 2.5]]), degree=1),), 1.0)
    given = {
        "reflectors": reflectors_at(CORNERS),
        "scanners": (scanner or replace(SCANNER, reflector_range=20.0),),
        **changes,
    }
    return Project(floor_map=room(12.0, 8.0), routes=(route,), **given)


def ambiguous(project: Project, reflectors: ReflectorMap, *poses) -> list[bool]:
    return ambiguous_poses(vehicle_visibility(replace(project, reflectors=reflectors)), poses).ambiguous.tolist()


def without_each(reflectors: ReflectorMap) -> list[ReflectorMap]:
    every = reflectors.reflectors
    return [ReflectorMap(every[:i] + every[i + 1 :]) for i in range(len(every))]


def test_a_symmetric_hall_gets_a_layout_that_tells_the_start_of_a_route_from_its_rival():
    project, start = symmetric_hall(), (3.0, 2.5, 0.0)
    alike = place(project, options=PlacementOptions(demands=Demands(visible=2, survive_failure=False)))
    assert (alike.added, alike.unmet) == (0, ())
    assert ambiguous(project, alike.reflectors, start) == [True]
    demands = Demands(visible=2, survive_failure=False, unambiguous_starts=True)
    clear = place(project, options=PlacementOptions(demands=demands))
    assert (clear.added, clear.unmet) == (1, ())
    assert ambiguous(project, clear.reflectors, start) == [False]


def test_places_stay_clear_whichever_single_reflector_is_blocked():
    spot = (6.0, 5.0)
    project = symmetric_hall(stations=(Station(name="Dock", x=9.0, y=2.5),), reflectors=ReflectorMap())
    demands = Demands(visible=1, unambiguous_stations=True, unambiguous_spots=(spot,))
    found = place(project, options=PlacementOptions(demands=demands, extend=False))
    assert found.unmet == ()
    for layout in (found.reflectors, *without_each(found.reflectors)):
        assert ambiguous(project, layout, (9.0, 2.5, 0.0), (*spot, 0.0)) == [False, False]


def test_a_spot_without_a_heading_is_clear_in_all_of_them_and_one_with_a_heading_in_that_one():
    narrow = replace(SCANNER, field_of_view_deg=(-90.0, 90.0), reflector_range=20.0)
    project = symmetric_hall(scanner=narrow)
    counts = []
    for spot in ((6.0, 3.0, 0.0), (6.0, 3.0)):
        demands = Demands(visible=1, survive_failure=False, unambiguous_spots=(spot,))
        found = place(project, options=PlacementOptions(demands=demands))
        assert found.unmet == ()
        headings = [0.0] if len(spot) == 3 else np.arange(8) * np.pi / 4
        poses = [(*spot[:2], heading) for heading in headings]
        assert not any(ambiguous(project, found.reflectors, *poses))
        counts.append(found.added)
    assert 0 < counts[0] <= counts[1]


def test_a_place_that_nothing_clears_is_named_beside_the_nearest_metre_of_a_route():
    project = symmetric_hall(stations=(Station(name="Dock", x=8.2, y=3.0),))
    nowhere = CandidateOptions(keep_out=((0.0, 0.0, 12.0, 8.0),))
    demands = Demands(visible=2, survive_failure=False, unambiguous_stations=True)
    (unmet,) = place(project, options=PlacementOptions(demands=demands, candidates=nowhere)).unmet
    assert (unmet.reason, unmet.place, unmet.route, unmet.metres) == ("ambiguous", "station 'Dock'", "Across", (5,))


def test_locked_reflectors_stay_where_the_layout_starts_empty():
    locked = replace(symmetric_hall().reflectors.reflectors[2], locked=True)
    corners = symmetric_hall().reflectors.reflectors
    project = symmetric_hall(reflectors=ReflectorMap((*corners[:2], locked, corners[3])))
    found = place(project, options=PlacementOptions(demands=Demands(visible=2), extend=False))
    assert found.reflectors.reflectors[0] == locked
    assert found.added == len(found.reflectors) - 1 > 0
    assert found.unmet == ()


def test_the_first_scans_before_the_vehicle_sets_off_ask_for_nothing():
    """Its pose there is as sure as was assumed, whatever the layout; so is that at a station where the route starts."""
    project = hall(stations=(Station(name="Dock", x=2.0, y=4.0, required_accuracy=0.025),))
    assumed = PredictionOptions(start_sigmas=(0.05, 0.05, 0.02))
    demands = Demands(visible=1, survive_failure=False, position_limit=0.03)
    found = place(project, options=PlacementOptions(demands=demands, prediction=assumed))
    assert found.unmet == ()
    planned = plan_route(replace(project, reflectors=found.reflectors), "Through", assumed)
    prediction = predict_route(planned)
    assert prediction.two_sigma[0, 0] > 0.03
    assert prediction.two_sigma[planned.drive.sets_off :, :2].max() <= 0.03
    assert planned.drive.metres[planned.drive.sets_off] == 0.0 < planned.drive.metres[planned.drive.sets_off + 1]


TIGHT = Demands(visible=1, position_limit=0.025)


@pytest.mark.parametrize("limit", [0.02, 0.03])
def test_more_effort_never_gives_more_reflectors(limit: float):
    demands = Demands(visible=1, position_limit=limit)
    sizes = [
        place(hall(parameters=POOR), options=PlacementOptions(demands=demands, checks=checks)).added
        for checks in (0, 1, 5, 150)
    ]
    assert sizes == sorted(sizes, reverse=True)


def test_a_search_that_is_ended_gives_its_best_layout_so_far():
    whole = place(hall(parameters=POOR), options=PlacementOptions(demands=TIGHT))

    def end_when_fewer_are_looked_for(_done: float, what: str) -> None:
        if what == "doing with fewer":
            raise JobCancelled("enough")

    ended = place(
        hall(parameters=POOR), options=PlacementOptions(demands=TIGHT), progress=end_when_fewer_are_looked_for
    )
    assert ended.was_ended
    assert not whole.was_ended
    assert ended.unmet == ()
    assert holds(hall(parameters=POOR), ended.reflectors, TIGHT)
    assert ended.added >= whole.added


def test_the_bound_knows_the_limits_and_not_only_what_is_seen():
    """One reflector in sight is enough to be seen; it is far too few for such limits.

    Constants are exact: with those of the default uncertainty nothing holds 12 mm in this hall.
    """
    loose = Demands(visible=1, survive_failure=False)
    tight = replace(loose, position_limit=0.012)
    by_sight, by_limit = (
        place(hall(parameters=POOR, uncertainty=EXACT), options=PlacementOptions(demands=each))
        for each in (loose, tight)
    )
    assert by_limit.unmet == ()
    assert by_sight.at_least < by_limit.at_least <= by_limit.added
