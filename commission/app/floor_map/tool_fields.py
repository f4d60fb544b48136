"""The floor map's tools as part of the selection's panel: how walls are drawn, and the two points to align by."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.field_widget import add_widget, held, labelled, meant
from commission.app.base.inputs import Inputs, enable, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, table, write
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing.actions import ChooseTool
from commission.app.editing.editor import editor_of
from commission.app.editing.tool import Tool
from commission.app.editing.tool_panel import ToolButtons
from commission.app.editing.tool_rail import ToolRail
from commission.app.floor_map import actions
from commission.app.floor_map.align_tool import LETTERS, AlignTool, NamedPoint
from commission.app.floor_map.pen import MapPen
from commission.app.floor_map.tools import EraseTool, ObstacleTool, WallTool
from commission.site.editing.alignment import DOUBTFUL, WRONG
from commission.site.editing.plant_fit import PlantFit, fit_points
from commission.site.fields import field_info, get_field
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT

FREE, UNKNOWN = "free", "unknown"
MAP_ONLY, EVERYTHING = "the map alone", "what is on it, too"
MAP_TOOLS: tuple[Tool, ...] = (EraseTool(), WallTool(), ObstacleTool(), AlignTool())
"""In the order of their buttons."""
KEYS: tuple[tuple[str, Literal["X", "L", "O", "G"], Tool], ...] = (
    ("Erase walls", "X", EraseTool()),
    ("Draw a wall", "L", WallTool()),
    ("Draw an obstacle", "O", ObstacleTool()),
    ("Align with the plant", "G", AlignTool()),
)
"""What a key does."""
NOWHERE = NamedPoint((0.0, 0.0), (0.0, 0.0))
PLANT, NAME = field_info(NOWHERE, "plant"), field_info(NOWHERE, "name")
MOST_POINTS = 12
"""Surveyed points whose residuals are listed, the worst first."""
LONGEST_NAME = 40
"""Letters of a point's name that are kept."""


class MapToolButtons(ToolRail):
    """The floor map's tools on the rail, and their keys."""

    group = "map"
    tools = MAP_TOOLS
    keys: ClassVar = {tool.name: key for _label, key, tool in KEYS}
    above = len(ToolButtons.tools)

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        super().__init__(gui, post, browser)
        for label, key, tool in KEYS:
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(posting(post, lambda _event, tool=tool: ChooseTool(tool)))


class MapToolFields(BasePanel):
    """Thickness, what erased cells become, points and their plant coordinates; only what the tool in use needs."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._gui, self._post, self._browser = gui, post, browser
        self._shown: tuple[MapPen, Tool | None] | None = None
        self._inputs = Inputs(gui, post, actions.SetPen, self._read)
        self._thickness = self._inputs.field("thickness", MapPen())
        self._becomes = self._inputs.choice("to_unknown", MapPen(), {False: FREE, True: UNKNOWN})
        self._add_alignment()

    def _read(self, state: AppState, name: str) -> Any:
        """Return a property of the browser's pen."""
        return get_field(state.of_browser(self._browser, MapPen), name)

    def _add_alignment(self) -> None:
        gui = self._gui
        self._folder = gui.add_folder("Onto the plant's coordinates", visible=False)
        with self._folder:
            self._points = [self._add_point(index) for index in range(2)]
            self._moves = gui.add_dropdown(
                "Moves", (MAP_ONLY, EVERYTHING), hint="Reflectors, routes, stations: where they are, or with the map."
            )
            self._moves.on_update(
                posting(self._post, lambda event: actions.SetAligned(event.target.value == EVERYTHING))
            )
            self._surveyed = gui.add_text(
                "Surveyed points",
                "",
                multiline=True,
                hint="Rows of name, x, y in the plant from a table: names are those of reflectors and stations. "
                "Where there are any, everything is moved by them, and A and B do not count.",
            )
            self._surveyed.on_update(posting(self._post, lambda event: actions.SetSurveyed(event.target.value)))
            self._said = gui.add_html("")
            self._align = gui.add_button("Move and turn", hint="The map keeps its scale; can be undone.")
            self._align.on_click(posting(self._post, lambda _event: actions.AlignMap()))

    def _add_point(self, index: int) -> tuple[Any, Any]:
        """Add name and plant coordinates of a point."""
        gui, letter = self._gui, LETTERS[index]
        name = add_widget(gui, labelled(NAME, f"{letter} {NAME.label}"), "")
        plant = add_widget(gui, labelled(PLANT, f"{letter} {PLANT.label}"), NOWHERE.plant)

        def typed(_event: GuiEvent[Any]) -> page_actions.Action:
            return actions.SetPlantPoint(index, meant(PLANT, plant.value), meant(NAME, name.value)[:LONGEST_NAME])

        for widget in (name, plant):
            widget.on_update(posting(self._post, typed))
        return name, plant

    def draw_slowly(self, view: PageView) -> None:
        """Show what the tool in use needs."""
        pen, tool = view.state.of_browser(self._browser, MapPen), editor_of(view.state, self._browser).tool
        if self._shown == (pen, tool):
            return
        self._shown = (pen, tool)
        show(self._thickness, visible=isinstance(tool, WallTool))
        show(self._becomes, visible=isinstance(tool, EraseTool))
        show(self._folder, visible=isinstance(tool, AlignTool))
        self._inputs.follow(view.state)
        if isinstance(tool, AlignTool):
            self._show_alignment(tool)

    def _show_alignment(self, tool: AlignTool) -> None:
        for index, widgets in enumerate(self._points):
            known = index < len(tool.known)
            point = tool.known[index] if known else NOWHERE
            for widget, value in zip(widgets, (point.name, held(PLANT, point.plant)), strict=True):
                write(widget, value)
                enable(widget, "" if known else f"click point {LETTERS[index]} on the floor first")
        write(self._moves, EVERYTHING if tool.everything else MAP_ONLY)
        self._said.content = f"<div style='padding:2px 6px'>{alignment_text(tool)}</div>"
        if tool.surveyed:
            enable(self._align, "")
            return
        found = tool.alignment()
        why_not = "two points and their places in the plant are needed" if found is None else ""
        if found is not None and found.share > WRONG:
            why_not = "the distances on the map and in the plant differ too much"
        enable(self._align, why_not)


