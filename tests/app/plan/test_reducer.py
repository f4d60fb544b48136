import math
from dataclasses import replace

import pytest

from commission.app.base.actions import Action
from commission.app.base.state import AppState
from commission.app.plan.actions import ReadFloor, SetPlan
from commission.app.plan.settings import Figure, PlanSettings
from commission.errors import UsageError
from commission.planning.dilution import Heading
from commission.site.project import Project
from tests.app.asking import after as outcome
from tests.app.asking import joined


def after(project: Project, *wishes: Action) -> PlanSettings:
    return outcome(joined(AppState(project, project)), *wishes).state.part(PlanSettings)


def test_settings_are_set_from_plain_values(project: Project) -> None:
    plan = after(project, SetPlan("figure", "visible"), SetPlan("heading", "given"), SetPlan("given_heading", 0.5))
    assert (plan.figure, plan.heading, plan.given_heading) == (Figure.VISIBLE, Heading.GIVEN, 0.5)


@pytest.mark.parametrize(
    "wish",
    [
        SetPlan("color", "red"),
        SetPlan("figure", "beauty"),
        SetPlan("route", "Nowhere"),
        SetPlan("opacity", 1.5),
        SetPlan("given_heading", math.inf),
        SetPlan("blocked_per_m", -0.1),
    ],
)
def test_what_does_not_exist_or_is_out_of_range_is_refused(project: Project, wish: SetPlan) -> None:
    with pytest.raises((UsageError, ValueError)):
        after(project, wish)


def test_settings_of_the_plan_are_no_undo_steps(project: Project) -> None:
    state = outcome(AppState(project, project), SetPlan("figure", "visible")).state
    assert not state.undo
    assert not state.is_changed


def test_a_click_reads_only_while_there_is_a_heatmap(project: Project) -> None:
    click = ReadFloor((1.0, 2.0), 0.1)
    assert after(project, click).probe is None
    assert after(project, SetPlan("figure", "visible"), click).probe == (1.0, 2.0)


def test_a_click_on_a_ranked_reflector_asks_for_its_dependents(project: Project) -> None:
    reflector = project.reflectors.reflectors[1]
    click = ReadFloor((reflector.x + 0.05, reflector.y), 0.1)
    assert after(project, SetPlan("ranking", value=True), click).failed == reflector.id
    assert after(project, click).failed == ""


def test_another_failure_forgets_whose_it_was(project: Project) -> None:
    plan = after(project, SetPlan("ranking", value=True), SetPlan("failed", "R1"), SetPlan("failure", "dirty"))
    assert plan.failed == ""


def test_asking_for_a_ranking_again_is_another_wish(project: Project) -> None:
    ask = SetPlan("ranking", value=True)
    assert after(project, ask) != after(project, ask, ask)
    assert after(project, ask, SetPlan("ranking", value=False)) == PlanSettings()
    assert replace(after(project, ask), ranking=0) == PlanSettings()
