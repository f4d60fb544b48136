"""Marks in the scene that all layers draw alike: lines of constant width, flat points, pictures on the floor."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from viser import ImageHandle, LineSegmentsHandle, PointCloudHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_POINTS, NO_SEGMENTS, Points
from commission.app.base.map_scene import set_points
from commission.planning.coverage import Lattice

CASED_PX = 2.5
"""So much wider is what is around a line, in all."""
CASED_MARK_PX = 3
"""The same of a mark."""


class Cased:
    """Lines or marks with a casing: the same places once more, wider, in the color of what is around the floor.

    All casings lie in one plane below all marks, so none hides a mark of another layer. On plain floor a casing is
    hardly seen; on the bright end of a heatmap no thin mark is seen without it.

    Parameters
    ----------
    marks : what is looked at.
    casing : what is around it.
    """

    def __init__(
        self, marks: LineSegmentsHandle | PointCloudHandle, casing: LineSegmentsHandle | PointCloudHandle
    ) -> None:
        self._marks, self._casing = marks, casing
        self._is_cased = True

    @property
    def points(self) -> Points:
        """(N, 2, 3) segments or (N, 3) places [m], frame of the parent node."""
        return self._marks.points

    @points.setter
    def points(self, points: Points) -> None:
        """Draw these, and the casing below them."""
        self.draw(points, cased=True)

    def draw(self, points: Points, *, cased: bool) -> None:
        """Draw these, and the casing below them only where it is needed: what moves is sent with every picture.

        Parameters
        ----------
        points : (N, 2, 3) segments or (N, 3) places [m], frame of the parent node.
        cased : whether the floor has colors of a study, on which marks are not seen without a casing.
        """
        set_points(self._marks, points)
        if cased:
            below = np.array(points)
            # What is hidden far below stays there.
            below[..., 2] = np.minimum(below[..., 2], theme.Height.CASING)
            set_points(self._casing, below)
        elif self._is_cased:
            set_points(self._casing, NO_POINTS if points.ndim == 2 else NO_SEGMENTS)
        self._is_cased = cased

    @property
    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Both, to show or hide."""
        return self._casing, self._marks


def add_cased_lines(scene: SceneApi, name: str, color: theme.Color, thickness: float) -> Cased:
    """Add lines that are seen on any color of the floor, as thick on the screen from near and far.

    Parameters
    ----------
    scene : where.
    name : of the node.
    color : of all lines.
    thickness : on the screen, without the casing [pixels].
    """
    casing = add_lines(scene, f"{name}_casing", theme.CASING, thickness + CASED_PX)
    return Cased(add_lines(scene, name, color, thickness), casing)


def add_cased_marks(scene: SceneApi, name: str, color: theme.Color, pixels: int) -> Cased:
    """Add points that are seen on any color of the floor, as large on the screen from near and far.

    Parameters
    ----------
    scene : where.
    name : of the node, as of `add_marks`.
    color : of all marks.
    pixels : diameter of each on the screen, without the casing.
    """
    casing = add_marks(scene, f"{name}_casing", theme.CASING, pixels + CASED_MARK_PX)
    return Cased(add_marks(scene, name, color, pixels), casing)


def add_lines(
    scene: SceneApi, name: str, color: theme.Color, thickness: float, *, lines: Points = NO_SEGMENTS
) -> LineSegmentsHandle:
    """Add lines that are as thick on the screen from near and far.

    Parameters
    ----------
    scene : where.
    name : of the node.
    color : of all lines: with one color their number may change.
    thickness : on the screen [pixels].
    lines : (N, 2, 3) segments [m], frame of the parent node.
    """
    return scene.add_line_segments(name, points=lines, colors=color, thickness=thickness, thickness_units="screen")


def add_points(
    scene: SceneApi,
    name: str,
    color: theme.Color,
    size: float,
    *,
    points: Points = NO_POINTS,
    shape: Literal["circle", "square", "diamond", "rounded", "sparkle"] = "circle",
) -> PointCloudHandle:
    """Add flat points.

    Parameters
    ----------
    scene : where.
    name : of the node.
    color : of all points.
    size : diameter of each [m].
    points : (N, 3) places [m], frame of the parent node.
    shape : of each point.
    """
    # viser's default, float16, has steps of 16 mm in 16 m.
    return scene.add_point_cloud(
        name, points=points, colors=color, point_size=size, point_shape=shape, point_shading="flat", precision="float32"
    )


def add_marks(
    scene: SceneApi,
    name: str,
    color: theme.Color,
    pixels: int,
    *,
    points: Points = NO_POINTS,
    shape: Literal["circle", "square", "diamond", "sparkle"] = "circle",
) -> PointCloudHandle:
    """Add points that are as large on the screen from near and far.

    Parameters
    ----------
    scene : where.
    name : of the node; its size is added, for the page's script `marks.js`, which holds it.
    color : of all marks.
    pixels : diameter of each on the screen.
    points : (N, 3) places [m], frame of the parent node.
    shape : of each mark; "sparkle" is a cross.
    """
    return add_points(scene, f"{name}/{pixels}px", color, 0.05, points=points, shape=shape)


def add_floor_picture(
    scene: SceneApi, name: str, picture: NDArray[np.uint8], lattice: Lattice, *, visible: bool
) -> ImageHandle:
    """Add a picture of a lattice, lying on the floor below all marks.

    Parameters
    ----------
    scene : where.
    name : of the node.
    picture : (H, W, 4) image; its height and width are multiples of the lattice's rows and columns.
    lattice : the spots that it shows.
    visible : whether it is shown at first.
    """
    return scene.add_image(
        name,
        picture,
        render_width=lattice.columns * lattice.spacing,
        render_height=lattice.rows * lattice.spacing,
        format="png",
        position=(*lattice.middle, theme.Height.HEAT),
        cast_shadow=False,
        receive_shadow=False,
        visible=visible,
    )
