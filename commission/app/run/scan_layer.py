"""The newest scan: where each beam ended, seen from the estimated pose."""

from __future__ import annotations

from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer
from commission.app.base.marks import add_points
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.site.project import Project


class ScanLayer(BaseLayer):
    """Scan points."""

    name = "Scan"
    rank = 160
    legend = (theme.Legend("scan point (paper: dark)", theme.SCAN, theme.Mark.DOT),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._points = add_points(scene, "/run/scan", theme.SCAN, 0.04)

    def show_site(self, project: Project) -> None:
        """Adapt the size of points to the site's."""
        self._points.point_size = 0.4 * extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw the newest scan."""
        run = view.part(RunView)
        if run is None:
            return
        self._points.points = lift(run.scan_map, theme.Height.SCAN)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the points."""
        return (self._points,)