def alignment_text(tool: AlignTool) -> str:
    """Return what the points say, as html."""
    if tool.surveyed:
        return surveyed_text(fit_points(tool.surveyed))
    clicked = [
        (f"{letter} on the map", f"{point.at[0]:.3f}, {point.at[1]:.3f} m")
        for letter, point in zip(LETTERS, tool.known, strict=False)
    ]
    found = tool.alignment()
    if found is None:
        missing = f"click {LETTERS[len(tool.known)]}" if len(tool.known) < 2 else "they are too close to each other"
        return f"{table(clicked)}<div class='c-note'>Points: {missing}</div>"
    color = (
        theme.css(theme.REFUSED)
        if found.share > WRONG
        else theme.css(theme.DOUBTFUL)
        if found.share > DOUBTFUL
        else "inherit"
    )
    difference = f"{MILLIMETRES.text(found.residual, '+.0f')} ({PERCENT.text(found.share, '.2f')})"
    residual = f"<span style='color:{color}'>{difference}</span>"
    rows = [
        ("Difference", residual),
        ("A to B, map", f"{found.on_map:.3f} m"),
        ("A to B, plant", f"{found.in_plant:.3f} m"),
        ("Turns by", DEGREES.text(float(found.T_plant_map[2]), ".3f")),
        *clicked,
    ]
    note = ""
    if found.share > WRONG:
        note = f"More than {PERCENT.text(WRONG, 'g')}: a wrong point, number or scale."
    elif found.share > DOUBTFUL:
        note = f"More than {PERCENT.text(DOUBTFUL, 'g')}: look at the points and their numbers."
    return f"{table(rows)}<div class='c-note'>{note}</div>"


def surveyed_text(found: PlantFit) -> str:
    """Return by how much each surveyed point is missed, the worst first, as html."""
    order = np.argsort(-found.offs, kind="stable")[:MOST_POINTS]
    rows = [
        ("Points", str(len(found.pairs))),
        ("RMS", MILLIMETRES.text(found.rms, ".1f")),
        ("Turns by", DEGREES.text(float(found.T_plant_map[2]), ".3f")),
        ("Distances, plant / map", f"{found.scale:.5f}"),
        *(
            (
                f"{escaped(found.pairs[index].name)} off by",
                f"{MILLIMETRES.number(found.residuals[index, 0], '+.1f')}, "
                f"{MILLIMETRES.text(found.residuals[index, 1], '+.1f')}",
            )
            for index in order.tolist()
        ),
    ]
    striking = found.striking
    note = f"Stands out: {', '.join(map(escaped, striking))}. Look at it, or leave it out." if striking else ""
    return f"{table(rows)}<div class='c-note'>{note}</div>"
