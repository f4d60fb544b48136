"""What depends on a reflector in the page: one failure after the other, clicks, and reflectors that nothing sees."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from commission.app.base.actions import Action
from commission.app.base.state import AppState
from commission.app.failures.failure_panel import ranking_table
from commission.app.plan.actions import AlsoFails, SetPlan
from commission.app.plan.settings import PlanSettings
from commission.app.plan.view import FailureView
from commission.app.plan.work import rank
from commission.errors import UsageError
from commission.planning.dependence import worst_failures
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.app.asking import after
from tests.app.plan.test_planner import Bench


@pytest.fixture
def bench(project: Project) -> Iterator[Bench]:
    bench = Bench(project)
    yield bench
    bench.close()


def ask(bench: Bench, *wishes: Action) -> FailureView:
    bench.state = after(bench.state, *wishes).state
    bench.service.follow(bench.state)
    failures = bench.found().failures
    assert failures is not None
    return failures


def test_the_next_failure_again_and_again_are_the_worst_failures(bench: Bench, project: Project) -> None:
    planned = rank(project, PlanSettings(), lambda _fraction, _message: None).planned
    expected = [project.reflectors.reflectors[each.reflector].id for each in worst_failures(planned, 3)]
    failures = ask(bench, SetPlan("ranking", value=True))
    found = [failures.names[0]]
    for _ in range(2):
        failures = ask(bench, AlsoFails(failures.names[0]))
        found.append(failures.names[0])
    assert found == expected
    assert failures.fallen == tuple(expected[:2])
    assert len(failures.fallen_places) == 2
    assert not set(failures.fallen) & set(failures.names)


def test_ranking_anew_begins_with_nothing_failed(bench: Bench) -> None:
    first = ask(bench, SetPlan("ranking", value=True))
    assert ask(bench, AlsoFails(first.names[0])).fallen
    again = ask(bench, SetPlan("ranking", value=True))
    assert not again.fallen
    assert again.names == first.names


def test_an_unknown_reflector_cannot_fail(project: Project) -> None:
    with pytest.raises(UsageError, match="Nobody"):
        after(AppState(project, project), AlsoFails("Nobody"))


def test_it_is_said_of_a_reflector_that_no_route_sees_it(bench: Bench, project: Project) -> None:
    hidden = Reflector(id="Hidden", x=30.0, y=30.0)
    reflectors = ReflectorMap((*project.reflectors.reflectors, hidden))
    bench.state = replace(bench.state, project=replace(project, reflectors=reflectors))
    failures = ask(bench, SetPlan("ranking", value=True), SetPlan("failed", "Hidden"))
    assert failures.chosen is None
    assert failures.place == (30.0, 30.0)
    assert "Hidden is seen on no route" in ranking_table(failures)


def test_the_table_names_what_failed_before(bench: Bench) -> None:
    first = ask(bench, SetPlan("ranking", value=True))
    assert "Failed before" not in ranking_table(first)
    assert "Failed before" in ranking_table(ask(bench, AlsoFails(first.names[0])))
