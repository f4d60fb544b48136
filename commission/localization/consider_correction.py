"""Correct with considered constants: the belief, and its covariance with them, take in one associated detection.

What the constants are, and what they have to do with a detection, is in `consider`; without them it is `kalman`.
"""

from __future__ import annotations

import math

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray
from commission.geometry.directions import UnitVector, composed, direction_of, turn_to
from commission.localization.consider import (
    CLOCK,
    MOUNT_HEADING,
    MOUNT_X,
    MOUNT_Y,
    RANGE_BIAS,
    Considering,
    ConsiderModel,
    Seen,
    innovation_with,
    seen_with,
)
from commission.localization.kalman import (
    Corrected,
    Gain,
    Innovation,
    correct,
    corrected_covariance,
    gain,
    moved_by,
)
from commission.localization.observation import Expected, ObservationModel, expect_at, offset_facing
from commission.localization.pose_gaussian import PoseGaussian


@compiled_inline
def correct_aimed_with(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    facing: UnitVector,
    measured_range: float,
    aim: UnitVector,
    reflector_x: float,
    reflector_y: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering,
    width: int,
    at: int,
) -> Corrected:
    """Correct a belief, and its covariance with the constants, by one detection of one reflector.

    Parameters
    ----------
    belief, facing : before the correction, where it is linearized, and the direction of its heading.
    measured_range : range bias already taken off [m].
    aim : measured bearing as a direction, in base.
    reflector_x, reflector_y : the reflector's center [m], map frame.
    surveyed_variance : of the reflector's place, each axis [m^2].
    model : of the observation.
    given : of the scan; its working array is corrected in place.
    width : columns of it that are in use.
    at : first of the two columns of the reflector.

    Notes
    -----
    x = x + K v, P = A P A^T + K N K^T - D K^T - K D^T with D = C J^T and N = R + J P_p J^T + H D + (H D)^T, which is
    Joseph's form of the whole state, and C = A C - K J P_p: Schmidt 1966; A = I - K H.
    """
    offset_x, offset_y = offset_facing(facing, model)
    dx, dy = reflector_x - (belief.x + offset_x), reflector_y - (belief.y + offset_y)
    e = expect_at(dx, dy, math.nan, offset_x, offset_y)
    turn = turn_to(-e.range_x, -e.range_y, composed(facing, aim))
    d = seen_with(facing, e, surveyed_variance, given, at)
    v = innovation_with(belief, e, measured_range, turn, model, d)
    k = gain(v)
    covariance = covariance_with(belief, e, k, v, d, 0.0, surveyed_variance, given, width, at)
    return moved_by(belief, facing, k, v, covariance)


@compiled_inline
def covariance_with(  # noqa: PLR0917 - a detection and the constants, number by number
    belief: PoseGaussian,
    e: Expected,
    k: Gain,
    v: Innovation,
    d: Seen,
    cross_noise: float,
    surveyed_variance: float,
    given: Considering,
    width: int,
    at: int,
) -> tuple[float, float, float, float, float, float]:
    """Upper triangle of the covariance after a detection; that with the constants is corrected in place.

    Parameters
    ----------
    belief : before it.
    e, k, v : its Jacobian, the gain and the innovation.
    d : what the constants have to do with it.
    cross_noise : covariance of the noise of range and bearing [m rad].
    surveyed_variance : of the reflector's place, each axis [m^2].
    given, width, at : as in `correct_aimed_with`.

    Notes
    -----
    A P A^T + K N K^T - D K^T - K D^T, C = A C - K J P_p: Schmidt 1966, see `correct_aimed_with`.
    """
    hd_rr = e.range_x * d.xr + e.range_y * d.yr + e.range_theta * d.tr
    hd_rb = e.range_x * d.xb + e.range_y * d.yb + e.range_theta * d.tb
    hd_br = e.bearing_x * d.xr + e.bearing_y * d.yr + e.bearing_theta * d.tr
    hd_bb = e.bearing_x * d.xb + e.bearing_y * d.yb + e.bearing_theta * d.tb
    n_rb = d.rb + hd_rb + hd_br + cross_noise
    xx, xy, xt, yy, yt, tt = corrected_covariance(
        belief, e, k, v.range_noise + d.rr + 2.0 * hd_rr, v.bearing_noise + d.bb + 2.0 * hd_bb
    )
    _correct_cross(given.room.work, width, e, k)
    _add_constants(given.room.work, at, e, k, d, surveyed_variance, given.variances)
    return (
        xx + 2.0 * (n_rb * k.xr * k.xb - d.xr * k.xr - d.xb * k.xb),
        xy + n_rb * (k.xr * k.yb + k.xb * k.yr) - d.xr * k.yr - d.xb * k.yb - k.xr * d.yr - k.xb * d.yb,
        xt + n_rb * (k.xr * k.tb + k.xb * k.tr) - d.xr * k.tr - d.xb * k.tb - k.xr * d.tr - k.xb * d.tb,
        yy + 2.0 * (n_rb * k.yr * k.yb - d.yr * k.yr - d.yb * k.yb),
        yt + n_rb * (k.yr * k.tb + k.yb * k.tr) - d.yr * k.tr - d.yb * k.tb - k.yr * d.tr - k.yb * d.tb,
        tt + 2.0 * (n_rb * k.tr * k.tb - d.tr * k.tr - d.tb * k.tb),
    )


