"""What is drawn along a route: the ribbon's pieces, stretches that fail, a run beside the prediction, the chart."""

import re
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.view import LivedPath
from commission.app.prediction.chart import chart
from commission.app.prediction.driven import driven
from commission.app.prediction.event_layer import events, place_at
from commission.app.prediction.limit_colors import BOUNDS, limit_classes, palette
from commission.app.prediction.ribbon_layer import pieces
from commission.app.prediction.stacks import Stacked, stacked
from commission.app.prediction.tracks import TrackAxis, round_up
from commission.app.prediction.view import RouteView, route_view
from commission.planning.error_budget import CONTRIBUTIONS, predict_errors
from commission.planning.route_prediction import RoutePrediction, plan_route, predict_route
from commission.site.parameters import FilterParameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.stations import Station
from commission.studies.prediction import PredictionInput
from commission.studies.prediction import prediction as prediction_study
from commission.studies.run import RunResult


@pytest.fixture(scope="module")
def prediction(project: Project) -> RoutePrediction:
    return predict_route(plan_route(project, project.routes[0].name))


@pytest.fixture
def lived(result: RunResult) -> LivedPath:
    return LivedPath(result.columns.means, result.two_sigma, result.position_two_sigma)


def test_thinning_a_ribbon_keeps_its_worst_spot_and_both_ends() -> None:
    points = np.stack([np.arange(1000.0), np.zeros(1000)], axis=1)
    shares = np.zeros(1000)
    shares[503] = 2.0
    lines, classes = pieces(points, shares, 100)
    assert len(lines) <= 100
    assert lines[0, 0].tolist() == [0.0, 0.0]
    assert lines[-1, 1].tolist() == [999.0, 0.0]
    assert classes.max() == len(palette()) - 1
    assert np.array_equal(lines[1:, 0], lines[:-1, 1])


def test_a_load_above_the_limit_has_a_color_outside_of_the_ramp() -> None:
    below, above = limit_classes(np.array([0.999 * BOUNDS[-1], 1.001 * BOUNDS[-1]])).tolist()
    assert (below, above) == (len(palette()) - 2, len(palette()) - 1)


def test_a_run_there_and_back_is_laid_over_the_metres_it_was_driven(
    lived: LivedPath, prediction: RoutePrediction
) -> None:
    found = driven(lived, prediction)
    assert found is not None
    assert np.all(np.diff(found.metres) >= 0.0)
    # The vehicle stops some centimetres short of the planned end or beyond.
    assert found.metres[-1] == pytest.approx(prediction.drive.length, abs=0.2)


def test_a_run_elsewhere_is_not_laid_over_the_route(lived: LivedPath, prediction: RoutePrediction) -> None:
    assert driven(replace(lived, poses=lived.poses + np.array([3.0, 3.0, 0.0])), prediction) is None


def strict(project: Project) -> Project:
    """A project whose supervisor stops the vehicle at once, and lets it go on metres later."""
    limits = replace(project.parameters.supervisor, position_limit=0.012)
    # White noise alone: with constants considered, 2-sigma never shrinks as far again.
    noise = FilterParameters(consider=False)
    return replace(project, parameters=replace(project.parameters, supervisor=limits, filter=noise))


def expected(project: Project) -> RouteView:
    """What the page shows of the first route."""
    return route_view(prediction_study(PredictionInput.of(project, project.routes[0].name)), outdated=False)


def test_the_chart_says_where_the_supervisor_stops_and_draws_it(project: Project) -> None:
    calm = chart(expected(project), None)
    assert "nowhere" in calm
    assert "c-stop" not in calm
    route = expected(strict(project))
    drawn = chart(route, None)
    assert "nowhere" not in drawn
    # One line in each of the six drawings.
    assert drawn.count("class='c-stop'") == 6 * len(route.prediction.trips()) > 0
    assert drawn.count("class='c-recovery'") == 6 * len(route.prediction.recoveries()) > 0


