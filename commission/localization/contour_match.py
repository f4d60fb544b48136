"""Perfect Match: the pose at which the points of a scan lie best on the contours of a map (Sobreira et al. 2015).

Kernels over points and a table, from a pose to a pose with its second derivative. What the localizer makes of it is in
`contour`; nothing here knows odometry, a belief or a clock.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray
from commission.localization.contour_tables import ContourTables, read_distance

CLEAR = 4.0
"""Cells before a contour where its direction is read."""
REACH = 1.5
"""Starts are tried this many sigmas around."""
BETWEEN_STARTS = 0.4
"""Distance of starts that are tried [m]."""
BETWEEN_HEADINGS = 0.12
"""The same of headings [rad]."""
MOST_STARTS = 3
"""Starts to each side at most."""
FEW_POINTS = 180
"""Points that are enough to choose between starts."""
QUICK_ITERATIONS = 12
"""Iterations from each of them."""
WIDE, NARROW = 1.0, 0.1
"""L with which they are brought near, and with which they are compared [m]."""
BINS = 50
"""Bins of the histogram of errors."""
VALLEY = 0.1
"""Share of the highest bin below which a bin of the histogram belongs to no contour any more."""
NARROWEST = 3.0
"""Threshold at least, in 1-sigma of a beam."""
GROW, SHRINK = 1.2, 0.5
"""Factors of the step of RPROP (Riedmiller and Braun 1993)."""
FIRST_STEP = 0.02
"""First step of RPROP [m]."""
LARGEST_STEP = 0.5
"""Step of RPROP at most [m]."""
DAMPING = 1e-3
"""First damping of Gauss-Newton (Levenberg 1944), share of the mean of the diagonal."""


class MatchRule(NamedTuple):
    """How to match, for kernels."""

    by_rprop: bool
    """Else Gauss-Newton."""
    length: float
    """L of the cost [m]."""
    iterations: int
    """Largest number of them."""
    smallest_step: float
    """It stops when all steps are smaller [m]."""
    largest_error: float
    """What is farther from a contour is never matched [m]."""
    sigma: float
    """1-sigma of the distance of a beam's end from its contour [m]."""


PROBED = 4
"""Cells to both sides of a match in which a place that costs less is looked for: walls are seldom thicker."""
PROBES = 3
"""Of so many points one is enough for that."""


class Cost(NamedTuple):
    """Cost of a pose, its gradient, and half of its second derivative, which is symmetric; angles times the lever."""

    beams: float
    """Points that count."""
    total: float
    gx: float
    gy: float
    gt: float
    xx: float
    xy: float
    xt: float
    yy: float
    yt: float
    tt: float


class GridPose(NamedTuple):
    """A pose in cells of the table."""

    u: float
    v: float
    theta: float


