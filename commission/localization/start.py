"""Global localization: things that were seen, matched to a part of the reflector map, whatever the vehicle is told.

Pairs of things are looked up in the sorted table of all pairs of reflectors; what they suggest is judged by all things,
and by the reflectors that should be seen from there and are not. A hypothesis is where the frame of odometry lies in
the map, so that it goes with the vehicle. Which one is believed, and when, is `relocalization`'s business.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.ray_kernels import RayTables
from commission.localization.missed import is_taken, missed_reflectors
from commission.localization.reflector_index import Cells, cell_range

CANDIDATES = 96
"""Poses that pairs suggest and that are judged: those that most things fit."""
HYPOTHESES = 24
"""Hypotheses that are carried on."""
TRIED = 24_000
"""Pairs of reflectors that are tried at most: 20 ms of work."""
PAIRS = 24
"""Pairs of things that are looked up at most."""
MOST_SCORED = 24
"""Things by which a candidate is chosen, those seen most often; the likelihood is of all."""
GATE = 11.8
"""Squared distance up to which a thing is a reflector: 99.7 % of chi-square with 2 degrees of freedom."""
SEEN = 0.8
"""Probability that a reflector in free sight is detected again and again: people stand before some, some are down."""
FIT_STEPS = 4
"""Steps of Gauss and Newton; the first associates widely, the last decides."""
SAME_PLACE = 0.4
"""Poses nearer than that [m], with headings nearer than `SAME_HEADING`, are one hypothesis."""
SAME_HEADING = 0.15
"""[rad]"""
MARGIN = 5.0
"""The vehicle may be that far outside of the rectangle around all reflectors [m]."""
ROW = 12
"""Numbers of a hypothesis: x, y, heading of the frame of odometry in the map, its covariance (xx, xy, xt, yy, yt, tt),
log of the evidence, things that fit a reflector, and in how many scans in a row it was the only one left."""


class Prior(NamedTuple):
    """What is known before anything is seen: the floor evenly, half of the belief around a pose where one is known."""

    log_even: float
    """Log of the density of a pose anywhere [1 / (m^2 rad)]."""
    known: bool
    """Whether there is a last good pose."""
    x: float
    y: float
    theta: float
    position_variance: float
    heading_variance: float


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


@compiled_inline
def nearest_entry(  # noqa: PLR0917 - a place and the map, array by array
    x: float, y: float, reach: float, cells: Cells, places: FloatArray, cell_offsets: IntArray
) -> tuple[int, float]:
    """Row of the nearest reflector within reach, and its squared distance [m^2]; -1 where there is none.

    Parameters
    ----------
    x, y : the place [m], map frame.
    reach : radius of the search [m].
    cells, places, cell_offsets : the map, see `ReflectorIndex`.

    Notes
    -----
    entry = argmin |place - reflector|, by definition.
    """
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


@compiled
def candidates(  # noqa: PLR0917 - things and the map, array by array
    things: FloatArray,
    pairs: IntArray,
    distances: FloatArray,
    ends: IntArray,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    found: FloatArray,
) -> int:
    """Poses of the frame of odometry that pairs of things suggest, those that fit most things; returns their number.

    Parameters
    ----------
    things : (C, 5) x, y [m] and covariance xx, xy, yy [m^2] in the frame of odometry.
    pairs : (P, 2) things to be looked up, the most telling first.
    distances, ends : see `DistanceTable`.
    cells, places, cell_offsets : the map, see `ReflectorIndex`.
    found : (CANDIDATES, 4) out: x, y, heading of the frame in the map [m, m, rad], and how well it fits.

    Notes
    -----
    The motion that lays a pair of things onto a pair of reflectors of that distance, middle onto middle, is judged by
    the sum of 1 - (d / reach)^2 over the other things: geometry, derived.
    """
    count, tried = 0, 0
    scored = min(len(things), MOST_SCORED)
    reach = np.empty(scored)
    survey = cells.largest_variance
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
                best, square = nearest_entry(px, py, reach[k], cells, places, cell_offsets)
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


@compiled_inline
def _inverse3(  # noqa: PLR0917 - a matrix, number by number
    a: float, b: float, c: float, d: float, e: float, f: float
) -> tuple[float, float, float, float, float, float, float]:
    """Inverse (upper triangle) and determinant of [[a, b, c], [b, d, e], [c, e, f]].

    Notes
    -----
    Cofactors over determinant, by definition.
    """
    xx, xy, xt = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * xx + b * xy + c * xt
    scale = 1.0 / det
    return (
        xx * scale,
        xy * scale,
        xt * scale,
        (a * f - c * c) * scale,
        (b * c - a * e) * scale,
        (a * d - b * b) * scale,
        det,
    )


@compiled
def judge(  # noqa: PLR0917 - things, views and the map, array by array
    poses: FloatArray,
    things: FloatArray,
    base_x: float,
    base_y: float,
    clutter: float,
    prior: Prior,
    views: FloatArray,
    eyes: FloatArray,
    walls: RayTables,
    walled: bool,
    facings: FloatArray,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    judged: FloatArray,
) -> None:
    """Fit each pose to all things by least squares, and weigh the evidence for it.

    Parameters
    ----------
    poses : (H, 3) frame of odometry in the map [m, m, rad].
    things : (C, 5) x, y [m] and covariance xx, xy, yy [m^2] in the frame of odometry.
    base_x, base_y : where the vehicle is now in that frame [m]: poses are fitted about that place.
    clutter : density of things that are no reflectors [1 / m^2].
    prior : density of poses.
    views : (V, 5) scanners in the frame of odometry [m, m, rad], index of the scanner, weight of the view.
    eyes : (E, 5) scanner, first bearing and width of a stretch of its field of view [rad], smallest and largest range
        of a reflector [m].
    walls, walled : what hides reflectors, and whether there is a floor map at all.
    facings : (N,) direction that a flat reflector faces [rad]; NaN: seen from all sides.
    cells, places, cell_offsets : the map, see `ReflectorIndex`.
    judged : (H, ROW) out; the covariance is of the vehicle's pose.

    Notes
    -----
    log evidence = sum of log(SEEN N(d; S) / clutter) over things that fit, + sum of log(1 - SEEN) over reflectors that
    should be seen and fit no thing, + log((2 pi)^(3/2) det(P)^(1/2) prior): Laplace's approximation of the
    probability of the things, over that of the same number of things at random places; derived.
    """
    taken = np.empty(len(things), dtype=np.int64)
    for h in range(len(poses)):
        x, y, t = poses[h, 0], poses[h, 1], poses[h, 2]
        fit = _fit_step(x, y, t, things, base_x, base_y, clutter, 4.0, cells, places, cell_offsets, taken)
        for step in range(1, FIT_STEPS):
            if fit.fits < 2:
                break
            x, y, t = _moved(x, y, t, fit, base_x, base_y)
            widen = 4.0 if step < 2 else 1.0
            fit = _fit_step(x, y, t, things, base_x, base_y, clutter, widen, cells, places, cell_offsets, taken)
        judged[h, 0], judged[h, 1], judged[h, 2] = x, y, wrap_scalar(t)
        judged[h, 9], judged[h, 10], judged[h, 11] = -math.inf, fit.fits, 0.0
        xx, xy, xt, yy, yt, tt, det = _inverse3(fit.xx, fit.xy, fit.xt, fit.yy, fit.yt, fit.tt)
        if fit.fits < 2 or not det > 0.0:
            continue
        judged[h, 3], judged[h, 4], judged[h, 5] = xx, xy, xt
        judged[h, 6], judged[h, 7], judged[h, 8] = yy, yt, tt
        c, s = math.cos(t), math.sin(t)
        density = _density(prior, x + c * base_x - s * base_y, y + s * base_x + c * base_y, t)
        evidence = fit.evidence + 1.5 * math.log(2.0 * math.pi) - 0.5 * math.log(det) + math.log(density)
        missed = missed_reflectors(x, y, t, taken, views, eyes, walls, walled, facings, places)
        judged[h, 9] = evidence + missed * math.log(1.0 - SEEN)


class Fit(NamedTuple):
    """Things that fit a pose, and the normal equations of its correction about the vehicle's place."""

    fits: int
    evidence: float
    xx: float
    xy: float
    xt: float
    yy: float
    yt: float
    tt: float
    gx: float
    gy: float
    gt: float


