"""The floor map as Perfect Match reads it: how far each place is from the nearest contour, as one table.

Distances have a sign, less than zero inside a wall: so they pass through zero at the face where beams stop instead of
turning there, and both faces of a wall are told from its middle.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.se2 import inverse, transform_points
from commission.site.floor_map import FloorMap

FAR = 1e3
"""Distance from contours of a map that has none [m]."""


class ContourTables(NamedTuple):
    """Distances from contours for kernels, and where the table lies."""

    distances: NDArray[np.float32]
    """(H, W) distance of each cell's center from the nearest face of an occupied cell [m], negative inside of one."""
    resolution: float
    """Edge of a cell [m]."""
    x: float
    """`T_grid_map`: pose of the map in the frame of the table [m, m, rad]."""
    y: float
    theta: float
    depth: float = 0.0
    """How far behind the drawn faces contours lie [m]: what `read_distance` reads is less by it."""


class Reading(NamedTuple):
    """Distance from the nearest contour at a place, and how it changes from cell to cell."""

    distance: float
    """[m]; NaN outside of the table."""
    along_columns: float
    """Change per cell towards higher columns [m]."""
    along_rows: float


class ItsOwnKey:
    """A map as the key of a cache: equal to itself alone, so that no cells are compared."""

    def __init__(self, floor: FloorMap) -> None:
        self.floor = floor

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ItsOwnKey) and other.floor is self.floor

    def __hash__(self) -> int:
        return id(self.floor)


@functools.lru_cache(maxsize=2)
def _tables_of(key: ItsOwnKey) -> ContourTables:
    floor = key.floor
    distances = signed_distances(floor.occupancy())
    distances.setflags(write=False)
    x, y, theta = inverse(floor.origin).tolist()
    return ContourTables(distances, float(floor.resolution), x, y, theta)


def contour_tables(floor: FloorMap) -> ContourTables:
    """Return the table of a floor map: computed once for each map, which takes about a second for 8 million cells.

    Parameters
    ----------
    floor : its occupied cells are contours; unknown ones are free, as they are for beams.
    """
    return _tables_of(ItsOwnKey(floor))


def signed_distances(grid: OccupancyGrid) -> NDArray[np.float32]:
    """(H, W) distance of each cell's center from the nearest face of an occupied cell [m], negative inside of one.

    From center to center (exact Euclidean distance transform) less half a cell, so that it is 0 on a straight face;
    `FAR` everywhere when none is occupied.
    """
    half = 0.5 * grid.resolution
    outside = grid.distance_field()
    inside = OccupancyGrid(np.logical_not(grid.occupied), grid.resolution).distance_field()
    return np.clip(np.where(grid.occupied, half - inside, outside - half), -FAR, FAR).astype(np.float32)


@compiled_inline
def read_distance(distances: NDArray[np.float32], u: float, v: float) -> Reading:
    """Read a table between four cells.

    Parameters
    ----------
    distances : of `ContourTables`.
    u, v : place [cells], column and row, where whole numbers are centers of cells.

    Notes
    -----
    d = bilinear of the four distances around; its gradient is that of the same patch, exactly. The tables of gradients
    in Sobreira et al. 2015 (figures 2 and 3) are the differences of this one from cell to cell.
    """
    rows, columns = distances.shape
    if not (u >= 0.0 and v >= 0.0 and u < columns - 1.0 and v < rows - 1.0):
        return Reading(math.nan, 0.0, 0.0)
    column, row = int(u), int(v)
    fu, fv = u - column, v - row
    here, right = np.float64(distances[row, column]), np.float64(distances[row, column + 1])
    above, across = np.float64(distances[row + 1, column]), np.float64(distances[row + 1, column + 1])
    low, high = here + fu * (right - here), above + fu * (across - above)
    return Reading(low + fv * (high - low), (right - here) + fv * ((across - above) - (right - here)), high - low)


def distances_at(tables: ContourTables, points_map: FloatArray) -> FloatArray:
    """(N,) distance of points (N, 2) [m], map frame, from the nearest contour [m]; NaN outside of the table."""
    places = transform_points((tables.x, tables.y, tables.theta), points_map) / tables.resolution - 0.5
    found = np.empty(len(places))
    _read_all(tables.distances, np.ascontiguousarray(places), found)
    return found


@compiled
def _read_all(distances: NDArray[np.float32], places: FloatArray, found: FloatArray) -> None:
    """`read_distance` at (N, 2) places [cells]."""
    for i in range(len(places)):
        found[i] = read_distance(distances, places[i, 0], places[i, 1]).distance
