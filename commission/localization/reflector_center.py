"""Where the center of a reflector is, from the beams of its cluster: three kernels, for `detector` alone.

Each takes the scan (`ranges`, `flags`, `count`), the cluster's `first` and `last` beam, which count on past a full
turn, and the bearings `angle_min` and `increment`; each returns range [m] and bearing [rad], not wrapped.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.localization.beam_echo import LIT_SHARE, BeamModel, cylinder_echo, flagged_span, half_width_at, lit_part
from commission.site.reflectors import RANGE_PER_RADIUS

GRAZING = 0.9
"""Beams whose lit part passes the axis at more than this share of the radius do not shape the fit: there the surface
falls away so steeply that the echo is a mixture, and one beam's noise moves the center by several times as much."""
MISSING = 0.5
"""Beams that may be missing in a cluster before one asks why."""
BEHIND = 4.0
"""Sigmas of a beam's range by which it is too far to be an echo of the circle alone."""
NEARER = 3.0
"""Sigmas of a beam's range by which something beside the cluster is nearer than the reflector."""
MEAN_DEPTH = RANGE_PER_RADIUS
"""Mean distance, in radii, from the lit half of a circle to the line through its center across the beam."""
STEEPEST_SHARE = 0.5
"""Largest product of slope and half width of a plate that shapes its center: a plate at 63 degrees, 28 degrees wide."""
ITERATIONS = 3
"""Gauss-Newton steps. Of 60 noisy posts at 0.4 to 9 m, the median center is then 0.01 micrometres from where it
settles, the worst 0.6 mm."""


@compiled_inline
def _range_at(ranges: NDArray[np.float32], flags: NDArray[np.bool_], count: int, beam: int) -> float:
    """Range of a beam, NaN where it is not a reflective echo (a bridged beam)."""
    k = beam if beam < count else beam - count
    if flags[k] and ranges[k] > 0.0 and ranges[k] < math.inf:
        return float(ranges[k])
    return math.nan


@compiled_inline
def _mean_range(ranges: NDArray[np.float32], flags: NDArray[np.bool_], count: int, first: int, last: int) -> float:
    """Mean range of the reflective beams first to last, NaN when none is."""
    total, number = 0.0, 0
    for beam in range(first, last + 1):
        distance = _range_at(ranges, flags, count, beam)
        if not math.isnan(distance):
            total += distance
            number += 1
    return total / number if number > 0 else math.nan


@compiled_inline
def central_beam(  # noqa: PLR0917 - a scan, a cluster in it and the reflector
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    count: int,
    first: int,
    last: int,
    angle_min: float,
    increment: float,
    radius: float,
) -> tuple[float, float]:
    """Center by the paper's rule: bearing of the central beam, its range plus the radius.

    Of an even number, the middle of the central two; where the central beam is a bridged one, of its neighbors.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    count : beams of a turn, or of the scan.
    first, last : the cluster's first and last beam, which count on past a full turn.
    angle_min, increment : first bearing and step between beams [rad].
    radius : of the reflector [m].

    Notes
    -----
    r = ranges[(first + last) / 2] + radius, b = angle_min + increment (first + last) / 2: Sobreira et al. 2016,
    Algorithm 2, line 5.
    """
    low, high = (first + last) // 2, (first + last + 1) // 2
    distance = _mean_range(ranges, flags, count, low, high)
    if math.isnan(distance):
        distance = _mean_range(ranges, flags, count, low - 1, high + 1)
    return distance + radius, angle_min + 0.5 * increment * (first + last)


class PlateFit(NamedTuple):
    """What the beams of a plate tell."""

    range: float
    """Of its center [m]."""
    bearing: float
    """Of its center [rad], not wrapped."""
    slope: float
    """Tangent of the angle of incidence, positive where the range grows with the bearing; 0 of a single beam."""
    spread: float
    """Sum of squared distances of the beams from their middle, across the line of sight [m^2]: the slope's variance is
    that of a range over it. 0 of a single beam."""
    rest: float
    """Sum of squared differences between its beams and the line [m^2]."""


