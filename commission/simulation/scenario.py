"""A whole virtual drive: motion, odometry, scans and ground truth as the records of a real vehicle, made from a seed.

Every source of chance (start, wheels, beams, people, lost scans) has its own generator, so that switching one of them
off leaves the others' draws as they were.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, frozen
from commission.progress import Progress, silent
from commission.simulation import follower, scan
from commission.simulation.drive import DriveOptions, TrueMotion, drive, measure
from commission.simulation.people import Crowd, WalkableFloor
from commission.simulation.scan import VirtualScanner
from commission.site.path import legs_of
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, Record, ReferencePose, Scan

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
    project : site, vehicle, scanner, `parameters.odometry` (the wheels' true noise) and disturbances.
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
    route = project.route(route_name)
    disturbances = project.disturbances
    motion = drive(route, project.vehicle, _rng(seed, START), options)
    displacements = measure(
        motion, project.vehicle, project.parameters.odometry, disturbances.slips_per_100_m, _rng(seed, WHEELS)
    )
    stamps = np.arange(0, motion.duration_ns + 1, project.scanner.period_ns, dtype=np.int64)
    poses = motion.poses_at(stamps)
    scans = _scans(project, seed, stamps, poses, options.whole_scans)
    done = 0
    for index, (stamp, pose) in enumerate(zip(stamps.tolist(), poses, strict=True)):
        progress(index / len(stamps), "driving")
        due = int(np.searchsorted(motion.stamps_ns, stamp, side="right"))
        yield from _odometry(motion, displacements, done, due)
        done = due
        yield ReferencePose(stamp, pose)
        scan_record = next(scans)
        if scan_record is not None:
            yield scan_record
    yield from _odometry(motion, displacements, done, len(displacements))
    progress(1.0, "driving")


def virtual_drive(
    project: Project,
    route_name: str,
    seed: int,
    *,
    options: DriveOptions = DEFAULTS,
    progress: Progress = silent,
) -> RecordLog:
    """Gather the records of a whole drive; parameters and errors as in `records`."""
    return RecordLog.collect(records(project, route_name, seed, options=options, progress=progress))


def _odometry(motion: TrueMotion, displacements: FloatArray, first: int, last: int) -> Iterator[Record]:
    """Odometry records of rows `first` to before `last`."""
    for row in range(first, last):
        yield Odometry(int(motion.stamps_ns[row]), displacements[row])


def _scans(project: Project, seed: int, stamps: IntArray, poses: FloatArray, whole: bool) -> Iterator[Scan | None]:
    """One scan per stamp, None where it is lost."""
    disturbances = project.disturbances
    scanner = VirtualScanner.of(project)
    beams, losses, walkers = _rng(seed, BEAMS), _rng(seed, LOSSES), _rng(seed, PEOPLE)
    crowd: Crowd | None = None
    if disturbances.people:
        crowd = Crowd(WalkableFloor.of(project), disturbances.people, disturbances.walking_speed, walkers)
    nobody = np.empty((0, 3))
    seconds = 1e-9 * project.scanner.period_ns
    for stamp, pose in zip(stamps.tolist(), poses, strict=True):
        if crowd is not None:
            crowd.step(seconds, pose)
        ranges, flags = scanner.scan(pose, nobody if crowd is None else crowd.legs(), beams, whole=whole)
        if any(0.0 <= 1e-9 * stamp - period.start < period.duration for period in disturbances.covered):
            flags[:] = False
        record = Scan(
            stamp_ns=stamp,
            ranges=ranges,
            angle_min=project.scanner.angle_min,
            angle_increment=project.scanner.angle_increment,
            intensities=None,
            reflector=flags,
        )
        yield None if losses.uniform() < disturbances.dropped_scans else record


def _rng(seed: int, stream: int) -> np.random.Generator:
    """Generator of one stream of a seed."""
    return np.random.default_rng((seed, stream))


def warm_up() -> None:
    """Compile every kernel of the simulation."""
    follower.warm_up()
    scan.warm_up()
