"""What is expected along a route, as a ribbon in colors of the share of the limit. `event_layer` draws what happens."""

from __future__ import annotations

import numpy as np
from viser import LineSegmentsHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_lines
from commission.app.base.view import PageView
from commission.app.prediction.limit_colors import limit_classes, palette
from commission.app.prediction.view import RouteView
from commission.geometry.arrays import FloatArray, IntArray
from commission.planning.route_prediction import RoutePrediction

MOST_PIECES = 1500
WIDTH, RIM = 6.0, 9.0


def pieces(points: FloatArray, limit_shares: FloatArray, at_most: int) -> tuple[FloatArray, IntArray]:
    """Thin a colored line without losing its worst spots.

    Parameters
    ----------
    points : (K, 2) array [m].
    limit_shares : (K,) share of the supervisor's limit at each point [1].
    at_most : about how many pieces remain.

    Returns
    -------
    lines : (N, 2, 2) pieces [m], end to end.
    classes : (N,) class of the largest share of each.
    """
    step = max(1, -(-len(points) // at_most))
    starts = np.arange(0, len(points) - 1, step)
    ends = np.minimum(starts + step, len(points) - 1)
    return np.stack([points[starts], points[ends]], axis=1), limit_classes(np.maximum.reduceat(limit_shares, starts))


class RibbonLayer(BaseLayer):
    """Predicted uncertainty along the chosen route."""

    name = "Route prediction"
    group = LayerGroup.PLAN
    rank = 90
    reads: tuple[str, ...] = ()

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        # A dark rim keeps the ribbon apart from a heatmap in the same colors. One node for each color: colors of
        # single vertices come out lighter in the browser than the same color of a whole node.
        self._rim = self._lines("rim", theme.RIM, RIM)
        self._ribbon = tuple(self._lines(f"ribbon/{index}", color, WIDTH) for index, color in enumerate(palette()))
        self._shown: RoutePrediction | None = None

    def _lines(self, name: str, color: theme.Color, width: float) -> LineSegmentsHandle:
        return add_lines(self.scene, f"/plan/{name}", color, width)

    def draw(self, view: PageView) -> None:
        """Draw the ribbon anew where the prediction has changed."""
        route = view.part(RouteView)
        prediction = None if route is None else route.prediction
        if prediction is self._shown:
            return
        self._shown = prediction
        points, limit_shares = (np.empty((0, 2)), np.empty(0))
        if prediction is not None:
            points, limit_shares = prediction.drive.poses[:, :2], prediction.limit_share
        lines, classes = (
            pieces(points, limit_shares, MOST_PIECES) if len(points) > 1 else (points.reshape(0, 2, 2), limit_shares)
        )
        self._rim.points = stroke_segments(lines, theme.Height.ROUTE)
        for index, node in enumerate(self._ribbon):
            chosen = lines[classes == index]
            if len(chosen) or len(node.points) > 1:
                node.points = stroke_segments(chosen, theme.Height.ACCUMULATED)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return ribbon and rim."""
        return self._rim, *self._ribbon
