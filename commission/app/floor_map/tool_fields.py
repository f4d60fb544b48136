"""The floor map's tools as part of the selection's panel: how walls are drawn, and the two points to align by."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base.panel import Post, posting, table, write
from commission.app.editing.editor import AlignmentDraft, Editor, MapPen, NamedPoint, Tool
from commission.app.floor_map import actions
from commission.app.floor_map.tools import alignment_of
from commission.site.editing.alignment import DOUBTFUL, WRONG

FREE, UNKNOWN = "free", "unknown"
MAP_ONLY, EVERYTHING = "the map alone", "what is on it, too"
LETTERS = "AB"
LONGEST_NAME = 40
"""Letters of a point's name that are kept."""


class MapToolFields:
    """Thickness, what erased cells become, points and their plant coordinates; only what the tool in use needs."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._gui, self._post, self._browser = gui, post, browser
        self._pen = MapPen()
        self._thickness = gui.add_number(
            "Thickness [mm]",
            100.0,
            min=1.0,
            max=10_000.0,
            step=1.0,
            visible=False,
            hint="Half on each side of the line.",
        )
        self._thickness.on_update(
            posting(post, lambda event: self._with_pen(thickness=float(event.target.value) / 1000.0))
        )
        self._becomes = gui.add_dropdown(
            "Becomes", (FREE, UNKNOWN), visible=False, hint="What erased cells are then; both let the laser pass."
        )
        self._becomes.on_update(posting(post, lambda event: self._with_pen(to_unknown=event.target.value == UNKNOWN)))
        self._add_alignment()

    def _with_pen(self, **changes: Any) -> page_actions.Action:
        return actions.SetPen(replace(self._pen, **changes))

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
            self._said = gui.add_html("")
            self._align = gui.add_button("Move and turn", hint="The map keeps its scale; can be undone.")
            self._align.on_click(posting(self._post, lambda _event: actions.AlignMap()))

    def _add_point(self, index: int) -> tuple[Any, Any]:
        """Add name and plant coordinates of a point."""
        gui, letter = self._gui, LETTERS[index]
        name = gui.add_text(f"{letter} is", "", hint="What you call it, such as: column B4.")
        plant = gui.add_vector2(f"{letter} x, y [m]", (0.0, 0.0), step=0.001, hint="Where it lies in the plant.")

        def typed(_event: GuiEvent[Any]) -> page_actions.Action:
            x, y = (float(value) for value in plant.value)
            return actions.SetPlantPoint(index, (x, y), str(name.value).strip()[:LONGEST_NAME])

        for widget in (name, plant):
            widget.on_update(posting(self._post, typed))
        return name, plant

    def show(self, editor: Editor) -> None:
        """Follow the editor."""
        self._pen = editor.pen
        for widget, tool in (
            (self._thickness, Tool.WALL),
            (self._becomes, Tool.ERASE),
            (self._folder, Tool.ALIGN),
        ):
            if widget.visible is not (editor.tool is tool):
                widget.visible = editor.tool is tool
        write(self._thickness, round(1000.0 * editor.pen.thickness, 3))
        write(self._becomes, UNKNOWN if editor.pen.to_unknown else FREE)
        if editor.tool is Tool.ALIGN:
            self._show_alignment(editor.alignment)

    def _show_alignment(self, draft: AlignmentDraft) -> None:
        for index, widgets in enumerate(self._points):
            known = index < len(draft.points)
            point = draft.points[index] if known else NamedPoint((0.0, 0.0), (0.0, 0.0))
            plant = (round(point.plant[0], 4), round(point.plant[1], 4))
            for widget, value in zip(widgets, (point.name, plant), strict=True):
                write(widget, value)
                if widget.disabled is known:
                    widget.disabled = not known
        write(self._moves, EVERYTHING if draft.everything else MAP_ONLY)
        self._said.content = f"<div style='padding:2px 6px'>{alignment_text(draft)}</div>"
        found = alignment_of(draft)
        self._align.disabled = found is None or found.share > WRONG


def alignment_text(draft: AlignmentDraft) -> str:
    """Return what the points say, as html."""
    clicked = [
        (f"{letter} on the map", f"{point.at[0]:.3f}, {point.at[1]:.3f} m")
        for letter, point in zip(LETTERS, draft.points, strict=False)
    ]
    found = alignment_of(draft)
    if found is None:
        missing = f"click {LETTERS[len(draft.points)]}" if len(draft.points) < 2 else "they are too close to each other"
        return f"{table(clicked)}<div class='c-note'>Points: {missing}</div>"
    color = "#ff8a80" if found.share > WRONG else "#ffb74d" if found.share > DOUBTFUL else "inherit"
    residual = f"<span style='color:{color}'>{1000.0 * found.residual:+.0f} mm ({100.0 * found.share:.2f} %)</span>"
    rows = [
        ("Difference", residual),
        ("A to B, map", f"{found.on_map:.3f} m"),
        ("A to B, plant", f"{found.in_plant:.3f} m"),
        ("Turns by", f"{math.degrees(float(found.T_plant_map[2])):.3f} °"),
        *clicked,
    ]
    note = ""
    if found.share > WRONG:
        note = f"More than {100.0 * WRONG:g} %: a wrong point, number or scale."
    elif found.share > DOUBTFUL:
        note = f"More than {100.0 * DOUBTFUL:g} %: look at the points and their numbers."
    return f"{table(rows)}<div class='c-note'>{note}</div>"
