"""A drive along a route: the true motion, and the odometry that the vehicle reports of it.

The follower steers by the true pose. The wheels' errors therefore never show in the motion, only in its report; for the
localizer it makes no difference which of the two is called the error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from commission.errors import ProjectError
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray, frozen
from commission.geometry.se2 import compose, exp
from commission.localization.kinematics import body_twist, wheel_speeds
from commission.simulation.follower import drives_of, follow_leg, way_of
from commission.site.path import CREEP, Leg, MotionLimits, legs_of
from commission.site.routes import Route
from commission.site.truth import TrueWheels
from commission.site.vehicle import DifferentialVehicle, TricycleVehicle, Vehicle

PAUSE_AT_STOP = 0.5
"""Rest between two legs [s]."""
SLIP_DURATION = (0.1, 0.3)
"""Shortest and longest slip [s]."""
SLIP_EXCESS = (0.2, 0.6)
"""Smallest and largest share by which a slipping wheel turns too fast."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveOptions:
    """How a virtual drive is driven and reported."""

    odometry_rate: float = 50.0
    """Odometry records, and control steps, per second [1/s]."""
    rest: float = 1.0
    """Rest before and after the route [s]."""
    start_sigma: tuple[float, float, float] = (0.01, 0.01, 0.005)
    """1-sigma of the true start pose about the route's start, along x [m], y [m] and heading [rad]."""
    limits: MotionLimits = field(default_factory=MotionLimits)
    """What the drives can do."""
    whole_scans: bool = True
    """Whether every beam is cast. Without those that can meet no reflector a drive takes a third of the time, and what
    is detected is the same to the last bit; a vehicle that looks for itself does not know what those went through."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.odometry_rate) and 1.0 <= self.odometry_rate <= 1000.0):
            raise ValueError(f"odometry_rate is {self.odometry_rate:g}; expected 1 to 1000 records per second")
        if not (math.isfinite(self.rest) and self.rest >= 0.0):
            raise ValueError(f"rest is {self.rest:g}; expected 0 s or more")
        if not all(math.isfinite(sigma) and sigma >= 0.0 for sigma in self.start_sigma):
            raise ValueError(f"start_sigma is {self.start_sigma}; expected three numbers, 0 or more")

    @property
    def period_ns(self) -> int:
        """Time between odometry records [ns]."""
        return round(1e9 / self.odometry_rate)


@dataclass(frozen=True, slots=True, eq=False)
class TrueMotion:
    """The true motion of base, a constant twist from one stamp to the next."""

    stamps_ns: IntArray
    """(M,) [ns], equally spaced from 0."""
    poses: FloatArray
    """(M, 3) `T_map_base` at each stamp [m, m, rad]."""
    twists: FloatArray
    """(M, 3) twist that led to each pose, base frame [m/s, m/s, rad/s]; the first row is zero."""

    @property
    def period_ns(self) -> int:
        """Time between two stamps [ns]."""
        return int(self.stamps_ns[1] - self.stamps_ns[0])

    @property
    def duration_ns(self) -> int:
        """Time from the first to the last stamp [ns]."""
        return int(self.stamps_ns[-1] - self.stamps_ns[0])

    def poses_at(self, stamps_ns: IntArray) -> FloatArray:
        """Poses of base in map at any stamps of the drive: (K, 3) array [m, m, rad]; exact, not interpolated."""
        before = np.clip(stamps_ns // self.period_ns, 0, len(self.poses) - 2)
        seconds = 1e-9 * (stamps_ns - self.stamps_ns[before])
        on_stamp = (stamps_ns - self.stamps_ns[before])[:, np.newaxis] == self.period_ns
        moved = compose(self.poses[before], exp(self.twists[before + 1] * seconds[:, np.newaxis]))
        return np.where(on_stamp, self.poses[before + 1], moved)


def drive(
    route: Route,
    vehicle: Vehicle,
    rng: np.random.Generator,
    options: DriveOptions,
    *,
    legs: Sequence[Leg] | None = None,
) -> TrueMotion:
    """Drive a route from rest to rest.

    Parameters
    ----------
    route, vehicle : what to follow, and with which kinematics.
    rng : draws the true start pose.
    options : rates, rests and limits.
    legs : those of the route, where they are known: to find them takes longer than to drive.

    Returns
    -------
    motion : true poses at the odometry's stamps.

    Raises
    ------
    ProjectError
        when the vehicle cannot follow the route to its end (it steers too little for its curves).
    """
    legs = legs_of(route, vehicle, options.limits) if legs is None else legs
    period = 1e-9 * options.period_ns
    drives = drives_of(vehicle, options.limits, period)
    pose = compose(legs[0].start_pose, rng.standard_normal(3) * options.start_sigma)
    standing = np.zeros((max(1, round(options.rest / period)) + 1, 3))
    poses, twists = [np.repeat(pose[np.newaxis], len(standing), axis=0)], [standing]
    for number, leg in enumerate(legs):
        steps = _patience(leg, period)
        leg_poses, leg_twists = np.empty((steps, 3)), np.empty((steps, 3))
        count = follow_leg(drives, way_of(leg), pose, leg_poses, leg_twists)
        if count == steps:
            raise ProjectError(
                f"route {route.name!r}: the {vehicle.kind} vehicle does not reach the end of leg {number + 1} of "
                f"{len(legs)}; expected curves that it can steer"
            )
        pose = leg_poses[count - 1].copy() if count else pose
        rest = options.rest if number == len(legs) - 1 else PAUSE_AT_STOP
        standing = np.zeros((round(rest / period), 3))
        poses += [leg_poses[:count], np.repeat(pose[np.newaxis], len(standing), axis=0)]
        twists += [leg_twists[:count], standing]
    all_poses = np.concatenate(poses)
    stamps = np.arange(len(all_poses), dtype=np.int64) * options.period_ns
    return TrueMotion(
        stamps, frozen(all_poses, (None, 3), "poses"), frozen(np.concatenate(twists), (None, 3), "twists")
    )


def _patience(leg: Leg, period: float) -> int:
    """Control steps after which a leg counts as not drivable: three times what its speeds take, and ten seconds."""
    seconds = float(np.sum(leg.step / np.maximum(leg.speeds, CREEP)))
    return round((3.0 * seconds + 10.0) / period)


def measure(
    motion: TrueMotion,
    vehicle: Vehicle,
    wheels: TrueWheels,
    slips_per_100_m: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Displacements that the vehicle reports: the true ones by wheels of the wrong size, with noise and slips.

    Parameters
    ----------
    motion : true motion.
    vehicle : which wheels can slip.
    wheels : their noise, drawn from in the base frame by the filter's own model, so that a filter with the same figures
        is consistent: along and across the motion with the square root of the distance, in heading with that of
        distance, turn and time, along the vehicle's axis with that of time. And their scale.
    slips_per_100_m : mean number of slips, each of one wheel that turns too fast for a moment.
    rng : draws the noise, then the slips.

    Returns
    -------
    displacements : (M, 3) array [m, m, rad] in the base frame at the stamp before; the first row is zero.
    """
    period = 1e-9 * motion.period_ns
    noise = wheels.noise
    reported = _with_slips(
        replace(motion, twists=scaled(motion.twists, vehicle, wheels)), vehicle, slips_per_100_m, rng
    )
    reported *= period
    moves = motion.twists * period
    distance = np.hypot(moves[:, 0], moves[:, 1])
    turn = np.abs(moves[:, 2])
    direction = moves[:, :2] / np.where(distance > 0.0, distance, 1.0)[:, np.newaxis]
    draws = rng.standard_normal((len(moves), 4))
    along = noise.forward_per_sqrt_m * np.sqrt(distance) * draws[:, 0]
    across = noise.lateral_per_sqrt_m * np.sqrt(distance) * draws[:, 1]
    heading = np.sqrt(
        noise.heading_per_sqrt_m**2 * distance
        + noise.heading_per_sqrt_rad**2 * turn
        + noise.heading_per_sqrt_s**2 * period
    )
    reported[:, 0] += along * direction[:, 0] - across * direction[:, 1]
    reported[:, 1] += along * direction[:, 1] + across * direction[:, 0]
    reported[:, 0] += noise.forward_per_sqrt_s * math.sqrt(period) * draws[:, 2]
    reported[:, 2] += heading * draws[:, 3]
    reported[0] = 0.0
    displacements = exp(reported)
    displacements[:, 2] = wrap(displacements[:, 2])
    return displacements


