"""Exact ray casting on an occupancy grid: each ray stops at the cell that cell-by-cell traversal would stop at.

A ray jumps from free rectangle to free rectangle instead of from cell to cell. Noise, beams and reflectors are not its
business; kernels elsewhere call `ray_kernels.cast_ray` and `is_line_free` with the `tables` of a `RayCaster`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from commission.geometry.arrays import BoolArray, FloatArray, equal_fields
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.ray_kernels import (
    LINE,
    TILE_COLUMNS,
    TILE_ROWS,
    RayTables,
    cast_parallel,
    cast_ray,
    cast_serial,
    free_rectangles,
    is_line_free,
    lines_free,
)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class RayCaster:
    """A grid prepared for rays; everything outside it is free, a start inside a wall has range 0.

    Memory is eight bytes per cell; preparing 8 million cells takes about 0.4 s.
    """

    grid: OccupancyGrid
    """The cells that stop rays."""
    tables: RayTables = field(repr=False, compare=False)
    """For kernels: the first argument of `cast_ray` and `is_line_free`."""

    def __init__(self, grid: OccupancyGrid) -> None:
        x, y, yaw = (float(value) for value in grid.origin)
        rows, columns = grid.occupied.shape
        # Tables in the order of the quadrant's number: x backward adds 1, y backward adds 2.
        quadrants = [
            _tiled(free_rectangles(grid.occupied, down, left)) for down in (False, True) for left in (False, True)
        ]
        rectangles = _aligned(np.concatenate(quadrants))
        rectangles.setflags(write=False)
        tables = RayTables(
            rectangles=rectangles,
            rows=rows,
            columns=columns,
            tile_columns=-(-columns // TILE_COLUMNS),
            quadrant_size=quadrants[0].size,
            resolution=float(grid.resolution),
            origin_x=x,
            origin_y=y,
            origin_cos=math.cos(yaw),
            origin_sin=math.sin(yaw),
        )
        object.__setattr__(self, "grid", grid)
        object.__setattr__(self, "tables", tables)

    def __eq__(self, other: object) -> bool:
        """Equal when the grids are."""
        return equal_fields(self, other)

    def cast(self, rays_map: ArrayLike, max_range: float) -> FloatArray:
        """Distance to the first occupied cell along each ray.

        Parameters
        ----------
        rays_map : (..., 3) array of start and heading [m, m, rad], map frame.
        max_range : [m]

        Returns
        -------
        ranges : (...) array [m]; inf where nothing is hit up to `max_range`.
        """
        rays = _flat(rays_map, 3)
        return cast_serial(self.tables, rays, float(max_range)).reshape(np.shape(rays_map)[:-1])

    def cast_parallel(self, rays_map: ArrayLike, max_range: float) -> FloatArray:
        """Return what `cast` does, to the last bit, using all cores."""
        rays = _flat(rays_map, 3)
        return cast_parallel(self.tables, rays, float(max_range)).reshape(np.shape(rays_map)[:-1])

    def line_of_sight(self, points_a: ArrayLike, points_b: ArrayLike) -> BoolArray:
        """Whether every cell touched on the straight line from a to b, both ends included, is free.

        Parameters
        ----------
        points_a, points_b : (..., 2) arrays [m], map frame, that broadcast against each other.

        Returns
        -------
        free : (...) array.
        """
        a, b = np.broadcast_arrays(np.asarray(points_a, dtype=np.float64), np.asarray(points_b, dtype=np.float64))
        return lines_free(self.tables, _flat(a, 2), _flat(b, 2)).reshape(a.shape[:-1])


def warm_up() -> None:
    """Compile the kernels of this module."""
    caster = RayCaster(OccupancyGrid(np.eye(3, dtype=np.bool_), 1.0))
    caster.cast([[0.5, 1.5, 0.1]], 10.0)
    caster.cast_parallel([[0.5, 1.5, 0.1]], 10.0)
    caster.line_of_sight([[0.5, 1.5]], [[1.5, 2.5]])
    cast_ray(caster.tables, 0.5, 1.5, 1.0, 0.0, 10.0)
    is_line_free(caster.tables, 0.5, 1.5, 1.5, 2.5)


def _tiled(cells: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Reorder an (H, W) table tile by tile, flat; cells added to fill the last tiles are never read."""
    rows, columns = -(-cells.shape[0] // TILE_ROWS), -(-cells.shape[1] // TILE_COLUMNS)
    whole = np.zeros((rows * TILE_ROWS, columns * TILE_COLUMNS), dtype=np.uint16)
    whole[: cells.shape[0], : cells.shape[1]] = cells
    return whole.reshape(rows, TILE_ROWS, columns, TILE_COLUMNS).transpose(0, 2, 1, 3).reshape(-1)


def _aligned(table: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Copy to an address that is a multiple of a cache line, so that each tile is one of them and not two."""
    room = np.empty(table.nbytes + LINE, dtype=np.uint8)
    start = -room.ctypes.data % LINE
    aligned = room[start : start + table.nbytes].view(np.uint16)
    aligned[:] = table
    return aligned


def _flat(values: ArrayLike, width: int) -> FloatArray:
    """Rows of a (..., width) array as a contiguous, writable-typed (N, width) array: one type for the compiler."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != width:
        raise ValueError(f"array has shape {array.shape}; expected (..., {width})")
    return np.array(array.reshape(-1, width), order="C")
