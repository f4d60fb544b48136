"""A whole virtual drive: motion, odometry, scans and ground truth as the records of a real vehicle, made from a seed.

Every source of chance (start, wheels, beams, people, lost scans) has its own generator, so that switching one of them
off leaves the others' draws as they were. What is constant over a drive is drawn in `constants`.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, frozen
from commission.progress import Progress, silent
from commission.simulation import follower, people, scan
from commission.simulation.constants import draw_truth, error_of, true_site
from commission.simulation.drive import DriveOptions, TrueMotion, drive, measure
from commission.simulation.goniometer import reflexes_along
from commission.simulation.goods import reels_at
from commission.simulation.people import Crowd, WalkableFloor
from commission.simulation.scan import VirtualScanner
from commission.simulation.tags import tag_frames
from commission.site.disturbances import ScannerError
from commission.site.path import Leg, legs_of
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import ORDER_WITHIN_A_STAMP, Odometry, Record, ReferencePose, Reflex, Scan
from commission.site.scanner import Scanner, scan_moments
from commission.site.truth import Truth

START, WHEELS, BEAMS, PEOPLE, LOSSES = range(5)
TAGS, BEARINGS = 6, 7
"""Streams of random numbers of one seed; 5 is that of `constants`."""

DEFAULTS = DriveOptions()


@dataclass(frozen=True, slots=True, eq=False)
class DriveStart:
    """What is known of the vehicle before it moves: the localizer's initial belief."""

    pose: FloatArray
    """(3,) `T_map_base` at the route's start [m, m, rad]."""
    sigmas: FloatArray
    """(3,) 1-sigma of x [m], y [m] and heading [rad], map frame."""


def start_of(
    project: Project, route_name: str, options: DriveOptions = DEFAULTS, *, legs: Sequence[Leg] | None = None
) -> DriveStart:
    """Return where a drive starts and how far the true start may lie from it.

    Parameters
    ----------
    project : site and vehicle.
    route_name : which route.
    options : sigmas of the start, and limits of the motion.
    legs : those of the route, where they are known.

    Raises
    ------
    UsageError
        there is no such route.
    """
    route = project.route(route_name)
    pose = (legs_of(route, project.vehicle, options.limits) if legs is None else legs)[0].start_pose
    return DriveStart(pose, frozen(options.start_sigma, (3,), "start sigmas"))


