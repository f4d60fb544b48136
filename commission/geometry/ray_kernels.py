"""Compiled ray casting by jumps over free rectangles, for `raycast` and for kernels that cast rays of their own.

Two rules make the answer unique, and equal to that of cell-by-cell traversal. A ray enters a cell at
t = (border - start) / direction, computed from the start and never accumulated. Where it would cross two borders at
once, it crosses the horizontal one first.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline, compiled_parallel, parallel_range
from commission.geometry.arrays import BoolArray, FloatArray

# Edges of more cells than a byte can count are stored as this.
LONGEST_EDGE = 255
# Rays of a batch that take turns, so that while one waits for memory the others go on (twice as fast where the rays
# have nothing in common, since each of their jumps misses the caches).
LANES = 16
# Stands in the place of a free rectangle for a ray that has left the grid or its range.
MISSED = -1
# Rays that one core takes at a time.
CHUNK = 1024
# A tile of 4 x 8 cells of two bytes is one cache line, so neighbors in both directions are usually loaded together.
TILE_ROWS, TILE_COLUMNS = 4, 8
LINE = 64
# Smallest size of a direction component; zero becomes this, smaller ones grow to it and keep their sign, which decides
# on which side of its border a start lies. The next border is then beyond any range, without dividing by zero.
TINY = 1e-300
# Coordinates [cells] beyond this are not rays but mistakes (NaN and infinity included), and hit nothing.
FARTHEST = 1e8
# Up to there a point on a ray is rounded by less than 1e-7 cells: at this distance from a border its cell is certain.
CERTAIN = 1e-6


class RayTables(NamedTuple):
    """What the kernels need to know of a grid, as plain arrays and numbers."""

    rectangles: NDArray[np.uint16]
    """Flat: per quadrant (x backward + 2 * y backward), tile by tile, a large free rectangle from a cell onward: its
    columns, and 256 times its rows."""
    rows: int
    columns: int
    tile_columns: int
    quadrant_size: int
    """Cells of one quadrant's table."""
    resolution: float
    """Edge of a cell [m]."""
    origin_x: float
    origin_y: float
    origin_cos: float
    origin_sin: float


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

    Notes
    -----
    t = (border - start) / direction at each border of a free rectangle: Amanatides, Woo 1987, by rectangles instead of
    cells.
    """
    limit = max_range * (1.0 / tables.resolution)
    x, y, dx, dy, inverse_x, inverse_y, t, row, column = _begin(tables, x, y, dir_x, dir_y)
    while row >= 0 and t <= limit:
        size = _free_rectangle(tables, dx, dy, row, column)
        if size == 0:
            return t * tables.resolution, row, column
        t, row, column = _jump(tables.rows, tables.columns, size, x, y, dx, dy, inverse_x, inverse_y, row, column)
    return math.inf, -1, -1


@compiled
def is_line_free(tables: RayTables, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether no occupied cell is touched on the straight line from a to b, both ends included: by `cast_ray`.

    Parameters
    ----------
    tables : of a `RayCaster`.
    ax, ay, bx, by : the two ends [m], map frame.
    """
    length = math.hypot(bx - ax, by - ay)
    scale = 1.0 / length if length > 0.0 else 0.0
    return cast_ray(tables, ax, ay, (bx - ax) * scale, (by - ay) * scale, length)[1] < 0


@compiled
def _free_rectangle(tables: RayTables, dx: float, dy: float, row: int, column: int) -> int:
    """Free rectangle that a ray in this cell may cross at once, columns + 256 rows [cells]; 0 in a wall."""
    table = ((0 if dx > 0.0 else 1) + (0 if dy > 0.0 else 2)) * tables.quadrant_size
    return int(tables.rectangles[table + _place_in_table(tables, row, column)])


@compiled
def _place_in_table(tables: RayTables, row: int, column: int) -> int:
    """Index of a cell in a table that is kept tile by tile: tiles of `TILE_ROWS` x `TILE_COLUMNS` cells."""
    return ((((row >> 2) * tables.tile_columns + (column >> 3)) << 5) | ((row & 3) << 3)) | (column & 7)


@compiled
def is_occupied(tables: RayTables, row: int, column: int) -> bool:
    """Whether a cell stops rays; cells outside the grid do not.

    Parameters
    ----------
    tables : of a `RayCaster`.
    row, column : of the cell.

    Notes
    -----
    No formula: a look into the table of free rectangles, which are 0 in a wall.
    """
    if row < 0 or row >= tables.rows or column < 0 or column >= tables.columns:
        return False
    return tables.rectangles[_place_in_table(tables, row, column)] == 0


