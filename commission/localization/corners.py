"""Convex corners in a scan: of pillars, pallets, boxes. Two lines through a segment that is cut where it bends most.

Andreasson et al. 2011, section 3.3.2. What is no reel is tried as a corner.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.localization.reels import NO_SIGHTING, Sighting

FEWEST_OF_A_SIDE = 4
"""Points of each of the two lines: of fewer, their residual says nothing."""


class CornerRule(NamedTuple):
    """What a segment must be like to be a corner (Andreasson et al. 2011, section 3.3.2)."""

    enabled: bool
    least_side: float
    largest_side: float
    """Length of each side [m]."""
    largest_residual: float
    """Root of the mean square of the distances of points from their line [m]."""
    tolerance: float
    """How far the angle between the lines may be off 90 degrees [rad]."""
    sigma: float
    """1-sigma noise of a point across its line [m]; what the points show counts where it is more."""


class FittedLine(NamedTuple):
    """A line through points by least squares: where their middle is, its direction, and how well it is known."""

    x: float
    y: float
    along_x: float
    along_y: float
    residual: float
    """Root of the mean square of the distances [m]."""
    spread: float
    """Sum of the squares along the line [m^2]."""
    points: int


@compiled
def line_through(points: FloatArray) -> FittedLine:
    """Fit a line to points: least squares of the distances across it.

    Parameters
    ----------
    points : (n, 2) [m].

    Notes
    -----
    Direction of the larger eigenvalue of the scatter, 0.5 atan2(2 xy, xx - yy): Pearson 1901.
    """
    n = len(points)
    mx, my = 0.0, 0.0
    for i in range(n):
        mx += points[i, 0]
        my += points[i, 1]
    mx, my = mx / n, my / n
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(n):
        u, v = points[i, 0] - mx, points[i, 1] - my
        xx, xy, yy = xx + u * u, xy + u * v, yy + v * v
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    c, s = math.cos(angle), math.sin(angle)
    # The points go one way along it: from the first to the last.
    if c * (points[n - 1, 0] - points[0, 0]) + s * (points[n - 1, 1] - points[0, 1]) < 0.0:
        c, s = -c, -s
    along = c * c * xx + 2.0 * c * s * xy + s * s * yy
    across = max(s * s * xx - 2.0 * c * s * xy + c * c * yy, 0.0)
    return FittedLine(mx, my, c, s, math.sqrt(across / n), along, n)


@compiled_inline
def _bend(points: FloatArray) -> int:
    """Where a segment bends most: its point farthest from the chord between first and last."""
    n = len(points)
    cx, cy = points[n - 1, 0] - points[0, 0], points[n - 1, 1] - points[0, 1]
    farthest, at = -1.0, 0
    for i in range(1, n - 1):
        off = abs(cx * (points[i, 1] - points[0, 1]) - cy * (points[i, 0] - points[0, 0]))
        if off > farthest:
            farthest, at = off, i
    return at


@compiled
def corner_of(  # noqa: PLR0911 - a test after the other
    points: FloatArray, x: float, y: float, rule: CornerRule
) -> Sighting:
    """Return the corner that a segment shows, or nothing.

    Parameters
    ----------
    points : (n, 2) of the segment [m], in the order of their beams.
    x, y : place of the scanner [m], in the same frame.
    rule : what it takes.

    Notes
    -----
    Andreasson et al. 2011, section 3.3.2: both sides as long as they may be, both residuals below the limit, the lines
    90 degrees apart within a tolerance; place where they meet, heading the mean of theirs, outwards. Of each line the
    offset at the corner has the variance s^2 (1 / n + d^2 / spread), d from its middle to there: covariance
    N^-1 diag(those) N^-T with N the normals. Only convex ones count: nearer to the scanner than the chord.
    """
    n = len(points)
    if not rule.enabled or n < 2 * FEWEST_OF_A_SIDE:
        return NO_SIGHTING
    at = _bend(points)
    if at + 1 < FEWEST_OF_A_SIDE or n - at < FEWEST_OF_A_SIDE:
        return NO_SIGHTING
    a, b = line_through(points[: at + 1]), line_through(points[at:])
    if max(a.residual, b.residual) > rule.largest_residual:
        return NO_SIGHTING
    cross = a.along_x * b.along_y - a.along_y * b.along_x
    along = a.along_x * b.along_x + a.along_y * b.along_y
    if abs(abs(math.atan2(cross, along)) - 0.5 * math.pi) > rule.tolerance:
        return NO_SIGHTING
    t = ((b.x - a.x) * b.along_y - (b.y - a.y) * b.along_x) / cross
    px, py = a.x + t * a.along_x, a.y + t * a.along_y
    u = (px - b.x) * b.along_x + (py - b.y) * b.along_y
    first = math.hypot(points[0, 0] - px, points[0, 1] - py)
    last = math.hypot(points[n - 1, 0] - px, points[n - 1, 1] - py)
    if min(first, last) < rule.least_side or max(first, last) > rule.largest_side:
        return NO_SIGHTING
    middle_x, middle_y = 0.5 * (points[0, 0] + points[n - 1, 0]), 0.5 * (points[0, 1] + points[n - 1, 1])
    if math.hypot(px - x, py - y) >= math.hypot(middle_x - x, middle_y - y):
        return NO_SIGHTING
    # Outwards: along the first side towards the corner, and against the second.
    heading = wrap_scalar(math.atan2(a.along_y - b.along_y, a.along_x - b.along_x))
    va = max(rule.sigma, a.residual) ** 2 * (1.0 / a.points + t * t / max(a.spread, 1e-9))
    vb = max(rule.sigma, b.residual) ** 2 * (1.0 / b.points + u * u / max(b.spread, 1e-9))
    # Columns of N^-1: an offset of one line moves the corner along the other.
    ax, ay, bx, by = b.along_x / cross, b.along_y / cross, a.along_x / cross, a.along_y / cross
    xx, xy, yy = va * ax * ax + vb * bx * bx, va * ax * ay + vb * bx * by, va * ay * ay + vb * by * by
    return Sighting(True, px, py, xx, xy, yy, heading)
