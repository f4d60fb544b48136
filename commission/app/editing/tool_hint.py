"""One line over the floor that says what a click does now and how far one has come. Nothing to click in it."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.base.panel import BasePanel, escaped
from commission.app.base.view import PageView
from commission.app.editing.editor import Editor, Tool
from commission.app.editing.gestures import moved, selected_of
from commission.app.editing.station_gestures import moved_station
from commission.app.floor_map.tools import alignment_of
from commission.site.project import Project


def hint(project: Project, editor: Editor) -> str:
    """Return what the tool in use expects; empty when there is nothing to say."""
    if editor.drag is not None and (editor.selected or editor.station):
        return _dragging(project, editor)
    match editor.tool:
        case Tool.SELECT:
            said = ""
        case Tool.PLACE:
            where = " at the nearest wall" if editor.snapping.walls else ""
            said = f"Place: click on the floor for a reflector{where} &nbsp; (Esc ends)"
        case Tool.ROUTE:
            points = len(editor.draft)
            ready = ", Enter makes a route of them" if points > 1 else ""
            said = f"Route: click its points, {points} so far{ready} &nbsp; (Esc drops them)"
        case Tool.STATION:
            said = "Station: click where the vehicle has to stand, on a route it looks along it &nbsp; (Esc ends)"
        case Tool.MEASURE:
            which = "second" if len(editor.measured) == 1 else "first"
            said = f"Measure: click the {which} point &nbsp; (Esc ends)"
        case Tool.KEEP_OUT:
            said = "Keep out: drag over an area without new reflectors, click one to free it &nbsp; (Esc ends)"
        case Tool.ERASE | Tool.OBSTACLE:
            said = f"{editor.tool}: drag a rectangle, or click corners{_so_far(editor, 3)} &nbsp; (Esc ends)"
        case Tool.WALL:
            thickness = f"{1000.0 * editor.pen.thickness:g} mm thick"
            said = f"Wall, {thickness}: click its points{_so_far(editor, 2)} &nbsp; (Esc ends)"
        case Tool.ALIGN:
            which = ("A", "B")[len(editor.alignment.points)] if len(editor.alignment.points) < 2 else ""
            click = (
                f"click {which}, a corner or a reflector of known plant coordinates" if which else "type coordinates"
            )
            said = f"Align: {click} &nbsp; (Esc ends)"
        case Tool.CALIBRATE:
            said = "Image: click two points of known distance, far apart; then type it on the left &nbsp; (Esc ends)"
    return said


def _aligning(editor: Editor) -> str:
    """Say which point comes next, or how well the two fit."""
    points, found = len(editor.alignment.points), alignment_of(editor.alignment)
    if points < 2:
        return f"click {'AB'[points]}, a corner or a reflector of known plant coordinates"
    if found is None:
        return "A and B are too close to each other"
    difference = f"{1000.0 * found.residual:+.0f} mm ({100.0 * found.share:.2f} %)"
    return f"type the plant's coordinates of A and B; their distances differ by {difference}"


def _so_far(editor: Editor, needed: int) -> str:
    """Say how many points there are, and what Enter makes of them."""
    points = len(editor.draft)
    if points == 0:
        return ""
    return f", {points} so far" + (", Enter finishes" if points >= needed else "")


def _dragging(project: Project, editor: Editor) -> str:
    """Say where what is being dragged would come to lie."""
    station = moved_station(project, editor)
    if station is not None:
        heading = f"{math.degrees(station.heading):.1f}°"
        return f"{escaped(station.name)} to x {station.x:.3f} m, y {station.y:.3f} m, heading {heading}"
    selected = selected_of(project, editor)
    if editor.drag is None or len(selected) == 0:
        return ""
    if len(selected) > 1:
        dx, dy = editor.drag.offset
        return f"{len(selected)} reflectors by {dx:+.3f} m, {dy:+.3f} m"
    place = next(r for r in moved(project, editor).reflectors if r.id == selected[-1].id)
    return f"{escaped(place.id)} to x {place.x:.3f} m, y {place.y:.3f} m"


class ToolHint(BasePanel):
    """The line, in the middle above the floor."""

    def __init__(self, gui: GuiApi, browser: int) -> None:
        self._browser = browser
        self._html = gui.add_html("")
        self._shown = ""

    def draw(self, view: PageView) -> None:
        """Follow the editor without delay."""
        text = hint(view.state.project, view.state.of_browser(self._browser, Editor))
        if text == self._shown:
            return
        self._shown = text
        self._html.content = (
            "<div class='c-hint' style='position:fixed;z-index:40;top:52px;left:50%;transform:translateX(-50%);"
            "pointer-events:none;white-space:nowrap;font-size:12.5px;padding:3px 14px;border-radius:3px;"
            f"background:rgba(16,18,21,.88);border:1px solid #ff9f1c'>{text}</div>"
            if text
            else ""
        )
