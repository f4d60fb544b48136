"""What is asked of the raw-sensor view. Pure; importing it registers the handlers with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.live.actions import SetThreshold
from commission.site.fields import with_field

KEY = "detector.intensity_threshold"


@reduce.register
def set_threshold(action: SetThreshold, state: AppState, sender: Sender) -> Outcome:
    """Set the threshold: one undo step for a dragged line."""
    parameters = with_field(state.project.parameters, KEY, action.value, "parameter")
    if parameters == state.project.parameters:
        return Outcome(state)
    edit = Edit("set intensity threshold", sender, KEY)
    return Outcome(edited(state, replace(state.project, parameters=parameters), edit))
