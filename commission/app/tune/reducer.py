"""What the actions of the step Tune mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.tune.actions import ResetParameters, SetParameter, SetUncertainty
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
def set_uncertainty(action: SetUncertainty, state: AppState, sender: Sender) -> Outcome:
    """Say how well one constant is known: one undo step for a moved slider."""
    uncertainty = with_field(state.project.uncertainty, action.name, action.value, "uncertainty")
    if uncertainty == state.project.uncertainty:
        return Outcome(state)
    edit = Edit(f"set uncertainty of {action.name.replace('_', ' ')}", sender, f"uncertainty.{action.name}")
    return Outcome(edited(state, replace(state.project, uncertainty=uncertainty), edit))


@reduce.register
def reset_parameters(_action: ResetParameters, state: AppState, sender: Sender) -> Outcome:
    """Go back to the saved parameters and uncertainty: one undo step."""
    saved = state.saved
    project = replace(state.project, parameters=saved.parameters, uncertainty=saved.uncertainty)
    if (project.parameters, project.uncertainty) == (state.project.parameters, state.project.uncertainty):
        return Outcome(state)
    return Outcome(edited(state, project, Edit("reset parameters", sender)))
