"""Edits of the floor map: areas erased or filled, walls drawn, the grid made larger. Files are none of its business.

A cell belongs to an area when its center does (even-odd rule, so that any closed line will do); every function returns
a new map, or the given one where no cell changes. Time grows with the rectangle around what is drawn, except for one
copy of the cells.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.rasterize import draw_segments
from commission.site.checks import between
from commission.site.floor_map import FREE, MOST_CELLS, OCCUPIED, UNKNOWN, FloorMap

THICKNESS = (0.001, 10.0)
"""Thinnest and thickest wall that can be drawn [m]."""
NEW_RESOLUTION = 0.05
"""Edge of a cell of a map that begins with what is drawn [m]: that of most maps."""
NEW_MARGIN = 1.0
"""Free floor around what a new map begins with [m]."""


@dataclass(frozen=True, slots=True)
class _Window:
    """Cells of a rectangle of the grid, marked."""

    bottom: int
    """Its first row."""
    left: int
    """Its first column."""
    marked: BoolArray
    """(H, W) which of them are meant."""

    @property
    def part(self) -> tuple[slice, slice]:
        """Its rows and columns."""
        rows, columns = self.marked.shape
        return slice(self.bottom, self.bottom + rows), slice(self.left, self.left + columns)


def fill(floor_map: FloorMap, polygon_map: ArrayLike, value: int) -> FloorMap:
    """Set each cell whose center lies in a polygon.

    Parameters
    ----------
    floor_map : the map; what of the polygon lies outside of it is cut off.
    polygon_map : (N, 2) array of corners [m], map frame; it is closed, and may cross itself.
    value : UNKNOWN, FREE or OCCUPIED.

    Raises
    ------
    UsageError
        fewer than three corners.
    """
    return _set(floor_map, [_polygon_window(floor_map, _to_cells(floor_map, _corners(polygon_map, 3)))], value)


def draw_obstacle(floor_map: FloorMap | None, polygon_map: ArrayLike) -> FloorMap:
    """Make a closed area occupied; the grid grows to hold it.

    Parameters
    ----------
    floor_map : the map; a new one begins when None.
    polygon_map : (N, 2) array of corners [m], map frame.

    Raises
    ------
    UsageError
        fewer than three corners, or an area so thin that it holds no cell's center.
    """
    corners = _corners(polygon_map, 3)
    room = _holding(floor_map, corners, 0.0)
    window = _polygon_window(room, _to_cells(room, corners))
    if window is None or not window.marked.any():
        raise UsageError(
            f"the obstacle is smaller than a cell of {1000.0 * room.resolution:g} mm; expected a larger one"
        )
    return _set(room, [window], OCCUPIED)


def draw_wall(floor_map: FloorMap | None, points_map: ArrayLike, thickness: float) -> FloorMap:
    """Make a wall along a line: cells whose centers it covers, and those that its middle line touches.

    The middle line makes a thin wall tight: without it one thinner than a cell would have gaps, or vanish.

    Parameters
    ----------
    floor_map : the map, which grows to hold the wall; a new one begins when None.
    points_map : (N, 2) array of points of the line [m], map frame. Its ends are square, its corners round.
    thickness : of the wall [m], half of it on each side of the line.

    Raises
    ------
    UsageError
        fewer than two different points.
    ValueError
        the thickness is out of range.
    """
    between(thickness, THICKNESS, "thickness", "m")
    points = _corners(points_map, 2)
    room = _holding(floor_map, points, 0.5 * thickness)
    line, half = _to_cells(room, points), 0.5 * thickness / room.resolution
    pieces = [_polygon_window(room, _band(start, end, half)) for start, end in itertools.pairwise(line)]
    corners = [_disc_window(room, corner, half) for corner in line[1:-1]]
    return _set(room, [*pieces, *corners, _line_window(room, line)], OCCUPIED)


def _corners(points_map: ArrayLike, at_least: int) -> FloatArray:
    """Points without repetitions in a row, such as a double click leaves: (N, 2) array [m]."""
    points = np.asarray(points_map, dtype=np.float64).reshape(-1, 2)
    if not np.isfinite(points).all():
        raise UsageError("a point is not finite; expected places on the floor")
    different = points[np.insert(np.any(points[1:] != points[:-1], axis=1), 0, values=True)] if len(points) else points
    if len(different) < at_least:
        raise UsageError(f"{len(different)} different points are too few; expected {at_least} or more")
    return different


def _to_cells(floor_map: FloorMap, points_map: FloatArray) -> FloatArray:
    """Points in cells: (N, 2) array of column and row, whole numbers on the cells' borders."""
    return se2.transform_points(se2.inverse(floor_map.origin), points_map) / floor_map.resolution


