"""Where a camera has been, by the laser and by the contour that it sees: Alenya et al. 2005, Fig. 11."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import polyline_segments, thinned
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.studies.vision import VisionResult

MOST_POINTS = 800


class CameraLayer(BaseLayer):
    """Both tracks of the camera."""

    name = "Camera tracks"
    group = LayerGroup.RUN
    rank = 218
    legend = (
        theme.Legend("camera by the laser", theme.CAMERA_BY_LASER, theme.Mark.LINE),
        theme.Legend("camera by its contour", theme.CAMERA_BY_CONTOUR, theme.Mark.LINE),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._laser = add_cased_lines(scene, "/run/camera/laser", theme.CAMERA_BY_LASER, 3.0)
        self._contour = add_cased_lines(scene, "/run/camera/contour", theme.CAMERA_BY_CONTOUR, 2.0)
        self._shown: VisionResult | None = None

    def draw_slowly(self, view: PageView) -> None:
        """Draw both whole; they do not grow with the cursor."""
        found = view.part(VisionResult)
        if found is self._shown:
            return
        self._shown = found
        for line, track in ((self._laser, "laser_map"), (self._contour, "camera_map")):
            places = np.empty((0, 2)) if found is None else thinned(getattr(found, track)[:, :2], MOST_POINTS)
            line.points = polyline_segments(places, theme.Height.TRAIL)

    def is_used(self, view: PageView) -> bool:
        """Whether the drive has a camera."""
        return view.part(VisionResult) is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return both lines."""
        return *self._laser.nodes, *self._contour.nodes