@compiled_inline
def cost_of(  # noqa: PLR0917 - a pose and the points, number by number
    pose: GridPose,
    lever: float,
    points: FloatArray,
    tables: ContourTables,
    length: float,
    threshold: float,
    exact: bool,
) -> Cost:
    """Cost of a pose with its derivatives.

    Parameters
    ----------
    pose : where base is tried [cells, rad].
    lever : cells that a radian counts for.
    points : (n, 2) points of the scan [cells], base frame.
    tables : of the map.
    length : L [m].
    threshold : points with a larger error do not count [m].
    exact : whether the second derivative is that of E; else the one of Gauss-Newton, which is nowhere negative.

    Notes
    -----
    E = sum 1 - L^2 / (L^2 + min(d, A)^2): Sobreira et al. 2015, equation 1 with the threshold A of figure 8. E' = 2 L^2
    d / (L^2 + d^2)^2; E'' = 2 L^2 (L^2 - 3 d^2) / (L^2 + d^2)^3, or E' / d for Gauss-Newton; the second derivative of
    the distance itself is left out: it stands beside E', which is 0 on a contour.
    """
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    per_lever, l2 = 1.0 / lever, length * length
    beyond = 1.0 - l2 / (l2 + threshold * threshold)
    beams, total, gx, gy, gt = 0.0, 0.0, 0.0, 0.0, 0.0
    xx, xy, xt, yy, yt, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        ax, ay = c * px - s * py, s * px + c * py
        drawn, jx, jy = read_distance(tables.distances, pose.u + ax, pose.v + ay)
        d = drawn + tables.depth
        if not abs(d) <= threshold:
            total += beyond
            continue
        jt = (jy * ax - jx * ay) * per_lever
        share = l2 / (l2 + d * d)
        weight = 2.0 * share * share / l2
        slope = weight * d
        curve = weight * (4.0 * share - 3.0) if exact else weight
        beams += 1.0
        total += 1.0 - share
        gx += slope * jx
        gy += slope * jy
        gt += slope * jt
        xx += curve * jx * jx
        xy += curve * jx * jy
        xt += curve * jx * jt
        yy += curve * jy * jy
        yt += curve * jy * jt
        tt += curve * jt * jt
    return Cost(beams, total, gx, gy, gt, xx, xy, xt, yy, yt, tt)


@compiled
def information_of(  # noqa: PLR0917 - a pose and the points, number by number
    pose: GridPose, lever: float, points: FloatArray, tables: ContourTables, length: float, threshold: float
) -> Cost:
    """Cost of a pose, with the second derivative by directions of contours that the steps of cells do not show in.

    Parameters
    ----------
    pose, lever, points, tables, length, threshold : as in `cost_of`.

    Notes
    -----
    d^2 E / dX^2 = sum E'' n n^T, E'' as in `cost_of`, n the distance's gradient `CLEAR` cells before the end of the
    beam (derived): beside a slanting wall the nearest cell is now on one side, now on the other, which would say
    something of the place along it.
    """
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    per_lever, l2 = 1.0 / lever, length * length
    beams, total = 0.0, 0.0
    xx, xy, xt, yy, yt, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        ax, ay = c * px - s * py, s * px + c * py
        d = read_distance(tables.distances, pose.u + ax, pose.v + ay).distance + tables.depth
        if not abs(d) <= threshold:
            continue
        short = max(1.0 - CLEAR / max(math.sqrt(px * px + py * py), 1e-9), 0.0)
        _, jx, jy = read_distance(tables.distances, pose.u + short * ax, pose.v + short * ay)
        jt = (jy * ax - jx * ay) * per_lever
        share = l2 / (l2 + d * d)
        curve = 2.0 * share * share / l2 * (4.0 * share - 3.0)
        beams += 1.0
        total += 1.0 - share
        xx += curve * jx * jx
        xy += curve * jx * jy
        xt += curve * jx * jt
        yy += curve * jy * jy
        yt += curve * jy * jt
        tt += curve * jt * jt
    return Cost(beams, total, 0.0, 0.0, 0.0, xx, xy, xt, yy, yt, tt)


class Spread(NamedTuple):
    """How far the truth may be from a start: 1-sigma."""

    x: float
    """[cells]"""
    y: float
    heading: float
    """[rad]"""


class Match(NamedTuple):
    """Where a scan matches best."""

    pose: GridPose
    threshold: float
    """Points with a larger error are not matched [m]."""
    iterations: int


