"""Every inlier and outlier of the drive so far (Sobreira et al. 2016, Fig. 11)."""

from __future__ import annotations

from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_marks
from commission.app.base.view import PageView
from commission.app.run.view import RunView


class AccumulatedLayer(BaseLayer):
    """Detections accumulated over the drive."""

    name = "Accumulated detections"
    group = LayerGroup.RUN
    rank = 180

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._inliers, self._outliers = (
            add_cased_marks(scene, f"/run/accumulated/{name}", color, 3)
            for name, color in (("inliers", theme.INLIER), ("outliers", theme.OUTLIER_ASSOCIATION))
        )

    def draw_slowly(self, view: PageView) -> None:
        """Draw every detection so far, unless the layer is off: it is the largest of all."""
        run = view.part(RunView)
        if run is None:
            return
        state = view.state
        if run.accumulated is None or self.name in state.hidden:
            return
        found, cased = run.accumulated, view.floor_is_colored
        for marks, places in ((self._inliers, found.inliers), (self._outliers, found.outliers)):
            marks.draw(lift(places, theme.Height.ACCUMULATED), cased=cased)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return both sets of points."""
        return *self._inliers.nodes, *self._outliers.nodes
