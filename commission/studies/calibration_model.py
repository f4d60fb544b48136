"""What a recording says of poses and constants together: residuals, their Jacobians, and what is unknown.

Detections and odometry of a whole drive as rows; nothing is solved or decided in here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.studies.calibration_track import WHEELS, Track, at, between, moved_by_wheels, track_of

PER_SCANNER = 4
"""Unknown constants of a scanner: x, y and heading of its mounting, offset of its clock."""
SMALLEST_RANGE = 1e-3
"""Ranges are not linearized below this [m]."""
SMOOTH_S, SMOOTH_SCANS = 0.25, 3.0
"""Half the time over which a motion is averaged where wheels and clocks are fitted: at least so long [s], and scans."""
LEAST_VARIANCES = np.array([1e-9, 1e-9, 1e-10])
"""Of any motion, so that no row is of infinite weight: along, across [m^2], heading [rad^2]."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each unknown constant stands; all are differences to what the project says."""

    scanners: int
    """Number of scanners."""
    reflectors: int
    """Number of reflectors."""

    @property
    def size(self) -> int:
        """Number of unknown constants."""
        return self.places + 2 * self.reflectors

    @property
    def bias(self) -> int:
        """Range bias of all scanners [m]."""
        return PER_SCANNER * self.scanners

    @property
    def wheels(self) -> int:
        """First of the constants of the wheels: scale of way and turn, turn per metre [rad/m]."""
        return self.bias + 2

    @property
    def range_scale(self) -> int:
        """Share by which the bias grows with the range: ranges that are too long in proportion."""
        return self.bias + 1

    @property
    def places(self) -> int:
        """First of x and y of each reflector [m]."""
        return self.wheels + WHEELS

    def mounting(self, scanner: int) -> slice:
        """Return where x, y [m] and heading [rad] of a scanner's mounting are."""
        return slice(PER_SCANNER * scanner, PER_SCANNER * scanner + 3)

    def clock(self, scanner: int) -> int:
        """Return where the offset of a scanner's clock is [s]."""
        return PER_SCANNER * scanner + 3


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MeasuredDrive:
    """What was measured: K scans with n detections in total, and the odometry."""

    odometry_ns: IntArray
    """(M,) stamps of odometry [ns]."""
    displacements: FloatArray
    """(M, 3) as the project corrects them [m, m, rad]."""
    missing: FloatArray
    """(M,) variance of the motion that was not told before each record, along each axis [m^2]; 0 where none is."""
    stamps_ns: IntArray
    """(K,) of the scans [ns]."""
    scanners: IntArray
    """(K,) scanner of each."""
    middles: FloatArray
    """(S,) when the middle of a sweep is measured after its stamp, by the project's clock offset [s]."""
    mountings: FloatArray
    """(S, 3) by the project [m, m, rad]."""
    places: FloatArray
    """(N, 2) reflectors of the map [m]."""
    cycle: IntArray
    """(n,) scan of each detection."""
    measured: FloatArray
    """(n, 2) range without the project's bias [m] and bearing, counter-clockwise seen from above [rad]."""
    delays: FloatArray
    """(n,) how much later than the middle of its sweep each was measured [s]."""

    @property
    def layout(self) -> Layout:
        """Where each unknown constant stands."""
        return Layout(len(self.mountings), len(self.places))


class Point(NamedTuple):
    """What is assumed: a pose for each scan, at the time of its middle, and the constants."""

    poses: FloatArray
    """(K, 3) `T_map_base` [m, m, rad]."""
    constants: FloatArray
    """(p,) see `Layout`."""


class SightRows(NamedTuple):
    """Rows of the detections: two for each."""

    residuals: FloatArray
    """(n, 2) measured minus expected range [m] and bearing [rad]."""
    by_pose: FloatArray
    """(n, 2, 3) derivative of what is expected with respect to the pose of its scan."""
    by_constants: FloatArray
    """(n, 2, 8) with respect to mounting x, y, heading, clock, range bias and scale, and x, y of its reflector."""
    ranges: FloatArray
    """(n,) expected without a bias [m]."""


