"""Small random drives for the localizer's tests: noise exactly as the filter assumes, records of any rates."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Belief
from commission.localization.observation import range_bearing
from commission.localization.setup import LocalizerSetup
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan
from commission.site.reflectors import Reflector, ReflectorMap


@dataclass(frozen=True)
class Drive:
    """Records and the true pose at each scan."""

    records: list[Record]
    initial: Belief
    truth: FloatArray

    scanners: tuple[str, ...] = ("scanner",)

    @property
    def log(self) -> RecordLog:
        return RecordLog.collect(self.records, self.scanners)


@dataclass(frozen=True)
class Plan:
    """How a random drive goes."""

    scans: int = 100
    odometry_ns: int = 20_000_000
    scan_ns: int = 40_000_000
    scan_offset_ns: int = 0
    speed: float = 0.5
    clutter: float = 0.5
    reach: float = 15.0
    beams: int = 0
    """Beams of raw scans; 0: the sensor detects."""
    slip: float = 0.0
    """Turn that the odometry reports and the vehicle does not make, halfway [rad]."""
    both_after: int = -1
    """Scan from which the sensor also sends detections of its own."""


def random_map(rng: np.random.Generator, count: int, side: float = 20.0, **more: float) -> ReflectorMap:
    places = rng.uniform(0.0, side, (count, 2))
    return ReflectorMap(tuple(Reflector(id=f"R{i}", x=float(x), y=float(y), **more) for i, (x, y) in enumerate(places)))


def odometry_error(
    rng: np.random.Generator, displacement: FloatArray, seconds: float, setup: LocalizerSetup
) -> FloatArray:
    """Motion that happened when `displacement` was measured, drawn as the filter's noise model says (halfway)."""
    noise = setup.filter.odometry
    chord = math.hypot(displacement[0], displacement[1])
    direction = math.atan2(displacement[1], displacement[0]) - 0.5 * displacement[2]
    along = rng.normal() * math.sqrt(noise.forward_per_m * chord)
    across = rng.normal() * math.sqrt(noise.lateral_per_m * chord)
    axis = rng.normal() * math.sqrt(noise.forward_per_s * seconds)
    heading = rng.normal() * math.sqrt(
        noise.heading_per_m * chord + noise.heading_per_rad * abs(displacement[2]) + noise.heading_per_s * seconds
    )
    c, s = math.cos(direction), math.sin(direction)
    half = se2.exp(0.5 * se2.log(displacement))
    error = np.array([c * along - s * across + axis, s * along + c * across, heading])
    return se2.compose(se2.compose(half, error), half)


def random_drive(setup: LocalizerSetup, rng: np.random.Generator, plan: Plan) -> Drive:
    """A drive on a circle of 4 m radius in the middle of a 20 m hall; several scanners take turns."""
    start = np.array([10.0, 6.0, 0.0])
    covariance = np.diag([0.02, 0.02, 0.005]) ** 2
    pose = se2.compose(start, rng.multivariate_normal(np.zeros(3), covariance))
    stop_ns = plan.scans * plan.scan_ns + plan.scan_offset_ns
    odometry = range(0, stop_ns + plan.odometry_ns, plan.odometry_ns)
    scans = [plan.scan_offset_ns + k * plan.scan_ns for k in range(plan.scans)]
    records: list[Record] = []
    truth: list[FloatArray] = []
    seconds = plan.odometry_ns * 1e-9
    measured = se2.exp(np.array([plan.speed, 0.0, plan.speed / 4.0]) * seconds)
    pending = list(scans)
    for stamp in odometry:
        moved = np.zeros(3) if stamp == 0 else measured
        happened = moved if stamp == 0 else odometry_error(rng, measured, seconds, setup)
        while pending and pending[0] < stamp:
            share = (pending[0] - (stamp - plan.odometry_ns)) / plan.odometry_ns
            between = se2.compose(pose, se2.exp(share * se2.log(happened)))
            _scan(records, truth, pending.pop(0), between, setup, rng, plan)
        pose = se2.compose(pose, happened)
        slips = plan.slip != 0.0 and 0 <= stamp - stop_ns // 2 < plan.odometry_ns
        records.append(Odometry(stamp, moved + np.array([0.0, 0.0, plan.slip]) if slips else moved))
        while pending and pending[0] == stamp:
            _scan(records, truth, pending.pop(0), pose, setup, rng, plan)
    names = tuple(scanner.name for scanner in setup.scanners)
    return Drive(records, Belief(0, start, covariance), np.array(truth), names)


def _scan(
    records: list[Record],
    truth: list[FloatArray],
    stamp: int,
    pose: FloatArray,
    setup: LocalizerSetup,
    rng: np.random.Generator,
    plan: Plan,
) -> None:
    records.append(ReferencePose(stamp, pose))
    index = len(truth)
    truth.append(pose)
    alone = dataclasses.replace(setup, scanners=(setup.scanners[index % len(setup.scanners)],))
    scanner = index % len(setup.scanners)
    if plan.beams == 0 or 0 <= plan.both_after <= index:
        records.append(Detections(stamp, detections(pose, alone, rng, plan), scanner))
    if plan.beams:
        records.append(dataclasses.replace(scan(stamp, pose, alone, rng, plan), scanner=scanner))


def detections(pose: FloatArray, setup: LocalizerSetup, rng: np.random.Generator, plan: Plan) -> FloatArray:
    model = setup.observations[0]
    expected = range_bearing(pose, setup.scanners[0].mounting, setup.reflectors.centers)
    seen = expected[expected[:, 0] < plan.reach]
    sigma = [math.sqrt(model.range_variance), math.sqrt(model.bearing_variance)]
    seen = seen + rng.normal(size=seen.shape) * sigma + [model.range_bias, 0.0]
    seen = seen[seen[:, 0] > 0.0]  # of a reflector that the scanner has driven into, noise would make a range below 0
    false = rng.uniform([0.5, -math.pi], [plan.reach, math.pi], (rng.poisson(plan.clutter), 2))
    return rng.permutation(np.concatenate([seen, false]))


def scan(stamp: int, pose: FloatArray, setup: LocalizerSetup, rng: np.random.Generator, plan: Plan) -> Scan:
    """Cast a full turn of beams against the cylinders alone; clutter is single flagged beams."""
    increment = 2.0 * math.pi / plan.beams
    bearings = -math.pi + increment * np.arange(plan.beams)
    ranges = np.full(plan.beams, 18.0)
    flags = np.zeros(plan.beams, dtype=bool)
    for (distance, bearing), radius in zip(
        range_bearing(pose, setup.scanners[0].mounting, setup.reflectors.centers), setup.reflectors.radii, strict=True
    ):
        if not radius < distance < plan.reach:
            continue
        turn = np.arctan2(np.sin(bearings - bearing), np.cos(bearings - bearing))
        offset = distance * np.sin(turn)
        hit = (np.abs(offset) < radius) & (np.abs(turn) < 0.5 * math.pi)
        near = distance * np.cos(turn) - np.sqrt(np.maximum(radius**2 - offset**2, 0.0))
        hit &= near < ranges
        ranges[hit] = near[hit]
        flags |= hit
    ranges += rng.normal(0.0, 0.005, plan.beams)
    for beam in rng.integers(0, plan.beams, rng.poisson(plan.clutter)):
        flags[beam] = True
    ranges[rng.uniform(size=plan.beams) < 0.002] = np.nan
    return Scan(
        stamp_ns=stamp,
        ranges=ranges.astype(np.float32),
        angle_min=-math.pi,
        angle_increment=increment,
        intensities=None,
        reflector=flags,
    )
