"""Places where a reflector could be put up: along walls, racks and pillars. Which are needed is in `placement`."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.occupancy import OccupancyGrid
from commission.site.layout_brief import CandidateOptions, Rectangle, low_high


def wall_candidates(grid: OccupancyGrid, options: CandidateOptions) -> FloatArray:
    """Places on the free side of walls and pillars, a gap and a radius off them.

    Both faces of a thin wall and all faces of a pillar have places of their own: from one the other cannot be seen.

    Parameters
    ----------
    grid : the floor.
    options : spacing, radius, gap, heights and keep-out areas; its clearance is `clear_of`'s business.

    Returns
    -------
    centers : (C, 2) array [m], map frame; of those that face the same way no two are nearer than the spacing, and none
        is farther than it from where one could be.
    """
    # From center to center of cells: half a cell of it belongs to the wall.
    wanted = 0.5 * grid.resolution + options.gap + options.radius
    distance = grid.distance_field()
    cells = np.argwhere((distance >= wanted) & (distance < wanted + grid.resolution))
    if len(cells) == 0:
        return np.empty((0, 2))
    centers = grid.cell_centers(cells)
    allowed = np.isfinite(mounting_heights(centers, options))
    for rectangle in options.keep_out:
        allowed &= ~_inside(centers, rectangle)
    centers, facing = centers[allowed], _facing(distance, cells[allowed])
    return np.concatenate([_thinned(centers[facing == side], options.spacing) for side in range(4)])


def mounting_heights(centers: FloatArray, options: CandidateOptions) -> FloatArray:
    """Height at which the middle of a reflector is put up at each place.

    Parameters
    ----------
    centers : (C, 2) places [m], map frame.
    options : allowed heights, and how far from the scanner's beams the middle may be.

    Returns
    -------
    heights : (C,) the allowed height nearest to the beams [m]; NaN where no reflector of that length is met by them.
    """
    lowest, highest = np.zeros(len(centers)), np.full(len(centers), np.inf)
    for rule in options.allowed_heights:
        here = np.ones(len(centers), dtype=np.bool_) if rule.area is None else _inside(centers, rule.area)
        lowest[here] = np.maximum(lowest[here], rule.lowest)
        highest[here] = np.minimum(highest[here], rule.highest)
    heights = np.clip(options.height, lowest, highest)
    met = (lowest <= highest) & (np.abs(heights - options.height) <= 0.5 * options.length)
    return np.where(met, heights, np.nan)


def clear_of(centers: FloatArray, path: FloatArray, distance: float) -> BoolArray:
    """Whether places are farther than a distance from all points of a path.

    Parameters
    ----------
    centers : (C, 2) places [m], map frame.
    path : (N, 2) points [m], map frame.
    distance : [m]

    Returns
    -------
    clear : (C,) array.
    """
    if len(path) == 0 or len(centers) == 0:
        return np.ones(len(centers), dtype=np.bool_)
    nearest, _ = cKDTree(path).query(centers)
    return np.asarray(nearest > distance, dtype=np.bool_)


def _inside(centers: FloatArray, rectangle: Rectangle) -> BoolArray:
    """Whether places (C, 2) lie in a rectangle, given by any two opposite corners."""
    low, high = low_high(rectangle)
    return np.asarray(((centers >= low) & (centers <= high)).all(axis=1), dtype=np.bool_)


def _facing(distance: FloatArray, cells: IntArray) -> IntArray:
    """Which of four ways leads away from the wall at (C, 2) cells: 0 right, 1 up, 2 left, 3 down on the grid."""
    # Repeated at the edges, so that a grid of one row has slopes too.
    around = np.pad(distance, 1, mode="edge")
    row, column = cells.T + 1
    up = around[row + 1, column] - around[row - 1, column]
    right = around[row, column + 1] - around[row, column - 1]
    return np.round(np.arctan2(up, right) / (0.5 * math.pi)).astype(np.int64) % 4


def _thinned(points: FloatArray, spacing: float) -> FloatArray:
    """Keep points, in their order, that are at least the spacing from all kept before."""
    if len(points) == 0:
        return points
    tree = cKDTree(points)
    free = np.ones(len(points), dtype=np.bool_)
    kept: list[int] = []
    for index in range(len(points)):
        if free[index]:
            kept.append(index)
            free[tree.query_ball_point(points[index], spacing * (1.0 - 1e-9))] = False
    return points[kept]