@compiled_inline
def plate(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    count: int,
    first: int,
    last: int,
    body: tuple[int, int],
    angle_min: float,
    increment: float,
) -> PlateFit:
    """Center of a flat plate: a line through its beams, halfway between where the cluster's two edges meet it.

    Halfway in bearing is not halfway along a plate that stands obliquely: at 1 m, a plate of 0.5 m at 45 degrees would
    be off by 31 mm.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    count : beams of a turn, or of the scan.
    first, last : the cluster's first and last beam, which count on past a full turn: they tell its width.
    body : first and last beam that measure it, and tell where it is.
    angle_min, increment : first bearing and step between beams [rad].

    Notes
    -----
    z = z0 + slope a by least squares, with a = r sin(b), z = r cos(b), b from the middle beam; the edges at b = +-e, e
    half the width of the cluster, meet it at a = +-z0 t / (1 -+ slope t), t = tan(e). The angle of incidence is that of
    the ray to the center, atan(slope) + atan(a / z). Derived.
    """
    middle = 0.5 * (first + last)
    n, sum_a, sum_z, sum_aa, sum_az, sum_zz = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for beam in range(body[0], body[1] + 1):
        distance = _range_at(ranges, flags, count, beam)
        if math.isnan(distance):
            continue
        off = increment * (beam - middle)
        a, z = distance * math.sin(off), distance * math.cos(off)
        n += 1
        sum_a += a
        sum_z += z
        sum_aa += a * a
        sum_az += a * z
        sum_zz += z * z
    at = angle_min + increment * middle
    if n < 2:
        return PlateFit(sum_z / max(n, 1), at, 0.0, 0.0, 0.0)
    spread = sum_aa - sum_a * sum_a / n
    slope = (sum_az - sum_a * sum_z / n) / spread
    start = (sum_z - slope * sum_a) / n
    rest = max(sum_zz - start * sum_z - slope * sum_az, 0.0)
    edge = math.tan(min(0.5 * abs(increment) * (last - first + 1), 0.25 * math.pi))
    # Steeper than the beams themselves is no plate, but a row of things behind each other.
    reach = min(max(slope * edge, -STEEPEST_SHARE), STEEPEST_SHARE)
    across = start * edge * reach / (1.0 - reach * reach)
    along = start + slope * across
    aside = across / along
    seen = (slope + aside) / max(1.0 - slope * aside, STEEPEST_SHARE)
    return PlateFit(
        math.hypot(across, along),
        at + math.atan2(across, along),
        seen,
        spread,
        math.sqrt(rest / (n - 2)) if n > 2 else 0.0,
    )


@compiled_inline
def circle_fit(  # noqa: PLR0917 - a scan, a cluster in it, the reflector and the beams
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    count: int,
    first: int,
    last: int,
    body: tuple[int, int],
    angle_min: float,
    increment: float,
    radius: float,
    model: BeamModel,
    full_turn: bool,
) -> tuple[float, float]:
    """Center by least squares: a circle of known radius through the ranges, its bearing held by the cluster's edges.

    The ranges refine what the edges tell as far as their noise allows; the edges keep clusters of one or two beams well
    posed.

    The echo of a beam comes from the middle of its lit part, which for the outer beams is nearer to the axis than the
    middle of the beam: taking the latter put posts at 15 to 20 m up to 9 mm too near. A beam counts the less the
    steeper the surface falls away under it, because the noise of its bearing then becomes noise of its range.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    count : beams of a turn, or of the scan.
    first, last : the cluster's first and last beam, which count on past a full turn: they tell its width.
    body : first and last beam that measure it, and tell where it is.
    angle_min, increment : first bearing and step between beams [rad].
    radius : of the reflector [m].
    model : width and noise of the beams.
    full_turn : whether the last beam is the first one's neighbor.

    Notes
    -----
    min over (r, b) of sum (range - echo(r, b))^2 / (var_r + slope^2 var_b) + (b - edges)^2 / var_edges: Gauss-Newton on
    the maximum likelihood, derived.
    """
    middle = angle_min + 0.5 * increment * (first + last)
    mean = _mean_range(ranges, flags, count, body[0], body[1])
    start = mean + MEAN_DEPTH * radius
    half_width = half_width_at(start, model.half_divergence, model.half_aperture)
    aside, variance = _from_edges(ranges, count, first, last, increment, start, radius, half_width, model, full_turn)
    distance, turned = start, aside
    bearing_variance = model.bearing_sigma * model.bearing_sigma
    range_variance = model.range_sigma * model.range_sigma
    held = 1.0 / variance
    low, high = body
    if high - low > 1:
        # An edge beam half on what is behind is farther than the body can be there.
        ends = angle_min + increment * low - middle - aside, angle_min + increment * high - middle - aside
        farthest = BEHIND * model.range_sigma
        low += (
            _range_at(ranges, flags, count, low) > _expected_echo(start, radius, ends[0], half_width).range + farthest
        )
        high -= (
            _range_at(ranges, flags, count, high) > _expected_echo(start, radius, ends[1], half_width).range + farthest
        )
    for iteration in range(ITERATIONS):
        n_rr, n_rt, n_tt = 0.0, 0.0, held
        g_r, g_t = 0.0, held * (aside - turned)
        for beam in range(low, high + 1):
            measured = _range_at(ranges, flags, count, beam)
            off = angle_min + increment * beam - middle
            # Which beams count, and how much, is settled at the start: else the fit would not settle.
            initial = _expected_echo(start, radius, off - aside, half_width)
            if math.isnan(measured) or initial.grazes:
                continue
            weight = 1.0 / (range_variance + initial.slope * initial.slope * bearing_variance)
            # At first both are at the start.
            echo = initial if iteration == 0 else _expected_echo(distance, radius, off - turned, half_width)
            residual = measured - echo.range
            n_rr += weight
            n_rt -= weight * echo.slope
            n_tt += weight * echo.slope * echo.slope
            g_r += weight * residual
            g_t -= weight * echo.slope * residual
        if n_rr == 0.0:
            # Every beam grazes or misses (a far reflector between two narrow beams).
            return start, middle + aside
        determinant = n_rr * n_tt - n_rt * n_rt
        # A cluster that is no reflector must not throw the center behind the scanner.
        distance = max(distance + (n_tt * g_r - n_rt * g_t) / determinant, 0.5 * mean)
        turned += (n_rr * g_t - n_rt * g_r) / determinant
    return distance, middle + turned


