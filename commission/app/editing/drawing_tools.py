"""Tools that draw: points clicked one after the other, and rectangles dragged. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.app.base.actions import ClickFloor, DragFloor, Point, Sender
from commission.app.base.reducer import Outcome
from commission.app.base.state import AppState
from commission.app.editing.editor import Drag, Grab, editor_of, with_tool
from commission.app.editing.tool import Tool
from commission.errors import UsageError


@dataclass(frozen=True, slots=True)
class DrawingTool(Tool):
    """Takes points by clicks; Enter makes something of them."""

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Take one more point."""
        return Outcome(with_tool(state, sender, replace(self, points=(*self.points, click.place))))

    def finished(self, state: AppState, sender: Sender) -> Outcome:
        """Make something of the points, once there are enough."""
        found = len(set(self.points))
        if found < self.fewest:
            raise UsageError(f"{found} points were clicked; expected {self.fewest} or more to make the {self.makes}")
        return self.made(state, self.points, sender)

    def made(self, state: AppState, points: tuple[Point, ...], sender: Sender) -> Outcome:  # noqa: ARG002 - a default
        """Return what follows from these points.

        Parameters
        ----------
        state : in which they were clicked.
        points : those clicked, in order [m], map frame.
        sender : who clicked them.
        """
        return Outcome(state)

    def so_far(self) -> str:
        """Say how many points there are, and what Enter makes of them."""
        if not self.points:
            return ""
        return f", {len(self.points)} so far" + (", Enter finishes" if len(self.points) >= self.fewest else "")


def area_dragged(state: AppState, drag: DragFloor, sender: Sender) -> tuple[AppState, bool]:
    """Let a rectangle grow with a drag; return whether it is drawn to its end, and then has a width and a height.

    Parameters
    ----------
    state : before.
    drag : from its start to where it is now [m], map frame.
    sender : who drags.
    """
    editor = editor_of(state, sender.browser)
    if drag.phase != "end":
        whole = Drag(Grab.RECTANGLE, drag.start, drag.now)
        return state.with_browser(sender.browser, replace(editor, drag=whole, reach=drag.reach)), False
    is_area = drag.start[0] != drag.now[0] and drag.start[1] != drag.now[1]
    return state.with_browser(sender.browser, replace(editor, drag=None)), is_area