class MotionRows(NamedTuple):
    """Rows of the odometry between scans: along the motion, across it, heading."""

    residuals: FloatArray
    """(K - 1, 3) reported minus assumed motion [m, m, rad]."""
    by_before: FloatArray
    """(K - 1, 3, 3) derivative of what is assumed with respect to the pose before."""
    by_after: FloatArray
    """(K - 1, 3, 3) with respect to the pose after."""
    by_wheels: FloatArray
    """(K - 1, 3, 3) of assumed minus reported with respect to the wheels' constants."""
    chords: FloatArray
    """(K - 1,) length of the motion [m]."""
    growth: FloatArray
    """(K - 1, 3) way [m], turn [rad] and time [s]: what the variances grow with."""
    missing: FloatArray
    """(K - 1,) variance of motion that was not told [m^2]."""


def moments(drive: MeasuredDrive, constants: FloatArray) -> FloatArray:
    """(K,) when the middle of each scan was measured, by the clock of the odometry [ns]."""
    layout = drive.layout
    late = np.array([constants[layout.clock(s)] for s in range(layout.scanners)])
    return drive.stamps_ns + 1e9 * (drive.middles - late)[drive.scanners]


def track(drive: MeasuredDrive, constants: FloatArray) -> Track:
    """Odometry of the drive with assumed wheels."""
    return track_of(drive.odometry_ns, drive.displacements, wheels_of(drive, constants))


def wheels_of(drive: MeasuredDrive, constants: FloatArray) -> FloatArray:
    """(3,) constants of the wheels: scale of way and turn, turn per metre [rad/m]."""
    first = drive.layout.wheels
    return constants[first : first + WHEELS]


def see(drive: MeasuredDrive, point: Point, reflector: IntArray, twists: FloatArray) -> SightRows:
    """Rows of detections that belong to reflectors.

    Parameters
    ----------
    drive : what was measured.
    point : what is assumed.
    reflector : (n,) reflector of each detection.
    twists : (K, 3) velocity of base at each scan [m/s, m/s, rad/s].

    Notes
    -----
    h of Sobreira et al. 2016, equation 2, from the pose at the detection's own time, X exp(tau v); a scanner that moves
    by ds changes the range by -u ds and the bearing by -n ds / range, u the direction of the ray and n to its left.
    """
    layout, k = drive.layout, drive.cycle
    s = drive.scanners[k]
    mounted = drive.mountings + np.stack([point.constants[layout.mounting(i)] for i in range(layout.scanners)])
    places = drive.places + point.constants[layout.places :].reshape(-1, 2)
    base = point.poses[k]
    moved = se2.compose(base, se2.exp(drive.delays[:, np.newaxis] * twists[k]))
    scanner = se2.compose(moved, mounted[s])
    ray = places[reflector] - scanner[:, :2]
    distance = np.maximum(np.hypot(ray[:, 0], ray[:, 1]), SMALLEST_RANGE)
    ux, uy = ray[:, 0] / distance, ray[:, 1] / distance
    bias = point.constants[layout.bias] + point.constants[layout.range_scale] * distance
    expected = np.stack((distance + bias, np.arctan2(uy, ux) - scanner[:, 2]), axis=1)
    residuals = drive.measured - expected
    residuals[:, 1] = wrap(residuals[:, 1])

    longer = 1.0 + point.constants[layout.range_scale]

    def by_motion(x: FloatArray, y: FloatArray, turn: FloatArray | float) -> FloatArray:
        """(n, 2) of a scanner that moves by x, y in the map and turns."""
        return np.stack((-longer * (ux * x + uy * y), -(ux * y - uy * x) / distance - turn), axis=1)

    one, none = np.ones(len(k)), np.zeros(len(k))
    lever = scanner[:, :2] - base[:, :2]
    by_pose = np.stack(
        (by_motion(one, none, 0.0), by_motion(none, one, 0.0), by_motion(-lever[:, 1], lever[:, 0], 1.0)), 2
    )
    c, sine = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    arm = scanner[:, :2] - moved[:, :2]
    # Not the velocity by odometry, whose noise is in the residuals too: it draws clocks to the middle between records.
    forward, left, turn = velocities(point.poses, moments(drive, point.constants))[k].T
    speed_x = c * forward - sine * left - turn * arm[:, 1]
    speed_y = sine * forward + c * left + turn * arm[:, 0]
    by_constants = np.stack(
        (
            by_motion(c, sine, 0.0),
            by_motion(-sine, c, 0.0),
            by_motion(none, none, 1.0),
            -by_motion(speed_x, speed_y, turn),
            np.stack((one, none), axis=1),
            np.stack((distance, none), axis=1),
            -by_motion(one, none, 0.0),
            -by_motion(none, one, 0.0),
        ),
        axis=2,
    )
    return SightRows(residuals, by_pose, by_constants, distance)


