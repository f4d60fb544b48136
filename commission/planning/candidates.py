"""Places where a reflector could be put up: along walls, racks and pillars. Which are needed is in `placement`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.occupancy import OccupancyGrid
from commission.site.checks import above, at_least

Rectangle = tuple[float, float, float, float]
"""x and y of the lower-left corner, x and y of the upper-right one [m], map frame."""


@dataclass(frozen=True, slots=True)
class CandidateOptions:
    """Where reflectors may be put up, and which kind."""

    spacing: float = 1.0
    """Distance between neighboring candidates [m]."""
    radius: float = 0.04
    """Radius of the reflectors to be put up [m]."""
    height: float = 0.2
    """Height of their middle above the floor [m]; the scanner's."""
    gap: float = 0.02
    """Distance left between a reflector's surface and the wall [m]."""
    clearance: float = 0.3
    """Distance left between a reflector and the vehicle on its routes [m]."""
    keep_out: tuple[Rectangle, ...] = ()
    """Areas without reflectors: x and y of two opposite corners each [m]."""

    def __post_init__(self) -> None:
        above(self.spacing, 0.0, "candidates.spacing", "m")
        above(self.radius, 0.0, "candidates.radius", "m")
        at_least(self.height, 0.0, "candidates.height", "m")
        at_least(self.gap, 0.0, "candidates.gap", "m")
        at_least(self.clearance, 0.0, "candidates.clearance", "m")
        if not all(math.isfinite(value) for rectangle in self.keep_out for value in rectangle):
            raise ValueError(f"candidates.keep_out is {self.keep_out}; expected finite metres")


def wall_candidates(grid: OccupancyGrid, options: CandidateOptions) -> FloatArray:
    """Places on the free side of walls, a gap and a radius off them.

    Parameters
    ----------
    grid : the floor.
    options : spacing, radius, gap and keep-out areas; its clearance is `clear_of`'s business.

    Returns
    -------
    centers : (C, 2) array [m], map frame; no two nearer than the spacing, none farther than it from where it could be.
    """
    # From center to center of cells: half a cell of it belongs to the wall.
    wanted = 0.5 * grid.resolution + options.gap + options.radius
    distance = grid.distance_field()
    cells = np.argwhere((distance >= wanted) & (distance < wanted + grid.resolution))
    if len(cells) == 0:
        return np.empty((0, 2))
    centers = grid.cell_centers(cells)
    allowed = np.ones(len(centers), dtype=np.bool_)
    for x_a, y_a, x_b, y_b in options.keep_out:
        low, high = (min(x_a, x_b), min(y_a, y_b)), (max(x_a, x_b), max(y_a, y_b))
        allowed &= ~((centers >= low) & (centers <= high)).all(axis=1)
    return _thinned(centers[allowed], options.spacing)


def clear_of(centers: FloatArray, path: FloatArray, distance: float) -> BoolArray:
    """Whether places (C, 2) are farther than a distance [m] from all points (N, 2) of a path."""
    if len(path) == 0 or len(centers) == 0:
        return np.ones(len(centers), dtype=np.bool_)
    nearest, _ = cKDTree(path).query(centers)
    return np.asarray(nearest > distance, dtype=np.bool_)


def _thinned(points: FloatArray, spacing: float) -> FloatArray:
    """Keep points, in their order, that are at least the spacing from all kept before."""
    tree = cKDTree(points)
    free = np.ones(len(points), dtype=np.bool_)
    kept: list[int] = []
    for index in range(len(points)):
        if free[index]:
            kept.append(index)
            free[tree.query_ball_point(points[index], spacing * (1.0 - 1e-9))] = False
    return points[kept]