def records(
    project: Project,
    route_name: str,
    seed: int,
    *,
    options: DriveOptions = DEFAULTS,
    dirt: Mapping[str, float] | None = None,
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
    dirt : share of the scans in which a reflector does not shine, by its name; where there are intensities, none.
    progress : called at each scan; may raise to cancel.

    Yields
    ------
    record : Odometry (the first one zero), and at each scan a ReferencePose (the truth, also where the scan is lost)
        and a Scan; where the site has tags, frames with them; where the vehicle has a goniometer, its reflexes, and the
        truth at each of them. Stamps start at 0.

    Raises
    ------
    UsageError
        unknown route.
    ProjectError
        the vehicle cannot follow the route.
    """
    truth = draw_truth(project, route_name, seed)
    route, site = project.route(route_name), true_site(project, truth)
    motion = drive(route, project.vehicle, stream_of(seed, START), options)
    slips = project.disturbances.slips_per_100_m
    displacements = measure(motion, project.vehicle, truth.wheels, slips, stream_of(seed, WHEELS))
    stamps, scanners = scan_moments(project.scanners, motion.duration_ns)
    ranging = ~np.array([scanner.is_goniometer for scanner in project.scanners])[scanners]
    stamps, scanners = stamps[ranging], scanners[ranging]
    met = _reflexes(site, motion, seed, truth)
    poses = motion.poses_at(stamps)
    moments = list(itertools.starmap(_Moment, zip(stamps.tolist(), scanners.tolist(), poses, strict=True)))
    virtual = [VirtualScanner.of(site, scanner, dirt) for scanner in site.scanners]
    swept = _swept(_told(moments, progress), motion, project)
    scans = _scans(project, virtual, seed, swept, options.whole_scans)
    shown = np.unique(np.concatenate((stamps, [record.stamp_ns for record in met]))).astype(np.int64)
    yield from heapq.merge(
        _odometry(motion, displacements),
        _reference(shown, motion.poses_at(np.minimum(shown, motion.duration_ns))),
        tag_frames(site, motion, stream_of(seed, TAGS), late_s=truth.tag_camera.clock_offset),
        met,
        *(
            _reported(
                _of_scanner(all_scans, index), project.scanners[index], error_of(truth, project.scanners[index].name)
            )
            for index, all_scans in enumerate(itertools.tee(scans, len(project.scanners)))
        ),
        key=lambda record: (record.stamp_ns, ORDER_WITHIN_A_STAMP[type(record)]),
    )
    progress(1.0, "driving")


def virtual_drive(
    project: Project,
    route_name: str,
    seed: int,
    *,
    options: DriveOptions = DEFAULTS,
    dirt: Mapping[str, float] | None = None,
    progress: Progress = silent,
) -> RecordLog:
    """Gather the records of a whole drive, and what is true in it; parameters and errors as in `records`."""
    names = tuple(scanner.name for scanner in project.scanners)
    log = RecordLog.collect(records(project, route_name, seed, options=options, dirt=dirt, progress=progress), names)
    return replace(log, truth=draw_truth(project, route_name, seed))


def _reflexes(site: Project, motion: TrueMotion, seed: int, truth: Truth) -> list[Reflex]:
    """All that the goniometer of the vehicle reports; nothing where it has none."""
    found = list[Reflex]()
    for scanner in site.scanners:
        if scanner.is_goniometer:
            late_s = scanner.clock_offset + error_of(truth, scanner.name).clock_offset
            found += reflexes_along(site, scanner, motion, stream_of(seed, BEARINGS), late_s=late_s)
    return found


def _odometry(motion: TrueMotion, displacements: FloatArray) -> Iterator[Record]:
    """All odometry records."""
    for stamp, displacement in zip(motion.stamps_ns.tolist(), displacements, strict=True):
        yield Odometry(stamp, displacement)


def _reference(stamps: IntArray, poses: FloatArray) -> Iterator[Record]:
    """The truth at each scan."""
    for stamp, pose in zip(stamps.tolist(), poses, strict=True):
        yield ReferencePose(stamp, pose)


class _Moment(NamedTuple):
    """When a scanner scans: stamp [ns], index of the scanner, pose of base, and (B, 3) those of the beams' times."""

    stamp_ns: int
    scanner: int
    pose: FloatArray
    beam_poses: FloatArray | None = None


def _swept(moments: Iterable[_Moment], motion: TrueMotion, project: Project) -> Iterator[_Moment]:
    """Add the true pose at each beam's time where a sweep takes time; the vehicle stands before and after the drive."""
    offsets = [np.rint(1e9 * scanner.beam_times).astype(np.int64) for scanner in project.scanners]
    for moment in moments:
        if project.scanners[moment.scanner].sweep_duration == 0.0:
            yield moment
        else:
            stamps = np.clip(moment.stamp_ns + offsets[moment.scanner], 0, motion.duration_ns)
            yield moment._replace(beam_poses=motion.poses_at(stamps))


def _scans(
    project: Project, virtual: Sequence[VirtualScanner], seed: int, moments: Iterable[_Moment], whole: bool
) -> Iterator[tuple[int, Scan | None]]:
    """Scanner and scan of each moment, None where it is lost; people walk where the project has floor."""
    disturbances, scanners = project.disturbances, project.scanners
    beams, losses = ([stream_of(seed, kind, index) for index in range(len(scanners))] for kind in (BEAMS, LOSSES))
    walkers = stream_of(seed, PEOPLE)
    crowd: Crowd | None = None
    if disturbances.people:
        crowd = Crowd(WalkableFloor.of(project), disturbances.people, disturbances.walking_speed, walkers)
    nobody = np.empty((0, 3))
    before = -scanners[0].period_ns
    for stamp, index, pose, beam_poses in moments:
        if crowd is not None:
            crowd.step(1e-9 * (stamp - before), pose)
        before = stamp
        legs = nobody if crowd is None else crowd.legs()
        if disturbances.reels:
            legs = np.concatenate([legs, reels_at(disturbances.reels, 1e-9 * stamp)])
        intensities, flags = None, None
        if disturbances.intensity.enabled:
            ranges, intensities = virtual[index].bright_scan(pose, legs, beams[index], beam_poses=beam_poses)
        else:
            ranges, flags = virtual[index].scan(pose, legs, beams[index], whole=whole, beam_poses=beam_poses)
        if any(0.0 <= 1e-9 * stamp - period.start < period.duration for period in disturbances.covered):
            for told in (intensities, flags):
                if told is not None:
                    told[:] = 0
        record = Scan(
            stamp_ns=stamp,
            ranges=ranges,
            angle_min=scanners[index].angle_min,
            angle_increment=scanners[index].angle_increment,
            intensities=intensities,
            reflector=flags,
            scanner=index,
        )
        yield index, None if losses[index].uniform() < disturbances.dropped_scans else record


def _of_scanner(scans: Iterable[tuple[int, Scan | None]], scanner: int) -> Iterator[Scan | None]:
    """Scans of one scanner."""
    return (record for index, record in scans if index == scanner)


def _reported(scans: Iterable[Scan | None], scanner: Scanner, error: ScannerError) -> Iterator[Scan]:
    """Scans that a scanner reports whose ranges and clock are off; what it stamps before the drive is lost."""
    late_ns = round(1e9 * (scanner.clock_offset + error.clock_offset))
    for record in scans:
        if record is None:
            continue
        if error.range_bias == 0.0 and late_ns == 0:
            yield record
            continue
        stamp = record.stamp_ns + late_ns
        ranges = np.maximum(record.ranges + np.float32(error.range_bias), np.float32(0.0))
        if stamp >= 0:
            yield replace(record, stamp_ns=stamp, ranges=ranges)


def _told(moments: Sequence[_Moment], progress: Progress) -> Iterator[_Moment]:
    """Tell of each moment."""
    for index, moment in enumerate(moments):
        progress(index / len(moments), "driving")
        yield moment


def stream_of(seed: int, stream: int, scanner: int = 0) -> np.random.Generator:
    """Generator of one stream of a seed; what the first scanner draws does not depend on how many there are.

    Parameters
    ----------
    seed : of the drive.
    stream : START, WHEELS, BEAMS, PEOPLE or LOSSES.
    scanner : index of the scanner, where each has its own.
    """
    return np.random.default_rng((seed, stream, scanner) if scanner else (seed, stream))


def warm_up() -> None:
    """Compile every kernel of the simulation."""
    follower.warm_up()
    scan.warm_up()
    people.warm_up()