def constant_columns(drive: MeasuredDrive, reflector: IntArray) -> IntArray:
    """(n, 8) which unknown each column of `SightRows.by_constants` is of."""
    layout, s = drive.layout, drive.scanners[drive.cycle]
    first = PER_SCANNER * s
    places = layout.places + 2 * reflector
    bias = np.full(len(s), layout.bias)
    return np.stack((first, first + 1, first + 2, first + 3, bias, bias + 1, places, places + 1), axis=1)


def move(drive: MeasuredDrive, point: Point, way: Track, times: FloatArray) -> MotionRows:
    """Rows of the odometry between one scan and the next.

    Parameters
    ----------
    drive : what was measured.
    point : what is assumed.
    way : `track` of the drive with these constants.
    times : (K,) `moments` of the scans [ns], ascending.

    Notes
    -----
    The rows are turned along the chord, and the one across has half the heading's lever taken off, so that the three
    are independent under the noise of `odometry.predict`, whose heading acts with the moments L / 2 and L^2 / 3.
    The derivative by the wheels is that of a longer motion about each interval, whose noise is that of poses before and
    after: an instrumental variable (Fuller 1987, section 1.4). With the motion that odometry reports itself, noise in
    both shrinks a scale of turns by 6 %, with that of the poses between two scans it grows by as much.
    """
    reported = between(at(way, times))
    assumed = se2.relative(point.poses[:-1], point.poses[1:])
    by_wheels = moved_by_wheels(_steady(point.poses, times), wheels_of(drive, point.constants))
    residuals = reported - assumed
    residuals[:, 2] = wrap(residuals[:, 2])
    theta = point.poses[:-1, 2]
    c, s = np.cos(theta), np.sin(theta)
    by_before, by_after = np.zeros((2, len(theta), 3, 3))
    by_after[:, 0, 0], by_after[:, 0, 1], by_after[:, 1, 0], by_after[:, 1, 1], by_after[:, 2, 2] = c, s, -s, c, 1.0
    by_before[:, :, :2] = -by_after[:, :, :2]
    by_before[:, 0, 2], by_before[:, 1, 2], by_before[:, 2, 2] = assumed[:, 1], -assumed[:, 0], -1.0
    chords = np.hypot(reported[:, 0], reported[:, 1])
    # A vehicle that hardly moves errs along its own axis.
    direction = np.where(chords > 1e-6, np.arctan2(reported[:, 1], reported[:, 0]), 0.5 * reported[:, 2])
    c, s = np.cos(direction), np.sin(direction)
    turned = np.zeros((len(theta), 3, 3))
    turned[:, 0, 0], turned[:, 0, 1], turned[:, 1, 0], turned[:, 1, 1], turned[:, 2, 2] = c, s, -s, c, 1.0
    turned[:, 1, 2] = -0.5 * chords
    return MotionRows(
        np.einsum("kij,kj->ki", turned, residuals),
        turned @ by_before,
        turned @ by_after,
        -turned @ by_wheels,
        chords,
        growth(way, times),
        np.diff(np.interp(times, drive.odometry_ns, np.cumsum(drive.missing))),
    )


