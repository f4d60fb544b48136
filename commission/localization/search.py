"""How far from a detection its reflector may lie: bounds that hold at any range, heading and correlation.

They only leave out what cannot be inside the gate; which reflector is the likeliest is `association`'s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.directions import UnitVector
from commission.localization.consider import Considering
from commission.localization.filter_kinds import is_invariant
from commission.localization.observation import SMALLEST_RANGE, ObservationModel, offset_facing
from commission.localization.pose_gaussian import PoseGaussian, larger_eigenvalue

POINTS_APART = 3.0**0.5
"""Sigma points lie as many sigmas from the mean."""
LEAST_REST = 0.05
"""Where less is left of a heading, a reflector may be anywhere."""


class Viewpoint(NamedTuple):
    """What is common to all detections of a scan: scanner's place and bounds of its uncertainty."""

    offset_x: float
    offset_y: float
    position_sigma: float
    """Largest 1-sigma of the scanner's position in any direction [m]."""
    heading_sigma: float


@compiled_inline
def viewpoint(belief: PoseGaussian, facing: UnitVector, model: ObservationModel) -> Viewpoint:
    """Scanner's place, and the largest 1-sigma of its position and heading.

    Parameters
    ----------
    belief : pose of base.
    facing : its heading.
    model : mounting of the scanner.

    Notes
    -----
    sigma^2 = `larger_eigenvalue` of J P J^T, J = [[1, 0, -oy], [0, 1, ox]]: derived from the lever (ox, oy) of the
    scanner.
    """
    offset_x, offset_y = offset_facing(facing, model)
    # The scanner moves by (-offset_y, offset_x) per radian of heading.
    xx = belief.xx - 2.0 * offset_y * belief.xt + offset_y * offset_y * belief.tt
    xy = belief.xy + offset_x * belief.xt - offset_y * belief.yt - offset_x * offset_y * belief.tt
    yy = belief.yy + 2.0 * offset_x * belief.yt + offset_x * offset_x * belief.tt
    largest = larger_eigenvalue(xx, xy, yy)
    return Viewpoint(offset_x, offset_y, math.sqrt(max(largest, 0.0)), math.sqrt(max(belief.tt, 0.0)))


@compiled_inline
def widened(view: Viewpoint, largest_variance: float, given: Considering) -> Viewpoint:
    """Bounds that hold the constants, too, whatever their covariance with the pose is.

    Parameters
    ----------
    view : of the belief alone.
    largest_variance : of all surveyed places, each axis [m^2].
    given : of the scan.

    Notes
    -----
    sigma(a + b) <= sigma(a) + sigma(b), whatever their covariance is; the constants are independent of each other.
    Derived.
    """
    p = given.variances
    # The scanner is as fast as base, and faster by what it turns about base.
    speed2 = given.speed_x * given.speed_x + given.speed_y * given.speed_y
    lever2 = view.offset_x * view.offset_x + view.offset_y * view.offset_y
    speed = math.sqrt(speed2) + abs(given.turn_rate) * math.sqrt(lever2)
    position2 = largest_variance + p.mount_position + p.range_bias + p.clock * speed * speed
    heading2 = p.mount_heading + p.clock * given.turn_rate * given.turn_rate
    return Viewpoint(
        view.offset_x,
        view.offset_y,
        view.position_sigma + math.sqrt(position2),
        view.heading_sigma + math.sqrt(heading2),
    )


@compiled_inline
def search_radius2(
    d: float, measured_range: float, view: Viewpoint, model: ObservationModel, largest_variance: float
) -> float:
    """Square of the distance on the floor, from a detection, within which all of Mahalanobis distance <= d lie [m^2].

    Parameters
    ----------
    d : largest Mahalanobis distance.
    measured_range : of the detection [m].
    view : scanner's place and the bounds of its uncertainty.
    model : of the observation.
    largest_variance : of all surveyed places, each axis [m^2].

    Notes
    -----
    u^2 + r (r + u) c^2, u = d sigma_r, c the chord of a turn by d sigma_b. Derived: each innovation is at most d of its
    own sigma. The sigma of the range is bounded by that of the scanner's position; the sigma of the bearing too, seen
    from the nearest range that the first bound leaves.
    """
    range_variance = view.position_sigma * view.position_sigma + model.range_variance + largest_variance
    depth = d * math.sqrt(range_variance)
    nearest = measured_range - depth
    chord2 = 4.0
    if nearest > SMALLEST_RANGE:
        per_nearest = 1.0 / nearest
        bearing_sigma = view.position_sigma * per_nearest + view.heading_sigma
        bearing_variance = bearing_sigma * bearing_sigma + model.bearing_variance
        bearing_variance += largest_variance * per_nearest * per_nearest
        # (2 sin(b / 2))^2 <= b^2, and <= 4 for any turn.
        chord2 = min(4.0, d * d * bearing_variance)
    distance = abs(measured_range)
    # The margin covers the rounding of everything above.
    return (depth * depth + distance * (distance + depth) * chord2) * (1.0 + 1e-8) + 1e-12


@compiled_inline
def radius2_by(  # noqa: PLR0917 - a distance and what bounds it, number by number
    kind: int | None, d: float, measured_range: float, view: Viewpoint, model: ObservationModel, largest_variance: float
) -> float:
    """Square of the distance within which to search for reflectors, for a kind of filter [m^2].

    Parameters
    ----------
    kind : of the filter.
    d, measured_range, view, model, largest_variance : as in `search_radius2`.

    Notes
    -----
    `search_radius2`, of `POINTS_APART` times the sigmas where points are as far apart. Right-invariant: a distance u
    on the floor has at most the sigma s + h (r + u) + n of position, heading and noise, so that u <= d (s + h r + n) /
    (1 - d h); derived.
    """
    if kind is None:
        return search_radius2(d, measured_range, view, model, largest_variance)
    if not is_invariant(kind):
        apart = POINTS_APART * (1.0 + 1.0 / d)
        wider = Viewpoint(view.offset_x, view.offset_y, apart * view.position_sigma, apart * view.heading_sigma)
        return search_radius2(d, measured_range, wider, model, largest_variance)
    distance, rest = abs(measured_range), 1.0 - d * view.heading_sigma
    if rest < LEAST_REST:
        return math.inf
    noise2 = max(model.range_variance, distance * distance * model.bearing_variance) + largest_variance
    radius = d * (view.position_sigma + view.heading_sigma * distance + math.sqrt(noise2)) / rest
    return radius * radius * (1.0 + 1e-8) + 1e-12


@compiled_inline
def reach_of(view: Viewpoint, largest_variance: float, given: Considering | None) -> Viewpoint:
    """Bounds by which reflectors are searched.

    Parameters
    ----------
    view, largest_variance, given : as in `widened`; None: no constants are considered.

    Notes
    -----
    No formula: `widened`, where constants are considered.
    """
    if given is None:
        return view
    return widened(view, largest_variance, given)