def _holding(floor_map: FloorMap | None, points_map: FloatArray, margin: float) -> FloorMap:
    """The map with unknown cells added at its sides until it holds points and a margin [m]; a new one when None."""
    if floor_map is None:
        low = np.floor((points_map.min(axis=0) - margin - NEW_MARGIN) / NEW_RESOLUTION)
        high = np.ceil((points_map.max(axis=0) + margin + NEW_MARGIN) / NEW_RESOLUTION)
        columns, rows = _checked_size(high - low)
        origin = np.array([*(low * NEW_RESOLUTION), 0.0])
        return FloorMap(np.full((rows, columns), FREE, np.int8), NEW_RESOLUTION, origin)
    cells, size = _to_cells(floor_map, points_map), np.array(floor_map.cells.shape[::-1])
    reach = margin / floor_map.resolution
    below = np.maximum(np.ceil(reach - cells.min(axis=0)), 0.0)
    above = np.maximum(np.ceil(cells.max(axis=0) + reach - size), 0.0)
    if not (below.any() or above.any()):
        return floor_map
    _checked_size(size + below + above)
    (left, bottom), (right, top) = below.astype(int), above.astype(int)
    grown = np.pad(floor_map.cells, ((bottom, top), (left, right)), constant_values=UNKNOWN)
    corner = np.array([-left * floor_map.resolution, -bottom * floor_map.resolution, 0.0])
    return FloorMap(grown, floor_map.resolution, se2.compose(floor_map.origin, corner))


def _checked_size(size: FloatArray) -> tuple[int, int]:
    """Columns and rows as whole numbers; raises UsageError for more cells than a map may have."""
    columns, rows = (float(n) for n in size)
    if not columns * rows <= MOST_CELLS:
        raise UsageError(
            f"the map would have {columns * rows:.3g} cells; expected at most {MOST_CELLS}: draw nearer to it"
        )
    return int(columns), int(rows)


def _set(floor_map: FloorMap, windows: Sequence[_Window | None], value: int) -> FloorMap:
    """The map with the marked cells set; itself when they are so already."""
    if not any(w is not None and np.any(w.marked & (floor_map.cells[w.part] != value)) for w in windows):
        return floor_map
    cells = floor_map.cells.copy()
    for window in windows:
        if window is not None:
            cells[window.part][window.marked] = value
    return replace(floor_map, cells=cells)


def _bounds(floor_map: FloorMap, low: FloatArray, high: FloatArray) -> tuple[int, int, int, int] | None:
    """First and end row, first and end column of the cells with centers in a rectangle; None when there are none."""
    rows, columns = floor_map.cells.shape
    left, bottom = (max(math.ceil(value - 0.5), 0) for value in low)
    right = min(math.floor(high[0] - 0.5) + 1, columns)
    top = min(math.floor(high[1] - 0.5) + 1, rows)
    return (bottom, top, left, right) if bottom < top and left < right else None


def _polygon_window(floor_map: FloorMap, polygon: FloatArray) -> _Window | None:
    """Cells whose centers lie in a polygon given in cells.

    Along each row of centers the edges are crossed at known columns; a center is inside when the number of crossings at
    or before it is odd. An edge owns its lower end and not its upper one, so that a corner counts once.
    """
    bounds = _bounds(floor_map, polygon.min(axis=0), polygon.max(axis=0))
    if bounds is None:
        return None
    bottom, top, left, right = bounds
    toggles = np.zeros((top - bottom, right - left + 1), dtype=np.int8)
    for (x1, y1), (x2, y2) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        (xa, ya), (xb, yb) = ((x1, y1), (x2, y2)) if y1 < y2 else ((x2, y2), (x1, y1))
        first, end = max(math.ceil(ya - 0.5), bottom), min(math.ceil(yb - 0.5), top)
        if first >= end:
            continue
        rows = np.arange(first, end)
        # Divided last: an edge through a center then crosses it exactly, where corners are on fractions of a cell.
        crossings = xa + (rows + 0.5 - ya) * (xb - xa) / (yb - ya)
        columns = np.clip(np.ceil(crossings - 0.5).astype(np.int64), left, right) - left
        toggles[rows - bottom, columns] ^= 1
    return _Window(bottom, left, np.bitwise_xor.accumulate(toggles, axis=1)[:, :-1].astype(np.bool_))


def _band(start: FloatArray, end: FloatArray, half: float) -> FloatArray:
    """Corners of a straight piece of wall: (4, 2) array [cells]."""
    along = (end - start) / np.hypot(*(end - start))
    across = half * np.array([-along[1], along[0]])
    return np.array([start + across, end + across, end - across, start - across])


def _disc_window(floor_map: FloorMap, center: FloatArray, radius: float) -> _Window | None:
    """Cells whose centers lie in a circle given in cells."""
    bounds = _bounds(floor_map, center - radius, center + radius)
    if bounds is None:
        return None
    bottom, top, left, right = bounds
    x, y = np.arange(left, right) + 0.5 - center[0], np.arange(bottom, top) + 0.5 - center[1]
    return _Window(bottom, left, x**2 + y[:, np.newaxis] ** 2 <= radius**2)


def _line_window(floor_map: FloorMap, line: FloatArray) -> _Window | None:
    """Cells that a line given in cells touches."""
    rows, columns = floor_map.cells.shape
    low, high = np.floor(line.min(axis=0)), np.floor(line.max(axis=0)) + 1.0
    left, bottom = (max(int(value), 0) for value in low)
    right, top = min(int(high[0]), columns), min(int(high[1]), rows)
    if left >= right or bottom >= top:
        return None
    marked = np.zeros((top - bottom, right - left), dtype=np.bool_)
    segments = np.concatenate([line[:-1], line[1:]], axis=1) - np.array([left, bottom, left, bottom])
    draw_segments(marked, np.ascontiguousarray(segments))
    return _Window(bottom, left, marked)
