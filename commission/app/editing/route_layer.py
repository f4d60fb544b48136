"""Planned routes: a line with arrows in the direction of travel; reverse segments are dashed."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import stroke_segments
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.routes import Direction, Segment

POINTS_PER_SEGMENT = 160
DASH = 5


def _curve(segment: Segment) -> FloatArray:
    """(N, 2) points along a segment, equally spaced [m]."""
    spline = segment.spline()
    return spline.point(spline.u_at(np.linspace(0.0, spline.length, POINTS_PER_SEGMENT)))


def _arrows(curve: FloatArray, size: float) -> FloatArray:
    """(2 N, 2, 2) strokes of arrow heads spread along a curve [m]."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    count = max(1, int(lengths[-1] // (20.0 * size)))
    at = np.clip(np.searchsorted(lengths, (np.arange(count) + 0.5) / count * lengths[-1]), 1, len(curve) - 1)
    tips, along = curve[at], curve[at] - curve[at - 1]
    headings = np.arctan2(along[:, 1], along[:, 0])
    strokes = [
        np.stack([tips, tips + size * np.stack([np.cos(headings + turn), np.sin(headings + turn)], axis=1)], axis=1)
        for turn in (2.6, -2.6)
    ]
    return np.concatenate(strokes)


class RouteLayer(BaseLayer):
    """All routes of the project."""

    name = "Routes"
    group = LayerGroup.SITE
    rank = 50
    reads: tuple[str, ...] = ("floor_map", "routes")
    legend = (theme.Legend("route (dashed: in reverse)", theme.ROUTE, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = add_cased_lines(scene, "/routes", theme.ROUTE, 1.5)

    def show_site(self, project: Project) -> None:
        """Draw every segment of every route in one set of lines."""
        size = 2.2 * extent_of(project).mark_size()
        strokes: list[FloatArray] = []
        for segment in (segment for route in project.routes for segment in route.segments):
            curve = _curve(segment)
            line = np.stack([curve[:-1], curve[1:]], axis=1)
            if segment.direction is Direction.REVERSE:
                line = line[(np.arange(len(line)) // DASH) % 2 == 0]
            strokes += [line, _arrows(curve, size)]
        every = np.concatenate(strokes) if strokes else np.empty((0, 2, 2))
        self._lines.points = stroke_segments(every, theme.Height.ROUTE)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines, and what is dark around them."""
        return self._lines.nodes