def driven_wheels(vehicle: Vehicle) -> int:
    """Number of wheels whose turning is measured; the steering angle of a tricycle is no wheel."""
    return 1 if isinstance(vehicle, TricycleVehicle) else len(wheel_speeds(vehicle, np.zeros(3)))


def scaled(twists: FloatArray, vehicle: Vehicle, wheels: TrueWheels) -> FloatArray:
    """Twists that a vehicle believes to make whose wheels are smaller, or farther apart, than it knows.

    Parameters
    ----------
    twists : (M, 3) true ones [m/s, m/s, rad/s], base frame.
    vehicle : as it believes to be.
    wheels : their scale.

    Returns
    -------
    believed : (M, 3) the same array where nothing is wrong.

    Notes
    -----
    For every kind of vehicle the way from true to believed twist is linear: true twist, speeds of the true wheels, what
    they report, twist of the vehicle's own wheels.
    """
    each = np.array(wheels.wheel_scales) if wheels.wheel_scales else np.zeros(driven_wheels(vehicle))
    if not (each.any() or wheels.forward_scale or wheels.separation_scale):
        return twists
    true_vehicle = _with_separation(vehicle, 1.0 + wheels.separation_scale)
    columns = []
    for axis in np.eye(3):
        turning = np.array(wheel_speeds(true_vehicle, axis))
        turning[: len(each)] *= (1.0 + wheels.forward_scale) * (1.0 + each)
        columns.append(body_twist(vehicle, turning))
    return twists @ np.array(columns)


