"""On the floor: how much better or worse a fix is than with the kept layout, and where its reflectors stood."""

from __future__ import annotations

import numpy as np
from viser import ImageHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, Points, outline_segments, rings, stroke_segments
from commission.app.base.extent import extent_of
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines, add_floor_picture
from commission.app.base.view import PageView
from commission.app.layouts.difference import DifferenceView, picture
from commission.app.layouts.view import LayoutsView
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap

RING_MARKS = 1.0
"""Radius of the ring where a reflector stood, in sizes of a mark."""


class DifferenceLayer(BaseLayer):
    """The difference heatmap."""

    name = "Difference of layouts"
    group = LayerGroup.PLAN
    rank = 25
    reads: tuple[str, ...] = ()

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._image: ImageHandle | None = None
        self._shown: tuple[DifferenceView | None, float] = (None, 0.0)

    def draw(self, view: PageView) -> None:
        """Draw the picture anew where it or its opacity has changed."""
        found, opacity = view.part(LayoutsView), view.state.part(FloorPicture).opacity
        difference = None if found is None else found.difference
        if (difference, opacity) == self._shown:
            return
        self._shown = difference, opacity
        if self._image is not None:
            self._image.remove()
            self._image = None
        if difference is not None:
            visible = self.name not in view.state.hidden
            image = picture(difference.classes, opacity)
            self._image = add_floor_picture(self.scene, "/plan/difference", image, difference.lattice, visible=visible)

    def is_used(self, view: PageView) -> bool:  # noqa: ARG002 - its scale stands in the legend by itself
        """It has no entry among the marks."""
        return False

    def colors_floor(self, view: PageView) -> bool:
        """Whether there is a picture."""
        found = view.part(LayoutsView)
        return found is not None and found.difference is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the picture."""
        return () if self._image is None else (self._image,)


class KeptLayoutLayer(BaseLayer):
    """Reflectors of the kept layout that stand otherwise now."""

    name = "Kept layout"
    group = LayerGroup.PLAN
    rank = 125
    legend = (theme.Legend("reflector of the kept layout", theme.KEPT, theme.Mark.DOT),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._mark = 0.1
        self._shown: tuple[object, ...] = ()
        self._lines = add_cased_lines(scene, "/plan/kept_layout", theme.KEPT, 2.0)

    def show_site(self, project: Project) -> None:
        """Adapt the size of the rings to the site's."""
        self._mark = extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw where one of the two layouts has changed."""
        found = view.part(LayoutsView)
        key = (None, None, self._mark) if found is None else (found.kept.reflectors, found.now, self._mark)
        if len(key) == len(self._shown) and all(one is other for one, other in zip(key, self._shown, strict=True)):
            return
        self._shown = key
        self._lines.points = NO_SEGMENTS if found is None else self._drawn(found.kept.reflectors, found.now)

    def _drawn(self, before: ReflectorMap, now: ReflectorMap) -> Points:
        places, moves = differences(before, now)
        height = theme.Height.LABEL
        return np.concatenate(
            [outline_segments(rings(places, RING_MARKS * self._mark), height), stroke_segments(moves, height)]
        )

    def is_used(self, view: PageView) -> bool:
        """Whether another layout is beside that of now."""
        found = view.part(LayoutsView)
        return found is not None and not found.is_same

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return rings and lines."""
        return self._lines.nodes


def differences(before: ReflectorMap, now: ReflectorMap) -> tuple[FloatArray, FloatArray]:
    """Return the (N, 2) places of reflectors that are there no more [m], and (M, 2, 2) lines to where some went.

    Parameters
    ----------
    before, now : the two layouts; what has the same id is the same reflector.
    """
    standing = {(each.x, each.y) for each in now.reflectors}
    named = {each.id: (each.x, each.y) for each in now.reflectors}
    gone = [each for each in before.reflectors if (each.x, each.y) not in standing]
    moves = [((each.x, each.y), named[each.id]) for each in gone if each.id in named]
    return np.array([(each.x, each.y) for each in gone]).reshape(-1, 2), np.array(moves).reshape(-1, 2, 2)
