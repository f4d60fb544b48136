"""Paper reels in a scan: a circle through the points of each segment by Taubin's fit, and what it takes to be a reel.

Andreasson et al. 2011, section 3.3.1, with its five tests. Nothing here knows where the vehicle is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray

NEWTON_STEPS = 20
"""Steps to the root of Taubin's polynomial at most; nearly all need five."""
NEAR_SINGULAR = 1e-12
"""Share of the largest term below which three points lie on a line."""
CUSP_BEAMS = 3
"""Points on either side that must be nearer, so that what lies between two things that touch is no part of either."""


class Circle(NamedTuple):
    """A circle through points."""

    found: bool
    """Whether there is one: points on a line have none."""
    x: float
    y: float
    radius: float


class Sighting(NamedTuple):
    """A place that a segment tells, in the frame of its points."""

    found: bool
    x: float
    y: float
    xx: float
    """Covariance of the place [m^2]."""
    xy: float
    yy: float
    shape: float
    """Radius of a reel [m], heading of a corner [rad]."""


NO_SIGHTING = Sighting(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class ReelRule(NamedTuple):
    """What a segment must be like to be a reel (Andreasson et al. 2011, section 3.3.1)."""

    fewest_points: int
    least_radius: float
    largest_radius: float
    largest_residual: float
    """Root of the mean square of the distances of points from the circle [m]."""
    least_arc: float
    largest_arc: float
    """Arc angle of Fig. 3 [rad]: how much of the circle was seen."""
    sigma: float
    """1-sigma noise of a point across the circle [m]; what the points show counts where it is more."""


@compiled
def cut_into_segments(  # noqa: PLR0917 - points and a place, number by number
    points: FloatArray, count: int, gap: float, x: float, y: float, starts: IntArray
) -> int:
    """Cut the points of a scan where two neighbors lie apart, or where the surface is concave; return how many pieces.

    Parameters
    ----------
    points : (n, 2) [m], in the order of their beams.
    count : how many of them count.
    gap : distance of neighbors from which on they belong to two things [m].
    x, y : place of the scanner [m], in the frame of the points.
    starts : (n + 1,) out: first point of each segment, and behind the last one `count`.

    Notes
    -----
    |p_i - p_i-1| > gap, or a local maximum of the distance from the scanner, by definition: of a convex thing the
    distance has none, so that two reels that touch are two.
    """
    pieces = 0
    since = 0
    for i in range(count):
        if i == 0:
            starts[0], pieces = 0, 1
            continue
        dx, dy = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        if dx * dx + dy * dy > gap * gap:
            starts[pieces], since = i, i
            pieces += 1
        elif i - since >= CUSP_BEAMS and i + CUSP_BEAMS < count and _is_cusp(points, i, x, y, gap / 3.0):
            starts[pieces], since = i, i
            pieces += 1
    starts[pieces] = count
    return pieces


@compiled_inline
def _is_cusp(points: FloatArray, i: int, x: float, y: float, depth: float) -> bool:
    """Whether a point is the farthest of its neighbors, and those on both sides are nearer by a depth [m]."""
    own = math.hypot(points[i, 0] - x, points[i, 1] - y)
    for k in range(1, CUSP_BEAMS + 1):
        before = math.hypot(points[i - k, 0] - x, points[i - k, 1] - y)
        after = math.hypot(points[i + k, 0] - x, points[i + k, 1] - y)
        if before > own or after > own or (k == CUSP_BEAMS and max(before, after) > own - depth):
            return False
    return True


@compiled
def taubin_circle(points: FloatArray) -> Circle:
    """Fit a circle to points by Taubin's approximate distance.

    Parameters
    ----------
    points : (n, 2) [m].

    Notes
    -----
    Least sum f^2 / mean |grad f|^2 of f = A (x^2 + y^2) + B x + C y + D: Taubin 1991, section III, as the smallest root
    eta of det(M - eta N) = 0 by Newton's method from 0, which finds it from below: Chernov 2010, section 5.10. Its
    center is nearly unbiased, also where the arc is short, other than that of Kasa's algebraic fit.
    """
    n = len(points)
    mx, my = 0.0, 0.0
    for i in range(n):
        mx += points[i, 0]
        my += points[i, 1]
    mx, my = mx / max(n, 1), my / max(n, 1)
    xx, yy, xy, xz, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        u, v = points[i, 0] - mx, points[i, 1] - my
        w = u * u + v * v
        xx += u * u
        yy += v * v
        xy += u * v
        xz += u * w
        yz += v * w
        zz += w * w
    share = 1.0 / max(n, 1)
    xx, yy, xy, xz, yz, zz = xx * share, yy * share, xy * share, xz * share, yz * share, zz * share
    z, spread = xx + yy, xx * yy - xy * xy
    a3 = 4.0 * z
    a2 = -3.0 * z * z - zz
    a1 = zz * z + 4.0 * spread * z - xz * xz - yz * yz - z * z * z
    a0 = xz * xz * yy + yz * yz * xx - zz * spread - 2.0 * xz * yz * xy + z * z * spread
    eta, value = 0.0, a0
    for _ in range(NEWTON_STEPS):
        slope = a1 + eta * (2.0 * a2 + 3.0 * a3 * eta)
        step = eta - value / slope
        if step == eta or not math.isfinite(step):
            break
        further = a0 + step * (a1 + step * (a2 + step * a3))
        if abs(further) >= abs(value):
            break
        eta, value = step, further
    det = eta * eta - eta * z + spread
    if n < 3 or not abs(det) > NEAR_SINGULAR * z * z:
        return Circle(False, 0.0, 0.0, 0.0)
    cx = 0.5 * (xz * (yy - eta) - yz * xy) / det
    cy = 0.5 * (yz * (xx - eta) - xz * xy) / det
    return Circle(True, mx + cx, my + cy, math.sqrt(cx * cx + cy * cy + z))


@compiled
def arc_angle(points: FloatArray, x: float, y: float) -> float:
    """Angle that points take on a circle about a center [rad]: between the first and the last of them, the way they go.

    Parameters
    ----------
    points : (n, 2) [m], in order.
    x, y : center [m].

    Notes
    -----
    alpha = |sum of the angles between neighbors|: Andreasson et al. 2011, Fig. 3.
    """
    total = 0.0
    for i in range(1, len(points)):
        ax, ay = points[i - 1, 0] - x, points[i - 1, 1] - y
        bx, by = points[i, 0] - x, points[i, 1] - y
        total += math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    return abs(total)


@compiled
def reel_of(  # noqa: PLR0911 - a test after the other
    points: FloatArray, x: float, y: float, rule: ReelRule
) -> Sighting:
    """Return the reel that a segment shows, or nothing.

    Parameters
    ----------
    points : (n, 2) of the segment [m], in the order of their beams.
    x, y : place of the scanner [m], in the same frame.
    rule : what it takes.

    Notes
    -----
    Andreasson et al. 2011, section 3.3.1: enough points, the radius inside of its limits, the residual below its limit,
    the center farther away than the mean of the points, the arc inside of its limits. Covariance s^2 (J^T J)^-1 of
    center and radius with rows (cos, sin, 1) of the points: that of a geometric fit; the radius is left out of it.
    """
    n = len(points)
    if n < rule.fewest_points:
        return NO_SIGHTING
    circle = taubin_circle(points)
    if not circle.found or not rule.least_radius <= circle.radius <= rule.largest_radius:
        return NO_SIGHTING
    squares, mx, my = 0.0, 0.0, 0.0
    cc, cs, ss, c1, s1 = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        ux, uy = points[i, 0] - circle.x, points[i, 1] - circle.y
        distance = max(math.hypot(ux, uy), 1e-9)
        off = distance - circle.radius
        squares += off * off
        c, s = ux / distance, uy / distance
        cc, cs, ss, c1, s1 = cc + c * c, cs + c * s, ss + s * s, c1 + c, s1 + s
        mx, my = mx + points[i, 0], my + points[i, 1]
    residual = math.sqrt(squares / n)
    if residual > rule.largest_residual:
        return NO_SIGHTING
    if math.hypot(circle.x - x, circle.y - y) <= math.hypot(mx / n - x, my / n - y):
        return NO_SIGHTING
    if not rule.least_arc <= arc_angle(points, circle.x, circle.y) <= rule.largest_arc:
        return NO_SIGHTING
    # The radius is eliminated from the normal equations (Schur complement).
    cc, cs, ss = cc - c1 * c1 / n, cs - c1 * s1 / n, ss - s1 * s1 / n
    det = cc * ss - cs * cs
    if not det > NEAR_SINGULAR * n * n:
        return NO_SIGHTING
    variance = max(rule.sigma, residual) ** 2 / det
    return Sighting(True, circle.x, circle.y, variance * ss, -variance * cs, variance * cc, circle.radius)
