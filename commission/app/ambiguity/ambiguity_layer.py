"""Where a cold start is ambiguous: a map of the floor, and one pair of look-alikes with the poses that confuse them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from viser import ImageHandle, LabelHandle, SceneApi, SceneNodeHandle

from commission.app.ambiguity.cold_start import CLASSES, EVERY, SOME, TOO_FEW, UNIQUE
from commission.app.ambiguity.view import ColdStartView, TwinsView
from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, Points, heading_mark, outline_segments, stroke_segments
from commission.app.base.extent import extent_of
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import Cased, add_cased_lines, add_floor_picture
from commission.app.base.paints import Plan
from commission.app.base.view import PageView
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.site.project import Project

MAP_COLORS: dict[int, theme.Color] = {
    UNIQUE: Plan.UNIQUE.dark,
    TOO_FEW: Plan.TOO_FEW.dark,
    SOME: Plan.SOME.dark,
    EVERY: Plan.EVERY.dark,
}
SHARPNESS = 4
"""Points of the picture for each spot and axis."""
GROUP_COLORS = theme.FIRST_TWIN, theme.SECOND_TWIN
RING_POINTS = 28
RING_MARKS = 2.2
"""Radius of a ring, in sizes of a mark."""
SMALLEST_VEHICLE = 8.0
"""Half the length at which a vehicle's outline is drawn at least, in sizes of a mark."""


def ambiguity_picture(classes: NDArray[np.uint8], opacity: float) -> NDArray[np.uint8]:
    """Return the picture of classes given as (rows, columns): (n rows, n columns, 4) with n = `SHARPNESS`."""
    palette = np.zeros((CLASSES, 4), np.uint8)
    for index, color in MAP_COLORS.items():
        palette[index] = (*color, round(255 * opacity))
    # The browser blends neighboring points into each other, and between two kinds there is nothing.
    return palette[classes].repeat(SHARPNESS, axis=0).repeat(SHARPNESS, axis=1)


class AmbiguityLayer(BaseLayer):
    """Ambiguous places."""

    name = "Ambiguous places"
    group = LayerGroup.PLAN
    rank = 30
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes", "vehicle")
    legend = (
        theme.Legend("a place, and what it sees", theme.FIRST_TWIN, theme.Mark.DOT),
        theme.Legend("its look-alike", theme.SECOND_TWIN, theme.Mark.DOT),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._mark, self._outline = 0.1, np.zeros((4, 2))
        self._image: ImageHandle | None = None
        self._labels: tuple[LabelHandle, ...] = ()
        self._shown: tuple[ColdStartView | None, float] = (None, 0.0)
        self._twins: TwinsView | None = None
        self._groups: tuple[Cased, ...] = tuple(
            add_cased_lines(scene, f"/plan/twins/{index}", color, 2.5) for index, color in enumerate(GROUP_COLORS)
        )

    def show_site(self, project: Project) -> None:
        """Adapt the size of rings and outlines to the site's."""
        self._mark = extent_of(project).mark_size()
        outline = np.array(project.vehicle.outline)
        self._outline = outline * max(1.0, SMALLEST_VEHICLE * self._mark / float(np.abs(outline).max()))

    def draw(self, view: PageView) -> None:
        """Draw what has changed."""
        found, state = view.part(ColdStartView), view.state
        opacity, visible = state.part(FloorPicture).opacity, self.name not in state.hidden
        if (found, opacity) != self._shown:
            self._shown = found, opacity
            self._draw(found, opacity, visible=visible)
        twins = None if found is None else found.twins
        if twins is not self._twins:
            self._twins = twins
            for index, lines in enumerate(self._groups):
                lines.points = NO_SEGMENTS if twins is None else self._group(twins, index)
            for label in self._labels:
                label.remove()
            self._labels = () if twins is None else self._write(twins, visible=visible)

    def _draw(self, found: ColdStartView | None, opacity: float, *, visible: bool) -> None:
        """Draw the map."""
        if self._image is not None:
            self._image.remove()
            self._image = None
        if found is None or not found.is_drawn:
            return
        lattice = found.ambiguity.lattice
        self._image = add_floor_picture(
            self.scene, "/plan/ambiguity", ambiguity_picture(found.ambiguity.classes, opacity), lattice, visible=visible
        )

    def _group(self, twins: TwinsView, index: int) -> Points:
        """Rings around one group, the vehicle where it sees them, and its rays to them."""
        places, pose = twins.groups[index], np.array(twins.poses[index])
        angles = np.linspace(0.0, 2.0 * np.pi, RING_POINTS, endpoint=False)
        # Where both groups share a reflector, both rings are seen.
        radius = (1.0 + 0.35 * index) * RING_MARKS * self._mark
        circle = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        height = theme.Height.LABEL
        outline = se2.transform_points(pose, self._outline)
        arrow = se2.transform_points(pose, heading_mark(self._outline).reshape(-1, 2)).reshape(-1, 2, 2)
        return np.concatenate(
            [
                outline_segments(places[:, np.newaxis] + circle, height),
                outline_segments(outline[np.newaxis], height),
                stroke_segments(arrow, height),
                stroke_segments(_rays(pose, places), height),
            ]
        )

    def _write(self, twins: TwinsView, *, visible: bool) -> tuple[LabelHandle, ...]:
        """Write which vehicle is which."""
        return tuple(
            self.scene.add_label(
                f"/plan/twins/label/{index}",
                text,
                position=(pose[0], pose[1], theme.Height.LABEL),
                anchor="bottom-center",
                font_screen_scale=0.8,
                visible=visible,
            )
            for index, (text, pose) in enumerate(zip(("here", "or here?"), twins.poses, strict=True))
        )

    def is_used(self, view: PageView) -> bool:
        """Whether a pair is shown."""
        found = view.part(ColdStartView)
        return found is not None and found.twins is not None

    def colors_floor(self, view: PageView) -> bool:
        """Whether there is a map."""
        found = view.part(ColdStartView)
        return found is not None and found.is_drawn

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return map, rings and labels."""
        rings = (node for group in self._groups for node in group.nodes)
        return *(() if self._image is None else (self._image,)), *rings, *self._labels


def _rays(pose: FloatArray, places: FloatArray) -> FloatArray:
    """(N, 2, 2) lines from a vehicle to what it sees [m]."""
    return np.stack([np.broadcast_to(pose[:2], places.shape), places], axis=1)
