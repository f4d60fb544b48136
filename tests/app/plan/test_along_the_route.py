"""What is drawn along a route: the ribbon's pieces, stretches that fail, a run beside the prediction, the chart."""

from dataclasses import replace

import numpy as np
import pytest

from commission.app.layers.prediction import pieces
from commission.app.panels.plan_chart import chart
from commission.app.plan.loads import BOUNDS, load_classes, palette
from commission.app.plan.overlay import driven
from commission.app.plan.view import RouteView, stretches
from commission.app.session import Drive, Session
from commission.localization.setup import LocalizerSetup
from commission.planning.route_prediction import RoutePrediction, plan_route, predict_route
from commission.site.project import Project


@pytest.fixture(scope="module")
def prediction(project: Project) -> RoutePrediction:
    return predict_route(plan_route(project, project.routes[0].name))


@pytest.fixture
def session(project: Project, drive: Drive) -> Session:
    session = Session(drive, LocalizerSetup.of(project))
    session.advance(1e-9)
    while not session.at_end:
        session.step()
    return session


def test_thinning_a_ribbon_keeps_its_worst_spot_and_both_ends() -> None:
    points = np.stack([np.arange(1000.0), np.zeros(1000)], axis=1)
    loads = np.zeros(1000)
    loads[503] = 2.0
    lines, classes = pieces(points, loads, 100)
    assert len(lines) <= 100
    assert lines[0, 0].tolist() == [0.0, 0.0]
    assert lines[-1, 1].tolist() == [999.0, 0.0]
    assert classes.max() == len(palette()) - 1
    assert np.array_equal(lines[1:, 0], lines[:-1, 1])


def test_a_load_above_the_limit_has_a_color_outside_of_the_ramp() -> None:
    below, above = load_classes(np.array([0.999 * BOUNDS[-1], 1.001 * BOUNDS[-1]])).tolist()
    assert (below, above) == (len(palette()) - 2, len(palette()) - 1)


def test_stretches_are_cut_where_nothing_fails() -> None:
    points = np.arange(12.0).reshape(6, 2)
    found = stretches(points, np.array([True, True, False, False, True, False]))
    assert [len(part) for part in found] == [2, 1]
    assert stretches(points, np.zeros(6, bool)) == ()


def test_a_run_there_and_back_is_laid_over_the_metres_it_was_driven(
    session: Session, prediction: RoutePrediction
) -> None:
    found = driven(session.view().series, prediction)
    assert found is not None
    assert np.all(np.diff(found.metres) >= 0.0)
    # The vehicle stops some centimetres short of the planned end or beyond.
    assert found.metres[-1] == pytest.approx(prediction.drive.length, abs=0.2)


def test_a_run_elsewhere_is_not_laid_over_the_route(session: Session, prediction: RoutePrediction) -> None:
    series = session.view().series
    assert driven(replace(series, means=series.means + np.array([3.0, 3.0, 0.0])), prediction) is None


def test_the_chart_says_where_the_supervisor_stops(project: Project, prediction: RoutePrediction) -> None:
    assert "nowhere" in chart(_view(prediction), None)
    limits = replace(project.parameters.supervisor, position_limit=0.001)
    strict = replace(project, parameters=replace(project.parameters, supervisor=limits))
    stopped = predict_route(plan_route(strict, project.routes[0].name))
    assert len(stopped.trips())
    assert "nowhere" not in chart(_view(stopped), None)


def _view(prediction: RoutePrediction) -> RouteView:
    metres = prediction.per_metre()
    loads = np.maximum.reduceat(prediction.load, metres.first)
    return RouteView("There and back", prediction, metres, loads, outdated=False)
