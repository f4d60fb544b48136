"""The tool that keeps new reflectors out of areas of the floor. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import ClickFloor, DragFloor, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.editing.drawing_tools import area_dragged
from commission.app.editing.tool import Tool
from commission.app.placement.actions import FreeAreas, KeepOut


@dataclass(frozen=True, slots=True)
class KeepOutTool(Tool):
    """Draws areas, and frees those that are clicked on."""

    name = "Keep out"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Free the areas around the place."""
        return reduce(FreeAreas(click.place), state, sender)

    def dragged(self, state: AppState, drag: DragFloor, sender: Sender) -> Outcome:
        """Draw an area."""
        state, is_drawn = area_dragged(state, drag, sender)
        return reduce(KeepOut((*drag.start, *drag.now)), state, sender) if is_drawn else Outcome(state)

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say what drags and clicks do."""
        return "Keep out: drag over an area without new reflectors, click one to free it &nbsp; (Esc ends)"