@compiled_inline
def _moved(x: float, y: float, t: float, fit: Fit, base_x: float, base_y: float) -> tuple[float, float, float]:  # noqa: PLR0917
    """Pose of the frame after a step: the vehicle's place moves, and about it the frame turns.

    Notes
    -----
    delta = (J^T W J)^-1 J^T W d: Gauss and Newton.
    """
    xx, xy, xt, yy, yt, tt, _ = _inverse3(fit.xx, fit.xy, fit.xt, fit.yy, fit.yt, fit.tt)
    c, s = math.cos(t), math.sin(t)
    at_x = x + c * base_x - s * base_y + xx * fit.gx + xy * fit.gy + xt * fit.gt
    at_y = y + s * base_x + c * base_y + xy * fit.gx + yy * fit.gy + yt * fit.gt
    t += xt * fit.gx + yt * fit.gy + tt * fit.gt
    c, s = math.cos(t), math.sin(t)
    return at_x - (c * base_x - s * base_y), at_y - (s * base_x + c * base_y), t


@compiled
def _fit_step(  # noqa: PLR0917 - things and the map, array by array
    x: float,
    y: float,
    t: float,
    things: FloatArray,
    base_x: float,
    base_y: float,
    clutter: float,
    widen: float,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    taken: IntArray,
) -> Fit:
    """Associate all things at a pose, and sum up what they say of it; a gate `widen` times as large takes any."""
    c, s = math.cos(t), math.sin(t)
    a, b, e, f, g, k = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    gx, gy, gt = 0.0, 0.0, 0.0
    fits, evidence = 0, 0.0
    for i in range(len(things)):
        taken[i] = -1
        px, py = c * things[i, 0] - s * things[i, 1], s * things[i, 0] + c * things[i, 1]
        sxx = c * c * things[i, 2] - 2.0 * c * s * things[i, 3] + s * s * things[i, 4]
        sxy = c * s * (things[i, 2] - things[i, 4]) + (c * c - s * s) * things[i, 3]
        syy = s * s * things[i, 2] + 2.0 * c * s * things[i, 3] + c * c * things[i, 4]
        reach = math.sqrt(widen * GATE * (max(sxx, syy) + abs(sxy) + cells.largest_variance))
        best, _ = nearest_entry(x + px, y + py, min(reach, 1.5), cells, places, cell_offsets)
        # Two things are not one reflector: the one that was seen more often comes first.
        if best < 0 or is_taken(best, taken, i):
            continue
        sxx += places[best, 2]
        syy += places[best, 2]
        area = sxx * syy - sxy * sxy
        dx, dy = places[best, 0] - x - px, places[best, 1] - y - py
        d2 = (syy * dx * dx - 2.0 * sxy * dx * dy + sxx * dy * dy) / area
        gain = math.log(SEEN / (clutter * 2.0 * math.pi * math.sqrt(area))) - 0.5 * d2
        if d2 > widen * GATE or (widen == 1.0 and gain <= 0.0):
            continue
        taken[i] = best
        fits += 1
        evidence += gain
        # W = S^-1, J = [[1, 0, -(py - by)], [0, 1, px - bx]] about the vehicle.
        wxx, wxy, wyy = syy / area, -sxy / area, sxx / area
        jx, jy = (s * base_x + c * base_y) - py, px - (c * base_x - s * base_y)
        tx, ty = wxx * jx + wxy * jy, wxy * jx + wyy * jy
        a, b, e = a + wxx, b + wxy, e + tx
        f, g, k = f + wyy, g + ty, k + jx * tx + jy * ty
        gx, gy, gt = gx + wxx * dx + wxy * dy, gy + wxy * dx + wyy * dy, gt + tx * dx + ty * dy
    return Fit(fits, evidence, a, b, e, f, g, k, gx, gy, gt)


@compiled_inline
def _density(prior: Prior, x: float, y: float, t: float) -> float:
    """Density of a pose of the vehicle before anything is seen [1 / (m^2 rad)]; half of it even, half around a pose.

    Notes
    -----
    0.5 U + 0.5 N, a mixture; derived.
    """
    density = math.exp(prior.log_even)
    if prior.known:
        away2 = ((x - prior.x) ** 2 + (y - prior.y) ** 2) / prior.position_variance
        away2 += wrap_scalar(t - prior.theta) ** 2 / prior.heading_variance
        norm = (2.0 * math.pi) ** 1.5 * prior.position_variance * math.sqrt(prior.heading_variance)
        density = 0.5 * density + 0.5 * math.exp(-0.5 * away2) / norm
    return density
