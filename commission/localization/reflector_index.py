"""The reflector map sorted into square cells, so that a search around a point costs the same in any map.

Reflectors of one cell, and cells of one row, lie side by side: a search reads one slice per row it touches.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.site.reflectors import ReflectorMap

SMALLEST_CELL = 1.0
"""Edge of a cell [m]: wider than a usual gate, so that a search touches one to four cells."""


class Cells(NamedTuple):
    """The square cells over the map."""

    origin_x: float
    origin_y: float
    size: float
    """Edge of a cell [m]."""
    rows: int
    columns: int
    largest_variance: float
    """Of all surveyed places, each axis [m^2]."""
    per_metre: float
    """Cells in a metre: dividing takes longer."""


class ReflectorIndex(NamedTuple):
    """Reflectors in the order of their cells, row by row."""

    cells: Cells
    places: FloatArray
    """(N, 4) x, y [m], map frame; variance of the surveyed place, each axis [m^2]; index in the reflector map."""
    offsets: IntArray
    """(rows * columns + 1,) first row of `places` of each cell."""


def build_index(reflectors: ReflectorMap, survey_sigmas: FloatArray | None = None) -> ReflectorIndex:
    """Sort a reflector map into cells. Cells grow with the hall, so that there are at most a few per reflector.

    The places of the reflectors are known to 1-sigma (N,) [m], each axis; None: to their own.
    """
    centers = np.asarray(reflectors.centers)
    if survey_sigmas is None:
        survey_sigmas = np.array([reflector.own_sigma for reflector in reflectors.reflectors], dtype=np.float64)
    sigmas = survey_sigmas
    low = centers.min(axis=0) if len(centers) else np.zeros(2)
    extent = centers.max(axis=0) - low if len(centers) else np.zeros(2)
    most_cells = 4 * len(centers) + 1024
    cell = max(SMALLEST_CELL, math.sqrt(extent[0] * extent[1] / most_cells), float(extent.max()) / most_cells)
    columns, rows = (int(n) + 1 for n in extent // cell)
    cells = ((centers - low) // cell).astype(np.int64)
    keys = cells[:, 1] * columns + cells[:, 0]
    order = np.argsort(keys, kind="stable")
    offsets = np.searchsorted(keys[order], np.arange(rows * columns + 1)).astype(np.int64)
    places = np.column_stack((centers, np.square(sigmas), np.arange(len(centers), dtype=np.float64)))[order]
    largest = float(np.square(sigmas).max(initial=0.0))
    return ReflectorIndex(
        Cells(float(low[0]), float(low[1]), cell, rows, columns, largest, 1.0 / cell),
        read_only(places),
        read_only(offsets),
    )


def in_order_of_map(index: ReflectorIndex) -> FloatArray:
    """(N, 3) x, y [m] and variance [m^2] of each reflector, in the order of the reflector map."""
    places = np.empty((len(index.places), 3))
    places[index.places[:, 3].astype(np.int64)] = index.places[:, :3]
    return read_only(places)


@compiled_inline
def cell_range(low: float, high: float, per_metre: float, count: int) -> tuple[int, int]:
    """First and last cell that an interval touches; last < first when none.

    Parameters
    ----------
    low, high : ends of the interval, from the first cell's edge [m].
    per_metre : cells in a metre; rounded, so that an interval must be wider than what it is to hold by as much.
    count : of cells.

    Notes
    -----
    floor(low per_metre) to floor(high per_metre), clipped to 0 ... count - 1, by definition.
    """
    first, last = low * per_metre, high * per_metre
    if first >= count or last < 0.0:
        return 0, -1
    # Compared as floats before the conversion: infinity has no integer. NaN takes every cell.
    return int(first) if first > 0.0 else 0, int(last) if last < count else count - 1


@compiled_inline
def nearest_entry(x: float, y: float, reach: float, index: ReflectorIndex) -> tuple[int, float]:
    """Row of the nearest reflector within reach, and its squared distance [m^2]; -1 where there is none.

    Parameters
    ----------
    x, y : the place [m], map frame.
    reach : radius of the search [m].
    index : the map.

    Notes
    -----
    entry = argmin |place - reflector|, by definition.
    """
    cells, places, cell_offsets = index
    px, py = x - cells.origin_x, y - cells.origin_y
    first_row, last_row = cell_range(py - reach, py + reach, cells.per_metre, cells.rows)
    first_column, last_column = cell_range(px - reach, px + reach, cells.per_metre, cells.columns)
    least, best = reach * reach, -1
    for row in range(first_row, last_row + 1 if last_column >= first_column else first_row):
        start = cell_offsets[row * cells.columns + first_column]
        for entry in range(start, cell_offsets[row * cells.columns + last_column + 1]):
            dx, dy = places[entry, 0] - x, places[entry, 1] - y
            square = dx * dx + dy * dy
            if square <= least:
                least, best = square, entry
    return best, least