def velocities(poses: FloatArray, times: FloatArray) -> FloatArray:
    """(K, 3) velocity of base at each scan, averaged over a longer time about it [m/s, m/s, rad/s].

    Parameters
    ----------
    poses : (K, 3) `T_map_base` at the scans [m, m, rad].
    times : (K,) of the scans [ns], ascending.
    """
    seconds = (times - times[0]) * 1e-9
    half = _half_s(times)
    unwrapped = np.column_stack((poses[:, :2], np.unwrap(poses[:, 2])))
    begin, end = np.maximum(seconds - half, 0.0), np.minimum(seconds + half, seconds[-1])
    before, after = (
        np.stack([np.interp(at_s, seconds, axis) for axis in unwrapped.T], axis=1) for at_s in (begin, end)
    )
    moved = se2.log(se2.relative(before, after)) / np.maximum(end - begin, 1e-9)[:, np.newaxis]
    return moved


def _steady(poses: FloatArray, times: FloatArray) -> FloatArray:
    """(K - 1, 3) motion between scans at those velocities [m, m, rad]."""
    found = velocities(poses, times)
    seconds = np.diff(times)[:, np.newaxis] * 1e-9
    return se2.exp(0.5 * (found[1:] + found[:-1]) * seconds)


def growth(way: Track, times: FloatArray) -> FloatArray:
    """(K - 1, 3) way [m], turn [rad] and time [s] between some times [ns], each record's taken by its amount.

    Way and turn are those of a longer time about each interval: by its own ones, a motion whose noise adds to it would
    weigh less than one whose noise takes from it, and turns would seem larger by a few percent.
    """
    steps = np.column_stack((np.hypot(way.twists[:, 0], way.twists[:, 1]), np.abs(way.twists[:, 2])))
    sums = np.cumsum(steps, axis=0)
    middles, half = 0.5 * (times[1:] + times[:-1]), 1e9 * _half_s(times)
    begin, end = np.maximum(middles - half, times[0]), np.minimum(middles + half, times[-1])
    grown = np.stack(
        [np.interp(end, way.stamps_ns, each) - np.interp(begin, way.stamps_ns, each) for each in sums.T], axis=1
    )
    share = np.diff(times) / np.maximum(end - begin, 1.0)
    return np.column_stack((share[:, np.newaxis] * grown, np.diff(times) * 1e-9))


def _half_s(times: FloatArray) -> float:
    """Half the time over which motion is averaged [s]."""
    return max(SMOOTH_S, SMOOTH_SCANS * float(np.median(np.diff(times))) * 1e-9)


def motion_variances(moved: MotionRows, per: FloatArray) -> FloatArray:
    """(K - 1, 3) variances of the rows of the odometry.

    Parameters
    ----------
    moved : the rows.
    per : (6,) variances: forward per metre and second, lateral per metre, heading per metre, radian and second.
    """
    way, turn, seconds = moved.growth.T
    heading = per[3] * way + per[4] * turn + per[5] * seconds
    along = per[0] * way + per[1] * seconds
    across = per[2] * way + heading * moved.chords**2 / 12.0
    missing = moved.missing[:, np.newaxis]
    return np.stack((along, across, heading), axis=1) + LEAST_VARIANCES + missing


def chosen(drive: MeasuredDrive, rows: BoolArray) -> MeasuredDrive:
    """Return the drive with some of its detections."""
    from dataclasses import replace

    return replace(drive, cycle=drive.cycle[rows], measured=drive.measured[rows], delays=drive.delays[rows])