def _with_separation(vehicle: Vehicle, factor: float) -> Vehicle:
    """Return a vehicle whose wheels are farther apart by a factor."""
    if isinstance(vehicle, DifferentialVehicle):
        return replace(vehicle, wheel_separation=factor * vehicle.wheel_separation)
    if isinstance(vehicle, TricycleVehicle):
        return replace(vehicle, wheelbase=factor * vehicle.wheelbase)
    return replace(vehicle, center_distance=factor * vehicle.center_distance)


def _with_slips(motion: TrueMotion, vehicle: Vehicle, per_100_m: float, rng: np.random.Generator) -> FloatArray:
    """(M, 3) twists that the wheels report; where one slips it reports a motion that did not happen."""
    reported = np.array(motion.twists)
    period = 1e-9 * motion.period_ns
    travelled = np.cumsum(np.hypot(reported[:, 0], reported[:, 1])) * period
    count = int(rng.poisson(per_100_m * travelled[-1] / 100.0))
    for place in np.sort(rng.uniform(0.0, travelled[-1], count)):
        first = int(np.searchsorted(travelled, place))
        steps = max(1, round(rng.uniform(*SLIP_DURATION) / period))
        excess = 1.0 + rng.uniform(*SLIP_EXCESS)
        choice = rng.uniform()
        for row in range(first, min(first + steps, len(reported))):
            wheels = np.array(wheel_speeds(vehicle, motion.twists[row]))
            wheels[int(choice * driven_wheels(vehicle))] *= excess
            reported[row] = body_twist(vehicle, wheels)
    return reported
