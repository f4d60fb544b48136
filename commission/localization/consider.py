"""Considered constants: errors of map, mounting, range and clock, which the filter knows of and does not estimate.

A constant averages to nothing only in a filter that takes it for noise. Here its covariance with the pose is kept
(Schmidt 1966), so that a reflector seen a hundred times says no more of the pose than its survey allows.
"""

from __future__ import annotations

from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.directions import UnitVector, direction_of
from commission.localization.kalman import (
    Innovation,
    innovation,
)
from commission.localization.observation import (
    Expected,
    ObservationModel,
)
from commission.localization.odometry import Motion, NextOdometry, velocity
from commission.localization.pose_gaussian import PoseGaussian

PER_REFLECTOR = 2
"""Considered constants of a reflector: its place along x and y of the map."""
PER_SCANNER = 5
"""Of a scanner: x, y and heading of its mounting, range bias, clock."""
MOUNT_X, MOUNT_Y, MOUNT_HEADING, RANGE_BIAS, CLOCK, BLOCKS = range(3, 9)
"""Columns of a scan's working array: three of the transition, those of the scanner, then two for each detection."""


class ConsiderModel(NamedTuple):
    """Variances of the constants of every scanner; those of reflectors stand in `ReflectorIndex.places`."""

    mount_position: float
    """Along x and along y of base [m^2]."""
    mount_heading: float
    range_bias: float
    clock: float


class ConstantsRoom(NamedTuple):
    """Where a run keeps its covariance with the constants, and works a scan out."""

    cross: FloatArray
    """(3, 2 N + 5 S) covariance of the pose with the constants; further kinds of observation have columns behind."""
    work: FloatArray
    """(3, `BLOCKS` + 2 n) room for the largest scan: `consider_columns`."""
    busy: IntArray | None
    """See `busy_chunks`; None: all are."""


class Considering(NamedTuple):
    """What is common to all detections of a scan, and the arrays in which it is worked out."""

    variances: ConsiderModel
    moved_x: float
    """Motion of the belief since the cross covariance was written [m], map axes."""
    moved_y: float
    speed_x: float
    """Velocity of base at the scan [m/s], in base."""
    speed_y: float
    turn_rate: float
    room: ConstantsRoom


@compiled_inline
def cross_of(room: ConstantsRoom | None) -> FloatArray | None:
    """Covariance of the pose with the constants, or None where none is considered.

    Notes
    -----
    No formula: a part of `room`.
    """
    if room is None:
        return None
    return room.cross


@compiled_inline
def busy_of(room: ConstantsRoom | None) -> IntArray | None:
    """Which chunks of its columns may not be zero, see `busy_chunks`, or None where none is considered.

    Notes
    -----
    No formula: a part of `room`.
    """
    if room is None:
        return None
    return room.busy


class Seen(NamedTuple):
    """What the constants have to do with one detection of one reflector."""

    xr: float
    """C J^T: covariance of the pose with what they add to the range (r) and to the bearing (b)."""
    xb: float
    yr: float
    yb: float
    tr: float
    tb: float
    rr: float
    """J P_p J^T: covariance of what they add."""
    rb: float
    bb: float
    mount_xr: float
    """J: of range and bearing with respect to the mounting and the clock; the rest of it is plain."""
    mount_xb: float
    mount_yr: float
    mount_yb: float
    clock_r: float
    clock_b: float


@compiled_inline
def considering(  # noqa: PLR0917 - what the filter knows of its motion
    room: ConstantsRoom | None,
    belief: PoseGaussian,
    pivot: tuple[float, float],
    motion: Motion,
    following: NextOdometry,
    variances: ConsiderModel,
) -> Considering | None:
    """What the detections of a scan have in common; None where nothing is considered.

    Parameters
    ----------
    room, belief, pivot, variances : as in `considering_at`.
    motion, following : odometry before the scan and after it.

    Notes
    -----
    No formula: `considering_at` the `velocity`.
    """
    if room is None:
        return None
    return considering_at(room, belief, pivot, velocity(motion, following), variances)