def test_the_chart_draws_the_error_that_the_command_writes_and_what_it_comes_from(project: Project) -> None:
    route = expected(project)
    planned = plan_route(project, project.routes[0].name)
    errors = predict_errors(planned, predict_route(planned))
    largest = np.array([errors.position_two_sigma.max(), errors.two_sigma[:, 2].max()])
    np.testing.assert_array_equal(route.errors.max(axis=0), largest)
    drawn = chart(route, None)
    assert drawn.count("class='c-error'") == 2
    assert f">{1000 * largest[0]:.1f} mm<" in drawn
    assert f">{np.degrees(largest[1]):.2f}°<" in drawn
    # Each source has its name below the bars; what shows least here, the range, is too low to be drawn.
    assert all(f"</span>{name}</span>" in drawn for name in CONTRIBUTIONS)
    assert {name for n, name in enumerate(CONTRIBUTIONS) if f"c-source-{n}'" in drawn} >= {"noise", "map", "mounting"}


def test_bars_of_sources_end_at_the_level_and_have_the_heights_of_their_shares() -> None:
    axis = TrackAxis(
        length=2.0, metres=np.array([0.0, 1.0]), fills=("red", "red"), stops=np.empty(0), recoveries=np.empty(0)
    )
    shares = np.array([[0.5, 0.25, 0.25, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0]])
    track = Stacked(title="2σ [mm]", levels=np.array([10.0, 5.0]), shares=shares, limit=20.0, limit_text="20 mm")
    drawn = stacked(track, axis)
    # The axis ends a twentieth above the limit of 20 mm, which is drawn 20 / 21 of 60 pixels above the bottom.
    bars = re.findall(r"c-source-(\d)' x='[\d.]+' y='([\d.]+)' width='[\d.]+' height='([\d.]+)'", drawn)
    heights = {(int(source), float(height)) for source, _, height in bars}
    unit = 60.0 / 21.0
    expected = {(0, 5.0), (1, 2.5), (2, 2.5), (4, 5.0)}
    assert heights == {(source, round(level * unit, 2)) for source, level in expected}
    assert min(float(y) for _, y, _ in bars) == round(60.0 - 10.0 * unit, 2)
    assert f"y1='{60.0 / 21.0:.1f}'" in drawn
    # A limit that is far above the bars is told.
    far = stacked(replace(track, limit=100.0, limit_text="100 mm"), axis)
    assert "↑ limit 100 mm" in far
    assert "↑ limit" not in drawn


def test_the_floor_is_marked_where_the_supervisor_stops_and_lets_go_on(project: Project) -> None:
    route = expected(strict(project))
    found = events(route)
    assert len(found) == len(route.prediction.trips()) + len(route.prediction.recoveries())
    assert found[0].text.startswith("stops at")
    assert found[0].place == place_at(route.prediction, float(route.prediction.trips()[0]))


def test_a_station_says_whether_its_accuracy_is_met(project: Project) -> None:
    x, y = (float(value) for value in project.routes[0].segments[0].control_points[-1])
    drive = expected(project).prediction.drive
    heading = float(drive.poses[np.argmin(np.hypot(*(drive.poses[:, :2] - (x, y)).T)), 2])
    stations = (
        Station(name="Easy <dock>", x=x, y=y, heading=heading, required_accuracy=0.1),
        Station(name="Hard", x=x, y=y, heading=heading, required_accuracy=0.001),
    )
    route = expected(replace(project, stations=stations))
    drawn = chart(route, None)
    assert [each.is_met for each in route.stations] == [True, False]
    assert "Easy &lt;dock&gt;" in drawn
    assert ">met<" in drawn
    assert ">not met<" in drawn
    assert [event.text.endswith("not met") for event in events(route)] == [False, True]


def test_neighbors_inside_the_gate_are_listed_with_chance_and_metres_and_drawn(project: Project) -> None:
    assert not expected(project).risks
    first = project.reflectors.reflectors[0]
    twin = replace(first, id="Twin", y=first.y + 0.05)
    crowded = replace(project, reflectors=ReflectorMap((*project.reflectors.reflectors, twin)))
    route = expected(crowded)
    assert {(risk.reflector, risk.neighbor) for risk in route.risks} == {(first.id, "Twin"), ("Twin", first.id)}
    worst = route.risks[0]
    assert 0.1 < worst.chance <= 0.5
    assert route.risk.max() == worst.chance
    assert set(worst.metres) <= set(route.metres.metre.tolist())
    assert np.hypot(*(worst.points - worst.worst).T).min() == 0.0
    assert "wrong association" in chart(route, None)


def test_the_axis_of_a_plain_track_ends_at_a_round_number() -> None:
    assert [round_up(value) for value in (0.5, 0.51, 1.0, 3.0, 7.0, 20.0)] == [0.5, 1.0, 1.0, 5.0, 10.0, 20.0]
