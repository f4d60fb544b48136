"""What the actions of the virtual world mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.world.actions import SetDisturbance
from commission.site.fields import with_field


@reduce.register
def set_disturbance(action: SetDisturbance, state: AppState, sender: Sender) -> Outcome:
    """Change one number: one undo step for a moved slider."""
    disturbances = with_field(state.project.disturbances, action.name, action.value, "disturbance")
    if disturbances == state.project.disturbances:
        return Outcome(state)
    edit = Edit("change the virtual world", sender, f"disturbances.{action.name}")
    return Outcome(edited(state, replace(state.project, disturbances=disturbances), edit))
