"""Exact ray casting on an occupancy grid: each ray stops at the cell that cell-by-cell traversal would stop at.

A ray jumps from free square to free square instead of from cell to cell. Noise, beams and reflectors are not its
business; kernels elsewhere call `cast_ray` and `is_line_free` with the `tables` of a `RayCaster`.

Two rules make the answer unique. A ray enters a cell at t = (border - start) / direction, computed from the start and
never accumulated. Where it would cross two borders at once, it crosses the horizontal one first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from commission.compiled import compiled, compiled_parallel, parallel_range
from commission.geometry.arrays import BoolArray, FloatArray, equal_fields
from commission.geometry.occupancy import OccupancyGrid

# A square of more cells than a byte can count is stored as one of this size.
LARGEST_SQUARE = 255
# A tile of 8 x 8 bytes is one cache line, so neighbors in both directions are usually loaded together.
TILE = 8
# A direction component of zero becomes this: its borders then lie beyond any range, without dividing by zero.
TINY = 1e-300
# Coordinates [cells] beyond this are not rays but mistakes (NaN and infinity included), and hit nothing.
FARTHEST = 1e12


class RayTables(NamedTuple):
    """What the kernels need to know of a grid, as plain arrays and numbers."""

    squares: NDArray[np.uint8]
    """Flat: per quadrant (x backward + 2 * y backward), tile by tile, the largest free square from a cell onward."""
    rows: int
    columns: int
    tile_columns: int
    quadrant_size: int
    """Bytes of one quadrant's table."""
    resolution: float
    """Edge of a cell [m]."""
    origin_x: float
    origin_y: float
    origin_cos: float
    origin_sin: float


@dataclass(frozen=True, slots=True, eq=False, init=False)
class RayCaster:
    """A grid prepared for rays; everything outside it is free, a start inside a wall has range 0.

    Memory is four bytes per cell; preparing 8 million cells takes about 0.2 s.
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
            _tiled(free_squares(grid.occupied, down, left)) for down in (False, True) for left in (False, True)
        ]
        squares = np.concatenate(quadrants)
        squares.setflags(write=False)
        tables = RayTables(
            squares=squares,
            rows=rows,
            columns=columns,
            tile_columns=-(-columns // TILE),
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
        return _cast_serial(self.tables, rays, float(max_range)).reshape(np.shape(rays_map)[:-1])

    def cast_parallel(self, rays_map: ArrayLike, max_range: float) -> FloatArray:
        """Return what `cast` does, to the last bit, using all cores."""
        rays = _flat(rays_map, 3)
        return _cast_parallel(self.tables, rays, float(max_range)).reshape(np.shape(rays_map)[:-1])

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
        return _lines_free(self.tables, _flat(a, 2), _flat(b, 2)).reshape(a.shape[:-1])


@compiled
def cast_ray(  # noqa: PLR0917 - one ray, number by number
    tables: RayTables, x: float, y: float, dir_x: float, dir_y: float, max_range: float
) -> tuple[float, int, int]:
    """Distance along one ray, and the cell that stops it.

    Parameters
    ----------
    tables : of a `RayCaster`.
    x, y : start [m], map frame.
    dir_x, dir_y : direction of length 1, map frame.
    max_range : [m]

    Returns
    -------
    range : [m]; inf where nothing is hit up to `max_range`.
    row, column : the occupied cell; -1, -1 where nothing is hit.
    """
    c, s, scale = tables.origin_cos, tables.origin_sin, 1.0 / tables.resolution
    from_origin_x, from_origin_y = x - tables.origin_x, y - tables.origin_y
    distance, row, column = _cast_in_cells(
        tables,
        (c * from_origin_x + s * from_origin_y) * scale,
        (c * from_origin_y - s * from_origin_x) * scale,
        c * dir_x + s * dir_y,
        c * dir_y - s * dir_x,
        max_range * scale,
    )
    return distance * tables.resolution, row, column


@compiled
def is_line_free(tables: RayTables, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether no occupied cell is touched on the straight line from a to b [m, map frame], both ends included."""
    length = math.hypot(bx - ax, by - ay)
    scale = 1.0 / length if length > 0.0 else 0.0
    return cast_ray(tables, ax, ay, (bx - ax) * scale, (by - ay) * scale, length)[1] < 0


