"""The drive along a route as it is planned: where the vehicle is at each scan when nothing disturbs it.

No noise and no control law: the base stays on the route, at the speeds of its legs, with the rests at their ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from commission.geometry.angles import difference, wrap
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.site.checks import at_least
from commission.site.path import CREEP, KINK, Leg, MotionLimits, legs_of
from commission.site.routes import Route
from commission.site.scanner import Scanner, scan_moments
from commission.site.vehicle import TricycleVehicle, Vehicle


@dataclass(frozen=True, slots=True)
class DrivePlan:
    """Rests and limits of a planned drive."""

    rest: float = 1.0
    """Rest before and after the route [s]."""
    pause: float = 0.5
    """Rest where the vehicle stops on the way: at cusps and kinks [s]."""
    limits: MotionLimits = field(default_factory=MotionLimits)
    """What the drives can do."""

    def __post_init__(self) -> None:
        at_least(self.rest, 0.0, "plan.rest", "s")
        at_least(self.pause, 0.0, "plan.pause", "s")


@dataclass(frozen=True, slots=True, eq=False)
class NominalDrive:
    """Planned motion, sampled at the K scans of a drive. All arrays are read-only."""

    stamps_ns: IntArray
    """(K,) time of each scan [ns], from 0."""
    poses: FloatArray
    """(K, 3) `T_map_base` at each scan [m, m, rad]."""
    metres: FloatArray
    """(K,) way driven since the start [m], never falling."""
    scanners: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(K,) scanner of each scan; of none said, the first."""

    def __post_init__(self) -> None:
        if len(self.scanners) != len(self.stamps_ns):
            object.__setattr__(self, "scanners", read_only(np.zeros(len(self.stamps_ns), np.int64)))

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    @property
    def sets_off(self) -> int:
        """The last scan before the vehicle moves: until then it rests, and is sure of its pose by and by."""
        return max(int(np.searchsorted(self.metres, self.metres[0], side="right")) - 1, 0)

    @property
    def length(self) -> float:
        """Length of the whole way [m]."""
        return float(self.metres[-1])


def nominal_drive(
    route: Route, vehicle: Vehicle, scanners: Sequence[Scanner], plan: DrivePlan | None = None
) -> NominalDrive:
    """Plan the drive along a route from rest to rest.

    Parameters
    ----------
    route : what to drive.
    vehicle : all but a tricycle turn on the spot where the route has a kink; a tricycle steers on after it.
    scanners : their rates give the stamps.
    plan : rests and limits; the defaults when None.

    Returns
    -------
    drive : a pose for each scan.
    """
    plan = plan or DrivePlan()
    pieces: list[FloatArray] = []
    clock, driven = plan.rest, 0.0
    legs = legs_of(route, vehicle, plan.limits)
    for number, leg in enumerate(legs):
        if number:
            clock += plan.pause
            turn = float(difference(leg.start_pose[2], pieces[-1][-1, 3]))
            if abs(turn) > KINK and not isinstance(vehicle, TricycleVehicle):
                clock += abs(turn) / plan.limits.yaw_rate
        piece = _timed(leg, clock, driven)
        clock, driven = float(piece[-1, 0]), float(piece[-1, 4])
        pieces.append(piece)
    # Rows of time, x, y, unwrapped heading and way; what lies between two legs is a rest or a turn on the spot.
    rows = np.concatenate(pieces)
    rows[:, 3] = np.unwrap(rows[:, 3])
    stamps, indices = scan_moments(scanners, round((clock + plan.rest) * 1e9))
    x, y, heading, metres = (np.interp(stamps * 1e-9, rows[:, 0], rows[:, column]) for column in range(1, 5))
    poses = np.stack((x, y, wrap(heading)), axis=1)
    return NominalDrive(read_only(stamps), read_only(poses), read_only(metres), read_only(indices))


def _timed(leg: Leg, start: float, driven: float) -> FloatArray:
    """(N, 5) time [s], x, y, heading and way [m] of a leg's samples; its speeds change linearly in their squares."""
    speeds = np.maximum(leg.speeds, CREEP)
    seconds = np.concatenate(([0.0], np.cumsum(2.0 * leg.step / (speeds[1:] + speeds[:-1]))))
    facing = math.pi if leg.reverse else 0.0
    way = driven + leg.step * np.arange(len(leg.points))
    headings = np.unwrap(leg.travel_headings) + facing
    return np.column_stack((start + seconds, leg.points, headings, way)).astype(np.float64, copy=False)
