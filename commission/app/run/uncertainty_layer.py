"""The covariance of the estimated pose: an ellipse of 2-sigma for the position, two rays for the heading."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import outline_segments, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.geometry.gaussian import ellipse_points

SIGMAS = 2.0
RAY = 0.8


class UncertaintyLayer(BaseLayer):
    """Pose covariance."""

    name = "Pose covariance"
    group = LayerGroup.RUN
    rank = 200
    legend = (
        theme.Legend("2σ of the estimated position", theme.POSE, theme.Mark.RING),
        theme.Legend("2σ of the estimated heading", theme.HEADING, theme.Mark.LINE),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = add_cased_lines(scene, "/vehicle/covariance", theme.POSE, 2.0)
        self._rays = add_cased_lines(scene, "/vehicle/heading_spread", theme.HEADING, 2.0)

    def draw(self, view: PageView) -> None:
        """Draw ellipse and rays."""
        run = view.part(RunView)
        if run is None:
            return
        state = view.state
        # Drawn in the vehicle's frame, so that it sits on the vehicle even where a slow browser skips pictures.
        c, s = np.cos(run.pose[2]), np.sin(run.pose[2])
        to_base = np.array([[c, s], [-s, c]])
        covariance = to_base @ run.covariance[:2, :2] @ to_base.T
        ellipse = ellipse_points(np.zeros((1, 2)), covariance[np.newaxis], SIGMAS * state.magnify)
        spread = min(SIGMAS * state.magnify * float(np.sqrt(run.covariance[2, 2])), np.pi)
        ends = RAY * np.array([(np.cos(spread), np.sin(-spread)), (np.cos(spread), np.sin(spread))])
        rays = np.stack([np.zeros((2, 2)), ends], axis=1)
        cased = view.floor_is_colored
        self._lines.draw(outline_segments(ellipse, theme.Height.POSE), cased=cased)
        self._rays.draw(stroke_segments(rays, theme.Height.POSE), cased=cased)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines."""
        return *self._lines.nodes, *self._rays.nodes