@compiled
def _last_crossed(start: float, inverse: float, t: float, inclusive: bool, first: int, last: int, guess: float) -> int:  # noqa: PLR0917
    """Farthest index from `first` to `last` that a ray has entered at t, exactly by the rule of entry times."""
    step = 1 if inverse > 0.0 else -1
    offset = 0 if inverse > 0.0 else 1
    low, high = min(first, last), max(first, last)
    # The guess is off by rounding only; clamped before it becomes an integer, which it might not fit.
    index = math.floor(min(max(guess, float(low)), float(high)))
    while index != last:
        entry = (index + step + offset - start) * inverse
        if entry < t or (inclusive and entry == t):
            index += step
        else:
            break
    while index != first:
        entry = (index + offset - start) * inverse
        if entry > t or (not inclusive and entry == t):
            index -= step
        else:
            break
    return index


@compiled
def _entry(  # noqa: PLR0917
    tables: RayTables, x: float, y: float, dx: float, dy: float, inverse_x: float, inverse_y: float
) -> tuple[float, int, int]:
    """First cell of the grid that a ray from outside enters, and when; row -1 where it never does. Units: cells."""
    row, column = math.floor(y), math.floor(x)
    target_column = 0 if dx > 0.0 else tables.columns - 1
    target_row = 0 if dy > 0.0 else tables.rows - 1
    # An axis along which the start is beside the grid already needs no entry: its time is before any other.
    behind_x = column < 0 if dx > 0.0 else column >= tables.columns
    behind_y = row < 0 if dy > 0.0 else row >= tables.rows
    time_x = ((0.0 if dx > 0.0 else float(tables.columns)) - x) * inverse_x if behind_x else -1.0
    time_y = ((0.0 if dy > 0.0 else float(tables.rows)) - y) * inverse_y if behind_y else -1.0
    if time_x < 0.0 and time_y < 0.0:
        return 0.0, -1, -1
    if time_x >= time_y:
        # Crossing both at once means crossing the horizontal border first, so it counts as crossed.
        beyond = max(row, tables.rows) if dy > 0.0 else min(row, -1)
        row = _last_crossed(y, inverse_y, time_x, True, row, beyond, y + time_x * dy)
        t, column = time_x, target_column
    else:
        beyond = max(column, tables.columns) if dx > 0.0 else min(column, -1)
        column = _last_crossed(x, inverse_x, time_y, False, column, beyond, x + time_y * dx)
        t, row = time_y, target_row
    if row < 0 or row >= tables.rows or column < 0 or column >= tables.columns:
        return 0.0, -1, -1
    return t, row, column


@compiled
def _cast_in_cells(  # noqa: PLR0917
    tables: RayTables, x: float, y: float, dx: float, dy: float, limit: float
) -> tuple[float, int, int]:
    """`cast_ray` in the grid's own frame, with the cell's edge as the unit."""
    if not (abs(x) < FARTHEST and abs(y) < FARTHEST and abs(dx) < FARTHEST and abs(dy) < FARTHEST):
        return math.inf, -1, -1
    dx = TINY if abs(dx) < TINY else dx
    dy = TINY if abs(dy) < TINY else dy
    inverse_x, inverse_y = 1.0 / dx, 1.0 / dy
    step_x, offset_x = (1, 0) if dx > 0.0 else (-1, 1)
    step_y, offset_y = (1, 0) if dy > 0.0 else (-1, 1)
    table = ((0 if dx > 0.0 else 1) + (0 if dy > 0.0 else 2)) * tables.quadrant_size
    t, row, column = 0.0, math.floor(y), math.floor(x)
    if row < 0 or row >= tables.rows or column < 0 or column >= tables.columns:
        t, row, column = _entry(tables, x, y, dx, dy, inverse_x, inverse_y)
        if row < 0:
            return math.inf, -1, -1
    while t <= limit:
        tile = (row >> 3) * tables.tile_columns + (column >> 3)
        size = int(tables.squares[table + (tile << 6) + ((row & 7) << 3) + (column & 7)])
        if size == 0:
            return t, row, column
        next_column, next_row = column + size * step_x, row + size * step_y
        time_x = (next_column + offset_x - x) * inverse_x
        time_y = (next_row + offset_y - y) * inverse_y
        if time_x < time_y:
            t, column = time_x, next_column
            row = _last_crossed(y, inverse_y, t, True, row, next_row - step_y, y + t * dy)
            if column < 0 or column >= tables.columns or row < 0 or row >= tables.rows:
                break
        else:
            t, row = time_y, next_row
            column = _last_crossed(x, inverse_x, t, False, column, next_column - step_x, x + t * dx)
            if column < 0 or column >= tables.columns or row < 0 or row >= tables.rows:
                break
    return math.inf, -1, -1


