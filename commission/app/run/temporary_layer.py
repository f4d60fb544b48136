"""Temporary landmarks at the cursor: each with 2-sigma of its place, and how long ago it was seen."""

from __future__ import annotations

import numpy as np
from viser import LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, Points, crosses, outline_segments, rings, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.gaussian import ellipse_points
from commission.localization.temporary_memory import KIND, SEEN_NS, SHAPE, TemporaryLandmarks
from commission.localization.temporary_model import LandmarkKind

SIGMAS = 2.0
CORNER_MARK = 0.2
"""Half the width of the cross on a corner [m]."""
MOST_AGES = 20
"""Landmarks that bear their age, those seen longest ago."""
YOUNGEST_S = 1.0
"""Age from which on it is written [s]."""


class TemporaryLayer(BaseLayer):
    """Temporary landmarks."""

    name = "Temporary landmarks"
    group = LayerGroup.RUN
    rank = 207
    legend = (
        theme.Legend("reel or corner that is a landmark", theme.GOODS, theme.Mark.LINE),
        theme.Legend("2σ of its place; age in s", theme.GOODS_SIGMA, theme.Mark.RING),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._bodies = add_cased_lines(scene, "/run/temporary/bodies", theme.GOODS, 2.0)
        self._ellipses = add_cased_lines(scene, "/run/temporary/sigmas", theme.GOODS_SIGMA, 1.5)
        self._labels: tuple[LabelHandle, ...] = ()
        self._shown: tuple[object, ...] = (None,)

    def draw(self, view: PageView) -> None:
        """Draw what is remembered now."""
        run = view.part(RunView)
        known = None if run is None else run.temporary
        shown = (None,) if run is None or known is None else (known, view.state.magnify, run.newest)
        if shown == self._shown:
            return
        self._shown = shown
        for label in self._labels:
            label.remove()
        self._labels = ()
        if known is None or run is None or run.estimate is None:
            self._bodies.points = self._ellipses.points = NO_SEGMENTS
            return
        self._bodies.points = body_lines(known)
        ellipses = ellipse_points(known.places_map, known.place_covariances, SIGMAS * view.state.magnify)
        self._ellipses.points = outline_segments(ellipses, theme.Height.POSE)
        visible = self.name not in view.state.hidden
        self._labels = tuple(
            self.scene.add_label(
                f"/run/temporary/label/{number}",
                f"{age:.0f} s",
                position=(float(place[0]), float(place[1]), theme.Height.LABEL),
                anchor="center-center",
                font_screen_scale=0.7,
                visible=visible,
            )
            for number, (place, age) in enumerate(ages_of(known, run.estimate.stamp_ns))
        )

    def is_used(self, view: PageView) -> bool:
        """Whether any are remembered."""
        run = view.part(RunView)
        return run is not None and run.temporary is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return lines and labels."""
        return *self._bodies.nodes, *self._ellipses.nodes, *self._labels


def body_lines(known: TemporaryLandmarks) -> Points:
    """Return a ring as large as each reel, and a cross on each corner.

    Parameters
    ----------
    known : landmarks.
    """
    is_reel: BoolArray = known.marks[:, KIND] == LandmarkKind.REEL
    reels = rings(known.places_map[is_reel], known.shapes[is_reel, SHAPE])
    marks = crosses(known.places_map[~is_reel], CORNER_MARK)
    return np.concatenate([outline_segments(reels, theme.Height.POSE), stroke_segments(marks, theme.Height.POSE)])


def ages_of(known: TemporaryLandmarks, stamp_ns: int) -> tuple[tuple[FloatArray, float], ...]:
    """Return place [m] and age [s] of the landmarks that were not seen of late, the oldest first.

    Parameters
    ----------
    known : landmarks.
    stamp_ns : now [ns].
    """
    ages = 1e-9 * (stamp_ns - known.marks[:, SEEN_NS])
    order = np.argsort(-ages, kind="stable")[:MOST_AGES]
    return tuple((known.places_map[k], float(ages[k])) for k in order.tolist() if ages[k] >= YOUNGEST_S)
