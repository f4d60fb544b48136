"""A route as something to drive: legs between two stops, sampled densely, each with its speed over the way.

Only geometry and speed limits: prediction and simulation plan the same legs. How a vehicle follows them is not here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.angles import difference
from commission.geometry.arrays import FloatArray, frozen
from commission.site.routes import Direction, Route, Segment
from commission.site.vehicle import TricycleVehicle, Vehicle

STEP = 0.005
"""Distance between samples [m]: a chord of 5 mm leaves a curve of 1 m radius by 3 um."""
KINK = math.radians(2.0)
"""Change of direction between two segments from which the vehicle has to stop [rad]."""
STEERING_WINDOW = 0.1
"""Way over which the needed steering rate is averaged [m]: a join of two curves is a step no wheel can follow."""
CREEP = 0.02
"""Lowest speed while on the way [m/s]: starts the motion, and reaches the stop in finite time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionLimits:
    """What the drives of a heavy indoor vehicle can do and its load may suffer."""

    acceleration: float = 0.4
    """Along the way, speeding up and braking [m/s^2]."""
    lateral_acceleration: float = 0.4
    """In curves [m/s^2]."""
    yaw_rate: float = 1.0
    """Turning rate [rad/s]."""
    yaw_acceleration: float = 3.0
    """Change of the turning rate [rad/s^2]."""
    steering_rate: float = 1.5
    """Rate of the steered wheel of a tricycle [rad/s]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Leg:
    """The way from one stop to the next, driven in one direction."""

    points: FloatArray
    """(N, 2) samples of the way [m], map frame; equally spaced but for the rounding of the length."""
    step: float
    """Distance between samples [m]."""
    travel_headings: FloatArray
    """(N,) direction of travel [rad]; in reverse the vehicle's rear points there."""
    curvatures: FloatArray
    """(N,) change of that direction over the way [1/m]."""
    speeds: FloatArray
    """(N,) speed allowed [m/s], 0 at both ends."""
    reverse: bool
    """Whether the rear goes ahead."""

    @property
    def length(self) -> float:
        """Length of the way [m]."""
        return self.step * (len(self.points) - 1)

    @property
    def start_pose(self) -> FloatArray:
        """(3,) `T_map_base` of a vehicle that stands ready on the first sample."""
        turn = math.pi if self.reverse else 0.0
        heading = float(difference(self.travel_headings[0] + turn, 0.0))
        return frozen([*self.points[0], heading], (3,), "start pose")


def legs_of(route: Route, vehicle: Vehicle, limits: MotionLimits) -> tuple[Leg, ...]:
    """Cut a route where the vehicle must stop: at cusps and at kinks.

    Parameters
    ----------
    route : at least one segment; neighbors share their end points.
    vehicle : the steering of a tricycle limits its speed where the curvature changes.
    limits : acceleration and turning rate.

    Returns
    -------
    legs : in order of driving.
    """
    runs: list[list[Segment]] = []
    for segment in route.segments:
        if runs and _goes_on(runs[-1][-1], segment):
            runs[-1].append(segment)
        else:
            runs.append([segment])
    return tuple(_leg(route, run, vehicle, limits) for run in runs)


def _goes_on(before: Segment, after: Segment) -> bool:
    """Whether the vehicle can drive from one segment into the next without a stop."""
    if before.direction is not after.direction:
        return False
    end, start = before.spline(), after.spline()
    turn = difference(start.heading(start.domain[0]), end.heading(end.domain[1]))
    return bool(abs(turn) <= KINK)


def _leg(route: Route, run: list[Segment], vehicle: Vehicle, limits: MotionLimits) -> Leg:
    """Sample the segments of one leg at equal distances and give each sample its speed."""
    splines = [segment.spline() for segment in run]
    ends = np.cumsum([spline.length for spline in splines])
    count = max(2, round(float(ends[-1]) / STEP) + 1)
    s = np.linspace(0.0, float(ends[-1]), count)
    points, headings, curvatures = np.empty((count, 2)), np.empty(count), np.empty(count)
    speeds = np.empty(count)
    owner = np.minimum(np.searchsorted(ends, s, side="left"), len(run) - 1)
    for index, (segment, spline) in enumerate(zip(run, splines, strict=True)):
        mine = owner == index
        u = spline.u_at(s[mine] - (ends[index] - spline.length))
        points[mine] = spline.point(u)
        headings[mine] = spline.heading(u)
        curvatures[mine] = spline.curvature(u)
        speeds[mine] = route.speed_of(segment)
    # Where control points coincide the tangent vanishes; the chord to the next sample is as good.
    chords = np.diff(points, axis=0, append=2.0 * points[-1:] - points[-2:-1])
    headings = np.where(np.isfinite(headings), headings, np.arctan2(chords[:, 1], chords[:, 0]))
    curvatures = np.where(np.isfinite(curvatures), curvatures, 0.0)
    step = float(ends[-1]) / (count - 1)
    speeds = _speed_profile(np.minimum(speeds, _speed_in_curves(curvatures, step, vehicle, limits)), step, limits)
    return Leg(
        points=frozen(points, (None, 2), "points"),
        step=step,
        travel_headings=frozen(headings, (None,), "travel headings"),
        curvatures=frozen(curvatures, (None,), "curvatures"),
        speeds=frozen(speeds, (None,), "speeds"),
        reverse=run[0].direction is Direction.REVERSE,
    )


def _speed_in_curves(curvatures: FloatArray, step: float, vehicle: Vehicle, limits: MotionLimits) -> FloatArray:
    """(N,) speed at which lateral acceleration, yaw rate and steering rate stay within their limits [m/s]."""
    bend = np.maximum(np.abs(curvatures), 1e-9)
    speeds = np.minimum(np.sqrt(limits.lateral_acceleration / bend), limits.yaw_rate / bend)
    if isinstance(vehicle, TricycleVehicle):
        steering = np.arctan(vehicle.wheelbase * curvatures)
        reach = max(1, round(0.5 * STEERING_WINDOW / step))
        padded = np.pad(steering, reach, mode="edge")
        rate = np.abs(padded[2 * reach :] - padded[: -2 * reach]) / (2 * reach * step)
        # Half of what the drive can do is left to the controller.
        speeds = np.minimum(speeds, 0.5 * limits.steering_rate / np.maximum(rate, 1e-9))
    return np.maximum(speeds, CREEP)


def _speed_profile(limit: FloatArray, step: float, limits: MotionLimits) -> FloatArray:
    """(N,) highest speed under a limit that starts and ends at rest within the acceleration: a trapezoid at least."""
    slope = 2.0 * limits.acceleration * step * np.arange(len(limit))
    squared = limit**2
    squared[0] = squared[-1] = 0.0
    squared = np.minimum.accumulate(squared - slope) + slope
    squared = (np.minimum.accumulate((squared - slope[::-1])[::-1]) + slope)[::-1]
    return np.sqrt(np.maximum(squared, 0.0))