@compiled
def _cast_serial(tables: RayTables, rays: FloatArray, max_range: float) -> FloatArray:
    """Ranges (N,) of rays (N, 3), one after the other."""
    ranges = np.empty(len(rays))
    for i in range(len(rays)):
        x, y, heading = rays[i, 0], rays[i, 1], rays[i, 2]
        ranges[i] = cast_ray(tables, x, y, math.cos(heading), math.sin(heading), max_range)[0]
    return ranges


@compiled_parallel
def _cast_parallel(tables: RayTables, rays: FloatArray, max_range: float) -> FloatArray:
    """Ranges (N,) of rays (N, 3), on all cores."""
    ranges = np.empty(len(rays))
    for i in parallel_range(len(rays)):
        x, y, heading = rays[i, 0], rays[i, 1], rays[i, 2]
        ranges[i] = cast_ray(tables, x, y, math.cos(heading), math.sin(heading), max_range)[0]
    return ranges


@compiled
def _lines_free(tables: RayTables, points_a: FloatArray, points_b: FloatArray) -> BoolArray:
    """Line of sight (N,) between the rows of two (N, 2) arrays."""
    free = np.empty(len(points_a), dtype=np.bool_)
    for i in range(len(points_a)):
        free[i] = is_line_free(tables, points_a[i, 0], points_a[i, 1], points_b[i, 0], points_b[i, 1])
    return free


@compiled
def free_squares(occupied: BoolArray, down: bool, left: bool) -> NDArray[np.uint8]:
    """Edge of the largest free square that has its corner in each cell and extends into one quadrant.

    Parameters
    ----------
    occupied : (H, W) array.
    down, left : whether the square extends towards lower rows, towards lower columns.

    Returns
    -------
    sizes : (H, W) uint8 array [cells]: 0 in occupied cells; outside the grid counts as free; at most 255.
    """
    height, width = occupied.shape
    padded = np.full((height + 2, width + 2), LARGEST_SQUARE, dtype=np.uint8)
    step_row, step_column = -1 if down else 1, -1 if left else 1
    for i in range(height):
        row = i + 1 if down else height - i
        for j in range(width):
            column = j + 1 if left else width - j
            if occupied[row - 1, column - 1]:
                padded[row, column] = 0
            else:
                side = min(padded[row + step_row, column], padded[row, column + step_column])
                smallest = min(side, padded[row + step_row, column + step_column])
                padded[row, column] = min(int(smallest) + 1, LARGEST_SQUARE)
    return padded[1:-1, 1:-1].copy()


def warm_up() -> None:
    """Compile the kernels of this module."""
    caster = RayCaster(OccupancyGrid(np.eye(3, dtype=np.bool_), 1.0))
    caster.cast([[0.5, 1.5, 0.1]], 10.0)
    caster.cast_parallel([[0.5, 1.5, 0.1]], 10.0)
    caster.line_of_sight([[0.5, 1.5]], [[1.5, 2.5]])
    cast_ray(caster.tables, 0.5, 1.5, 1.0, 0.0, 10.0)
    is_line_free(caster.tables, 0.5, 1.5, 1.5, 2.5)


def _tiled(sizes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Reorder an (H, W) table tile by tile, flat; cells added to fill the last tiles are never read."""
    rows, columns = -(-sizes.shape[0] // TILE), -(-sizes.shape[1] // TILE)
    whole = np.zeros((rows * TILE, columns * TILE), dtype=np.uint8)
    whole[: sizes.shape[0], : sizes.shape[1]] = sizes
    return whole.reshape(rows, TILE, columns, TILE).transpose(0, 2, 1, 3).reshape(-1)


def _flat(values: ArrayLike, width: int) -> FloatArray:
    """Rows of a (..., width) array as a contiguous, writable-typed (N, width) array: one type for the compiler."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != width:
        raise ValueError(f"array has shape {array.shape}; expected (..., {width})")
    return np.array(array.reshape(-1, width), order="C")
