"""What the actions of the step Tune mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from typing import Any

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.tune.actions import ParameterValue, ResetParameters, SetParameter
from commission.errors import UsageError
from commission.site.parameters import Parameters


def parameter(parameters: Parameters, key: str) -> ParameterValue:
    """Return the value of `group.name`; raises UsageError when there is none."""
    group, _, name = key.partition(".")
    value = getattr(getattr(parameters, group, None), name, None) if name.isidentifier() else None
    if not isinstance(value, bool | int | float | str):
        raise UsageError(f"no parameter is called {key!r}; expected group.name as in project.yaml")
    return value


def with_parameter(parameters: Parameters, key: str, value: ParameterValue) -> Parameters:
    """Return parameters with one changed; raises UsageError (unknown) or ValueError (out of range)."""
    parameter(parameters, key)
    group, _, name = key.partition(".")
    changes: dict[str, Any] = {group: dataclasses.replace(getattr(parameters, group), **{name: value})}
    return dataclasses.replace(parameters, **changes)


@reduce.register
def set_parameter(action: SetParameter, state: AppState, sender: Sender) -> Outcome:
    """Change one parameter: one undo step for a moved slider."""
    if parameter(state.project.parameters, action.key) == action.value:
        return Outcome(state)
    parameters = with_parameter(state.project.parameters, action.key, action.value)
    name = action.key.partition(".")[2].replace("_", " ")
    return Outcome(
        edited(state, replace(state.project, parameters=parameters), Edit(f"set {name}", sender, action.key))
    )


@reduce.register
def reset_parameters(_action: ResetParameters, state: AppState, sender: Sender) -> Outcome:
    """Go back to the saved parameters: one undo step."""
    if state.project.parameters == state.saved.parameters:
        return Outcome(state)
    project = replace(state.project, parameters=state.saved.parameters)
    return Outcome(edited(state, project, Edit("reset parameters", sender)))
