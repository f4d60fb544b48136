"""Reflectors that a vehicle should see from somewhere and does not: what speaks against a hypothesis of its pose."""

from __future__ import annotations

import math

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.ray_kernels import RayTables, is_line_free


@compiled_inline
def is_taken(entry: int, taken: IntArray, count: int) -> bool:
    """Whether one of the first things is that reflector already.

    Parameters
    ----------
    entry : row of `ReflectorIndex.places`.
    taken : (C,) such a row for each thing; -1: none.
    count : things that are asked.

    Notes
    -----
    No formula: it looks through a list.
    """
    found = False
    for i in range(count):
        found = found or taken[i] == entry
    return found


@compiled
def missed_reflectors(  # noqa: PLR0917 - views and the map, array by array
    x: float,
    y: float,
    t: float,
    taken: IntArray,
    views: FloatArray,
    eyes: FloatArray,
    walls: RayTables,
    walled: bool,
    facings: FloatArray,
    places: FloatArray,
) -> float:
    """Reflectors that should be seen and are not: each counts by the share of the views that it should be seen in.

    Parameters
    ----------
    x, y, t : frame of odometry in the map [m, m, rad].
    taken : (C,) row of `places` that each thing is; -1: none.
    views, eyes, walls, walled, facings, places : as in `judge`.

    Notes
    -----
    sum of min(1, sum of the weights of the views that see it), by definition.
    """
    c, s = math.cos(t), math.sin(t)
    missed = 0.0
    for entry in range(len(places)):
        if is_taken(entry, taken, len(taken)):
            continue
        share = 0.0
        for v in range(len(views)):
            vx, vy = x + c * views[v, 0] - s * views[v, 1], y + s * views[v, 0] + c * views[v, 1]
            dx, dy = places[entry, 0] - vx, places[entry, 1] - vy
            square = dx * dx + dy * dy
            facing = facings[entry]
            if not math.isnan(facing) and -dx * math.cos(facing) - dy * math.sin(facing) < 0.3 * math.sqrt(square):
                continue
            if not _is_in_view(dx, dy, square, t + views[v, 2], int(views[v, 3]), eyes):
                continue
            if walled:
                # Up to just before the reflector: it may stand at a wall.
                distance = math.sqrt(square)
                part = max(distance - 0.3, 0.0) / distance
                if not is_line_free(walls, vx, vy, vx + part * dx, vy + part * dy):
                    continue
            share += views[v, 4]
        missed += min(share, 1.0)
    return missed


@compiled_inline
def _is_in_view(dx: float, dy: float, square: float, heading: float, scanner: int, eyes: FloatArray) -> bool:  # noqa: PLR0917
    """Whether a scanner of some heading looks where a reflector is that lies (dx, dy) from it.

    Notes
    -----
    Range and bearing between their limits, by definition.
    """
    seen = False
    for e in range(len(eyes)):
        if int(eyes[e, 0]) != scanner or square > eyes[e, 4] ** 2 or square < eyes[e, 3] ** 2:
            continue
        bearing = math.atan2(dy, dx) - heading - eyes[e, 1]
        bearing -= 2.0 * math.pi * math.floor(bearing / (2.0 * math.pi))
        seen = seen or bearing <= eyes[e, 2]
    return seen
