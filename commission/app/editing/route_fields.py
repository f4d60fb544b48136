"""Inputs of the selected route and its control point, as part of the selection's panel."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.panel import Post, posting, write
from commission.app.editing import actions
from commission.app.editing.editor import Editor
from commission.app.editing.route_gestures import route_of, segment_of
from commission.site.project import Project
from commission.site.routes import SPEEDS, Direction


class RouteFields:
    """Name, control point, direction, speed, buttons."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._folder = gui.add_folder("Control point", visible=False)
        with self._folder:
            self._name = gui.add_text("Route", "", hint="Name of the route, unique within the project.")
            self._name.on_update(posting(post, lambda event: actions.RenameRoute(str(event.target.value).strip())))
            self._which = gui.add_html("")
            self._x = gui.add_number("x [m]", 0.0, step=0.001)
            self._y = gui.add_number("y [m]", 0.0, step=0.001)
            for widget in (self._x, self._y):
                widget.on_update(posting(post, self._placed))
            self._direction = gui.add_dropdown(
                "Segment", tuple(Direction), hint="Whether the vehicle's front or its rear goes ahead."
            )
            self._speed = gui.add_number(
                "Speed [m/s]", 0.5, min=SPEEDS.low, max=SPEEDS.high, step=0.01, hint="Planned speed of this segment."
            )
            for widget in (self._direction, self._speed):
                widget.on_update(posting(post, self._driven))
            gui.add_html(theme.WIDE)
            points = gui.add_button_group("", ("Insert", "Split", "Delete", "Delete route"))
            points.on_click(posting(post, self._pressed))

    def _placed(self, _event: GuiEvent[Any]) -> page_actions.Action:
        place = (float(self._x.value), float(self._y.value))
        return actions.PlaceControlPoint(place)

    def _driven(self, _event: GuiEvent[Any]) -> page_actions.Action:
        direction, speed = Direction(self._direction.value), float(self._speed.value)
        return actions.SetSegment(direction, speed)

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

    def show(self, project: Project, editor: Editor) -> None:
        """Show what is selected of the routes."""
        route, segment = route_of(project, editor), segment_of(project, editor)
        shown = route is not None and segment is not None and editor.point is not None
        if self._folder.visible is not shown:
            self._folder.visible = shown
        if route is None or segment is None or editor.point is None:
            return
        index = min(editor.point.index, len(segment.control_points) - 1)
        x, y = (round(float(value), 3) for value in segment.control_points[index])
        self._which.content = (
            f"<div class='c-note' style='padding:2px 6px'>Point {index + 1} of {len(segment.control_points)}, "
            f"segment {editor.point.segment + 1} of {len(route.segments)}, "
            f"{sum(s.spline().length for s in route.segments):.2f} m in all</div>"
        )
        values: tuple[tuple[Any, Any], ...] = (
            (self._name, route.name),
            (self._x, x),
            (self._y, y),
            (self._direction, segment.direction.value),
            (self._speed, round(route.speed_of(segment), 4)),
        )
        for widget, value in values:
            write(widget, value)
