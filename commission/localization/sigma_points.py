"""Correct by sigma points: unscented and cubature Kalman filter, the future work of Sobreira et al. 2016.

What they see of a reflector gives the line that fits best through them, and how far they lie off it. With the line in
the place of a Jacobian, and the rest as noise of the range and the bearing, everything else is that of `kalman`: so
constants can be considered. Predicting is exact in the mean up to the spread of the heading over one interval of
odometry, and is not done by points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.geometry.directions import UnitVector, composed, turn_to, turned_by
from commission.localization.consider import Considering, innovation_with, seen_with
from commission.localization.consider_correction import covariance_with
from commission.localization.kalman import (
    Corrected,
    Innovation,
    corrected_covariance,
    gain,
    innovation,
    moved_by,
    with_cross_noise,
)
from commission.localization.observation import SMALLEST_RANGE, Expected, ObservationModel
from commission.localization.pose_gaussian import PoseGaussian

STATES = 3
REACH = math.sqrt(STATES)
"""Points lie as many sigmas from the mean: of the cubature rule, and of the unscented one with alpha 1 and kappa 0."""
UNSCENTED_CENTER = 2.0
"""Weight of the mean itself in the covariance, beta: 2 for a Gaussian; 0 makes it the cubature rule."""
LEAST_ROOT = 1e-12
"""A smaller 1-sigma tells no slope [m], [rad]."""


class Fitted(NamedTuple):
    """Line through what the sigma points see of a reflector."""

    expected: Expected
    """Its slopes, and the mean range; the bearing is not read."""
    turn: float
    """From the mean bearing to the measured one [rad]."""
    rr: float
    """Covariance of how far the points lie off the line, to be added to R [m^2], [m rad], [rad^2]."""
    rb: float
    bb: float


@compiled
def fitted(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    aim: UnitVector,
    x: float,
    y: float,
    model: ObservationModel,
    center: float,
) -> Fitted:
    """Fit a line through what the sigma points of a belief see of a reflector.

    Parameters
    ----------
    belief, facing : before the correction, and the direction of its heading.
    measured_range : range bias already taken off [m].
    aim : measured bearing as a direction, in base.
    x, y : the reflector's center [m], map frame.
    model : of the observation.
    center : weight of the mean in the covariance: 0 or `UNSCENTED_CENTER`.

    Notes
    -----
    H = P_zx P^-1 and R + P_zz - H P H^T with the points mean +- sqrt(3) L e_i of weight 1/6, P = L L^T: Arasaratnam and
    Haykin 2009, Table I; Julier and Uhlmann 2004, equations 12 to 15, with alpha 1, beta 2, kappa 0; as a line,
    Lefebvre, Bruyninckx and De Schutter 2002. H L is half the difference of two points over sqrt(3).
    """
    L = _root(belief)
    seen = np.empty((2 * STATES + 1, 2))
    for point in range(2 * STATES + 1):
        dx, dy, turn = 0.0, 0.0, 0.0
        if point > 0:
            column = (point - 1) // 2
            reach = REACH if point % 2 else -REACH
            dx, dy, turn = reach * L[0, column], reach * L[1, column], reach * L[2, column]
        c, s = turned_by(facing, turn)
        to_x = x - (belief.x + dx + c * model.mount_x - s * model.mount_y)
        to_y = y - (belief.y + dy + s * model.mount_x + c * model.mount_y)
        distance = math.sqrt(to_x * to_x + to_y * to_y)
        per_distance = 1.0 / max(distance, SMALLEST_RANGE)
        seen[point, 0] = measured_range - distance
        seen[point, 1] = turn_to(to_x * per_distance, to_y * per_distance, composed(UnitVector(c, s), aim))
        if point > 0:
            seen[point, 1] = seen[0, 1] + wrap_scalar(seen[point, 1] - seen[0, 1])
    mean = np.zeros(2)
    for point in range(1, 2 * STATES + 1):
        mean[0] += seen[point, 0] / (2.0 * STATES)
        mean[1] += seen[point, 1] / (2.0 * STATES)
    halves, spread = np.empty((2, STATES)), np.zeros((2, 2))
    for i in range(STATES):
        for z in range(2):
            # Less: residuals, where the expected observation has the slopes.
            halves[z, i] = -(seen[1 + 2 * i, z] - seen[2 + 2 * i, z]) / (2.0 * REACH)
    for a in range(2):
        for b in range(2):
            spread[a, b] = center * (seen[0, a] - mean[a]) * (seen[0, b] - mean[b])
            for point in range(1, 2 * STATES + 1):
                spread[a, b] += (seen[point, a] - mean[a]) * (seen[point, b] - mean[b]) / (2.0 * STATES)
            for i in range(STATES):
                spread[a, b] -= halves[a, i] * halves[b, i]
    H = _over(halves, L)
    expected = Expected(measured_range - mean[0], 0.0, H[0, 0], H[0, 1], H[0, 2], H[1, 0], H[1, 1], H[1, 2])
    return Fitted(expected, wrap_scalar(mean[1]), max(spread[0, 0], 0.0), spread[0, 1], max(spread[1, 1], 0.0))


@compiled_inline
def _root(p: PoseGaussian) -> FloatArray:
    """(3, 3) lower triangle L of P = L L^T."""
    L = np.zeros((STATES, STATES))
    L[0, 0] = math.sqrt(max(p.xx, LEAST_ROOT * LEAST_ROOT))
    L[1, 0], L[2, 0] = p.xy / L[0, 0], p.xt / L[0, 0]
    L[1, 1] = math.sqrt(max(p.yy - L[1, 0] * L[1, 0], LEAST_ROOT * LEAST_ROOT))
    L[2, 1] = (p.yt - L[2, 0] * L[1, 0]) / L[1, 1]
    L[2, 2] = math.sqrt(max(p.tt - L[2, 0] * L[2, 0] - L[2, 1] * L[2, 1], LEAST_ROOT * LEAST_ROOT))
    return L


@compiled_inline
def _over(halves: FloatArray, L: FloatArray) -> FloatArray:
    """(2, 3) H of H L = halves, by substitution from the last column on."""
    H = np.empty((2, STATES))
    for z in range(2):
        H[z, 2] = halves[z, 2] / L[2, 2]
        H[z, 1] = (halves[z, 1] - H[z, 2] * L[2, 1]) / L[1, 1]
        H[z, 0] = (halves[z, 0] - H[z, 2] * L[2, 0] - H[z, 1] * L[1, 0]) / L[0, 0]
    return H


@compiled_inline
def widened_by(v: Innovation, line: Fitted, model: ObservationModel) -> Innovation:
    """Innovation with what the points lie off the line as noise.

    Parameters
    ----------
    v : without it.
    line : says how much it is.
    model : of the observation.

    Notes
    -----
    S + (P_zz - H P H^T), factored again as L D L^T, by definition; see `fitted`.
    """
    s_rr = v.s_rr + line.rr
    s_rb = v.w * v.s_rr + line.rb
    s_bb = v.schur + v.w * v.w * v.s_rr + line.bb
    per_s_rr = 1.0 / s_rr
    w = s_rb * per_s_rr
    schur = max(s_bb - w * s_rb, model.bearing_variance)
    return Innovation(
        v.range,
        v.bearing,
        s_rr,
        w,
        schur,
        per_s_rr,
        1.0 / schur,
        v.range_noise + line.rr,
        v.bearing_noise + line.bb,
        v.range_px,
        v.range_py,
        v.range_pt,
        v.bearing_px,
        v.bearing_py,
        v.bearing_pt,
    )


@compiled_inline
def fitted_innovation(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    line: Fitted,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    at: int,
) -> Innovation:
    """Innovation of a detection against one reflector, by a line through sigma points.

    Parameters
    ----------
    belief, facing : before the correction, and the direction of its heading.
    measured_range : range bias already taken off [m].
    line : see `fitted`.
    surveyed_variance : of the reflector's place, each axis [m^2].
    model : of the observation.
    given, at : as in `seen_with`, or None.

    Notes
    -----
    No formula: `innovation` or `innovation_with`, and `widened_by`.
    """
    e = line.expected
    if given is None:
        return widened_by(innovation(belief, e, measured_range, line.turn, surveyed_variance, model), line, model)
    constants = seen_with(facing, e, surveyed_variance, given, at)
    return widened_by(innovation_with(belief, e, measured_range, line.turn, model, constants), line, model)


@compiled
def correct_by_points(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    aim: UnitVector,
    reflector_x: float,
    reflector_y: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    width: int,
    at: int,
    center: float,
) -> Corrected:
    """Correct a belief, and its covariance with constants where they are considered, by one detection.

    Parameters
    ----------
    belief, facing : before the correction, and the direction of its heading.
    measured_range : range bias already taken off [m].
    aim : measured bearing as a direction, in base.
    reflector_x, reflector_y, surveyed_variance : the reflector's center [m], and variance of its place [m^2].
    model : of the observation.
    given, width, at : as in `correct_aimed_with`, or None.
    center : as in `fitted`.

    Notes
    -----
    x + K v, P - K S K^T with K = P_xz S^-1: Arasaratnam and Haykin 2009, Table I; here in Joseph's form of the line.
    """
    line = fitted(belief, facing, measured_range, aim, reflector_x, reflector_y, model, center)
    v = fitted_innovation(belief, facing, measured_range, line, surveyed_variance, model, given, at)
    e, k = line.expected, gain(v)
    if given is None:
        covariance = corrected_covariance(belief, e, k, v.range_noise, v.bearing_noise)
        covariance = with_cross_noise(covariance, k, line.rb)
    else:
        d = seen_with(facing, e, surveyed_variance, given, at)
        covariance = covariance_with(belief, e, k, v, d, line.rb, surveyed_variance, given, width, at)
    return moved_by(belief, facing, k, v, covariance)
