"""The tool that draws zones. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import DragFloor, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.editing.drawing_tools import area_dragged
from commission.app.editing.tool import Tool
from commission.app.editing.zone_actions import AddZone


@dataclass(frozen=True, slots=True)
class ZoneTool(Tool):
    """Draws rectangular zones; other corners are typed."""

    name = "Zone"

    def dragged(self, state: AppState, drag: DragFloor, sender: Sender) -> Outcome:
        """Draw a zone."""
        state, is_drawn = area_dragged(state, drag, sender)
        return reduce(AddZone((*drag.start, *drag.now)), state, sender) if is_drawn else Outcome(state)

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say what a drag does."""
        return "Zone: drag over the part of the floor that it covers &nbsp; (Esc ends)"
