"""A whole virtual drive: motion, odometry, scans and ground truth as the records of a real vehicle, made from a seed.

Every source of chance (start, wheels, beams, people, lost scans) has its own generator, so that switching one of them
off leaves the others' draws as they were. What is constant over a drive is drawn in `constants`.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, frozen
from commission.progress import Progress, silent
from commission.simulation import follower, scan
from commission.simulation.constants import draw_truth, error_of, true_site
from commission.simulation.drive import DriveOptions, TrueMotion, drive, measure
from commission.simulation.people import Crowd, WalkableFloor
from commission.simulation.scan import VirtualScanner
from commission.site.disturbances import ScannerError
from commission.site.path import legs_of
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import ORDER_WITHIN_A_STAMP, Odometry, Record, ReferencePose, Scan

START, WHEELS, BEAMS, PEOPLE, LOSSES = range(5)
"""Streams of random numbers of one seed."""

DEFAULTS = DriveOptions()


@dataclass(frozen=True, slots=True, eq=False)
class DriveStart:
    """What is known of the vehicle before it moves: the localizer's initial belief."""

    pose: FloatArray
    """(3,) `T_map_base` at the route's start [m, m, rad]."""
    sigmas: FloatArray
    """(3,) 1-sigma of x [m], y [m] and heading [rad], map frame."""


def start_of(project: Project, route_name: str, options: DriveOptions = DEFAULTS) -> DriveStart:
    """Return where a drive starts and how far the true start may lie from it.

    Parameters
    ----------
    project : site and vehicle.
    route_name : which route.
    options : sigmas of the start, and limits of the motion.

    Raises
    ------
    UsageError
        there is no such route.
    """
    route = project.route(route_name)
    pose = legs_of(route, project.vehicle, options.limits)[0].start_pose
    return DriveStart(pose, frozen(options.start_sigma, (3,), "start sigmas"))


def records(
    project: Project,
    route_name: str,
    seed: int,
    *,
    options: DriveOptions = DEFAULTS,
    progress: Progress = silent,
) -> Iterator[Record]:
    """Drive a route and deliver the vehicle's records in order, one scan at a time.

    Parameters
    ----------
    project : site, vehicle, scanner and disturbances, among them the wheels' true noise and the constant errors. What
        the filter believes, `parameters`, is not read.
    route_name : which route.
    seed : the same seed, project and options give the same records to the last bit.
    options : rates, rests and limits. Scans and odometry share their stamps where the rates divide.
    progress : called at each scan; may raise to cancel.

    Yields
    ------
    record : Odometry (the first one zero), and at each scan a ReferencePose (the truth, also where the scan is lost)
        and a Scan. Stamps start at 0.

    Raises
    ------
    UsageError
        unknown route.
    ProjectError
        the vehicle cannot follow the route.
    """
    truth = draw_truth(project, route_name, seed)
    route, site = project.route(route_name), true_site(project, truth)
    motion = drive(route, project.vehicle, _rng(seed, START), options)
    slips = project.disturbances.slips_per_100_m
    displacements = measure(motion, project.vehicle, truth.wheels, slips, _rng(seed, WHEELS))
    stamps = np.arange(0, motion.duration_ns + 1, project.scanners[0].period_ns, dtype=np.int64)
    poses = motion.poses_at(stamps)
    scans = _scans(project, site, seed, zip(stamps.tolist(), poses, strict=True), options.whole_scans)
    yield from heapq.merge(
        _odometry(motion, displacements),
        _reference(stamps, poses),
        _told(_as_reported(scans, error_of(truth, project.scanners[0].name)), len(stamps), progress),
        key=lambda record: (record.stamp_ns, ORDER_WITHIN_A_STAMP[type(record)]),
    )
    progress(1.0, "driving")


def virtual_drive(
    project: Project,
    route_name: str,
    seed: int,
    *,
    options: DriveOptions = DEFAULTS,
    progress: Progress = silent,
) -> RecordLog:
    """Gather the records of a whole drive, and what is true in it; parameters and errors as in `records`."""
    log = RecordLog.collect(records(project, route_name, seed, options=options, progress=progress))
    return replace(log, truth=draw_truth(project, route_name, seed))


def _odometry(motion: TrueMotion, displacements: FloatArray) -> Iterator[Record]:
    """All odometry records."""
    for stamp, displacement in zip(motion.stamps_ns.tolist(), displacements, strict=True):
        yield Odometry(stamp, displacement)


def _reference(stamps: IntArray, poses: FloatArray) -> Iterator[Record]:
    """The truth at each scan."""
    for stamp, pose in zip(stamps.tolist(), poses, strict=True):
        yield ReferencePose(stamp, pose)


def _scans(
    project: Project, site: Project, seed: int, moments: Iterable[tuple[int, FloatArray]], whole: bool
) -> Iterator[Scan | None]:
    """One scan per moment, None where it is lost; people walk where the project has floor, beams meet the true site."""
    disturbances = project.disturbances
    scanner = VirtualScanner.of(site, site.scanners[0])
    beams, losses, walkers = _rng(seed, BEAMS), _rng(seed, LOSSES), _rng(seed, PEOPLE)
    crowd: Crowd | None = None
    if disturbances.people:
        crowd = Crowd(WalkableFloor.of(project), disturbances.people, disturbances.walking_speed, walkers)
    nobody = np.empty((0, 3))
    seconds = 1e-9 * project.scanners[0].period_ns
    for stamp, pose in moments:
        if crowd is not None:
            crowd.step(seconds, pose)
        ranges, flags = scanner.scan(pose, nobody if crowd is None else crowd.legs(), beams, whole=whole)
        if any(0.0 <= 1e-9 * stamp - period.start < period.duration for period in disturbances.covered):
            flags[:] = False
        record = Scan(
            stamp_ns=stamp,
            ranges=ranges,
            angle_min=project.scanners[0].angle_min,
            angle_increment=project.scanners[0].angle_increment,
            intensities=None,
            reflector=flags,
        )
        yield None if losses.uniform() < disturbances.dropped_scans else record


def _as_reported(scans: Iterator[Scan | None], error: ScannerError) -> Iterator[Scan | None]:
    """Scans as a scanner reports them whose ranges and clock are off; what it stamps before the drive is lost."""
    late_ns = round(1e9 * error.clock_offset)
    for record in scans:
        if record is None or (error.range_bias == 0.0 and late_ns == 0):
            yield record
            continue
        stamp = record.stamp_ns + late_ns
        ranges = np.maximum(record.ranges + np.float32(error.range_bias), np.float32(0.0))
        yield None if stamp < 0 else replace(record, stamp_ns=stamp, ranges=ranges)


def _told(scans: Iterator[Scan | None], count: int, progress: Progress) -> Iterator[Record]:
    """Tell of each scan, and pass on those that are not lost."""
    for index, record in enumerate(scans):
        progress(index / count, "driving")
        if record is not None:
            yield record


def _rng(seed: int, stream: int) -> np.random.Generator:
    """Generator of one stream of a seed."""
    return np.random.default_rng((seed, stream))


def warm_up() -> None:
    """Compile every kernel of the simulation."""
    follower.warm_up()
    scan.warm_up()