@compiled_inline
def considering_at(
    room: ConstantsRoom | None,
    belief: PoseGaussian,
    pivot: tuple[float, float],
    twist: tuple[float, float, float],
    variances: ConsiderModel,
) -> Considering | None:
    """What the detections of a scan have in common; None where nothing is considered.

    Parameters
    ----------
    room : covariance of the pose with the constants, and where the scan is worked out; or None.
    belief : after *predict*.
    pivot : place of the belief [m] when `cross` was written.
    twist : velocity of base at the scan [m/s, m/s, rad/s], in base.
    variances : of the constants.

    Notes
    -----
    moved = belief - pivot: what F of all motion since then is made of, by definition.
    """
    if room is None:
        return None
    return Considering(variances, belief.x - pivot[0], belief.y - pivot[1], twist[0], twist[1], twist[2], room)


class ScannerJacobian(NamedTuple):
    """J of range (r) and bearing (b) with respect to mounting and clock; the rest of it is plain."""

    mount_xr: float
    mount_xb: float
    mount_yr: float
    mount_yb: float
    clock_r: float
    clock_b: float


@compiled_inline
def scanner_jacobian(
    facing: UnitVector, e: Expected, speed_x: float, speed_y: float, turn_rate: float
) -> ScannerJacobian:
    """How mounting and clock of the scanner change what it sees.

    Parameters
    ----------
    facing : heading of base.
    e : what is expected of a reflector.
    speed_x, speed_y, turn_rate : velocity of base [m/s, m/s, rad/s], in base.

    Notes
    -----
    H_xy R(theta) of the mounting; -H xdot of a clock that is late by one second. Derived from equation 2 of Sobreira et
    al. 2016.
    """
    c, s = facing
    mount_xr, mount_yr = c * e.range_x + s * e.range_y, c * e.range_y - s * e.range_x
    mount_xb, mount_yb = c * e.bearing_x + s * e.bearing_y, c * e.bearing_y - s * e.bearing_x
    # In base axes, H of the place is that of the mounting.
    return ScannerJacobian(
        mount_xr,
        mount_xb,
        mount_yr,
        mount_yb,
        -(mount_xr * speed_x + mount_yr * speed_y + e.range_theta * turn_rate),
        -(mount_xb * speed_x + mount_yb * speed_y + e.bearing_theta * turn_rate),
    )


@compiled_inline
def seen_with(facing: UnitVector, e: Expected, surveyed_variance: float, given: Considering, at: int) -> Seen:
    """What the constants have to do with a detection.

    Parameters
    ----------
    facing : heading of base.
    e : what is expected of the reflector.
    surveyed_variance : of its place, each axis [m^2].
    given : of the scan.
    at : first of the two columns of the reflector in the working array.

    Notes
    -----
    J = -H_xy of the reflector's place, -1 of the bearing by the mounting's heading, 1 of the range by its bias; the
    rest is `scanner_jacobian`. C J^T and J P_p J^T: derived from equation 2 of Sobreira et al. 2016.
    """
    mount_xr, mount_xb, mount_yr, mount_yb, clock_r, clock_b = scanner_jacobian(
        facing, e, given.speed_x, given.speed_y, given.turn_rate
    )
    p, work = given.variances, given.room.work
    places = surveyed_variance
    rr = p.mount_position * (mount_xr * mount_xr + mount_yr * mount_yr)
    rr += places * (e.range_x * e.range_x + e.range_y * e.range_y) + p.range_bias + p.clock * clock_r * clock_r
    rb = p.mount_position * (mount_xr * mount_xb + mount_yr * mount_yb)
    rb += places * (e.range_x * e.bearing_x + e.range_y * e.bearing_y) + p.clock * clock_r * clock_b
    bb = p.mount_position * (mount_xb * mount_xb + mount_yb * mount_yb) + p.mount_heading
    bb += places * (e.bearing_x * e.bearing_x + e.bearing_y * e.bearing_y) + p.clock * clock_b * clock_b
    jr = (mount_xr, mount_yr, clock_r, -e.range_x, -e.range_y)
    jb = (mount_xb, mount_yb, clock_b, -e.bearing_x, -e.bearing_y)
    return Seen(
        _times(work, 0, at, jr) + work[0, RANGE_BIAS],
        _times(work, 0, at, jb) - work[0, MOUNT_HEADING],
        _times(work, 1, at, jr) + work[1, RANGE_BIAS],
        _times(work, 1, at, jb) - work[1, MOUNT_HEADING],
        _times(work, 2, at, jr) + work[2, RANGE_BIAS],
        _times(work, 2, at, jb) - work[2, MOUNT_HEADING],
        rr,
        rb,
        bb,
        mount_xr,
        mount_xb,
        mount_yr,
        mount_yb,
        clock_r,
        clock_b,
    )


