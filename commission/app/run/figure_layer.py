"""Reflectors in the colors of how well they do, where one of their figures is chosen in the table."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_marks
from commission.app.base.view import PageView
from commission.app.run.found_table import BY_KEY, Found, classes_of, palette
from commission.app.run.state import RunState

PIXELS = 17
"""Diameter of a mark on the screen."""


class FigureLayer(BaseLayer):
    """A disc below each reflector."""

    name = "Reflectors by figure"
    group = LayerGroup.RUN
    rank = 115

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._marks = tuple(
            add_cased_marks(scene, f"/run/figures/{index}", color, PIXELS) for index, color in enumerate(palette())
        )
        self._shown: tuple[object, ...] = (None, "")

    def draw_slowly(self, view: PageView) -> None:
        """Color the reflectors of the newest figures."""
        found, key = view.part(Found), view.state.part(RunState).figure
        column = BY_KEY.get(key)
        shown = (found, key)
        if shown == self._shown:
            return
        self._shown = shown
        points, classes = np.empty((0, 2)), np.empty(0, np.int64)
        if found is not None and column is not None:
            points, classes = found.figures.places, classes_of(column.values(found.figures))
        for index, node in enumerate(self._marks):
            node.points = lift(points[classes == index], theme.Height.ACCUMULATED)

    def is_used(self, view: PageView) -> bool:
        """Whether a figure is chosen."""
        return bool(view.state.part(RunState).figure)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the discs, one node for each color."""
        return tuple(node for marks in self._marks for node in marks.nodes)