@compiled
def _begin(
    tables: RayTables, x: float, y: float, dir_x: float, dir_y: float
) -> tuple[float, float, float, float, float, float, float, int, int]:
    """Start and direction in the grid's frame [cells], their inverses, time and cell of entry; row -1 for a miss."""
    c, s, scale = tables.origin_cos, tables.origin_sin, 1.0 / tables.resolution
    from_origin_x, from_origin_y = x - tables.origin_x, y - tables.origin_y
    x = (c * from_origin_x + s * from_origin_y) * scale
    y = (c * from_origin_y - s * from_origin_x) * scale
    dx, dy = c * dir_x + s * dir_y, c * dir_y - s * dir_x
    if not (abs(x) < FARTHEST and abs(y) < FARTHEST and abs(dx) < FARTHEST and abs(dy) < FARTHEST):
        return x, y, dx, dy, 0.0, 0.0, 0.0, -1, -1
    if abs(dx) < TINY:
        dx = -TINY if dx < 0.0 else TINY
    if abs(dy) < TINY:
        dy = -TINY if dy < 0.0 else TINY
    inverse_x, inverse_y = 1.0 / dx, 1.0 / dy
    t, row, column = 0.0, math.floor(y), math.floor(x)
    if row < 0 or row >= tables.rows or column < 0 or column >= tables.columns:
        t, row, column = _entry(tables, x, y, dx, dy, inverse_x, inverse_y)
    return x, y, dx, dy, inverse_x, inverse_y, t, row, column


@compiled
def _jump(  # noqa: PLR0917
    rows: int,
    columns: int,
    size: int,
    x: float,
    y: float,
    dx: float,
    dy: float,
    inverse_x: float,
    inverse_y: float,
    row: int,
    column: int,
) -> tuple[float, int, int]:
    """When a ray leaves the free rectangle it is in, and the cell it enters; row -1 outside the grid. Units: cells.

    Takes numbers and not the tables, and has one way into its slow part: small enough to be inlined.
    """
    width, height = size & 0xFF, size >> 8
    next_column = column + width if dx > 0.0 else column - width
    next_row = row + height if dy > 0.0 else row - height
    time_x = ((next_column if dx > 0.0 else next_column + 1) - x) * inverse_x
    time_y = ((next_row if dy > 0.0 else next_row + 1) - y) * inverse_y
    # Selected, not branched: which border comes first is a coin toss that no processor predicts.
    crosses_x = time_x < time_y
    t = time_x if crosses_x else time_y
    start, direction = (y, dy) if crosses_x else (x, dx)
    along = start + t * direction
    index = math.floor(min(max(along, -FARTHEST), FARTHEST))
    if not CERTAIN < along - index < 1.0 - CERTAIN:
        first, beyond = (row, next_row) if crosses_x else (column, next_column)
        inverse = inverse_y if crosses_x else inverse_x
        index = _last_crossed(start, inverse, t, crosses_x, first, beyond - (1 if direction > 0.0 else -1), along)
    row = index if crosses_x else next_row
    column = next_column if crosses_x else index
    if row < 0 or row >= rows or column < 0 or column >= columns:
        return t, -1, -1
    return t, row, column


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
def cast_serial(tables: RayTables, rays: FloatArray, max_range: float) -> FloatArray:
    """Ranges of many rays on one core: `cast_ray` for each.

    Parameters
    ----------
    tables : of a `RayCaster`.
    rays : (N, 3) array: start and direction [m, m, rad], map frame.
    max_range : [m]

    Returns
    -------
    ranges : (N,) array [m]; inf where nothing is hit up to `max_range`.
    """
    ranges = np.empty(len(rays))
    _cast_in_turns(tables, rays, max_range, ranges)
    return ranges


