"""PID control along parametric curves (Sobreira et al. 2016, section 5.1) for all three kinds of vehicle, compiled.

It knows the way and the pose, nothing of sensors: the drive feeds it the true pose, as the paper's test fed it the pose
of the reference system.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, frozen
from commission.geometry.se2 import compose_scalars, exp_scalars
from commission.site.path import CREEP, Leg, MotionLimits
from commission.site.vehicle import OmnidirectionalVehicle, TricycleVehicle, Vehicle

DIFFERENTIAL, TRICYCLE, OMNIDIRECTIONAL = 0, 1, 2
END = 0.0005
"""Distance to the end of a leg at which the vehicle stands [m]."""
TURN_ON_SPOT = math.radians(3.0)
"""Heading error before a leg from which a vehicle that can turns on the spot [rad]."""
TURNED = 0.002
"""Heading error at which that turn is done [rad]."""
STEERED = 0.02
"""Steering error at which a tricycle sets off [rad]."""

# The error across the way settles over a distance, not over a time: its second derivative by the way is the curvature.
# Critically damped poles at 1/0.35 m give kp = 1/L^2 and kd = 2/L; ki takes out what steering offsets would leave.
SETTLING_LENGTH = 0.35
KP = 1.0 / SETTLING_LENGTH**2
KD = 2.0 / SETTLING_LENGTH
KI = 0.5
MAX_INTEGRAL = 0.05
OMNI_ACROSS_GAIN = 2.0
OMNI_HEADING_GAIN = 3.0


class Drives(NamedTuple):
    """What the kernel has to know of vehicle and limits."""

    kind: int
    """DIFFERENTIAL, TRICYCLE or OMNIDIRECTIONAL."""
    wheelbase: float
    """Of a tricycle [m]."""
    max_steering: float
    """Of a tricycle [rad]."""
    period: float
    """Time between control steps [s]."""
    acceleration: float
    """Along the way [m/s^2]."""
    yaw_rate: float
    """[rad/s]."""
    yaw_acceleration: float
    """[rad/s^2]."""
    steering_rate: float
    """[rad/s]."""


class LegArrays(NamedTuple):
    """A leg as bare arrays."""

    points: FloatArray
    """(N, 2) [m]."""
    step: float
    """[m]."""
    headings: FloatArray
    """(N,) direction of travel [rad]."""
    curvatures: FloatArray
    """(N,) [1/m]."""
    speeds: FloatArray
    """(N,) [m/s]."""
    sign: float
    """1 forward, -1 in reverse."""


def drives_of(vehicle: Vehicle, limits: MotionLimits, period: float) -> Drives:
    """Collect the kernel's numbers.

    Parameters
    ----------
    vehicle : any kind.
    limits : of its motion.
    period : time between control steps [s].
    """
    kind, wheelbase, max_steering = DIFFERENTIAL, 1.0, math.pi / 2
    if isinstance(vehicle, TricycleVehicle):
        # Straight across, the base would not move however fast the driven wheel turns.
        kind, wheelbase = TRICYCLE, vehicle.wheelbase
        max_steering = min(math.radians(vehicle.max_steering_deg), math.radians(89.0))
    elif isinstance(vehicle, OmnidirectionalVehicle):
        kind = OMNIDIRECTIONAL
    return Drives(
        kind,
        wheelbase,
        max_steering,
        period,
        limits.acceleration,
        limits.yaw_rate,
        limits.yaw_acceleration,
        limits.steering_rate,
    )


def way_of(leg: Leg) -> LegArrays:
    """Bare arrays of a leg."""
    sign = -1.0 if leg.reverse else 1.0
    return LegArrays(leg.points, leg.step, leg.travel_headings, leg.curvatures, leg.speeds, sign)


class RoutePlace(NamedTuple):
    """Where the vehicle is relative to the way."""

    sample: int
    """Nearest sample."""
    s: float
    """Arc length [m]."""
    across: float
    """Distance to the way, left of the direction of travel is positive [m]."""
    turned: float
    """Heading error [rad]."""


class Actuators(NamedTuple):
    """What the vehicle does at one moment."""

    speed: float
    """Along the way [m/s]."""
    yaw_rate: float
    """[rad/s]."""
    steering: float
    """Of a tricycle [rad]."""
    integral: float
    """Of the error across, over the way [m^2]."""
    turning: bool
    """Still turns on the spot before it sets off."""
    steered: bool
    """Has its wheel where the way begins; a tricycle steers at rest first, as a driver does."""


@compiled
def follow_leg(drives: Drives, way: LegArrays, start: FloatArray, poses: FloatArray, twists: FloatArray) -> int:
    """Drive one leg from rest to rest.

    Parameters
    ----------
    drives, way : vehicle and leg.
    start : (3,) true pose of base in map.
    poses, twists : (K, 3) outputs: after each control step the pose [m, m, rad], and the twist
        [m/s, m/s, rad/s] in the base frame that led there.

    Returns
    -------
    steps : rows written; K when the end was not reached in time.

    Notes
    -----
    curvature = way's - KP e - KD sin(heading error) - KI integral of e over the way, e the error across: PID of
    Sobreira et al. 2016, section 5.1, over distance instead of time.
    """
    x, y, theta = start[0], start[1], start[2]
    place = _place(way, 0, x, y, theta)
    on_spot = drives.kind != TRICYCLE
    state = Actuators(0.0, 0.0, 0.0, 0.0, on_spot and abs(place.turned) > TURN_ON_SPOT, on_spot)
    for k in range(len(poses)):
        place = _place(way, place.sample, x, y, theta)
        if way.step * (len(way.points) - 1) - place.s <= END:
            return k
        state, vx, vy = _control(drives, way, place, state)
        dx, dy, dtheta = exp_scalars(vx * drives.period, vy * drives.period, state.yaw_rate * drives.period)
        x, y, theta = compose_scalars(x, y, theta, dx, dy, dtheta)
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, theta
        twists[k, 0], twists[k, 1], twists[k, 2] = vx, vy, state.yaw_rate
    return len(poses)


@compiled
def _control(drives: Drives, way: LegArrays, place: RoutePlace, state: Actuators) -> tuple[Actuators, float, float]:
    """One control step: actuators after it, and the velocity of base in its own frame [m/s]."""
    turning = state.turning and abs(place.turned) > TURNED
    speed = 0.0
    if state.steered and not turning:
        speed = min(max(_speed_at(way, place.s), CREEP), state.speed + drives.acceleration * drives.period)
    integral = state.integral + place.across * speed * drives.period
    integral = min(max(integral, -MAX_INTEGRAL), MAX_INTEGRAL)
    bend = way.curvatures[place.sample]
    curvature = bend - KP * place.across - KD * math.sin(place.turned) - KI * integral
    vx, vy = way.sign * speed, 0.0
    if drives.kind == TRICYCLE:
        wanted = math.atan(drives.wheelbase * way.sign * curvature)
        steering = _towards(state.steering, wanted, drives.steering_rate * drives.period, drives.max_steering)
        steered = state.steered or abs(steering - wanted) < STEERED or abs(steering) >= drives.max_steering
        yaw_rate = vx * math.tan(steering) / drives.wheelbase
        return Actuators(speed, yaw_rate, steering, integral, False, steered), vx, vy
    wanted = speed * curvature
    if turning:
        wanted = -2.0 * place.turned
    elif drives.kind == OMNIDIRECTIONAL:
        vx, vy = _slide(way.sign, speed, place.across, place.turned)
        wanted = speed * bend - OMNI_HEADING_GAIN * place.turned
    yaw_rate = _towards(state.yaw_rate, wanted, drives.yaw_acceleration * drives.period, drives.yaw_rate)
    return Actuators(speed, yaw_rate, 0.0, integral, turning, True), vx, vy


@compiled
def _slide(sign: float, speed: float, across: float, turned: float) -> tuple[float, float]:
    """Velocity in the base frame of a vehicle that also moves sideways, back to the way [m/s]."""
    along, left = sign * speed, -sign * OMNI_ACROSS_GAIN * across
    c, s = math.cos(turned), math.sin(turned)
    return c * along + s * left, c * left - s * along


@compiled
def _place(way: LegArrays, index: int, x: float, y: float, theta: float) -> RoutePlace:
    """Find the nearest sample from `index` on, and the errors there."""
    while index + 1 < len(way.points) and _squared(way, index + 1, x, y) <= _squared(way, index, x, y):
        index += 1
    heading = way.headings[index]
    c, s = math.cos(heading), math.sin(heading)
    dx, dy = x - way.points[index, 0], y - way.points[index, 1]
    facing = 0.0 if way.sign > 0.0 else math.pi
    turned = wrap_scalar(theta + facing - heading)
    return RoutePlace(index, index * way.step + c * dx + s * dy, c * dy - s * dx, turned)


@compiled
def _squared(way: LegArrays, index: int, x: float, y: float) -> float:
    """Squared distance to a sample [m^2]."""
    dx, dy = x - way.points[index, 0], y - way.points[index, 1]
    return dx * dx + dy * dy


@compiled
def _speed_at(way: LegArrays, s: float) -> float:
    """Allowed speed at an arc length [m/s], interpolated in its square, which braking changes linearly."""
    place = min(max(s / way.step, 0.0), len(way.speeds) - 1.000001)
    index = int(place)
    share = place - index
    return math.sqrt((1.0 - share) * way.speeds[index] ** 2 + share * way.speeds[index + 1] ** 2)


@compiled
def _towards(value: float, wanted: float, step: float, limit: float) -> float:
    """One step of a rate-limited and bounded actuator."""
    wanted = min(max(wanted, -limit), limit)
    return min(max(wanted, value - step), value + step)


def warm_up() -> None:
    """Compile the follower on a way of three samples."""
    line = frozen([[0.0, 0.0], [0.01, 0.0], [0.02, 0.0]], (3, 2), "points")
    zeros, speeds = frozen(np.zeros(3), (3,), "headings"), frozen(np.full(3, 0.1), (3,), "speeds")
    drives = Drives(DIFFERENTIAL, 1.0, 1.0, 0.02, 0.4, 1.0, 3.0, 1.5)
    way = LegArrays(line, 0.01, zeros, zeros, speeds, 1.0)
    follow_leg(drives, way, np.zeros(3), np.empty((4, 3)), np.empty((4, 3)))