@compiled_inline
def _from_edges(  # noqa: PLR0917 - a scan, a cluster in it, the reflector and the beams
    ranges: NDArray[np.float32],
    count: int,
    first: int,
    last: int,
    increment: float,
    distance: float,
    radius: float,
    half_width: float,
    model: BeamModel,
    full_turn: bool,
) -> tuple[float, float]:
    """Bearing of the center from the middle of a cluster, as its edges alone tell it, and its variance [rad, rad^2].

    The middle of the two edges is right evenly to within f or 1 - f of half a beam step, where f is the fraction of a
    step in the width: on average a variance of 1/24 of its square, and half of that of a beam's own bearing.

    Where beams are missing and the beam beside one edge meets something nearer, the reflector is partly hidden there,
    by a pillar, a wall seen along, a leg or the end of the field of view. Then the other edge and the known width tell
    the center, with the variance of one edge. The middle would be off by half of what is hidden, and stay so while the
    vehicle passes.
    """
    step = abs(increment)
    high = math.asin(min(1.0, radius / distance))
    whole = flagged_span(high, half_width, LIT_SHARE) / step
    missing = whole - (last - first + 1)
    bearing_variance = model.bearing_sigma * model.bearing_sigma
    nearer = NEARER * model.range_sigma
    before = _is_hidden_beside(ranges, count, first, first - 1, nearer, full_turn)
    after = _is_hidden_beside(ranges, count, last, last + 1, nearer, full_turn)
    if missing <= MISSING or not (before or after):
        return 0.0, step * step / 24.0 + 0.5 * bearing_variance
    if before and after:
        # Anywhere within what is missing.
        return 0.0, step * step * (1.0 + missing * missing) / 12.0 + bearing_variance
    aside = 0.5 * missing * increment
    return (-aside if before else aside), step * step / 12.0 + bearing_variance


@compiled_inline
def _is_hidden_beside(  # noqa: PLR0917 - a scan and two beams of it
    ranges: NDArray[np.float32], count: int, edge: int, beside: int, nearer: float, full_turn: bool
) -> bool:
    """Whether the beam beside a cluster's edge meets something nearer, or lies outside the field of view."""
    if not full_turn and (beside < 0 or beside >= count):
        return True
    here = ranges[edge if edge < count else edge - count]
    there = ranges[beside % count]
    return 0.0 < there < here - nearer


@compiled_inline
def rest_of_cylinder(  # noqa: PLR0917 - a scan, a cluster in it and the reflector
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    count: int,
    first: int,
    last: int,
    angle_min: float,
    increment: float,
    distance: float,
    bearing: float,
    radius: float,
    half_width: float,
) -> float:
    """Sum of squared differences between the ranges of a cluster and those of a cylinder [m^2].

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    count : beams of a turn, or of the scan.
    first, last : the cluster's first and last beam, which count on past a full turn.
    angle_min, increment : first bearing and step between beams [rad].
    distance, bearing, radius : of the cylinder [m, rad, m].
    half_width : of the beams there [rad].

    Notes
    -----
    sum (range - echo)^2 with the echo of the middle of each beam's lit part, see `cylinder_echo`: by definition.
    """
    total = 0.0
    high = math.asin(min(1.0, radius / distance))
    for beam in range(first, last + 1):
        measured = _range_at(ranges, flags, count, beam)
        if not math.isnan(measured):
            lower, upper = lit_part(angle_min + increment * beam - bearing, half_width, -high, high)
            total += (measured - cylinder_echo(distance, radius, 0.5 * (lower + upper))) ** 2
    return total


class _Echo(NamedTuple):
    """Range that a beam should measure."""

    range: float
    """[m]."""
    slope: float
    """Its change per radian of the beam's bearing [m/rad]."""
    grazes: bool
    """Whether the surface is too steep there to shape the fit."""


@compiled_inline
def _expected_echo(distance: float, radius: float, off: float, half_width: float) -> _Echo:
    """Echo of a beam at a bearing `off` that of a circle's center. A beam that misses counts as one at the edge."""
    high = math.asin(min(1.0, radius / distance))
    lower, upper = lit_part(off, half_width, -high, high)
    across = distance * math.sin(0.5 * (lower + upper))
    widest = GRAZING * radius
    grazes = abs(across) > widest
    across = min(max(across, -widest), widest)
    depth = math.sqrt(radius * radius - across * across)
    along = math.sqrt(distance * distance - across * across) - depth
    # An end of the lit part moves with the beam unless it is the circle's own edge.
    moving = 0.5 * ((lower > -high) + (upper < high))
    return _Echo(along, moving * across * along / depth, grazes)