@compiled
def match(start: GridPose, lever: float, points: FloatArray, tables: ContourTables, rule: MatchRule) -> Match:
    """Match the points of a scan: first all of them, then those that the histogram of errors leaves.

    Parameters
    ----------
    start : where base is thought to be [cells, rad].
    lever : cells that a radian counts for.
    points : (n, 2) points of the scan [cells], base frame.
    tables : of the map.
    rule : how.

    Notes
    -----
    No formula: `minimized` with all points, `histogram_threshold` there, `minimized` with what it leaves; both are
    Sobreira et al. 2015, section 3. Then, where `beside` finds a place that costs less, again from there.
    """
    pose, used = minimized(start, lever, points, tables, rule, math.inf)
    threshold = histogram_threshold(pose, points, tables, rule)
    pose, again = minimized(pose, lever, points, tables, rule, threshold)
    used += again
    other = beside(pose, lever, points, tables, rule, threshold)
    if other.u != pose.u or other.v != pose.v:
        pose, again = minimized(other, lever, points, tables, rule, threshold)
        used += again
    return Match(pose, histogram_threshold(pose, points, tables, rule), used)


@compiled
def beside(  # noqa: PLR0917 - a pose and the points
    pose: GridPose, lever: float, points: FloatArray, tables: ContourTables, rule: MatchRule, threshold: float
) -> GridPose:
    """Return the least costly of the places some cells beside a pose, the pose itself where that costs least.

    Parameters
    ----------
    pose, lever, points, tables, rule, threshold : as in `minimized`.

    Notes
    -----
    tried = pose + k e, k from -`PROBED` to `PROBED` cells, e the direction that the second derivative of the cost says
    least of (derived). A wall has two faces: where few beams tell a direction, and a heading that was off has carried
    their ends through a thin wall, its far face holds the pose, as sure of itself as the right one.
    """
    few = points[::PROBES]
    at = cost_of(pose, lever, few, tables, rule.length, threshold, False)
    # The eigenvector of the smaller eigenvalue of ((xx, xy), (xy, yy)).
    angle = 0.5 * math.atan2(2.0 * at.xy, at.xx - at.yy) + 0.5 * math.pi
    c, s = math.cos(angle), math.sin(angle)
    best, least = pose, facing_cost(pose, few, tables, rule.length, threshold)
    for k in range(1, PROBED + 1):
        for sign in (-1.0, 1.0):
            tried = GridPose(pose.u + sign * k * c, pose.v + sign * k * s, pose.theta)
            cost = facing_cost(tried, few, tables, rule.length, threshold)
            if cost < least:
                best, least = tried, cost
    return best


@compiled_inline
def facing_cost(pose: GridPose, points: FloatArray, tables: ContourTables, length: float, threshold: float) -> float:
    """Cost of a pose in which a beam that has come through a wall matches nothing.

    Parameters
    ----------
    pose, points, tables, length, threshold : as in `cost_of`.

    Notes
    -----
    E of `cost_of`, d = infinity where d(end) > d(end - 1 cell) along the beam (derived): before the face that stops a
    beam the distance falls, behind the middle of the wall it rises.
    """
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    l2, total = length * length, 0.0
    beyond = 1.0 - l2 / (l2 + threshold * threshold)
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        ax, ay = c * px - s * py, s * px + c * py
        d = read_distance(tables.distances, pose.u + ax, pose.v + ay).distance + tables.depth
        if not abs(d) <= threshold:
            total += beyond
            continue
        short = max(1.0 - 1.0 / max(math.sqrt(px * px + py * py), 1.0), 0.0)
        before = read_distance(tables.distances, pose.u + short * ax, pose.v + short * ay).distance + tables.depth
        comes_through = before < d
        total += beyond if comes_through else 1.0 - l2 / (l2 + d * d)
    return total


@compiled_inline
def minimized(  # noqa: PLR0917 - a start and the points
    start: GridPose, lever: float, points: FloatArray, tables: ContourTables, rule: MatchRule, threshold: float
) -> tuple[GridPose, int]:
    """Minimize the cost from a start; return the pose, and the number of iterations.

    Parameters
    ----------
    start, lever, points, tables, rule : as in `match`.
    threshold : points with a larger error do not count [m].

    Notes
    -----
    No formula: `by_rprop` or `by_gauss_newton`.
    """
    if rule.by_rprop:
        return by_rprop(start, lever, points, tables, rule, threshold)
    return by_gauss_newton(start, lever, points, tables, rule, threshold)


