"""The floor map's tools as part of the selection's panel: how walls are drawn, and the points to align by."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

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
from commission.errors import UsageError
from commission.site.editing.alignment import DOUBTFUL, WRONG
from commission.site.editing.plant_check import FEWEST_FOR_WORST, PointCheck, check_points, worst_of
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
A_FOURTH = "<div class='c-note'>Of three points nothing says which one is wrong: a fourth does.</div>"
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
            self._points = [self._add_point(index) for index in range(len(LETTERS))]
            self._forget = gui.add_button("Forget the last point", color="gray", hint="The one that was clicked last.")
            self._forget.on_click(posting(self._post, lambda _event: actions.ForgetPoint()))
            self._clear = gui.add_button("Forget all points", color="gray", hint="They stay when you use another tool.")
            self._clear.on_click(posting(self._post, lambda _event: actions.ForgetPoint(everything=True)))
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
                hint="Rows of name, x, y in the plant from a table: names are those of reflectors, stations, or of "
                "points that you have clicked and named. Where there are any, everything is moved.",
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
        show(self._forget, visible=bool(tool.known))
        show(self._clear, visible=len(tool.known) > 1)
        for index, widgets in enumerate(self._points):
            known = index < len(tool.known)
            point = tool.known[index] if known else NOWHERE
            for widget, value in zip(widgets, (point.name, held(PLANT, point.plant)), strict=True):
                show(widget, visible=known or index < 2)
                write(widget, value)
                enable(widget, "" if known else f"click point {LETTERS[index]} on the floor first")
        write(self._moves, EVERYTHING if tool.everything else MAP_ONLY)
        self._said.content = f"<div style='padding:2px 6px'>{alignment_text(tool)}</div>"
        if tool.is_checked:
            enable(self._align, checked_problem(tool))
            return
        found = tool.alignment()
        why_not = "two points and their places in the plant are needed" if found is None else ""
        if found is not None and found.share > WRONG:
            why_not = "the distances on the map and in the plant differ too much"
        enable(self._align, why_not)


def alignment_text(tool: AlignTool) -> str:
    """Return what the points say, as html."""
    if tool.is_checked:
        return checked_text(tool)
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


def checked_problem(tool: AlignTool) -> str:
    """Return why the points make no fit, in one line; empty: they do."""
    try:
        fit_points(tool.pairs())
    except UsageError as error:
        return str(error)
    return ""


def checked_text(tool: AlignTool) -> str:
    """Return the fit of all points, and each point held against the others, the worst first, as html."""
    missing = tool.untyped()
    note = (
        f"Not counted: {', '.join(map(escaped, missing))}, of which x, y in the plant are missing." if missing else ""
    )
    problem = checked_problem(tool)
    if problem:
        color = theme.css(theme.REFUSED)
        return f"<div style='color:{color};font-size:12px'>{escaped(problem)}</div><div class='c-note'>{note}</div>"
    found = fit_points(tool.pairs())
    rows = [
        ("Points", str(len(found.pairs))),
        ("RMS", MILLIMETRES.text(found.rms, ".1f")),
        ("Turns by", DEGREES.text(float(found.T_plant_map[2]), ".3f")),
        ("Distances, plant / map", f"{found.scale:.5f}"),
    ]
    striking = found.striking
    if striking:
        note = f"Stands out: {', '.join(map(escaped, striking))}. Look at it, or leave it out. {note}"
    return f"{table(rows)}{points_table(found)}<div class='c-note'>{note}</div>"


def points_table(found: PlantFit) -> str:
    """Return what each point is off by and what the others say of it, the worst first and marked, as html."""
    checks = check_points(found)
    worst = worst_of(checks)
    titles = (
        ("", "Name of the point"),
        (
            f"dx, dy [{MILLIMETRES.unit}]",
            "Where the plant has the point less where the moved map has it, along the plant's axes",
        ),
        ("1σ", "What is to be expected of that, each axis, by how much all points scatter"),
        ("without it", "By how much the fit of all other points misses it, and the 1σ of that"),
    )
    head = "".join(f"<td title='{escaped(hint)}'>{title}</td>" for title, hint in titles)
    order = sorted(checks, key=lambda each: (-each.strength, -each.off))[:MOST_POINTS]
    lines = "".join(_point_row(each, is_worst=each is worst) for each in order)
    more = f"<div class='c-note'>and {len(checks) - MOST_POINTS} more</div>" if len(checks) > MOST_POINTS else ""
    return (
        f"<table class='c-before-after c-points'><tr>{head}</tr>{lines}</table>"
        f"{more}{'' if worst or len(checks) != FEWEST_FOR_WORST - 1 else A_FOURTH}"
    )


def _point_row(check: PointCheck, *, is_worst: bool) -> str:
    dx, dy = (MILLIMETRES.number(each, "+.1f") for each in check.residual)
    without = known(check.left_out) + (f" ± {known(check.left_out_sigma)}" if check.left_out >= 0.0 else "")
    name = f"<b>{escaped(check.pair.name)}</b> (worst)" if is_worst else escaped(check.pair.name)
    return f"<tr><td>{name}</td><td>{dx}, {dy}</td><td>{known(check.sigma)}</td><td>{without}</td></tr>"


def known(length: float) -> str:
    """Return a length in the unit of the table; a dash where it is not known [m]."""
    return "–" if math.isnan(length) else MILLIMETRES.number(length, ".1f")
