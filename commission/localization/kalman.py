"""Correct: the belief takes in one associated detection (Algorithm 1, lines 14 to 17). EKF, two by two.

Algorithm 1 as printed corrects every detection from the one prediction, so that only the last would count. Here each
correction starts from the freshest state and linearizes there; association alone is done at the prediction (line 10).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.directions import UnitVector, composed, direction_of, turn_to, turned_by
from commission.localization.observation import Expected, ObservationModel, expect_at, offset_facing
from commission.localization.pose_gaussian import PoseGaussian


class Innovation(NamedTuple):
    """Difference of a detection from what was expected, its covariance factored for solving, and P H^T.

    S = [[s_rr, w s_rr], [w s_rr, w^2 s_rr + schur]]: one step of elimination, nothing is inverted.
    """

    range: float
    bearing: float
    s_rr: float
    w: float
    schur: float
    per_s_rr: float
    """1 / s_rr: the one division, where each of its uses would take as long."""
    per_schur: float
    range_noise: float
    bearing_noise: float
    range_px: float
    """Covariance of expected range and x."""
    range_py: float
    range_pt: float
    bearing_px: float
    bearing_py: float
    bearing_pt: float


class Gain(NamedTuple):
    """Kalman gain: what a metre of range and a radian of bearing move each state by."""

    xr: float
    xb: float
    yr: float
    yb: float
    tr: float
    tb: float


@compiled_inline
def innovation(  # noqa: PLR0917 - a measurement, number by number
    belief: PoseGaussian,
    expected: Expected,
    measured_range: float,
    turn: float,
    surveyed_variance: float,
    model: ObservationModel,
) -> Innovation:
    """Innovation of a detection against one reflector, with its covariance.

    Parameters
    ----------
    belief : before the correction.
    expected : observation of the reflector expected from the mean of `belief`; its bearing is not read.
    measured_range : range bias already taken off [m].
    turn : from the expected bearing to the measured one [rad].
    surveyed_variance : of the reflector's place, each axis [m^2]; adds to R.
    model : of the observation.

    Notes
    -----
    v = z - h, S = H P H^T + R: Sobreira et al. 2016, Algorithm 1, lines 7 and 8. S is factored as L D L^T.
    """
    e = expected
    range_noise = model.range_variance + surveyed_variance
    bearing_noise = model.bearing_variance + surveyed_variance * (e.bearing_x * e.bearing_x + e.bearing_y * e.bearing_y)
    range_px, range_py, range_pt, bearing_px, bearing_py, bearing_pt = covariance_with_expected(belief, e)
    s_rr = e.range_x * range_px + e.range_y * range_py + e.range_theta * range_pt + range_noise
    s_rb = e.bearing_x * range_px + e.bearing_y * range_py + e.bearing_theta * range_pt
    s_bb = e.bearing_x * bearing_px + e.bearing_y * bearing_py + e.bearing_theta * bearing_pt + bearing_noise
    per_s_rr = 1.0 / s_rr
    w = s_rb * per_s_rr
    # S - R is positive semi-definite, so the Schur complement is at least that of R; rounding may not say so.
    schur = max(s_bb - w * s_rb, bearing_noise)
    return Innovation(
        measured_range - e.range,
        turn,
        s_rr,
        w,
        schur,
        per_s_rr,
        1.0 / schur,
        range_noise,
        bearing_noise,
        range_px,
        range_py,
        range_pt,
        bearing_px,
        bearing_py,
        bearing_pt,
    )


@compiled_inline
def squared_distance(given: Innovation) -> float:
    """Squared Mahalanobis distance of an innovation (NIS, 2 degrees of freedom).

    Notes
    -----
    v^T S^-1 v = v_r^2 / S_rr + (v_b - w v_r)^2 / schur with w = S_rb / S_rr: solved with S = L D L^T, by definition.
    """
    rest = given.bearing - given.w * given.range
    return given.range * given.range * given.per_s_rr + rest * rest * given.per_schur


@compiled_inline
def correct(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    measured_range: float,
    measured_bearing: float,
    reflector_x: float,
    reflector_y: float,
    surveyed_variance: float,
    model: ObservationModel,
) -> PoseGaussian:
    """Correct a belief by one detection of one reflector, linearized at that belief.

    Parameters
    ----------
    belief : before the correction.
    measured_range, measured_bearing : range bias already taken off [m], [rad].
    reflector_x, reflector_y : the reflector's center [m], map frame.
    surveyed_variance : of the reflector's place, each axis [m^2]; adds to R.
    model : of the observation.

    Notes
    -----
    No formula: `correct_aimed`, of the directions.
    """
    aim, facing = direction_of(model.mount_theta + measured_bearing), direction_of(belief.theta)
    return correct_aimed(belief, facing, measured_range, aim, reflector_x, reflector_y, surveyed_variance, model).belief


class Corrected(NamedTuple):
    """A belief after a detection, and the direction of its heading."""

    belief: PoseGaussian
    facing: UnitVector


@compiled_inline
def correct_aimed(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    aim: UnitVector,
    reflector_x: float,
    reflector_y: float,
    surveyed_variance: float,
    model: ObservationModel,
) -> Corrected:
    """Correct a belief like `correct`, by directions instead of angles: without arctangent, sine and cosine.

    Parameters
    ----------
    belief : before the correction; it is linearized there.
    facing : its heading.
    measured_range : range bias already taken off [m].
    aim : measured bearing, in base.
    reflector_x, reflector_y, surveyed_variance, model : as in `correct`.

    Notes
    -----
    x = x + K v, and P as in `corrected_covariance`: Sobreira et al. 2016, Algorithm 1, lines 16 and 17, at the freshest
    state.
    """
    offset_x, offset_y = offset_facing(facing, model)
    dx, dy = reflector_x - (belief.x + offset_x), reflector_y - (belief.y + offset_y)
    e = expect_at(dx, dy, math.nan, offset_x, offset_y)
    turn = turn_to(-e.range_x, -e.range_y, composed(facing, aim))
    v = innovation(belief, e, measured_range, turn, surveyed_variance, model)
    k = gain(v)
    covariance = corrected_covariance(belief, e, k, v.range_noise, v.bearing_noise)
    return moved_by(belief, facing, k, v, covariance)


@compiled_inline
def moved_by(
    belief: PoseGaussian,
    facing: UnitVector,
    k: Gain,
    v: Innovation,
    covariance: tuple[float, float, float, float, float, float],
) -> Corrected:
    """Belief after a detection.

    Parameters
    ----------
    belief, facing : before it, and the direction of its heading.
    k, v : gain and innovation.
    covariance : upper triangle of the one after it, row by row.

    Notes
    -----
    x = x + K v: Sobreira et al. 2016, Algorithm 1, line 16.
    """
    heading = k.tr * v.range + k.tb * v.bearing
    after = PoseGaussian(
        belief.x + k.xr * v.range + k.xb * v.bearing,
        belief.y + k.yr * v.range + k.yb * v.bearing,
        wrap_scalar(belief.theta + heading),
        *covariance,
    )
    return Corrected(after, turned_by(facing, heading))


@compiled_inline
def gain(given: Innovation) -> Gain:
    """Kalman gain, a row per state, solved with the factors of S.

    Notes
    -----
    K = P H^T S^-1: Sobreira et al. 2016, Algorithm 1, line 15.
    """
    v = given
    xb, yb = _second(v.range_px, v.bearing_px, v), _second(v.range_py, v.bearing_py, v)
    tb = _second(v.range_pt, v.bearing_pt, v)
    return Gain(
        v.range_px * v.per_s_rr - v.w * xb,
        xb,
        v.range_py * v.per_s_rr - v.w * yb,
        yb,
        v.range_pt * v.per_s_rr - v.w * tb,
        tb,
    )


@compiled_inline
def corrected_covariance(
    p: PoseGaussian, e: Expected, k: Gain, range_noise: float, bearing_noise: float
) -> tuple[float, float, float, float, float, float]:
    """Upper triangle of the covariance after a correction with any gain.

    Parameters
    ----------
    p : its covariance is P; its mean is not read.
    e : its Jacobian is H.
    k : gain, of this covariance or of another one.
    range_noise, bearing_noise : R [m^2], [rad^2].

    Notes
    -----
    A P A^T + K R K^T with A = I - K H: Joseph form (Bar-Shalom, Li, Kirubarajan 2001, equation 5.2.3-18). A multiplies
    as what it is, the identity less K H: M = P - K (H P), then M - (M H^T - K R) K^T, the upper triangle alone, which
    is the one symmetrization.
    """
    range_px, range_py, range_pt, bearing_px, bearing_py, bearing_pt = covariance_with_expected(p, e)
    m00, m01 = p.xx - k.xr * range_px - k.xb * bearing_px, p.xy - k.xr * range_py - k.xb * bearing_py
    m10, m11 = p.xy - k.yr * range_px - k.yb * bearing_px, p.yy - k.yr * range_py - k.yb * bearing_py
    m20, m21 = p.xt - k.tr * range_px - k.tb * bearing_px, p.yt - k.tr * range_py - k.tb * bearing_py
    m02, m12 = p.xt - k.xr * range_pt - k.xb * bearing_pt, p.yt - k.yr * range_pt - k.yb * bearing_pt
    m22 = p.tt - k.tr * range_pt - k.tb * bearing_pt
    xr = m00 * e.range_x + m01 * e.range_y + m02 * e.range_theta - range_noise * k.xr
    yr = m10 * e.range_x + m11 * e.range_y + m12 * e.range_theta - range_noise * k.yr
    tr = m20 * e.range_x + m21 * e.range_y + m22 * e.range_theta - range_noise * k.tr
    xb = m00 * e.bearing_x + m01 * e.bearing_y + m02 * e.bearing_theta - bearing_noise * k.xb
    yb = m10 * e.bearing_x + m11 * e.bearing_y + m12 * e.bearing_theta - bearing_noise * k.yb
    tb = m20 * e.bearing_x + m21 * e.bearing_y + m22 * e.bearing_theta - bearing_noise * k.tb
    return (
        m00 - xr * k.xr - xb * k.xb,
        m01 - xr * k.yr - xb * k.yb,
        m02 - xr * k.tr - xb * k.tb,
        m11 - yr * k.yr - yb * k.yb,
        m12 - yr * k.tr - yb * k.tb,
        m22 - tr * k.tr - tb * k.tb,
    )


@compiled_inline
def with_cross_noise(
    covariance: tuple[float, float, float, float, float, float], k: Gain, cross_noise: float
) -> tuple[float, float, float, float, float, float]:
    """Upper triangle of a corrected covariance where the noise of range and bearing is correlated.

    Parameters
    ----------
    covariance : without that.
    k : gain.
    cross_noise : covariance of both [m rad].

    Notes
    -----
    P + K [[0, r], [r, 0]] K^T, the rest of K R K^T, by definition.
    """
    xx, xy, xt, yy, yt, tt = covariance
    return (
        xx + 2.0 * cross_noise * k.xr * k.xb,
        xy + cross_noise * (k.xr * k.yb + k.xb * k.yr),
        xt + cross_noise * (k.xr * k.tb + k.xb * k.tr),
        yy + 2.0 * cross_noise * k.yr * k.yb,
        yt + cross_noise * (k.yr * k.tb + k.yb * k.tr),
        tt + 2.0 * cross_noise * k.tr * k.tb,
    )


@compiled_inline
def covariance_with_expected(p: PoseGaussian, e: Expected) -> tuple[float, float, float, float, float, float]:
    """Covariance of x, y and heading with the expected range, then with the expected bearing.

    Parameters
    ----------
    p : its covariance is P; its mean is not read.
    e : its Jacobian is H.

    Notes
    -----
    P H^T, by definition.
    """
    return (
        p.xx * e.range_x + p.xy * e.range_y + p.xt * e.range_theta,
        p.xy * e.range_x + p.yy * e.range_y + p.yt * e.range_theta,
        p.xt * e.range_x + p.yt * e.range_y + p.tt * e.range_theta,
        p.xx * e.bearing_x + p.xy * e.bearing_y + p.xt * e.bearing_theta,
        p.xy * e.bearing_x + p.yy * e.bearing_y + p.yt * e.bearing_theta,
        p.xt * e.bearing_x + p.yt * e.bearing_y + p.tt * e.bearing_theta,
    )


@compiled_inline
def _second(range_p: float, bearing_p: float, given: Innovation) -> float:
    """Second element of S^-1 applied to [range_p, bearing_p]."""
    return (bearing_p - given.w * range_p) * given.per_schur