@compiled_inline
def _times(work: FloatArray, row: int, at: int, j: tuple[float, float, float, float, float]) -> float:
    """One element of C J^T, but for the constants whose Jacobian is 1 or -1."""
    mounted = work[row, MOUNT_X] * j[0] + work[row, MOUNT_Y] * j[1] + work[row, CLOCK] * j[2]
    return mounted + work[row, at] * j[3] + work[row, at + 1] * j[4]


@compiled_inline
def innovation_with(  # noqa: PLR0917 - a measurement, number by number
    belief: PoseGaussian,
    e: Expected,
    measured_range: float,
    turn: float,
    model: ObservationModel,
    seen: Seen,
) -> Innovation:
    """Innovation of a detection, constants considered.

    Parameters
    ----------
    belief : before the correction.
    e : observation expected from its mean; its bearing is not read.
    measured_range : range bias already taken off [m].
    turn : from the expected bearing to the measured one [rad].
    model : of the observation.
    seen : what the constants have to do with it.

    Notes
    -----
    S = H P H^T + H C J^T + (H C J^T)^T + J P_p J^T + R, and P H^T + C J^T for the gain: Schmidt 1966; Jazwinski 1970,
    section 8.5.
    """
    range_px = belief.xx * e.range_x + belief.xy * e.range_y + belief.xt * e.range_theta + seen.xr
    range_py = belief.xy * e.range_x + belief.yy * e.range_y + belief.yt * e.range_theta + seen.yr
    range_pt = belief.xt * e.range_x + belief.yt * e.range_y + belief.tt * e.range_theta + seen.tr
    bearing_px = belief.xx * e.bearing_x + belief.xy * e.bearing_y + belief.xt * e.bearing_theta + seen.xb
    bearing_py = belief.xy * e.bearing_x + belief.yy * e.bearing_y + belief.yt * e.bearing_theta + seen.yb
    bearing_pt = belief.xt * e.bearing_x + belief.yt * e.bearing_y + belief.tt * e.bearing_theta + seen.tb
    s_rr = e.range_x * (range_px + seen.xr) + e.range_y * (range_py + seen.yr) + e.range_theta * (range_pt + seen.tr)
    s_rb = e.bearing_x * range_px + e.bearing_y * range_py + e.bearing_theta * range_pt
    s_rb += e.range_x * seen.xb + e.range_y * seen.yb + e.range_theta * seen.tb + seen.rb
    s_bb = e.bearing_x * (bearing_px + seen.xb) + e.bearing_y * (bearing_py + seen.yb)
    s_bb += e.bearing_theta * (bearing_pt + seen.tb) + seen.bb + model.bearing_variance
    # S - R is positive semi-definite; rounding may not say so.
    s_rr = max(s_rr + seen.rr + model.range_variance, model.range_variance)
    per_s_rr = 1.0 / s_rr
    w = s_rb * per_s_rr
    schur = max(s_bb - w * s_rb, model.bearing_variance)
    return Innovation(
        measured_range - e.range,
        turn,
        s_rr,
        w,
        schur,
        per_s_rr,
        1.0 / schur,
        model.range_variance,
        model.bearing_variance,
        range_px,
        range_py,
        range_pt,
        bearing_px,
        bearing_py,
        bearing_pt,
    )


@compiled_inline
def innovation_given(  # noqa: PLR0917 - a measurement, number by number
    belief: PoseGaussian,
    e: Expected,
    measured_range: float,
    measured_bearing: float,
    surveyed_variance: float,
    model: ObservationModel,
    given: Considering | None,
    at: int,
) -> Innovation:
    """Innovation of a detection, with constants where they are considered.

    Parameters
    ----------
    belief, e, measured_range, measured_bearing, surveyed_variance, model : as in `kalman.innovation`.
    given, at : as in `seen_with`, or None.

    Notes
    -----
    No formula: `innovation` or `innovation_with`.
    """
    turn = wrap_scalar(measured_bearing - e.bearing)
    if given is None:
        return innovation(belief, e, measured_range, turn, surveyed_variance, model)
    seen = seen_with(direction_of(belief.theta), e, surveyed_variance, given, at)
    return innovation_with(belief, e, measured_range, turn, model, seen)
