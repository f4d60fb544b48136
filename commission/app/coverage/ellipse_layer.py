"""Ellipses of a fix on the heatmap: how far, and in which direction, a single scan may err."""

from __future__ import annotations

from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, outline_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_lines
from commission.app.base.view import PageView
from commission.app.coverage.view import EllipseView, coverage_of
from commission.geometry.gaussian import ellipse_points

POINTS = 32


class FixEllipseLayer(BaseLayer):
    """1-sigma ellipses of a fix."""

    name = "Ellipses of a fix"
    group = LayerGroup.PLAN
    rank = 60
    reads: tuple[str, ...] = ()

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        # A dark rim, since the heatmap has every lightness.
        self._rim, self._lines = (
            add_lines(scene, f"/plan/ellipses/{name}", color, width)
            for name, color, width in (("rim", theme.RIM, 4.0), ("line", theme.PREVIEW, 1.8))
        )
        self._shown: EllipseView | None = None

    def draw(self, view: PageView) -> None:
        """Draw the ellipses anew where they have changed."""
        found = coverage_of(view).ellipses
        if found is self._shown:
            return
        self._shown = found
        if found is None or not len(found.centers):
            self._rim.points = self._lines.points = NO_SEGMENTS
            return
        outlines = ellipse_points(found.centers, found.covariances, found.factor, POINTS)
        self._rim.points = outline_segments(outlines, theme.Height.ACCUMULATED)
        self._lines.points = outline_segments(outlines, theme.Height.SCAN)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return lines and rim."""
        return self._rim, self._lines
