"""Global localization: things that were seen, matched to a part of the reflector map, whatever the vehicle is told.

Pairs of things are looked up in the sorted table of all pairs of reflectors; what they suggest is where the frame of
odometry lies in the map, so that it goes with the vehicle. How well that fits all things is `hypothesis_fit`'s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from commission.compiled import compiled
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.reflector_index import ReflectorIndex, nearest_entry

CANDIDATES = 96
"""Poses that pairs suggest and that are judged: those that most things fit."""
HYPOTHESES = 24
"""Hypotheses that are carried on."""
TRIED = 20_000
"""Pairs of reflectors that are tried at most: 10 ms of work."""
PAIRS = 24
"""Pairs of things that are looked up at most."""
MOST_SCORED = 24
"""Things by which a candidate is chosen, those seen most often; the likelihood is of all."""
SAME_PLACE = 0.4
"""Poses nearer than that [m], with headings nearer than `SAME_HEADING`, are one hypothesis."""
SAME_HEADING = 0.15
"""[rad]"""
MARGIN = 5.0
"""The vehicle may be that far outside of the rectangle around all reflectors [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class DistanceTable:
    """All ordered pairs of reflectors by their distance."""

    distances: FloatArray
    """(P,) [m], ascending."""
    ends: IntArray
    """(P, 2) rows of `ReflectorIndex.places`."""
    area: float
    """Of the floor on which the vehicle may be [m^2]."""


def pair_table(places: FloatArray, longest: float) -> DistanceTable:
    """Tabulate the pairs of reflectors up to a distance.

    Parameters
    ----------
    places : (N, 4) of a `ReflectorIndex`.
    longest : distance [m].
    """
    centers = places[:, :2]
    if len(centers) < 2:
        return DistanceTable(read_only(np.empty(0)), read_only(np.empty((0, 2), dtype=np.int64)), 1.0)
    pairs = np.asarray(KDTree(centers).query_pairs(longest, output_type="ndarray"), dtype=np.int64).reshape(-1, 2)
    pairs = np.concatenate((pairs, pairs[:, ::-1]))
    deltas = centers[pairs[:, 0]] - centers[pairs[:, 1]]
    distances = np.hypot(deltas[:, 0], deltas[:, 1])
    order = np.lexsort((pairs[:, 1], pairs[:, 0], distances))
    width, height = np.ptp(centers, axis=0) + 2.0 * MARGIN
    return DistanceTable(read_only(distances[order]), read_only(pairs[order]), float(width * height))


@compiled
def candidates(  # noqa: PLR0917 - things and the map, array by array
    things: FloatArray,
    pairs: IntArray,
    distances: FloatArray,
    ends: IntArray,
    index: ReflectorIndex,
    found: FloatArray,
) -> int:
    """Poses of the frame of odometry that pairs of things suggest, those that fit most things; returns their number.

    Parameters
    ----------
    things : (C, 5) x, y [m] and covariance xx, xy, yy [m^2] in the frame of odometry.
    pairs : (P, 2) things to be looked up, the most telling first.
    distances, ends : see `DistanceTable`.
    index : the map.
    found : (CANDIDATES, 4) out: x, y, heading of the frame in the map [m, m, rad], and how well it fits.

    Notes
    -----
    The motion that lays a pair of things onto a pair of reflectors of that distance, middle onto middle, is judged by
    the sum of 1 - (d / reach)^2 over the other things: geometry, derived.
    """
    count, tried = 0, 0
    scored = min(len(things), MOST_SCORED)
    reach = np.empty(scored)
    places, survey = index.places, index.cells.largest_variance
    for pair in range(len(pairs)):
        i, j = pairs[pair, 0], pairs[pair, 1]
        dx, dy = things[j, 0] - things[i, 0], things[j, 1] - things[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        ux, uy = dx / length, dy / length
        xx, xy, yy = things[i, 2] + things[j, 2], things[i, 3] + things[j, 3], things[i, 4] + things[j, 4]
        along = xx * ux * ux + 2.0 * xy * ux * uy + yy * uy * uy + 2.0 * survey
        across = xx * uy * uy - 2.0 * xy * ux * uy + yy * ux * ux + 2.0 * survey
        middle_x, middle_y = 0.5 * (things[i, 0] + things[j, 0]), 0.5 * (things[i, 1] + things[j, 1])
        for k in range(scored):
            away2 = (things[k, 0] - middle_x) ** 2 + (things[k, 1] - middle_y) ** 2
            own = max(things[k, 2], things[k, 4]) + survey
            variance = own + 0.25 * max(along, across) + across * away2 / (length * length)
            reach[k] = min(3.0 * math.sqrt(variance), 1.0)
        half = 3.0 * math.sqrt(along)
        low = np.searchsorted(distances, length - half)
        high = np.searchsorted(distances, length + half)
        if tried + high - low > TRIED and tried > 0:
            continue
        tried += high - low
        heading = math.atan2(dy, dx)
        for entry in range(low, min(high, low + TRIED)):
            a, b = ends[entry, 0], ends[entry, 1]
            ax, ay, bx, by = places[a, 0], places[a, 1], places[b, 0], places[b, 1]
            turn = math.atan2(by - ay, bx - ax) - heading
            c, s = math.cos(turn), math.sin(turn)
            x = 0.5 * (ax + bx) - c * middle_x + s * middle_y
            y = 0.5 * (ay + by) - s * middle_x - c * middle_y
            least = found[count - 1, 3] if count == CANDIDATES else 1e-3
            fit = 0.0
            for k in range(scored):
                if fit + (scored - k) <= least:
                    break
                if k in (i, j):
                    fit += 1.0
                    continue
                px, py = x + c * things[k, 0] - s * things[k, 1], y + s * things[k, 0] + c * things[k, 1]
                best, square = nearest_entry(px, py, reach[k], index)
                if best >= 0:
                    fit += 1.0 - square / (reach[k] * reach[k])
            if fit > least:
                count = _keep(found, count, x, y, turn, fit, middle_x, middle_y)
    return count


@compiled
def _keep(  # noqa: PLR0917 - a pose, number by number
    found: FloatArray, count: int, x: float, y: float, turn: float, fit: float, at_x: float, at_y: float
) -> int:
    """Sort a candidate in among those found, the best first; one that is there already keeps the better fit."""
    c, s = math.cos(turn), math.sin(turn)
    px, py = x + c * at_x - s * at_y, y + s * at_x + c * at_y
    for i in range(count):
        if abs(wrap_scalar(found[i, 2] - turn)) > 0.5 * SAME_HEADING:
            continue
        ci, si = math.cos(found[i, 2]), math.sin(found[i, 2])
        qx, qy = found[i, 0] + ci * at_x - si * at_y, found[i, 1] + si * at_x + ci * at_y
        if (px - qx) ** 2 + (py - qy) ** 2 < 0.25 * SAME_PLACE * SAME_PLACE:
            if fit <= found[i, 3]:
                return count
            for j in range(i, count - 1):
                found[j] = found[j + 1]
            count -= 1
            break
    place = min(count, CANDIDATES - 1)
    while place > 0 and found[place - 1, 3] < fit:
        place -= 1
    last = min(count, CANDIDATES - 1)
    for j in range(last, place, -1):
        found[j] = found[j - 1]
    found[place, 0], found[place, 1], found[place, 2], found[place, 3] = x, y, turn, fit
    return min(count + 1, CANDIDATES)
