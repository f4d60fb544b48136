"""Where the vehicle may be, while it looks where it is: each place with its heading and its 2-sigma."""

from __future__ import annotations

import numpy as np
from viser import LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, Points, outline_segments, rings, stroke_segments
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.hypotheses import shown_hypotheses
from commission.app.run.view import RunView
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import ellipse_points
from commission.localization.hypotheses import Hypothesis
from commission.site.project import Project
from commission.site.quantity import PERCENT

SIGMAS = 2.0
RING_MARKS = 2.2
"""Radius of the ring around each place, in sizes of a mark."""
ARROW_MARKS = 7.0
"""Length of its arrow."""
NUMBERED = 5
"""Places that bear their rank and probability."""


class HypothesisLayer(BaseLayer):
    """Hypotheses of a search."""

    name = "Hypotheses"
    group = LayerGroup.RUN
    rank = 205
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes", "vehicle")
    legend = (theme.Legend("where it may be, 2σ; not confirmed", theme.HYPOTHESIS, theme.Mark.RING),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._mark = 0.1
        self._lines = add_cased_lines(scene, "/run/hypotheses", theme.HYPOTHESIS, 2.0)
        self._labels: tuple[LabelHandle, ...] = ()
        self._shown: tuple[object, ...] = ()

    def show_site(self, project: Project) -> None:
        """Adapt rings and arrows to the size of the site."""
        self._mark = extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw what has changed."""
        run = view.part(RunView)
        found = () if run is None else shown_hypotheses(run.hypotheses)
        visible, magnify = self.name not in view.state.hidden, view.state.magnify
        shown = (*map(id, found), self._mark, magnify)
        if shown == self._shown:
            return
        self._shown = shown
        self._lines.points = hypothesis_lines(found, self._mark, magnify) if found else NO_SEGMENTS
        for label in self._labels:
            label.remove()
        self._labels = tuple(
            self.scene.add_label(
                f"/run/hypotheses/label/{rank}",
                f"{rank}: {PERCENT.text(each.probability, '.0f')}",
                position=(float(each.pose[0]), float(each.pose[1]) + 1.2 * RING_MARKS * self._mark, theme.Height.LABEL),
                anchor="bottom-center",
                font_screen_scale=0.8,
                visible=visible,
            )
            for rank, each in enumerate(found[:NUMBERED], start=1)
        )

    def is_used(self, view: PageView) -> bool:
        """Whether the vehicle looks where it is."""
        run = view.part(RunView)
        return run is not None and bool(run.hypotheses)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return lines and labels."""
        return *self._lines.nodes, *self._labels


def hypothesis_lines(found: tuple[Hypothesis, ...], mark: float, magnify: float) -> Points:
    """Return a ring, an arrow and an ellipse for each place.

    Parameters
    ----------
    found : the places.
    mark : size of a mark [m].
    magnify : by how much ellipses are drawn larger than they are.
    """
    poses = np.array([each.pose for each in found])
    covariances = np.array([each.covariance[:2, :2] for each in found])
    height = theme.Height.POSE
    arrows = np.concatenate([_arrow(pose, ARROW_MARKS * mark) for pose in poses])
    return np.concatenate(
        [
            outline_segments(rings(poses[:, :2], RING_MARKS * mark), height),
            outline_segments(ellipse_points(poses[:, :2], covariances, SIGMAS * magnify), height),
            stroke_segments(arrows, height),
        ]
    )


def _arrow(pose: FloatArray, length: float) -> FloatArray:
    """(3, 2, 2) strokes of an arrow along a heading [m]."""
    tip, wing = length, 0.25 * length
    strokes = np.array([[(0, 0), (tip, 0)], [(tip, 0), (tip - wing, wing)], [(tip, 0), (tip - wing, -wing)]])
    return se2.transform_points(pose, strokes.reshape(-1, 2)).reshape(-1, 2, 2)
