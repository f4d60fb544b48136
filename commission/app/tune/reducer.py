"""What the actions of the step Tune mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.tune.actions import ResetParameters, SetParameter
from commission.site.fields import with_field


@reduce.register
def set_parameter(action: SetParameter, state: AppState, sender: Sender) -> Outcome:
    """Change one parameter: one undo step for a moved slider."""
    parameters = with_field(state.project.parameters, action.key, action.value, "parameter")
    if parameters == state.project.parameters:
        return Outcome(state)
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
