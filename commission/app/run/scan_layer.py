"""The newest scan of each scanner: where each beam ended, seen from the estimated pose."""

from __future__ import annotations

from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_marks
from commission.app.base.view import PageView
from commission.app.run.view import RunView


class ScanLayer(BaseLayer):
    """Scan points."""

    name = "Scan"
    group = LayerGroup.RUN
    rank = 160
    legend = (
        theme.Legend("scan point (paper: dark)", theme.SCAN, theme.Mark.DOT),
        theme.Legend("scan point of a further scanner", theme.FURTHER_SCAN, theme.Mark.DOT),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._points = add_cased_marks(scene, "/run/scan", theme.SCAN, 3)
        self._further = add_cased_marks(scene, "/run/further_scan", theme.FURTHER_SCAN, 3)

    def draw(self, view: PageView) -> None:
        """Draw the newest scans."""
        run = view.part(RunView)
        if run is None:
            return
        cased = view.floor_is_colored
        self._points.draw(lift(run.scan_map[: run.first_scan], theme.Height.SCAN), cased=cased)
        # An empty cloud is sent only when there was something in it.
        if run.first_scan < len(run.scan_map) or len(self._further.points):
            self._further.draw(lift(run.scan_map[run.first_scan :], theme.Height.SCAN), cased=cased)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the points of the first scanner and those of the others."""
        return *self._points.nodes, *self._further.nodes