@compiled_inline
def _correct_cross(work: FloatArray, width: int, e: Expected, k: Gain) -> None:
    """A C of every column in use."""
    for j in range(width):
        x, y, theta = work[0, j], work[1, j], work[2, j]
        r = e.range_x * x + e.range_y * y + e.range_theta * theta
        b = e.bearing_x * x + e.bearing_y * y + e.bearing_theta * theta
        work[0, j] = x - k.xr * r - k.xb * b
        work[1, j] = y - k.yr * r - k.yb * b
        work[2, j] = theta - k.tr * r - k.tb * b


@compiled_inline
def _add_constants(  # noqa: PLR0917 - a detection and the constants, number by number
    work: FloatArray, at: int, e: Expected, k: Gain, d: Seen, surveyed_variance: float, p: ConsiderModel
) -> None:
    """Take K J P_p off the columns of those constants that a detection has to do with."""
    _add(work, MOUNT_X, k, p.mount_position * d.mount_xr, p.mount_position * d.mount_xb)
    _add(work, MOUNT_Y, k, p.mount_position * d.mount_yr, p.mount_position * d.mount_yb)
    _add(work, MOUNT_HEADING, k, 0.0, -p.mount_heading)
    _add(work, RANGE_BIAS, k, p.range_bias, 0.0)
    _add(work, CLOCK, k, p.clock * d.clock_r, p.clock * d.clock_b)
    _add(work, at, k, -surveyed_variance * e.range_x, -surveyed_variance * e.bearing_x)
    _add(work, at + 1, k, -surveyed_variance * e.range_y, -surveyed_variance * e.bearing_y)


@compiled_inline
def _add(work: FloatArray, column: int, k: Gain, r: float, b: float) -> None:
    """Take K J P_p off one column."""
    work[0, column] -= k.xr * r + k.xb * b
    work[1, column] -= k.yr * r + k.yb * b
    work[2, column] -= k.tr * r + k.tb * b


@compiled_inline
def correct_given(  # noqa: PLR0917 - a measurement and a reflector, number by number
    belief: PoseGaussian,
    measured_range: float,
    measured_bearing: float,
    reflector_x: float,
    reflector_y: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    at: int,
) -> PoseGaussian:
    """Correct a belief by a detection, with constants where they are considered.

    Parameters
    ----------
    belief, measured_range, measured_bearing : as in `kalman.correct`.
    reflector_x, reflector_y, surveyed_variance, model : as in `kalman.correct`.
    given, at : as in `correct_aimed_with`, or None.

    Notes
    -----
    No formula: `correct`, or `correct_aimed_with` of the directions.
    """
    x, y = reflector_x, reflector_y
    if given is None:
        return correct(belief, measured_range, measured_bearing, x, y, surveyed_variance, model)
    aim, facing, width = (
        direction_of(model.mount_theta + measured_bearing),
        direction_of(belief.theta),
        given.room.work.shape[1],
    )
    return correct_aimed_with(
        belief, facing, measured_range, aim, x, y, surveyed_variance, model, given, width, at
    ).belief
