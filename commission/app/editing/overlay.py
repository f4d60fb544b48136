"""What one browser sees of its own editing: rings around the selection, a preview of what is being done, a handle.

It draws from the state only; the project itself is drawn by the layers, for everyone.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
from viser import LabelHandle, SceneApi, TransformControlsEvent

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, lift, outline_segments, polyline_segments, rings
from commission.app.base.extent import extent_of
from commission.app.base.marks import add_cased_lines, add_points
from commission.app.base.panel import BasePanel, Post, from_browser
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.editor import Editor, Grab
from commission.app.editing.gestures import moved, selected_of
from commission.app.editing.posed_gestures import heading_tip, moved_posed
from commission.app.editing.posed_kinds import PosedMark, marks_of
from commission.app.editing.route_gestures import curve, moved_route, routes_of
from commission.app.editing.station_layer import station_marks
from commission.app.editing.tag_layer import tag_strokes
from commission.app.editing.tool import Label
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.tags import Tag

HANDLE_FROM = 14.0
"""Size of the selection's handle, in sizes of a mark."""


class Overlay(BasePanel):
    """One browser's own marks: a panel without widgets.

    Parameters
    ----------
    scene : the browser's own.
    post : takes the actions of the handle.
    browser : number of its connection.
    """

    def __init__(self, scene: SceneApi, post: Post, browser: int) -> None:
        self._scene, self._browser = scene, browser
        self._selected = add_cased_lines(scene, "/editing/selected", theme.SELECTED, 2.0)
        self._preview = add_cased_lines(scene, "/editing/preview", theme.PREVIEW, 1.5)
        self._points = add_points(scene, "/editing/points", theme.SELECTED, 0.1)
        self._labels: list[LabelHandle] = []
        self._handle = scene.add_transform_controls(
            "/editing/handle",
            active_axes=(True, True, False),
            disable_rotations=True,
            depth_test=False,
            visible=False,
        )
        self._dragging = False
        self._handle.on_update(self._drag_handle(post))
        self._shown: tuple[Project, Editor] | None = None

    def _drag_handle(self, post: Post) -> Callable[[TransformControlsEvent], Coroutine[Any, Any, None]]:
        async def dragged(event: TransformControlsEvent) -> None:
            if event.client is None:
                return
            self._dragging = event.phase != "end"
            x, y = (float(value) for value in self._handle.position[:2])
            post(from_browser(actions.DragSelection(event.phase, (x, y)), event.client.client_id))

        return dragged

    def draw(self, view: PageView) -> None:
        """Show an editor where it or the project has changed."""
        project, editor = view.state.project, view.state.of_browser(self._browser, Editor)
        if self._shown is not None and self._shown[0] is project and self._shown[1] == editor:
            return
        self._shown = project, editor
        size = 0.9 * extent_of(project).mark_size()
        selected = selected_of(project, editor)
        centers = np.array([(r.x, r.y) for r in selected]).reshape(-1, 2)
        # Once for all that is drawn of it: where a route attracts it, its nearest place is looked for.
        posed = moved_posed(project, editor)
        further = [(mark.x, mark.y) for mark in marks_of(project, editor)[1:]]
        more = np.array(further, dtype=np.float64).reshape(-1, 2)
        ringed = np.concatenate([centers, _point_place(project, editor), _places(posed), more])
        self._selected.points = outline_segments(rings(ringed, 1.5 * size), theme.Height.EDITING)
        self._preview.points = self._preview_of(view.state, editor, posed, size)
        self._draw_points(project, editor, posed, size)
        self._write(() if editor.tool is None else editor.tool.labels())
        self._draw_handle(centers, editor, size)

    def _draw_handle(self, centers: FloatArray, editor: Editor, size: float) -> None:
        """Put the handle at the middle of the selection, except while it is being dragged itself."""
        wanted = bool(len(centers)) and editor.tool is None and (editor.drag is None or self._dragging)
        self._handle.visible = wanted
        if wanted and not self._dragging:
            self._handle.scale = HANDLE_FROM * size
            x, y = (float(value) for value in centers.mean(axis=0))
            self._handle.position = (x, y, theme.Height.EDITING)

    def _preview_of(self, state: AppState, editor: Editor, posed: PosedMark | None, size: float) -> np.ndarray:
        """Return the lines of what is being dragged, drawn or measured."""
        project, height = state.project, theme.Height.EDITING
        lines: list[np.ndarray] = []
        drag = editor.drag
        if drag is not None and drag.grab is Grab.REFLECTORS:
            places = {r.id: (r.x, r.y) for r in moved(project, editor).reflectors}
            pairs = np.array([((r.x, r.y), places[r.id]) for r in selected_of(project, editor)]).reshape(-1, 2, 2)
            lines.append(outline_segments(rings(pairs[:, 1], size), height))
            lines.append(lift(pairs.reshape(-1, 2), height).reshape(-1, 2, 3))
        elif drag is not None and drag.grab is Grab.RECTANGLE:
            (x0, y0), (x1, y1) = drag.start, drag.now
            lines.append(outline_segments(np.array([[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]]), height))
        if posed is not None:
            is_tag = isinstance(posed, Tag)
            shape = tag_strokes((posed,), height) if is_tag else outline_segments(station_marks((posed,), size), height)
            lines.append(shape)
            # A line to the tip by which it is turned.
            lines.append(polyline_segments(np.array([(posed.x, posed.y), heading_tip(project, posed)]), height))
        if editor.point is not None:
            for segment in moved_route(project, editor):
                lines.append(polyline_segments(segment.control_points, height))
                lines.append(polyline_segments(curve(segment), height))
            for name in routes_of(project, editor)[1:]:
                lines += [polyline_segments(curve(segment), height) for segment in project.route(name).segments]
        if editor.tool is not None:
            lines += [polyline_segments(line, height) for line in editor.tool.sketch(state, self._browser)]
        return np.concatenate(lines) if lines else NO_SEGMENTS

    def _draw_points(self, project: Project, editor: Editor, posed: PosedMark | None, size: float) -> None:
        """Show the control points of the selected route, or the points drawn or measured so far."""
        places = [np.array(() if editor.tool is None else editor.tool.marks(), dtype=np.float64).reshape(-1, 2)]
        if editor.point is not None:
            places += [segment.control_points for segment in moved_route(project, editor)]
        if posed is not None:
            places.append(np.array([heading_tip(project, posed)]))
        self._points.point_size = size
        self._points.points = lift(np.concatenate(places), theme.Height.EDITING)

    def _write(self, labels: tuple[Label, ...]) -> None:
        """Write the words of the tool in use."""
        while len(self._labels) > len(labels):
            self._labels.pop().remove()
        for index, (text, place) in enumerate(labels):
            position = (*place, theme.Height.EDITING)
            if index == len(self._labels):
                self._labels.append(self._scene.add_label(f"/editing/label/{index}", text, position=position))
            self._labels[index].text, self._labels[index].position = text, position


def _places(posed: PosedMark | None) -> FloatArray:
    """Return the (1, 2) place of a station or a tag [m]; (0, 2) when there is none."""
    return np.empty((0, 2)) if posed is None else np.array([[posed.x, posed.y]])


def _point_place(project: Project, editor: Editor) -> FloatArray:
    """Return the (1, 2) place of the selected control point [m]; (0, 2) when there is none."""
    point, segments = editor.point, moved_route(project, editor)
    if point is None or point.segment >= len(segments):
        return np.empty((0, 2))
    return segments[point.segment].control_points[point.index : point.index + 1]
