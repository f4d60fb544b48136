"""Where routes ask too much of the vehicle: stretches in red or orange, and its outline where each is worst."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, Points, outline_segments, polyline_segments, thinned
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import Cased, add_cased_lines
from commission.app.base.view import PageView
from commission.app.problems.view import inspection_of
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.studies.violations import Stretch, Violation

WIDTH, OUTLINE_WIDTH = 9.0, 1.2
MOST_POINTS = 100
"""Points along one stretch: enough for any curve that a vehicle drives."""
MOST_OUTLINES = 60
"""Outlines that are drawn: more would hide the floor."""
SHORTEST = 1.2
"""Length of the mark of a corner, which has none of its own, in sizes of a mark."""


class ViolationLayer(BaseLayer):
    """Too tight curves, corners, walls in the way, too little room."""

    name = "Route violations"
    group = LayerGroup.SITE
    rank = 70
    reads: tuple[str, ...] = ("floor_map", "vehicle")
    legend = (
        theme.Legend("vehicle cannot drive this: curve, wall", theme.OVER_LIMIT, theme.Mark.LINE),
        theme.Legend("too little room, or a turn on the spot", theme.TOO_LITTLE, theme.Mark.LINE),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._outline: FloatArray = np.empty((0, 2))
        self._mark = 0.1
        self._shown: Sequence[Violation] | None = None
        self._fatal = self._lines("fatal", theme.OVER_LIMIT, WIDTH)
        self._little = self._lines("little", theme.TOO_LITTLE, WIDTH)
        self._worst_outlines = self._lines("outlines", theme.OVER_LIMIT, OUTLINE_WIDTH)

    def _lines(self, name: str, color: theme.Color, width: float) -> Cased:
        return add_cased_lines(self.scene, f"/violations/{name}", color, width)

    def show_site(self, project: Project) -> None:
        """Adapt the outline to the vehicle and the marks to the site."""
        self._outline = np.asarray(project.vehicle.outline, dtype=np.float64)
        self._mark = SHORTEST * extent_of(project).mark_size()
        self._shown = None

    def draw(self, view: PageView) -> None:
        """Draw every stretch anew where something was found anew."""
        violations = inspection_of(view).violations
        if violations is self._shown:
            return
        self._shown = violations
        self._fatal.points = self._stretches(v for v in violations if v.is_fatal)
        self._little.points = self._stretches(v for v in violations if not v.is_fatal)
        outlines = [
            se2.transform_points(violation.where.worst_pose, self._outline) for violation in violations[:MOST_OUTLINES]
        ]
        self._worst_outlines.points = outline_segments(np.array(outlines), theme.Height.ACCUMULATED)

    def is_used(self, view: PageView) -> bool:  # noqa: ARG002 - the protocol's
        """Whether a route asks too much."""
        return bool(self._shown)

    def _stretches(self, violations: Iterable[Violation]) -> Points:
        lines = [
            polyline_segments(self._visible(violation.where), theme.Height.ACCUMULATED) for violation in violations
        ]
        return np.concatenate(lines) if lines else NO_SEGMENTS

    def _visible(self, where: Stretch) -> FloatArray:
        """(N, 2) the stretch, or a short line through it where it has hardly a length [m]."""
        if where.length > self._mark:
            return thinned(where.poses[:, :2], MOST_POINTS)
        x, y, heading = where.worst_pose
        ahead = 0.5 * self._mark * np.array([np.cos(heading), np.sin(heading)])
        return np.array([x, y]) + np.stack((-ahead, ahead))

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return stretches and outlines."""
        return tuple(node for lines in (self._fatal, self._little, self._worst_outlines) for node in lines.nodes)
