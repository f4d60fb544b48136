"""What the ends of a scan's beams say of a hypothesis of the vehicle's pose, by the walls of the floor map.

A beam model in three parts: a beam ends at the wall that the map has there, before it (people and boxes are on no
map), or behind it, which is the rare one. Reflectors are `hypothesis_fit`'s: beams that end at one are left out.
"""

from __future__ import annotations

import math

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, read_only
from commission.geometry.ray_kernels import RayTables, cast_ray
from commission.localization.beam_ends import BIN, BINS, Ends

STRETCH = 6
"""Directions of which one beam is taken: one in three degrees."""
NEAREST_END = 0.3
"""Beams that end nearer than that say nothing: the vehicle's own parts [m]."""
AT_A_THING = 0.3
"""A beam that ends that near to something that was detected is that detection's [m]."""
AT_WALL = 0.15
"""Distance from a wall of the map within which a beam ends at it: cells, and the error of a hypothesis [m]."""
ASKEW = 0.01
"""Angle by which a beam may be off: heading of a hypothesis, width of a direction [rad]."""
HIT, SHORT, THROUGH = 0.55, 0.40, 0.05
"""Shares of the beams at the right pose: at the wall, before it, behind it."""
NULL_HIT, NULL_SHORT, NULL_THROUGH = 0.20, 0.40, 0.40
"""The same at a pose that has nothing to do with the scan."""
INDEPENDENT = 0.25
"""Share of the beams that count as independent: neighbors end at the same wall, box or person."""
MOST_FOR = math.log(1e3)
"""The walls speak no more than that for a pose rather than for a place that nobody has thought of: halls repeat."""
MOST_AMONG = 2.0 * MOST_FOR
"""Nor more than that for a pose rather than for another one."""
MOST_AGAINST = MOST_FOR
"""Nor more than that against one: a drawing has lines that are no walls, and may lie askew over the reflectors."""

NO_BEAMS = read_only(np.empty((0, 4)))


def wall_beams(views: FloatArray, ends: Ends, things: FloatArray) -> FloatArray:
    """Choose the beams of the newest view of each scanner by which poses are judged.

    Parameters
    ----------
    views : (V, 5) pose of scanners in the frame of odometry [m, m, rad], scanner, and time; the oldest first.
    ends : (V, BINS) see `beam_ends`.
    things : (C, 2) or more columns, x, y of what was detected in the frame of odometry [m].

    Returns
    -------
    beams : (B, 4) start x, y [m] and direction [rad] in the frame of odometry, length [m].
    """
    chosen = [np.empty((0, 4))]
    for scanner in np.unique(views[:, 3]):
        view = int(np.flatnonzero(views[:, 3] == scanner)[-1])
        known = np.isfinite(ends[view]) & (ends[view] >= NEAREST_END)
        stretches = known.reshape(-1, STRETCH)
        bins = (np.argmax(stretches, axis=1) + STRETCH * np.arange(BINS // STRETCH))[stretches.any(axis=1)]
        direction, length = views[view, 2] + (bins + 0.5) * BIN, ends[view, bins].astype(np.float64)
        x, y = views[view, 0] + length * np.cos(direction), views[view, 1] + length * np.sin(direction)
        away = np.hypot(x[:, np.newaxis] - things[:, 0], y[:, np.newaxis] - things[:, 1]).min(axis=1, initial=math.inf)
        start = np.broadcast_to(views[view, :2], (len(bins), 2))
        chosen.append(np.column_stack((start, direction, length))[away > AT_A_THING])
    return read_only(np.concatenate(chosen))


@compiled_inline
def _wall_ahead(tables: RayTables, x: float, y: float, direction: float, longest: float) -> float:
    """Distance of the first wall in a direction [m]; inf where there is none up to `longest`.

    Notes
    -----
    No formula: `cast_ray`.
    """
    return cast_ray(tables, x, y, math.cos(direction), math.sin(direction), longest)[0]


@compiled
def log_walls(x: float, y: float, t: float, beams: FloatArray, tables: RayTables) -> float:
    """Log of how much likelier the ends of beams are at a pose than at any other.

    Parameters
    ----------
    x, y, t : frame of odometry in the map [m, m, rad].
    beams : see `wall_beams`.
    tables : walls of the floor map.

    Notes
    -----
    w sum log(P(part) / P0(part)), from `-MOST_AGAINST` to `MOST_AMONG`: the beam model of Thrun et al. 2005, section
    6.3, with its hit, short and random part, each by its share alone; w tempers, since beams are not independent.
    """
    c, s = math.cos(t), math.sin(t)
    hit, short, through = math.log(HIT / NULL_HIT), math.log(SHORT / NULL_SHORT), math.log(THROUGH / NULL_THROUGH)
    total = 0.0
    for i in range(len(beams)):
        if INDEPENDENT * (total + hit * (len(beams) - i)) < -MOST_AGAINST:
            break
        sx, sy = x + c * beams[i, 0] - s * beams[i, 1], y + s * beams[i, 0] + c * beams[i, 1]
        direction, length = t + beams[i, 2], beams[i, 3]
        longest = length + 2.0 * AT_WALL
        middle = _wall_ahead(tables, sx, sy, direction, longest)
        if abs(middle - length) <= AT_WALL:
            total += hit
            continue
        left = _wall_ahead(tables, sx, sy, direction + ASKEW, longest)
        right = _wall_ahead(tables, sx, sy, direction - ASKEW, longest)
        nearest, farthest = min(middle, left, right), max(middle, left, right)
        if farthest < length - AT_WALL:
            total += through
        elif nearest <= length + AT_WALL:
            total += hit
        else:
            total += short
    return min(max(INDEPENDENT * total, -MOST_AGAINST), MOST_AMONG)
