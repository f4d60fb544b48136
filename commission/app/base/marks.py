"""Marks in the scene that all layers draw alike: lines of constant width, flat points, pictures on the floor."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from viser import ImageHandle, LineSegmentsHandle, PointCloudHandle, SceneApi

from commission.app.base import theme
from commission.app.base.drawing import NO_POINTS, NO_SEGMENTS, Points
from commission.planning.coverage import Lattice


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
