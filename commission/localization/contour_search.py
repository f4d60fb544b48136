"""Where in the whole hall a scan lies on the contours of the map: the best places, each once.

Poses on a lattice over the free floor are scored by few points of the scan, with a cost so wide that it leads from one
to the next; those that come out best are matched from there, as any scan is. It knows no belief and no clock.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.contour_match import (
    NARROW,
    QUICK_ITERATIONS,
    WIDE,
    GridPose,
    MatchRule,
    by_gauss_newton,
    cost_of,
)
from commission.localization.contour_sight import share_through_walls
from commission.localization.contour_tables import ContourTables, ItsOwnKey, contour_tables
from commission.site.floor_map import FloorMap

FINE_M = 0.1
"""Cells in which scores are read [m]."""
BETWEEN_PLACES = 0.4
"""Places of the lattice are that far apart [m]: half of how far a match was seen to converge from."""
BETWEEN_TURNS = 0.12
"""The same of headings [rad]."""
CLEARANCE = 0.15
"""Base is that far from any contour at least [m]."""
SEARCH_LENGTH = 0.5
"""L of the score [m]."""
FULL_SCORE = 200
"""Score of a point that lies on a contour."""
BETWEEN_POINTS = 0.15
"""Points of a scan that are nearer to the one before are left out [m]: else what is near counts for everything."""
MOST_POINTS = 60
"""Points by which a place of the lattice is scored."""
LOOKED_AT = 90
"""Points by which those that score best are looked at."""
CHOSEN = 600
"""Places of the lattice that are."""


class ScanPoints(NamedTuple):
    """Points of a scan in cells of the tables, for kernels."""

    points: FloatArray
    """(n, 2) base frame."""
    lever: float
    """Cells that a radian counts for."""
    x: float
    """Where the scanner is, base frame."""
    y: float

    def thinned(self, most: int) -> ScanPoints:
        """Return every k-th of them, so that there are about so many.

        Parameters
        ----------
        most : of them; less than twice as many stay.
        """
        return self._replace(points=read_only(np.ascontiguousarray(self.points[:: max(1, len(self.points) // most)])))


class ScoredFloor(NamedTuple):
    """Scores of contours, and the lattice of places, for kernels."""

    scores: NDArray[np.uint8]
    """(H, W) what a point in a cell counts."""
    per_cell: int
    """Cells of the table along one of them."""
    cell: float
    """Edge of a cell [m]."""
    places: IntArray
    """(P, 2) row and column of each place of the lattice."""


def scored_floor(floor: FloorMap) -> ScoredFloor:
    """Return the scores of a map, and where base can be in it: computed once for each map.

    Parameters
    ----------
    floor : its occupied cells are contours.

    Notes
    -----
    score = L^2 / (L^2 + d^2) of the nearest cell: 1 - E of Sobreira et al. 2015, equation 1.
    """
    return _scored(ItsOwnKey(floor))


@functools.lru_cache(maxsize=2)
def _scored(key: ItsOwnKey) -> ScoredFloor:
    tables = contour_tables(key.floor)
    per_cell = max(1, round(FINE_M / tables.resolution))
    rows, columns = tables.distances.shape
    high, wide = -(-rows // per_cell), -(-columns // per_cell)
    away = np.full((high * per_cell, wide * per_cell), np.inf, dtype=np.float32)
    away[:rows, :columns] = tables.distances
    blocks = away.reshape(high, per_cell, wide, per_cell)
    nearest = np.abs(blocks).min(axis=(1, 3))
    scores = np.floor(FULL_SCORE * SEARCH_LENGTH**2 / (SEARCH_LENGTH**2 + nearest.astype(np.float64) ** 2))
    cell = per_cell * tables.resolution
    every = max(1, round(BETWEEN_PLACES / cell))
    places = np.argwhere((blocks.min(axis=(1, 3)) > CLEARANCE)[every // 2 :: every, every // 2 :: every])
    scores = scores.astype(np.uint8)
    return ScoredFloor(read_only(scores), per_cell, cell, read_only(places * every + every // 2))


@compiled
def thinned(points: FloatArray, between: float, most: int) -> FloatArray:
    """Points of a scan, evenly along what it sees.

    Parameters
    ----------
    points : (n, 2) in any unit, in the order of the beams.
    between : distance from one to the next at least, in the same unit.
    most : points at most.

    Notes
    -----
    No formula: a point nearer to the last one kept is left out; of what is left, every k-th.
    """
    kept, count, last = np.empty(len(points), dtype=np.int64), 0, -1
    for i in range(len(points)):
        if last >= 0 and math.hypot(points[i, 0] - points[last, 0], points[i, 1] - points[last, 1]) < between:
            continue
        kept[count] = last = i
        count += 1
    number = min(count, most)
    chosen = np.empty((number, 2))
    for k in range(number):
        i = kept[k * count // number]
        chosen[k, 0], chosen[k, 1] = points[i, 0], points[i, 1]
    return chosen


@compiled
def promising(points: FloatArray, floor: ScoredFloor, turns: int, scores: IntArray, headings: FloatArray) -> None:
    """Write the best heading at each place of the lattice, and its score.

    Parameters
    ----------
    points : (n, 2) points of a scan in cells of the scores, base frame, see `thinned`.
    floor : scores and places.
    turns : headings that are tried.
    scores : (P,) out: sum of the scores of the points.
    headings : (P,) out [rad].

    Notes
    -----
    max over headings of sum score(place + R p), by definition.
    """
    count, farthest = len(points), 0.0
    for i in range(count):
        farthest = max(farthest, math.hypot(points[i, 0], points[i, 1]))
    # With room around it for the longest beam, no point lies outside of the table: a place in it is one number, and
    # never a negative one, which would be counted from its end.
    beside = math.ceil(farthest) + 1
    rows, columns = floor.scores.shape
    width = columns + 2 * beside
    padded = np.zeros((rows + 2 * beside) * width, dtype=np.uint8)
    for row in range(rows):
        first = (row + beside) * width + beside
        padded[first : first + columns] = floor.scores[row]
    ends = np.empty((turns, count), dtype=np.int64)
    for t in range(turns):
        c, s = math.cos(t * 2.0 * math.pi / turns), math.sin(t * 2.0 * math.pi / turns)
        for i in range(count):
            down = math.floor(s * points[i, 0] + c * points[i, 1] + 0.5)
            ends[t, i] = down * width + math.floor(c * points[i, 0] - s * points[i, 1] + 0.5)
    for place in range(len(floor.places)):
        at = (floor.places[place, 0] + beside) * width + floor.places[place, 1] + beside
        best, best_turn = -1, 0
        for t in range(turns):
            total = 0
            for i in range(count):
                total += padded[np.uintp(at + ends[t, i])]
            if total > best:
                best, best_turn = total, t
        scores[place], headings[place] = best, best_turn * 2.0 * math.pi / turns


@compiled
def looked_at(starts: FloatArray, scan: ScanPoints, tables: ContourTables, rule: MatchRule, found: FloatArray) -> None:
    """Match from each start with few steps, and say how badly points lie there.

    Parameters
    ----------
    starts : (n, 3) u, v [cells], heading [rad].
    scan : its points.
    tables, rule : as in `match`.
    found : (n, 4) out: u, v, heading, and what it costs.

    Notes
    -----
    cost = E / n + T, E of `cost_of` with `NARROW`, T the share of the beams that would have gone through a wall
    (derived): elsewhere in a building as many points lie on walls by chance, but seldom on those that are seen first.
    """
    quick = MatchRule(False, WIDE, QUICK_ITERATIONS, rule.smallest_step, rule.largest_error, rule.sigma)
    for k in range(len(starts)):
        start = GridPose(starts[k, 0], starts[k, 1], starts[k, 2])
        pose, _ = by_gauss_newton(start, scan.lever, scan.points, tables, quick, math.inf)
        cost = cost_of(pose, scan.lever, scan.points, tables, NARROW, math.inf, False).total / len(scan.points)
        found[k, 0], found[k, 1], found[k, 2] = pose.u, pose.v, pose.theta
        found[k, 3] = cost + share_through_walls(pose, scan.points, scan.x, scan.y, tables)


def places_of(scan: ScanPoints, tables: ContourTables, floor: ScoredFloor, rule: MatchRule) -> FloatArray:
    """Return where in the whole hall a scan matches, the best first, some of them more than once.

    Parameters
    ----------
    scan : its points.
    tables, floor : of the map.
    rule : how to match.

    Returns
    -------
    places : (P, 4) u, v [cells], heading [rad], and what it costs.
    """
    few = thinned(scan.points / floor.per_cell, BETWEEN_POINTS / floor.cell, MOST_POINTS)
    scores, headings = np.empty(len(floor.places), dtype=np.int64), np.empty(len(floor.places))
    promising(read_only(few), floor, math.ceil(2.0 * math.pi / BETWEEN_TURNS), scores, headings)
    best = np.argsort(-scores, kind="stable")[:CHOSEN]
    # Whole numbers are the centers of cells.
    at = (floor.places[best, ::-1] + 0.5) * floor.per_cell - 0.5
    found = np.empty((len(best), 4))
    starts = read_only(np.column_stack((at, headings[best])).astype(np.float64))
    looked_at(starts, scan.thinned(LOOKED_AT), tables, rule, found)
    return found[np.argsort(found[:, 3], kind="stable")]
