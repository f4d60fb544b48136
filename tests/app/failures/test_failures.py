"""What depends on a reflector in the page: one failure after the other, clicks, and reflectors that nothing sees."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Action
from commission.app.base.conditions import SetCondition
from commission.app.base.state import AppState
from commission.app.failures.actions import (
    AlsoFails,
    ChooseFailure,
    ClickReflector,
    DropRanking,
    RankReflectors,
    ShowFailure,
)
from commission.app.failures.failure_panel import ranking_table
from commission.app.failures.service import FailureService
from commission.app.failures.settings import FailureSettings
from commission.app.failures.view import FailureView, stretches
from commission.errors import UsageError
from commission.planning.dependence import worst_failures
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.failures import FailuresInput
from commission.studies.failures import failures as failures_of
from tests.app.asking import after
from tests.app.bench import Bench


@pytest.fixture
def bench(project: Project) -> Iterator[Bench[FailureService]]:
    bench = Bench(FailureService, project)
    yield bench
    bench.close()


def ask(bench: Bench[FailureService], *wishes: Action) -> FailureView:
    bench.ask(*wishes)
    failures = bench.found()
    assert failures is not None
    return failures


def test_the_next_failure_again_and_again_are_the_worst_failures(
    bench: Bench[FailureService], project: Project
) -> None:
    planned = failures_of(FailuresInput.of(project)).planned
    expected = [project.reflectors.reflectors[each.reflector].id for each in worst_failures(planned, 3)]
    failures = ask(bench, RankReflectors())
    found = [failures.names[0]]
    for _ in range(2):
        failures = ask(bench, AlsoFails(failures.names[0]))
        found.append(failures.names[0])
    assert found == expected
    assert failures.fallen == tuple(expected[:2])
    assert len(failures.fallen_places) == 2
    assert not set(failures.fallen) & set(failures.names)


def test_ranking_anew_begins_with_nothing_failed(bench: Bench[FailureService]) -> None:
    first = ask(bench, RankReflectors())
    assert ask(bench, AlsoFails(first.names[0])).fallen
    again = ask(bench, RankReflectors())
    assert not again.fallen
    assert again.names == first.names


def test_an_unknown_reflector_cannot_fail(project: Project) -> None:
    with pytest.raises(UsageError, match="Nobody"):
        after(AppState(project=project, saved=project), AlsoFails("Nobody"))


def test_it_is_said_of_a_reflector_that_no_route_sees_it(bench: Bench[FailureService], project: Project) -> None:
    hidden = Reflector(id="Hidden", x=30.0, y=30.0)
    reflectors = ReflectorMap((*project.reflectors.reflectors, hidden))
    bench.state = replace(bench.state, project=replace(project, reflectors=reflectors))
    failures = ask(bench, RankReflectors(), ShowFailure("Hidden"))
    assert failures.chosen is None
    assert failures.place == (30.0, 30.0)
    assert "Hidden is seen on no route" in ranking_table(failures)


def test_the_table_names_what_failed_before(bench: Bench[FailureService]) -> None:
    first = ask(bench, RankReflectors())
    assert "Failed before" not in ranking_table(first)
    assert "Failed before" in ranking_table(ask(bench, AlsoFails(first.names[0])))


def test_reflectors_are_ranked_once_until_asked_again(bench: Bench[FailureService]) -> None:
    failures = ask(bench, RankReflectors())
    assert set(failures.names) <= {r.id for r in bench.state.project.reflectors.reflectors}
    bench.ask(ShowFailure(failures.names[0]))
    assert bench.view.place is not None
    bench.move(0, 0.5)
    assert not bench.jobs.unfinished()
    assert bench.view.outdated
    assert not ask(bench, RankReflectors()).outdated


@pytest.mark.parametrize("change", [SetCondition("min_beams", 2), SetCondition("blocked_per_m", 0.05)])
def test_under_other_conditions_the_ranking_is_outdated(bench: Bench[FailureService], change: SetCondition) -> None:
    ask(bench, RankReflectors())
    bench.ask(change)
    assert not bench.jobs.unfinished()
    assert bench.view.outdated


@pytest.mark.parametrize("part", ["supervisor", "association", "odometry"])
def test_other_parameters_make_the_ranking_outdated(bench: Bench[FailureService], part: str) -> None:
    ask(bench, RankReflectors())
    parameters = bench.state.project.parameters
    edited = {
        "supervisor": replace(parameters.supervisor, position_limit=0.012),
        "association": replace(parameters.association, gate_probability=0.9),
        "odometry": replace(parameters.odometry, heading_per_sqrt_m=0.02),
    }[part]
    bench.edit(replace(bench.state.project, parameters=replace(parameters, **{part: edited})))
    assert bench.view.outdated


def test_another_failure_is_ranked_at_once_and_forgets_whose_it_was(bench: Bench[FailureService]) -> None:
    ask(bench, RankReflectors(), ShowFailure("R1"))
    moved = ask(bench, ChooseFailure("moved"))
    assert moved.failed == ""
    assert not moved.outdated
    assert {each.failure.value for each in moved.ranking} == {"moved"}


def test_a_click_on_a_ranked_reflector_asks_for_its_dependents(bench: Bench[FailureService]) -> None:
    reflector = bench.state.project.reflectors.reflectors[1]
    click = ClickReflector((reflector.x + 0.05, reflector.y), 0.1)
    bench.ask(click)
    assert bench.state.part(FailureSettings).failed == ""
    bench.ask(RankReflectors(), click)
    assert bench.state.part(FailureSettings).failed == reflector.id
    bench.ask(ClickReflector((100.0, 100.0), 0.1))
    assert bench.state.part(FailureSettings).failed == reflector.id


def test_a_ranking_that_is_dropped_is_wanted_no_more(bench: Bench[FailureService]) -> None:
    ask(bench, RankReflectors())
    bench.ask(DropRanking())
    assert bench.view is None
    assert bench.state.part(FailureSettings) == FailureSettings()


def test_stretches_are_cut_where_nothing_fails() -> None:
    points = np.arange(12.0).reshape(6, 2)
    found = stretches(points, np.array([True, True, False, False, True, False]))
    assert [len(part) for part in found] == [2, 1]
    assert stretches(points, np.zeros(6, bool)) == ()
