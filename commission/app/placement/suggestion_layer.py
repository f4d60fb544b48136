"""The suggested layout before it is accepted: new reflectors, those that would go crossed out, keep-outs."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import (
    NO_SEGMENTS,
    Points,
    crosses,
    lift,
    outline_segments,
    polyline_segments,
    stroke_segments,
)
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import Cased, add_cased_lines, add_points
from commission.app.base.view import PageView
from commission.app.placement.view import LayoutView
from commission.geometry.arrays import FloatArray
from commission.site.layout_brief import Rectangle, low_high
from commission.site.project import Project

RING_POINTS = 20
RING_MARKS = 1.3
"""Radius of the ring around a new reflector, in sizes of a mark."""
HATCH_MARKS = 8.0
"""Distance between the strokes in an area without reflectors, in sizes of a mark."""


def hatch(area: Rectangle, gap: float) -> FloatArray:
    """Return the (N, 2, 2) slanting strokes that fill a rectangle [m], a gap apart along x."""
    (x_low, y_low), (x_high, y_high) = low_high(area)
    # A stroke is where x - y is constant; both ends are cut off at the rectangle.
    slants = np.arange(x_low - y_high, x_high - y_low, gap)[1:]
    starts = np.maximum(x_low, slants + y_low)
    ends = np.minimum(x_high, slants + y_high)
    return np.stack([np.stack([starts, starts - slants], axis=1), np.stack([ends, ends - slants], axis=1)], axis=1)


class SuggestionLayer(BaseLayer):
    """Suggested reflectors."""

    name = "Suggested layout"
    group = LayerGroup.PLAN
    rank = 130
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes")
    legend = (
        theme.Legend("suggested reflector", theme.SUGGESTED, theme.Mark.DOT),
        theme.Legend("would be taken down", theme.TAKEN_DOWN, theme.Mark.SQUARE),
        theme.Legend("no new reflectors here", theme.KEEP_OUT, theme.Mark.LINE),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._mark = 0.1
        self._shown: LayoutView | None = None
        self._areas: tuple[Rectangle, ...] = ()
        self._suggested = add_points(scene, "/plan/suggested/reflectors", theme.SUGGESTED, 0.1)
        self._rings = self._lines("rings", theme.SUGGESTED, 2.0)
        self._crosses = self._lines("taken_down", theme.TAKEN_DOWN, 2.0)
        self._unmet = self._lines("unmet", theme.OVER_LIMIT, 8.0)
        self._keep_outs = self._lines("keep_out", theme.KEEP_OUT, 1.5)

    def _lines(self, name: str, color: theme.Color, width: float) -> Cased:
        return add_cased_lines(self.scene, f"/plan/suggested/{name}", color, width)

    def show_site(self, project: Project) -> None:
        """Adapt the size of the marks to the site's."""
        self._mark = extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw what has changed."""
        found, state = view.part(LayoutView), view.state
        areas = state.project.layout.candidates.keep_out
        if areas != self._areas:
            self._areas = areas
            self._keep_outs.points = self._outlined(self._areas)
        if found is self._shown:
            return
        self._shown = found
        nothing = np.empty((0, 2))
        suggestion = None if found is None else found.suggestion
        added, removed = (nothing, nothing) if suggestion is None else (suggestion.added, suggestion.removed)
        self._suggested.point_size = 1.2 * self._mark
        self._suggested.points = lift(added, theme.Height.LABEL)
        angles = np.linspace(0.0, 2.0 * np.pi, RING_POINTS, endpoint=False)
        circle = RING_MARKS * self._mark * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._rings.points = outline_segments(added[:, np.newaxis] + circle, theme.Height.LABEL)
        self._crosses.points = stroke_segments(crosses(removed, self._mark), theme.Height.LABEL)
        unmet = () if suggestion is None else suggestion.unmet
        parts = (polyline_segments(stretch.points, theme.Height.REFERENCE) for stretch in unmet)
        self._unmet.points = np.concatenate([NO_SEGMENTS, *parts])

    def _outlined(self, areas: tuple[Rectangle, ...]) -> Points:
        """Outline and hatch of areas."""
        corners = np.array([[(x, y), (u, y), (u, v), (x, v)] for x, y, u, v in areas]).reshape(-1, 4, 2)
        strokes = [hatch(area, HATCH_MARKS * self._mark) for area in areas]
        return np.concatenate(
            [
                outline_segments(corners, theme.Height.EDITING),
                *(stroke_segments(stroke, theme.Height.EDITING) for stroke in strokes),
            ]
        )

    def is_used(self, view: PageView) -> bool:
        """Whether there is a suggestion, or an area without reflectors."""
        return view.part(LayoutView) is not None or bool(view.state.project.layout.candidates.keep_out)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return reflectors, marks and areas."""
        cased = (self._rings, self._crosses, self._unmet, self._keep_outs)
        return self._suggested, *(node for lines in cased for node in lines.nodes)
