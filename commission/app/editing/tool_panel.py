"""Tools for the site on the rail, their keys, and what attracts while one places something."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, TypeAlias

from viser import GuiApi

from commission.app.base.actions import Action
from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import BasePanel, Post, posting, write_label
from commission.app.base.view import PageView
from commission.app.editing.actions import (
    Cancel,
    ChooseTool,
    DeleteSelected,
    DuplicateSelected,
    Finish,
    Nudge,
    SetSnapping,
)
from commission.app.editing.editor import Snapping, editor_of
from commission.app.editing.site_tools import SITE_TOOLS, MeasureTool, PlaceTool, RouteTool, StationTool, TagTool
from commission.app.editing.tool_rail import SELECT, ToolRail
from commission.site.fields import get_field, names_of
from commission.site.quantity import MILLIMETRES

Command: TypeAlias = tuple[str, Any, Any, Action]
"""Label, key and modifier as viser calls them, and what the key asks for."""

COMMANDS: tuple[Command, ...] = (
    ("Select", "V", None, ChooseTool(None)),
    ("Place reflectors", "R", None, ChooseTool(PlaceTool())),
    ("Draw a route", "T", None, ChooseTool(RouteTool())),
    ("Place stations", "K", None, ChooseTool(StationTool())),
    ("Place tags", "A", None, ChooseTool(TagTool())),
    ("Measure", "M", None, ChooseTool(MeasureTool())),
    ("Finish what is drawn", "enter", None, Finish()),
    ("Cancel", "escape", None, Cancel()),
    ("Delete the selection", "delete", None, DeleteSelected()),
    ("Duplicate the selection", "D", "cmd/ctrl+shift", DuplicateSelected()),
)


NUDGES: tuple[tuple[str, Literal["arrowleft", "arrowright", "arrowup", "arrowdown"], tuple[int, int]], ...] = (
    ("left", "arrowleft", (-1, 0)),
    ("right", "arrowright", (1, 0)),
    ("up", "arrowup", (0, 1)),
    ("down", "arrowdown", (0, -1)),
)
STEPS: tuple[tuple[float, Literal["shift"] | None], ...] = ((0.001, None), (0.01, "shift"))
"""How far an arrow key moves what is selected [m], and with which other key."""


class ToolButtons(ToolRail):
    """The tools for the site, and keys for what the hand does most."""

    group = "site"
    tools = (None, *SITE_TOOLS)
    keys: ClassVar = {
        SELECT if action.tool is None else action.tool.name: key
        for _label, key, _modifier, action in COMMANDS
        if isinstance(action, ChooseTool)
    }

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        super().__init__(gui, post, browser)
        for label, key, modifier, action in COMMANDS:
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            command.on_trigger(posting(post, lambda _event, action=action: action))
        for label, key, (x, y) in NUDGES:
            for step, modifier in STEPS:
                name = f"Move the selection {label} by {MILLIMETRES.text(step)}"
                command = gui.add_command(name, hotkey=key, modifier=modifier)
                nudge = Nudge((x * step, y * step))
                command.on_trigger(posting(post, lambda _event, nudge=nudge: nudge))


class FinishButton(BasePanel):
    """Makes something of the points that were clicked, once there are enough."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._finish = gui.add_button("Finish the route", visible=False, hint="Make it of the points clicked (Enter).")
        self._finish.on_click(posting(post, lambda _event: Finish()))

    def draw_slowly(self, view: PageView) -> None:
        """Follow the tool in use."""
        tool = editor_of(view.state, self._browser).tool
        is_enough = tool is not None and bool(tool.makes) and len(tool.points) >= tool.fewest
        show(self._finish, visible=is_enough)
        if tool is not None and is_enough:
            write_label(self._finish, f"Finish the {tool.makes}")


class SnappingPanel(BasePanel):
    """What attracts a reflector that is placed or dragged."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._inputs = Inputs(
            gui, post, SetSnapping, lambda state, name: get_field(editor_of(state, browser).snapping, name)
        )
        for name in names_of(Snapping):
            self._inputs.field(name, Snapping())

    def draw_slowly(self, view: PageView) -> None:
        """Follow the editor."""
        self._inputs.follow(view.state)
