"""A grid of free and occupied cells, placed anywhere in the map: cells from points and back, distance to obstacles.

Row 0 lies at the lowest y of the grid's own frame; everything outside the grid is free. Rays are in `raycast`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, equal_fields, frozen
from commission.geometry.se2 import inverse, transform_points


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """Which square cells of a rectangle stop a ray."""

    occupied: BoolArray
    """(H, W) True where a cell stops a ray; row 0 is the lowest y of the grid's own frame."""
    resolution: float
    """Edge of a cell [m]."""
    origin: FloatArray = field(default_factory=lambda: frozen([0.0, 0.0, 0.0], (3,), "origin"))
    """(3,) pose of the outer corner of cell (0, 0) in the map frame [m, m, rad]."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"resolution is {self.resolution:g}; expected meters per cell > 0")
        # A copy: a read-only view would still change with the array it was made from.
        occupied = np.array(self.occupied, dtype=np.bool_, order="C")
        if occupied.ndim != 2 or 0 in occupied.shape:
            raise ValueError(f"occupied has shape {occupied.shape}; expected rows x columns, each 1 or more")
        occupied.setflags(write=False)
        object.__setattr__(self, "occupied", occupied)
        object.__setattr__(self, "origin", frozen(self.origin, (3,), "origin"))

    def __eq__(self, other: object) -> bool:
        """Equal when every field is, arrays element by element."""
        return equal_fields(self, other)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m], along the grid's own axes."""
        rows, columns = self.occupied.shape
        return columns * self.resolution, rows * self.resolution

    def corners(self) -> FloatArray:
        """Corners of the rectangle, counterclockwise from the origin: (4, 2) array [m], map frame."""
        width, height = self.size
        return transform_points(self.origin, [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])

    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest upright rectangle around the grid: x_min, y_min, x_max, y_max [m], map frame."""
        corners = self.corners()
        low, high = corners.min(axis=0), corners.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def cells_at(self, points_map: ArrayLike) -> IntArray:
        """Cells that contain points; a point on an edge belongs to the cell of higher index.

        Parameters
        ----------
        points_map : (..., 2) array [m], map frame.

        Returns
        -------
        cells : (..., 2) array of [row, column], outside the grid too.
        """
        points_grid = transform_points(inverse(self.origin), points_map)
        return np.floor(points_grid / self.resolution).astype(np.int64)[..., ::-1]

    def cell_centers(self, cells: ArrayLike) -> FloatArray:
        """Centers of cells.

        Parameters
        ----------
        cells : (..., 2) array of [row, column], outside the grid too.

        Returns
        -------
        points_map : (..., 2) array [m], map frame.
        """
        points_grid = (np.asarray(cells, dtype=np.float64)[..., ::-1] + 0.5) * self.resolution
        return transform_points(self.origin, points_grid)

    def contains(self, points_map: ArrayLike) -> BoolArray:
        """Whether points (..., 2) [m, map frame] lie inside the grid's rectangle: (...) array."""
        return self._inside(self.cells_at(points_map))

    def is_occupied(self, points_map: ArrayLike) -> BoolArray:
        """Whether points (..., 2) [m, map frame] lie in an occupied cell: (...) array; False outside the grid."""
        cells = self.cells_at(points_map)
        inside = self._inside(cells)
        row, column = np.moveaxis(np.where(inside[..., np.newaxis], cells, 0), -1, 0)
        return inside & self.occupied[row, column]

    def distance_field(self) -> FloatArray:
        """Distance from the center of each cell to the center of the nearest occupied one.

        Returns
        -------
        distance : (H, W) array [m]; 0 in occupied cells, inf everywhere when none is occupied.
        """
        from scipy.ndimage import distance_transform_edt

        if not self.occupied.any():
            return np.full(self.occupied.shape, np.inf)
        free = np.logical_not(self.occupied)
        return np.asarray(distance_transform_edt(free, sampling=self.resolution), dtype=np.float64)

    def _inside(self, cells: IntArray) -> BoolArray:
        """Whether cells (..., 2) exist in the grid: (...) array."""
        return np.all((cells >= 0) & (cells < self.occupied.shape), axis=-1)
