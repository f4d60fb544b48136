"""Inputs of the selected route and its control point, as part of the selection's panel."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.inputs import Inputs, Setting, show
from commission.app.base.panel import Post, posting
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint, editor_of
from commission.app.editing.route_gestures import route_of, segment_of
from commission.geometry.arrays import frozen
from commission.site.fields import names_of
from commission.site.routes import Route, Segment

PLACE = names_of(actions.PlaceControlPoint)
DRIVE = ("direction", "speed")
"""Fields of `Segment` that are set here."""
SEGMENT = Segment(control_points=frozen([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]], (4, 2), "points"), speed=0.5)
"""What the widgets begin with."""


class RouteFields:
    """Name, control point, direction, speed, buttons."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._shown: ControlPoint | None = None
        self._inputs = Inputs(gui, post, _setting, self._read)
        self._folder = gui.add_folder("Control point", visible=False)
        with self._folder:
            self._inputs.field("name", Route("Route", (SEGMENT,)))
            self._which = gui.add_html("")
            for name in PLACE:
                self._inputs.field(name, actions.PlaceControlPoint((0.0, 0.0)))
            for name in DRIVE:
                self._inputs.field(name, SEGMENT)
            gui.add_html(theme.WIDE)
            points = gui.add_button_group("", ("Insert", "Split", "Delete", "Delete route"))
            points.on_click(posting(post, self._pressed))

    def _read(self, state: AppState, name: str) -> Any:
        """Return a value of the selected route, control point or segment; None without one."""
        editor = editor_of(state, self._browser)
        route, segment = route_of(state.project, editor), segment_of(state.project, editor)
        if route is None or segment is None or editor.point is None:
            return None
        if name == "speed":
            return route.speed_of(segment)
        x, y = segment.control_points[min(editor.point.index, len(segment.control_points) - 1)]
        return {"name": route.name, "direction": segment.direction, "place[0]": float(x), "place[1]": float(y)}[name]

    def _pressed(self, event: GuiEvent[Any]) -> page_actions.Action:
        match event.target.value:
            case "Insert":
                return actions.InsertControlPoint()
            case "Split":
                return actions.SplitSegment()
            case "Delete":
                return actions.DeleteControlPoint()
            case _:
                return actions.DeleteRoute()

    def show(self, state: AppState) -> None:
        """Show what is selected of the routes."""
        editor = editor_of(state, self._browser)
        route, segment, point = route_of(state.project, editor), segment_of(state.project, editor), editor.point
        if route is None or segment is None or point is None:
            show(self._folder, visible=False)
            return
        show(self._folder, visible=True)
        if point != self._shown:
            self._inputs.forget()
        self._shown = point
        self._inputs.follow(state)
        index = min(point.index, len(segment.control_points) - 1)
        self._which.content = (
            f"<div class='c-note' style='padding:2px 6px'>Point {index + 1} of {len(segment.control_points)}, "
            f"segment {point.segment + 1} of {len(route.segments)}, "
            f"{sum(s.spline().length for s in route.segments):.2f} m in all</div>"
        )


def _setting(name: str, value: Setting) -> page_actions.Action:
    """Return the action of one field's widget."""
    if name == "name":
        return actions.SetRoute("name", str(value))
    return actions.SetCoordinate(name, value) if name in PLACE else actions.SetSegment(name, value)