@compiled_parallel
def cast_parallel(tables: RayTables, rays: FloatArray, max_range: float) -> FloatArray:
    """Ranges of many rays on all cores: `cast_ray` for each.

    Parameters
    ----------
    tables, rays, max_range : as in `cast_serial`.

    Returns
    -------
    ranges : (N,) array [m], equal to those of `cast_serial`.
    """
    ranges = np.empty(len(rays))
    for chunk in parallel_range((len(rays) + CHUNK - 1) // CHUNK):
        part = slice(chunk * CHUNK, min((chunk + 1) * CHUNK, len(rays)))
        _cast_in_turns(tables, rays[part], max_range, ranges[part])
    return ranges


@compiled
def _cast_in_turns(tables: RayTables, rays: FloatArray, max_range: float, ranges: FloatArray) -> None:
    """Fill `ranges` (N,): `cast_ray` for each ray, LANES of them jumping in turns."""
    limit = max_range * (1.0 / tables.resolution)
    lines = np.empty((LANES, 6))
    times = np.empty(LANES)
    places = np.empty((LANES, 3), dtype=np.int64)
    sizes = np.empty(LANES, dtype=np.int64)
    following, active = 0, 0
    while active > 0 or following < len(rays):
        while active < LANES and following < len(rays):
            x, y, heading = rays[following, 0], rays[following, 1], rays[following, 2]
            x, y, dx, dy, inverse_x, inverse_y, t, row, column = _begin(
                tables, x, y, math.cos(heading), math.sin(heading)
            )
            lines[active, 0], lines[active, 1], lines[active, 2], lines[active, 3] = x, y, dx, dy
            lines[active, 4], lines[active, 5], times[active] = inverse_x, inverse_y, t
            places[active, 0], places[active, 1], places[active, 2] = row, column, following
            following, active = following + 1, active + 1
        # All loads before all jumps: a core waits for many of them at once.
        for lane in range(active):
            row, column = places[lane, 0], places[lane, 1]
            inside = row >= 0 and times[lane] <= limit
            sizes[lane] = _free_rectangle(tables, lines[lane, 2], lines[lane, 3], row, column) if inside else MISSED
        # From the last lane down, so that a lane that moves into the place of a finished one has had its turn.
        for lane in range(active - 1, -1, -1):
            if sizes[lane] > 0:
                x, y, dx, dy = lines[lane, 0], lines[lane, 1], lines[lane, 2], lines[lane, 3]
                inverse_x, inverse_y = lines[lane, 4], lines[lane, 5]
                row, column, size = places[lane, 0], places[lane, 1], sizes[lane]
                times[lane], places[lane, 0], places[lane, 1] = _jump(
                    tables.rows, tables.columns, size, x, y, dx, dy, inverse_x, inverse_y, row, column
                )
            else:
                hit = sizes[lane] != MISSED
                ranges[places[lane, 2]] = times[lane] * tables.resolution if hit else math.inf
                active -= 1
                times[lane] = times[active]
                for i in range(6):
                    lines[lane, i] = lines[active, i]
                for i in range(3):
                    places[lane, i] = places[active, i]


@compiled
def lines_free(tables: RayTables, points_a: FloatArray, points_b: FloatArray) -> BoolArray:
    """Line of sight between the rows of two arrays: `is_line_free` for each.

    Parameters
    ----------
    tables : of a `RayCaster`.
    points_a, points_b : (N, 2) arrays [m], map frame.

    Returns
    -------
    free : (N,) array.
    """
    free = np.empty(len(points_a), dtype=np.bool_)
    for i in range(len(points_a)):
        free[i] = is_line_free(tables, points_a[i, 0], points_a[i, 1], points_b[i, 0], points_b[i, 1])
    return free


@compiled
def free_rectangles(occupied: BoolArray, down: bool, left: bool) -> NDArray[np.uint16]:
    """Find a large free rectangle that has its corner in each cell and extends into one quadrant.

    Parameters
    ----------
    occupied : (H, W) array.
    down, left : whether the rectangle extends towards lower rows, towards lower columns.

    Returns
    -------
    rectangles : (H, W) array, columns + 256 rows [cells], each 1 to 255: 0 in occupied cells; outside the grid counts
        as free.

    Notes
    -----
    A free rectangle next door grows by the cell's own row or column, as far as these are free: free by induction. Of
    three such (from beside, from above, from across) that one is kept whose w h / (w + h) is the largest: half the
    harmonic mean of its edges, which stands for how far a ray of any direction gets in it. On halls rays make as many
    jumps as with the best of all rectangles, within 1 %.
    """
    height, width = occupied.shape
    found = np.zeros((height, width), dtype=np.uint16)
    # Of the row before: edges of its rectangles, and how far its columns are free; of cells outside, as long as can be.
    wide = np.full(width, LONGEST_EDGE, dtype=np.int64)
    high, upward = wide.copy(), wide.copy()
    for i in range(height):
        row = i if down else height - 1 - i
        beside_w, beside_h, across_w, across_h = LONGEST_EDGE, LONGEST_EDGE, LONGEST_EDGE, LONGEST_EDGE
        onward = LONGEST_EDGE
        for j in range(width):
            column = j if left else width - 1 - j
            above_w, above_h = wide[column], high[column]
            if occupied[row, column]:
                w, h, onward, upward[column] = 0, 0, 0, 0
            else:
                onward = min(onward + 1, LONGEST_EDGE)
                upward[column] = min(upward[column] + 1, LONGEST_EDGE)
                w, h = grown(beside_w, beside_h, above_w, above_h, across_w, across_h, onward, upward[column])
                found[row, column] = w + (h << 8)
            across_w, across_h = above_w, above_h
            beside_w, beside_h = w, h
            wide[column], high[column] = w, h
    return found


@compiled_inline
def grown(  # noqa: PLR0917 - three rectangles and two runs, number by number
    beside_w: int, beside_h: int, above_w: int, above_h: int, across_w: int, across_h: int, onward: int, upward: int
) -> tuple[int, int]:
    """Pick the rectangle of a free cell from those of its neighbors; 0 x 0 is that of a wall.

    Parameters
    ----------
    beside_w, beside_h, above_w, above_h, across_w, across_h : columns and rows of the neighbors' rectangles [cells].
    onward, upward : free cells from the cell on, along its row and along its column, itself included.

    Notes
    -----
    a / b > c / d as a d > c b, so that integers do, derived; the three candidates are those of `free_rectangles`.
    """
    w, h = min(across_w + 1, onward), min(across_h + 1, upward)
    other_w = min(beside_w + 1, LONGEST_EDGE)
    other_h = min(beside_h, upward) if beside_w > 0 else upward
    if other_w * other_h * (w + h) > w * h * (other_w + other_h):
        w, h = other_w, other_h
    other_w = min(above_w, onward) if above_w > 0 else onward
    other_h = min(above_h + 1, LONGEST_EDGE)
    if other_w * other_h * (w + h) > w * h * (other_w + other_h):
        w, h = other_w, other_h
    return w, h
