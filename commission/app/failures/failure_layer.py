"""What fails with one reflector: a ring around it, the metres that depend on it, crosses on what failed before."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, crosses, outline_segments, polyline_segments, stroke_segments
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.failures.view import FailureView
from commission.site.project import Project

RING_POINTS = 32
RING_MARKS = 2.2
"""Radius of the ring, in sizes of a mark."""


class FailingLayer(BaseLayer):
    """The chosen reflector and its dependents."""

    name = "What if one fails"
    group = LayerGroup.PLAN
    rank = 110
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes")
    legend = (theme.Legend("fails without the chosen reflector", theme.DEPENDENT, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._mark = 0.1
        self._shown: FailureView | None = None
        self._metres, self._ring, self._fallen = (
            add_cased_lines(scene, f"/plan/failing/{name}", theme.DEPENDENT, width)
            for name, width in (("metres", 8.0), ("ring", 3.0), ("fallen", 2.5))
        )

    def show_site(self, project: Project) -> None:
        """Adapt the size of the ring to the site's."""
        self._mark = extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw what depends on the chosen reflector."""
        found = view.part(FailureView)
        if found is self._shown:
            return
        self._shown = found
        lines = () if found is None else found.failing
        height = theme.Height.REFERENCE
        self._metres.points = np.concatenate([NO_SEGMENTS, *(polyline_segments(line, height) for line in lines)])
        fallen = np.empty((0, 2)) if found is None else found.fallen_places
        self._fallen.points = stroke_segments(crosses(fallen, 1.5 * self._mark), theme.Height.LABEL)
        place = None if found is None else found.place
        if place is None:
            self._ring.points = NO_SEGMENTS
            return
        angles = np.linspace(0.0, 2.0 * np.pi, RING_POINTS, endpoint=False)
        circle = np.array(place) + RING_MARKS * self._mark * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._ring.points = outline_segments(circle[np.newaxis], theme.Height.LABEL)

    def is_used(self, view: PageView) -> bool:
        """Whether a reflector's failure is shown, or one that came before."""
        found = view.part(FailureView)
        return found is not None and (found.place is not None or bool(found.fallen))

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return ring, metres and crosses."""
        return tuple(node for line in (self._metres, self._ring, self._fallen) for node in line.nodes)
