"""What the actions of the step Plan mean for its settings. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from typing import Any

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.editing.editor import Tool, editor_of
from commission.app.editing.gestures import reflector_at
from commission.app.plan.actions import AlsoFails, ClearEllipses, ReadFloor, SetPlan
from commission.app.plan.settings import Figure, PlanSettings
from commission.errors import UsageError
from commission.planning.dependence import Failure
from commission.planning.dilution import Heading, Measurement
from commission.site.project import Project

CHOICES: dict[str, type[Figure] | type[Heading] | type[Measurement] | type[Failure]] = {
    "figure": Figure,
    "heading": Heading,
    "measurement": Measurement,
    "failure": Failure,
}

MOST_SPOTS = 60
"""Ellipses that are kept: nobody tells more apart."""
COUNTED = ("ranking", "cold_start")
"""Settings that are requests: each true value is one more."""


def changed(action: SetPlan, plan: PlanSettings, project: Project) -> PlanSettings:
    """Return the settings with one changed.

    Raises
    ------
    CommissionError, ValueError
        there is no such setting or route, or the value is out of range.
    """
    if action.name not in {field.name for field in dataclasses.fields(PlanSettings)}:
        raise UsageError(f"the step Plan has no setting {action.name!r}")
    if action.name == "route" and action.value:
        project.route(str(action.value))
    choice = CHOICES.get(action.name)
    changes: dict[str, Any] = {action.name: action.value if choice is None else choice(str(action.value))}
    if action.name in COUNTED:
        # Counted, so that asking again after an edit is told apart from having asked.
        changes[action.name] = getattr(plan, action.name) + 1 if action.value else 0
    if action.name == "cold_start":
        # Its map is drawn where the heatmap would be.
        changes |= {"pair": -1, "figure": Figure.NONE if action.value else plan.figure}
    if action.name == "pair" and action.value == plan.pair:
        changes["pair"] = -1
    if action.name == "failure" or (action.name == "ranking" and not action.value):
        changes["failed"] = ""
    if action.name == "ranking":
        changes["fallen"] = ()
    return replace(plan, **changes)


def clicked(action: ReadFloor, plan: PlanSettings, project: Project) -> PlanSettings:
    """Return the settings after a click: on a ranked reflector it asks for its dependents, elsewhere for values.

    Where there is a heatmap, each click beside the reflectors leaves an ellipse.
    """
    reflector = reflector_at(project.reflectors, action.place, action.reach)
    if plan.ranking and reflector is not None:
        return replace(plan, failed=reflector)
    if not plan.figure:
        return replace(plan, probe=None)
    spots = plan.spots if reflector is not None else (*plan.spots, action.place)[-MOST_SPOTS:]
    return replace(plan, probe=action.place, spots=spots)


def also_fails(action: AlsoFails, plan: PlanSettings, project: Project) -> PlanSettings:
    """Return the settings with one more failure to go on from.

    Raises
    ------
    UsageError
        there is no such reflector.
    """
    if all(reflector.id != action.name for reflector in project.reflectors.reflectors):
        raise UsageError(f"no reflector is called {action.name!r}")
    return replace(plan, fallen=(*plan.fallen, action.name), failed="", ranking=plan.ranking + 1)


@reduce.register
def set_plan(action: SetPlan, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(state.with_part(changed(action, state.part(PlanSettings), state.project)))


@reduce.register
def read_floor(action: ReadFloor, state: AppState, sender: Sender) -> Outcome:
    if editor_of(state, sender.browser).tool is not Tool.SELECT:
        return Outcome(state)
    return Outcome(state.with_part(clicked(action, state.part(PlanSettings), state.project)))


@reduce.register
def clear_ellipses(_action: ClearEllipses, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(state.with_part(replace(state.part(PlanSettings), spots=())))


@reduce.register
def let_fail(action: AlsoFails, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(state.with_part(also_fails(action, state.part(PlanSettings), state.project)))
