"""The prediction's service: what it starts, keeps and drops."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from commission.app.base.conditions import SetCondition
from commission.app.prediction.chart import chart
from commission.app.prediction.service import PREDICTION, PredictionService
from commission.app.prediction.settings import PredictRoute
from commission.errors import UsageError
from commission.site.project import Project
from commission.site.stations import Station
from tests.acceptance.test_every_kind import project_of
from tests.app.bench import Bench


@pytest.fixture
def bench(project: Project) -> Iterator[Bench[PredictionService]]:
    bench = Bench(PredictionService, project)
    yield bench
    bench.close()


def predicted(bench: Bench[PredictionService]) -> None:
    bench.ask(PredictRoute(bench.state.project.routes[0].name))
    assert bench.found() is not None


def test_nothing_is_predicted_that_nobody_wants(bench: Bench[PredictionService]) -> None:
    bench.ask()
    assert not bench.jobs.unfinished()
    assert bench.view is None


def test_an_unknown_route_is_refused(bench: Bench[PredictionService]) -> None:
    with pytest.raises(UsageError, match="Nowhere"):
        bench.ask(PredictRoute("Nowhere"))


def test_a_route_is_predicted_and_predicted_anew_after_an_edit(bench: Bench[PredictionService]) -> None:
    predicted(bench)
    first = bench.view
    assert len(first.limit_shares) == len(first.metres.metre)
    bench.move(0, 0.5)
    assert bench.view.outdated
    second = bench.found()
    assert not second.outdated
    assert second.prediction is not first.prediction


@pytest.mark.parametrize(
    "part", ["supervisor", "association", "odometry", "observation", "vehicle", "scanner", "stations", "route", "map"]
)
def test_every_part_that_a_prediction_depends_on_predicts_anew(bench: Bench[PredictionService], part: str) -> None:
    predicted(bench)
    project, parameters = bench.state.project, bench.state.project.parameters
    route = project.routes[0]
    edited = {
        "supervisor": replace(parameters, supervisor=replace(parameters.supervisor, position_limit=0.012)),
        "association": replace(parameters, association=replace(parameters.association, gate_probability=0.9)),
        "odometry": replace(parameters, odometry=replace(parameters.odometry, heading_per_sqrt_m=0.02)),
        "observation": replace(parameters, observation=replace(parameters.observation, range_sigma=0.05)),
    }
    changes = {
        "vehicle": {"vehicle": replace(project.vehicle, height=1.0)},
        "scanner": {"scanners": (replace(project.scanners[0], range=(0.05, 6.0)),)},
        "stations": {"stations": (Station(name="Dock", x=2.0, y=2.0),)},
        "route": {"routes": (replace(route, speed=0.3), *project.routes[1:])},
        "map": {"floor_map": None},
    }.get(part) or {"parameters": edited[part]}
    bench.edit(replace(project, **changes))
    assert bench.view.outdated
    assert [job.name for job in bench.jobs.unfinished()] == [PREDICTION]
    assert not bench.found().outdated


@pytest.mark.parametrize("change", [SetCondition("min_beams", 2), SetCondition("blocked_per_m", 0.05)])
def test_under_other_conditions_it_is_predicted_anew(bench: Bench[PredictionService], change: SetCondition) -> None:
    predicted(bench)
    bench.ask(change)
    assert bench.view.outdated


def test_another_route_that_changes_predicts_nothing(bench: Bench[PredictionService]) -> None:
    project = bench.state.project
    other = replace(project.routes[0], name="Other")
    bench.edit(replace(project, routes=(project.routes[0], other)))
    predicted(bench)
    before = bench.view
    bench.edit(replace(bench.state.project, routes=(project.routes[0], replace(other, speed=0.2)), name="x"))
    assert not bench.jobs.unfinished()
    assert bench.view is before


def test_a_route_that_is_gone_is_not_predicted_any_more(bench: Bench[PredictionService]) -> None:
    predicted(bench)
    bench.edit(replace(bench.state.project, routes=()))
    assert bench.view is None
    assert not bench.jobs.unfinished()


def test_a_route_is_driven_by_every_kind_where_there_is_one_beside_ranges_of_reflectors() -> None:
    bench = Bench(PredictionService, project_of("tags"))
    try:
        predicted(bench)
        while bench.view.driven is None:
            bench.found()
        told = chart(bench.view, None)
        assert bench.view.driven.kinds == ("reflectors", "tags")
        assert "2σ of position by reflectors, tags [mm]" in told and "Corrections a metre" in told
        bench.edit(replace(bench.state.project, tags=()))
        bench.found()
        assert bench.view.driven is None
        assert "Corrections a metre" not in chart(bench.view, None)
    finally:
        bench.close()
