"""Detections of the newest scan where the gates judge them: inliers yellow, outliers red, one shape for each filter."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_POINTS, lift, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines, add_marks
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Status

Shape: TypeAlias = Literal["sparkle", "diamond"]

STYLES: dict[Status, tuple[theme.Color, Shape, str]] = {
    Status.INLIER: (theme.INLIER, "sparkle", "inlier"),
    Status.OUTLIER_ASSOCIATION: (theme.OUTLIER_ASSOCIATION, "sparkle", "outlier: outside every gate"),
    Status.OUTLIER_DETECTOR: (theme.OUTLIER_DETECTOR, "diamond", "outlier: too few or many beams"),
}
MARKS: dict[Shape, theme.Mark] = {"sparkle": theme.Mark.CROSS, "diamond": theme.Mark.DIAMOND}
PIXELS: dict[Shape, int] = {"sparkle": 13, "diamond": 9}
AROUND = 5
"""So much larger is what is dark around a mark [pixels]."""


class DetectionLayer(BaseLayer):
    """Detections of the newest scan, each with its offset from the reflector it is taken for."""

    name = "Detections"
    group = LayerGroup.RUN
    rank = 170
    legend = tuple(theme.Legend(text, color, MARKS[shape]) for color, shape, text in STYLES.values())

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._offsets = add_cased_lines(scene, "/run/offsets", theme.OFFSET, 1.0)
        self._clouds = {
            status: add_marks(scene, f"/run/detections/{status.name.lower()}", color, PIXELS[shape], shape=shape)
            for status, (color, shape, _) in STYLES.items()
        }
        # Without what is dark around it a yellow cross is not seen on the bright end of a heatmap.
        self._casings = {
            status: add_marks(
                scene,
                f"/run/detections/around_{status.name.lower()}",
                theme.CASING,
                PIXELS[shape] + AROUND,
                shape=shape,
            )
            for status, (_, shape, _) in STYLES.items()
        }

    def draw(self, view: PageView) -> None:
        """Draw every detection; its offset is magnified as the gates are."""
        run = view.part(RunView)
        if run is None:
            return
        places, offsets = drawn_detections(run, view.state.magnify)
        for status, cloud in self._clouds.items():
            if run.estimate is None:
                chosen = below = NO_POINTS
            else:
                at = places[run.estimate.status == status]
                chosen, below = lift(at, theme.Height.DETECTION), lift(at, theme.Height.AROUND_DETECTION)
            if len(chosen) or len(cloud.points):
                cloud.points, self._casings[status].points = chosen, below
        self._offsets.draw(stroke_segments(offsets, theme.Height.DETECTION), cased=view.floor_is_colored)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the marks of every status and the lines of their offsets."""
        return (*self._casings.values(), *self._clouds.values(), *self._offsets.nodes)


def drawn_detections(run: RunView, magnify: float) -> tuple[FloatArray, FloatArray]:
    """Return where the detections of the newest cycle are drawn, and the lines from their reflectors to them.

    A detection inside a gate is drawn inside it at any magnification, and one outside, outside.

    Parameters
    ----------
    run : at its cursor.
    magnify : how much larger than they are gates are drawn.

    Returns
    -------
    places : (N, 2) [m], map frame.
    offsets : (M, 2, 2) lines from a reflector to its detection [m].
    """
    places, estimate = run.judged_map.copy(), run.estimate
    if estimate is None:
        return places, np.empty((0, 2, 2))
    # Outside the gate as it is drawn a detection stays where it is, and has no line across the floor.
    near = (estimate.reflector >= 0) & (estimate.d2 <= magnify**2 * estimate.gate)
    centers = run.segment.setup.reflectors.centers[estimate.reflector[near]]
    places[near] = centers + magnify * (places[near] - centers)
    return places, np.stack([centers, places[near]], axis=1)
