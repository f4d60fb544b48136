"""Snapping: from where the engineer clicked or dragged to where a reflector is meant to be. It draws nothing.

The nearest wall surface is found in the occupancy grid itself, in a window around the click: no table has to be
prepared, and a wall that was just drawn counts at once.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from commission.errors import UsageError
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.se2 import inverse, transform_points
from commission.site.editing import reflectors as edits
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

REACH = 1.0
"""Distance up to which a wall attracts a reflector [m]."""
PLATE_DEPTH = 0.01
"""A flat plate on a wall has its reflecting face this far in front of it [m]."""
_FIT_RADIUS = 0.4
"""Part of a wall that says which way it faces [m]: wider than the steps of a slanted wall, narrower than a pillar."""
_ARM = 3
"""Cells over which both edges of a corner are straight."""
_STRAIGHT = 0.5
"""A wall is straight when its faces lie this close to a line, root mean square [cells]; steps of cells reach 0.35."""


@dataclass(frozen=True, slots=True)
class WallPoint:
    """A place on the surface of a wall."""

    x: float
    """x in the map frame [m]."""
    y: float
    """y in the map frame [m]."""
    heading: float
    """Direction in which the surface faces, map frame [rad]."""
    distance: float
    """From the given point to the surface [m]."""


@dataclass(frozen=True, slots=True)
class LinedUp:
    """A point moved so that it lines up with reflectors."""

    x: float
    """x in the map frame [m]."""
    y: float
    """y in the map frame [m]."""
    x_of: str | None
    """Reflector whose x it took; None: its own."""
    y_of: str | None
    """Reflector whose y it took; None: its own."""


def nearest_wall(grid: OccupancyGrid, point: tuple[float, float], reach: float = REACH) -> WallPoint | None:
    """Nearest place on a wall's surface.

    Parameters
    ----------
    grid : the walls.
    point : [m, m], map frame. In front of a wall only surfaces that face it count; inside one, all do.
    reach : how far to look [m].

    Returns
    -------
    wall : None when no surface lies within reach. Its heading is that of the straight line through the surface around
        it (slanted walls are stairs of cells), or of its cell's face where the surface is not straight.
    """
    if not reach > 0.0:
        raise UsageError(f"reach is {reach:g} m; expected more than 0 m")
    cell = grid.resolution
    p = transform_points(inverse(grid.origin), np.asarray(point, dtype=np.float64)) / cell
    middles, normals = _faces(grid, p, (reach + _FIT_RADIUS) / cell + 2.0)
    if not grid.is_occupied(point):
        facing = ((p - middles) * normals).sum(axis=1) > 0.0
        middles, normals = middles[facing], normals[facing]
    if len(middles) == 0:
        return None
    along = np.stack((-normals[:, 1], normals[:, 0]), axis=1)
    offsets = np.clip(((p - middles) * along).sum(axis=1), -0.5, 0.5)
    nearest_points = middles + offsets[:, np.newaxis] * along
    distances = np.hypot(*(p - nearest_points).T)
    best = int(np.argmin(distances))
    if distances[best] * cell > reach:
        return None
    hit, normal = _straightened(p, nearest_points[best], (middles, normals), normals[best], _FIT_RADIUS / cell)
    x, y = transform_points(grid.origin, hit * cell)
    heading = wrap_scalar(math.atan2(normal[1], normal[0]) + float(grid.origin[2]))
    return WallPoint(float(x), float(y), heading, float(np.hypot(*(p - hit))) * cell)


def on_wall(reflector: Reflector, wall: WallPoint) -> Reflector:
    """Put a reflector against a wall: a cylinder touches it, a flat plate lies on it and faces away from it."""
    is_flat = reflector.kind is ReflectorKind.FLAT
    depth = PLATE_DEPTH if is_flat else reflector.reckoned_radius
    x, y = wall.x + depth * math.cos(wall.heading), wall.y + depth * math.sin(wall.heading)
    return replace(reflector, x=x, y=y, heading=wall.heading if is_flat else reflector.heading)


def snap_to_wall(
    reflectors: ReflectorMap, ids: Collection[str], grid: OccupancyGrid, reach: float = REACH
) -> ReflectorMap:
    """Put the selection against the nearest walls; what is locked or has no wall near it stays.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    grid : of the floor map.
    reach : largest distance to a wall [m].
    """
    locked = edits.locked_among(reflectors, ids)
    chosen = frozenset(ids).difference(locked)

    def snapped(reflector: Reflector) -> Reflector:
        wall = nearest_wall(grid, (reflector.x, reflector.y), reach)
        return reflector if wall is None else on_wall(reflector, wall)

    return ReflectorMap(tuple(snapped(r) if r.id in chosen else r for r in reflectors.reflectors))


def to_grid(points: ArrayLike, spacing: float) -> FloatArray:
    """Nearest multiples of `spacing` [m] to points (..., 2) [m], map frame: (..., 2) array."""
    if not spacing > 0.0:
        raise UsageError(f"spacing of the grid is {spacing:g} m; expected more than 0 m")
    return np.round(np.asarray(points, dtype=np.float64) / spacing) * spacing


def align(reflectors: ReflectorMap, point: tuple[float, float], reach: float, ignored: Collection[str] = ()) -> LinedUp:
    """Move a point onto the row and the column of other reflectors.

    Parameters
    ----------
    reflectors : those to line up with.
    point : [m, m], map frame.
    reach : largest move along each axis [m].
    ignored : ids that do not attract, for example of what is being dragged.

    Returns
    -------
    aligned : with the reflectors that attracted it, for guide lines; of several equally near ones the first.
    """
    skipped = frozenset(ignored)
    names = [r.id for r in reflectors.reflectors if r.id not in skipped]
    centers = reflectors.centers[[r.id not in skipped for r in reflectors.reflectors]]
    found: list[tuple[float, str | None]] = []
    for axis in (0, 1):
        gaps = np.abs(centers[:, axis] - point[axis])
        best = int(np.argmin(gaps)) if len(gaps) else -1
        is_near = best >= 0 and gaps[best] <= reach
        found.append((float(centers[best, axis]), names[best]) if is_near else (float(point[axis]), None))
    return LinedUp(found[0][0], found[1][0], found[0][1], found[1][1])


def nearest_corner(grid: OccupancyGrid, point: tuple[float, float], reach: float) -> FloatArray | None:
    """Find the corner of a wall that is nearest to a point.

    Parameters
    ----------
    grid : the walls.
    point : where to look [m, m], map frame.
    reach : how far to look [m].

    Returns
    -------
    corner : (2,) array [m], map frame; None: none is near. A corner is where two edges meet that are straight over
        three cells each: the steps of a slanted wall are none.
    """
    cells = np.pad(np.asarray(grid.occupied, dtype=np.int8), _ARM)
    # Quadrants around each node of the lattice between the cells: below and above, to the left and to the right.
    quadrants = np.stack((cells[:-1, :-1], cells[:-1, 1:], cells[1:, :-1], cells[1:, 1:]))
    rows, columns = np.nonzero(quadrants.sum(axis=0) % 2)
    local = np.column_stack((columns, rows)) + 1.0 - _ARM
    places = transform_points(grid.origin, grid.resolution * local)
    gaps = np.hypot(*(places - np.asarray(point)).T)
    for index in np.argsort(gaps, kind="stable"):
        if gaps[index] > reach:
            return None
        if _has_arms(cells, int(rows[index]) + 1, int(columns[index]) + 1):
            return places[index]
    return None


def _has_arms(cells: NDArray[np.int8], row: int, column: int) -> bool:
    """Whether the two edges that meet at a node are straight for `_ARM` cells each."""
    right, left = cells[row - 1 : row + 1, column:], cells[row - 1 : row + 1, column - 1 :: -1]
    above, below = cells[row:, column - 1 : column + 1].T, cells[row - 1 :: -1, column - 1 : column + 1].T
    arms = [arm[:, :_ARM] for arm in (right, left, above, below) if arm[0, 0] != arm[1, 0]]
    return all(arm.shape[1] == _ARM and bool((arm == arm[:, :1]).all()) for arm in arms)


def _faces(grid: OccupancyGrid, p: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    """Middles and normals (M, 2) of faces between occupied and free cells around p, all in cells, grid frame."""
    rows, columns = grid.occupied.shape
    # One more cell on each side, so that what ends at the window does not look like a surface; beyond the grid is free.
    low = np.clip(np.floor(p - reach).astype(np.int64), 0, [columns, rows])
    high = np.clip(np.ceil(p + reach).astype(np.int64), 0, [columns, rows])
    window = np.zeros((max(high[1] - low[1], 0) + 2, max(high[0] - low[0], 0) + 2), dtype=np.bool_)
    bottom, left = max(low[1] - 1, 0), max(low[0] - 1, 0)
    part = grid.occupied[bottom : high[1] + 1, left : high[0] + 1]
    top_left = (bottom - (low[1] - 1), left - (low[0] - 1))
    window[top_left[0] : top_left[0] + part.shape[0], top_left[1] : top_left[1] + part.shape[1]] = part
    middles: list[FloatArray] = []
    normals: list[FloatArray] = []
    for step_row, step_column in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        beyond = np.roll(window, (-step_row, -step_column), axis=(0, 1))
        at = np.argwhere((window & ~beyond)[1:-1, 1:-1])
        normal = np.array([float(step_column), float(step_row)])
        middles.append(at[:, ::-1] + low + 0.5 + 0.5 * normal)
        normals.append(np.broadcast_to(normal, (len(at), 2)))
    return np.concatenate(middles), np.concatenate(normals)


def _straightened(
    p: FloatArray, hit: FloatArray, faces: tuple[FloatArray, FloatArray], normal: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray]:
    """Foot of p and normal of the straight line through the faces around a hit; hit and normal where there is none."""
    middles, normals = faces
    near = (np.hypot(*(middles - hit).T) <= radius) & (normals @ normal >= 0.0)
    points = middles[near]
    if len(points) < 3:
        return hit, normal
    center = points.mean(axis=0)
    _, spread, directions = np.linalg.svd(points - center, full_matrices=False)
    line = directions[0]
    across = np.array([-line[1], line[0]])
    across = across if across @ normal >= 0.0 else -across
    foot = p - ((p - center) @ across) * across
    # Beside a corner the faces make no line; beside a wall's end the line goes on where the wall does not.
    if spread[1] > _STRAIGHT * math.sqrt(len(points)) or np.hypot(*(points - foot).T).min() > 1.0:
        return hit, normal
    return foot, across