@compiled
def best_start(  # noqa: PLR0917 - a start and the points
    start: GridPose, spread: Spread, lever: float, points: FloatArray, tables: ContourTables, rule: MatchRule
) -> GridPose:
    """Where to match from: of a lattice over what is likely, what a few steps with a few points bring to least cost.

    Parameters
    ----------
    start : where base is thought to be [cells, rad].
    spread : how far it may be from there; where it is narrow, the start is all there is.
    lever, points, tables, rule : as in `match`.

    Notes
    -----
    start = mean + 1.5 sigma i / n for i from -n to n, n so that they lie 0.4 m and 7 degrees apart: half of how far one
    start was seen to converge from (derived).
    """
    per_cell = 1.0 / tables.resolution
    across = _half_count(spread.x, BETWEEN_STARTS * per_cell)
    along = _half_count(spread.y, BETWEEN_STARTS * per_cell)
    turns = _half_count(spread.heading, BETWEEN_HEADINGS)
    if across + along + turns == 0:
        return start
    few = points[:: max(1, len(points) // FEW_POINTS)]
    quick = MatchRule(
        False, max(rule.length, WIDE), QUICK_ITERATIONS, rule.smallest_step, rule.largest_error, rule.sigma
    )
    best, least = start, math.inf
    for i in range(-across, across + 1):
        for j in range(-along, along + 1):
            for k in range(-turns, turns + 1):
                tried = GridPose(
                    start.u + REACH * spread.x * i / max(across, 1),
                    start.v + REACH * spread.y * j / max(along, 1),
                    start.theta + REACH * spread.heading * k / max(turns, 1),
                )
                found, _ = by_gauss_newton(tried, lever, few, tables, quick, math.inf)
                cost = cost_of(found, lever, few, tables, NARROW, math.inf, False).total
                if cost < least:
                    best, least = found, cost
    return best


@compiled_inline
def _half_count(sigma: float, between: float) -> int:
    """Starts to each side."""
    return min(math.floor(REACH * sigma / between + 0.5), MOST_STARTS)


@compiled
def by_rprop(  # noqa: PLR0917 - a start and the points
    start: GridPose, lever: float, points: FloatArray, tables: ContourTables, rule: MatchRule, threshold: float
) -> tuple[GridPose, int]:
    """Minimize by resilient backpropagation: each coordinate has a step of its own, and the gradient gives its sign.

    Parameters
    ----------
    start, lever, points, tables, rule, threshold : as in `minimized`.

    Notes
    -----
    x = x - step sign(gradient); step grows by 1.2 while the sign stays, and halves where it turns, without a move then:
    Riedmiller and Braun 1993. It ends when all steps are below the smallest: the stop criterion of Sobreira et al.
    2015, section 3.
    """
    per_cell = 1.0 / tables.resolution
    smallest, largest = rule.smallest_step * per_cell, LARGEST_STEP * per_cell
    u, v, turn = start.u, start.v, 0.0
    step_u = step_v = step_t = FIRST_STEP * per_cell
    before_u, before_v, before_t = 0.0, 0.0, 0.0
    for i in range(rule.iterations):
        pose = GridPose(u, v, start.theta + turn / lever)
        at = cost_of(pose, lever, points, tables, rule.length, threshold, False)
        move_u, step_u, before_u = _resilient(at.gx, before_u, step_u, largest)
        move_v, step_v, before_v = _resilient(at.gy, before_v, step_v, largest)
        move_t, step_t, before_t = _resilient(at.gt, before_t, step_t, largest)
        u, v, turn = u + move_u, v + move_v, turn + move_t
        if max(step_u, step_v, step_t) < smallest:
            return GridPose(u, v, start.theta + turn / lever), i + 1
    return GridPose(u, v, start.theta + turn / lever), rule.iterations


@compiled_inline
def _resilient(gradient: float, before: float, step: float, largest: float) -> tuple[float, float, float]:
    """Move, next step, and the gradient to remember, of one coordinate."""
    if gradient * before > 0.0:
        step = min(step * GROW, largest)
    elif gradient * before < 0.0:
        return 0.0, step * SHRINK, 0.0
    elif gradient == 0.0:
        return 0.0, step * SHRINK, 0.0
    return -math.copysign(step, gradient), step, gradient


@compiled
def by_gauss_newton(  # noqa: PLR0917 - a start and the points
    start: GridPose, lever: float, points: FloatArray, tables: ContourTables, rule: MatchRule, threshold: float
) -> tuple[GridPose, int]:
    """Minimize by damped Gauss-Newton steps, with the weights of the cost.

    Parameters
    ----------
    start, lever, points, tables, rule, threshold : as in `minimized`.

    Notes
    -----
    (J^T W J + damping) step = -J^T W d with W = E' / d: iteratively reweighted least squares (Holland and Welsch 1977),
    damped (Levenberg 1944). A direction that no point constrains is not moved along. It ends by the same criterion as
    RPROP.
    """
    smallest = rule.smallest_step / tables.resolution
    pose, damping = start, DAMPING
    at = cost_of(pose, lever, points, tables, rule.length, threshold, False)
    for i in range(rule.iterations):
        damp = damping * (at.xx + at.yy + at.tt) / 3.0 + 1e-12
        du, dv, dt = _solved(at, damp)
        tried = GridPose(pose.u + du, pose.v + dv, pose.theta + dt / lever)
        there = cost_of(tried, lever, points, tables, rule.length, threshold, False)
        step = max(abs(du), abs(dv), abs(dt))
        if there.total <= at.total:
            pose, at, damping = tried, there, damping * 0.3
        else:
            damping = min(max(damping * 10.0, 1e-3), 1e6)
        if step < smallest:
            return pose, i + 1
    return pose, rule.iterations


@compiled_inline
def _solved(at: Cost, damp: float) -> tuple[float, float, float]:
    """Step of Gauss-Newton [cells]: Cholesky of the damped second derivative."""
    a = math.sqrt(at.xx + damp)
    b, c = at.xy / a, at.xt / a
    d = math.sqrt(max(at.yy + damp - b * b, damp))
    e = (at.yt - b * c) / d
    f = math.sqrt(max(at.tt + damp - c * c - e * e, damp))
    p = -at.gx / a
    q = (-at.gy - b * p) / d
    r = (-at.gt - c * p - e * q) / f
    z = r / f
    y = (q - e * z) / d
    return (p - b * y - c * z) / a, y, z


@compiled_inline
def histogram_threshold(pose: GridPose, points: FloatArray, tables: ContourTables, rule: MatchRule) -> float:
    """Error up to which points belong to contours of the map [m].

    Parameters
    ----------
    pose : of base [cells, rad].
    points : (n, 2) points of the scan [cells], base frame.
    tables : of the map.
    rule : largest error that is one of a contour, and 1-sigma of a beam.

    Notes
    -----
    A = edge of the first bin beyond the highest whose count < 0.1 highest: a histogram of errors as in Sobreira et al.
    2015, section 3, which leaves open how the threshold is taken from it.
    """
    counts = np.zeros(BINS)
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    per_bin = BINS / rule.largest_error
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        drawn = read_distance(tables.distances, pose.u + c * px - s * py, pose.v + s * px + c * py).distance
        d = abs(drawn + tables.depth)
        if d < rule.largest_error:
            counts[int(d * per_bin)] += 1.0
    highest = 0
    for i in range(1, BINS):
        if counts[i] > counts[highest]:
            highest = i
    valley = BINS
    for i in range(BINS - 1, highest, -1):
        if counts[i] < VALLEY * counts[highest]:
            valley = i
    return max(valley / per_bin, min(NARROWEST * rule.sigma, rule.largest_error))
