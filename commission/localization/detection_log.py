"""The detections of a whole recording as columns: extracted once, kept by the caller, replayed with any gate."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_parallel, parallel_range
from commission.geometry.arrays import BoolArray, FloatArray, Growing, IntArray, read_only
from commission.localization.bearing_cycles import BearingCycles, reflexes_among, reflexes_in_turn
from commission.localization.clusters import count_clusters
from commission.localization.detector import (
    INLIER,
    detect_clusters,
    reflective_beams,
    room_for,
    status_of_reported,
    without_blind,
)
from commission.localization.detector_model import BeamColumns, DetectorModel, beams_at, beams_of
from commission.localization.setup import LocalizerSetup
from commission.localization.tag_frames import TagCycles, among, in_turn
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanLog

SCANS_AT_ONCE = 512
"""Scans that are in memory at once: 1 MB of ranges of 541 beams."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DetectionLog:
    """What was detected in each scan of a drive, before any association."""

    stamps_ns: IntArray
    """(K,) time of each scan [ns], ascending."""
    scanners: IntArray
    """(K,) scanner of each scan, index in the setup."""
    offsets: IntArray
    """(K + 1,) rows of scan k: offsets[k] to offsets[k + 1]."""
    range_bearing: FloatArray
    """(n, 2) range [m] and bearing [rad] of each detection and rejected cluster, scanner frame."""
    beams: IntArray
    """(n,) width of each cluster [beams]; 0 where the sensor itself detected."""
    expected: FloatArray
    """(n,) width that the likeliest kind of reflector has there [beams]; NaN where nobody knows."""
    status: NDArray[np.int8]
    """(n,) `Status.INLIER`, or `Status.OUTLIER_DETECTOR` for a rejected cluster."""
    tags: TagCycles | None = None
    """What the camera that looks for tags saw; None where the log has no frames of it."""
    bearings: BearingCycles | None = None
    """What the goniometer met; None where the log has no reflexes."""

    @property
    def is_scan(self) -> BoolArray | None:
        """(K,) whether a cycle is a scan, and neither a frame nor a reflex; None where all of them are."""
        others = [part.is_frame for part in (self.tags,) if part is not None]
        others += [part.is_reflex for part in (self.bearings,) if part is not None]
        return ~np.logical_or.reduce(others) if others else None

    @property
    def others_before(self) -> int:
        """Frames and reflexes of the run before the first of these cycles; of no cycle none are asked for."""
        frames = int(self.tags.numbers[0]) if self.tags is not None and len(self.tags.numbers) else 0
        return frames + (self.bearings.first if self.bearings is not None else 0)

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    def part(self, first: int, last: int) -> DetectionLog:
        """Return the scans from `first` to before `last`."""
        if (first, last) == (0, len(self)):
            return self
        rows = slice(int(self.offsets[first]), int(self.offsets[last]))
        return _log(
            self.stamps_ns[first:last],
            self.scanners[first:last],
            self.offsets[first : last + 1] - self.offsets[first],
            self.range_bearing[rows],
            self.beams[rows],
            self.expected[rows],
            self.status[rows],
            None if self.tags is None else self.tags.part(first, last),
            None if self.bearings is None else self.bearings.part(first, last),
        )


def cycle_stamps(log: RecordLog, *, sensor_detects: bool = False) -> IntArray:
    """(K,) stamp of every scan that the localizer answers with an estimate [ns].

    Parameters
    ----------
    log : where the sensor has reported detections of its own, scans from then on are passed over; of equal stamps the
        sensor's own detections are delivered first.
    sensor_detects : whether it has done so before this log begins.
    """
    stamps = _scan_cycles(log, sensor_detects)
    if not len(log.tags) and not len(log.bearings):
        return stamps
    # As `among` has it: of equal stamps the frame comes first, then the reflex.
    return np.sort(np.concatenate((log.tags.stamps_ns, log.bearings.stamps_ns, stamps)), kind="stable")


def tag_cycles(log: RecordLog, *, sensor_detects: bool = False) -> TagCycles | None:
    """Frames of the camera that looks for tags among all cycles; None where the log has none.

    Parameters
    ----------
    log, sensor_detects : as in `cycle_stamps`.
    """
    if not len(log.tags):
        return None
    scans = _scan_cycles(log, sensor_detects)
    return among(log.tags, np.sort(np.concatenate((log.bearings.stamps_ns, scans)), kind="stable"))


def reflex_cycles(log: RecordLog, *, sensor_detects: bool = False) -> BearingCycles | None:
    """Reflexes of the goniometer among all cycles; None where the log has none.

    Parameters
    ----------
    log, sensor_detects : as in `cycle_stamps`.
    """
    return reflexes_among(log.bearings, log.tags.stamps_ns, _scan_cycles(log, sensor_detects))


def _scan_cycles(log: RecordLog, sensor_detects: bool) -> IntArray:
    """(S,) stamp of every cycle that is a scan [ns]."""
    scans = _scans_used(log, sensor_detects)
    if scans == 0:
        return log.detection_stamps_ns
    return np.concatenate((log.scan_stamps_ns[:scans], log.detection_stamps_ns))


def extract_detections(
    log: RecordLog,
    setup: LocalizerSetup,
    *,
    first: int = 0,
    last: int | None = None,
    sensor_detects: bool = False,
    parallel: bool = False,
) -> DetectionLog:
    """All detections of a drive that the localizer would use, in order of delivery.

    Depends on the log, the reflectors' radii, the scanner and `parameters.detector`; not on any other parameter.

    Parameters
    ----------
    log : what is used of it: see `cycle_stamps`.
    setup : reflector map, scanner and parameters.
    first, last : cycles from `first` to before `last` only; None: to the end.
    sensor_detects : whether the sensor has detected by itself before this log begins.
    parallel : whether to use all cores; the result is the same.

    Raises
    ------
    UsageError
        the log names a scanner that the setup does not have.
    """
    if not len(log.tags) and not len(log.bearings):
        return _of_scans(log, setup, (first, last), sensor_detects=sensor_detects, parallel=parallel)
    cycles = nothing_detected(
        cycle_stamps(log, sensor_detects=sensor_detects),
        tag_cycles(log, sensor_detects=sensor_detects),
        reflex_cycles(log, sensor_detects=sensor_detects),
    )
    end = len(cycles) if last is None else last
    is_scan = cycles.is_scan
    inner, outer = (cycle if is_scan is None else int(np.count_nonzero(is_scan[:cycle])) for cycle in (first, end))
    scanned = _of_scans(log, setup, (inner, outer), sensor_detects=sensor_detects, parallel=parallel)
    return _with_others(scanned, cycles.part(first, end))


def _with_others(scanned: DetectionLog, cycles: DetectionLog) -> DetectionLog:
    """Put scans among frames and reflexes, which have no detections."""
    is_scan = cycles.is_scan
    if is_scan is None:
        return scanned
    counts, scanners = np.zeros(len(cycles), dtype=np.int64), np.zeros(len(cycles), dtype=np.int64)
    counts[is_scan], scanners[is_scan] = np.diff(scanned.offsets), scanned.scanners
    offsets = np.concatenate(([0], np.cumsum(counts)))
    rows = scanned.range_bearing, scanned.beams, scanned.expected, scanned.status
    return _log(cycles.stamps_ns, scanners, offsets, *rows, cycles.tags, cycles.bearings)


def _of_scans(
    log: RecordLog,
    setup: LocalizerSetup,
    cycles: tuple[int, int | None],
    *,
    sensor_detects: bool,
    parallel: bool,
) -> DetectionLog:
    """Detections in the cycles that are scans, from one of them to before another."""
    (first, last), scans = cycles, _scans_used(log, sensor_detects)
    end = scans + len(log.detection_stamps_ns) if last is None else last
    parts: list[DetectionLog] = []
    if first < scans:
        parts.append(_in_scans(log, setup, (first, min(end, scans)), parallel=parallel))
    if end > scans or not parts:
        parts.append(_sensor_detections(log, setup).part(max(first - scans, 0), max(end - scans, 0)))
    return joined(parts)


def nothing_detected(
    stamps_ns: IntArray, tags: TagCycles | None = None, bearings: BearingCycles | None = None
) -> DetectionLog:
    """Return what scans detect while all reflectors are covered.

    Parameters
    ----------
    stamps_ns : of the cycles [ns].
    tags, bearings : what is seen by others, where there is anything.
    """
    offsets = np.zeros(len(stamps_ns) + 1, dtype=np.int64)
    scanners = np.zeros(len(stamps_ns), dtype=np.int64)
    return _log(stamps_ns, scanners, offsets, *room_for(0), tags, bearings)


def detect_log(scans: ScanLog, setup: LocalizerSetup, *, scanner: int = 0, parallel: bool = False) -> DetectionLog:
    """Detect the reflectors in every scan of one scanner: the same as `detector.detect`, scan by scan.

    Parameters
    ----------
    scans : with reflector flags, else intensities.
    setup : reflector map, scanners and parameters.
    scanner : which of the setup's.
    parallel : whether to use all cores; the result is the same.
    """
    model = setup.detectors[scanner]
    ranges = read_only(np.asarray(scans.ranges, dtype=np.float32))
    flags = reflective_beams(ranges, scans.intensities, scans.reflector, setup.parameters.detector)
    blind = setup.scanners[scanner].reported_blind_sectors
    ranges, flags = without_blind(ranges, flags, (scans.angle_min, scans.angle_increment), blind)
    beams = beams_of(scans.beams, scans.angle_min, scans.angle_increment)
    count, fill = (_count_parallel, _fill_parallel) if parallel else (_count, _fill)
    offsets = np.concatenate(([0], np.cumsum(count(ranges, flags, beams, model))))
    clusters = room_for(int(offsets[-1]))
    fill(ranges, flags, beams, model, offsets, *clusters)
    scanners = np.full(len(scans), scanner, dtype=np.int64)
    return _log(np.asarray(scans.stamps_ns), scanners, offsets, *clusters)


def _in_scans(log: RecordLog, setup: LocalizerSetup, cycles: tuple[int, int], *, parallel: bool) -> DetectionLog:
    """Detect in the scans from one to before another, counted in order of delivery over all scanners."""
    numbers = log.scan_order[slice(*cycles)]
    indices = setup.indices_of(log.scanners)
    parts: list[DetectionLog] = []
    places: list[IntArray] = []
    start = 0
    for scans in log.scans:
        where = np.flatnonzero((numbers >= start) & (numbers < start + len(scans)))
        if len(where):
            # Of one scanner, scans are delivered in the order in which they stand.
            first, last = int(numbers[where[0]]) - start, int(numbers[where[-1]]) - start + 1
            scanner = int(indices[scans.scanner])
            blocks = (
                scans.block(begin, min(begin + SCANS_AT_ONCE, last)) for begin in range(first, last, SCANS_AT_ONCE)
            )
            found = (detect_log(each, setup, scanner=scanner, parallel=parallel) for each in blocks)
            parts.append(joined(found))
            places.append(where)
        start += len(scans)
    return _interleaved(parts, places)


def _interleaved(parts: Sequence[DetectionLog], places: Sequence[IntArray]) -> DetectionLog:
    """Return the logs of several scanners as one; `places` says which cycle of it each scan is."""
    if len(parts) == 1:
        return parts[0]
    cycles = sum(map(len, parts))
    counts, stamps, scanners = (np.empty(cycles, dtype=np.int64) for _ in range(3))
    for part, where in zip(parts, places, strict=True):
        counts[where], stamps[where], scanners[where] = np.diff(part.offsets), part.stamps_ns, part.scanners
    offsets = np.concatenate(([0], np.cumsum(counts)))
    clusters = room_for(int(offsets[-1]))
    for part, where in zip(parts, places, strict=True):
        shift = np.repeat(offsets[where] - part.offsets[:-1], np.diff(part.offsets))
        rows = np.arange(len(part.range_bearing)) + shift
        clusters.range_bearing[rows], clusters.widths[rows] = part.range_bearing, part.beams
        clusters.expected[rows], clusters.status[rows] = part.expected, part.status
    return _log(stamps, scanners, offsets, *clusters)


def _sensor_detections(log: RecordLog, setup: LocalizerSetup) -> DetectionLog:
    """Return the detections that the sensor itself reported."""
    count = len(log.range_bearing)
    status = np.full(count, INLIER, dtype=np.int8)
    of = np.repeat(setup.indices_of(log.scanners)[log.detection_scanners], np.diff(log.detection_offsets))
    for index, scanner in enumerate(setup.scanners):
        its = of == index
        status[its] = status_of_reported(log.range_bearing[its], scanner.reported_blind_sectors)
    beams = np.zeros(count, dtype=np.int64)
    scanners = setup.indices_of(log.scanners)[log.detection_scanners]
    expected = np.full(count, np.nan)
    return _log(log.detection_stamps_ns, scanners, log.detection_offsets, log.range_bearing, beams, expected, status)


def _scans_used(log: RecordLog, sensor_detects: bool) -> int:
    """Number of scans to detect in: those before the sensor's own detections begin."""
    if sensor_detects:
        return 0
    if not len(log.detection_stamps_ns):
        return len(log.scan_stamps_ns)
    # Of equal stamps the sensor's own detections are delivered first.
    return int(np.searchsorted(log.scan_stamps_ns, log.detection_stamps_ns[0], side="left"))


def joined(logs: Iterable[DetectionLog]) -> DetectionLog:
    """Return one log after the other; of a single one itself, without a copy.

    Parameters
    ----------
    logs : one at least; each is asked for when the one before has been taken in.
    """
    rest = iter(logs)
    first, second = next(rest), next(rest, None)
    if second is None:
        return first
    stamps, scanners, offsets, beams = (Growing(np.int64) for _ in range(4))
    range_bearing, expected, status = Growing(np.float64, 2), Growing(np.float64), Growing(np.int8)
    offsets.append(first.offsets[:1])
    begin, tags, bearings = 0, list[TagCycles | None](), list[BearingCycles | None]()
    for log in itertools.chain((first, second), rest):
        stamps.append(log.stamps_ns)
        scanners.append(log.scanners)
        offsets.append(log.offsets[1:] + begin)
        begin += int(log.offsets[-1])
        range_bearing.append(log.range_bearing)
        beams.append(log.beams)
        expected.append(log.expected)
        status.append(log.status)
        tags.append(log.tags)
        bearings.append(log.bearings)
    return _log(
        stamps.array(),
        scanners.array(),
        offsets.array(),
        range_bearing.array(),
        beams.array(),
        expected.array(),
        status.array(),
        in_turn(tags),
        reflexes_in_turn(bearings),
    )


def _log(  # noqa: PLR0917 - the columns of the log
    stamps_ns: IntArray,
    scanners: IntArray,
    offsets: IntArray,
    range_bearing: FloatArray,
    beams: IntArray,
    expected: FloatArray,
    status: NDArray[np.int8],
    tags: TagCycles | None = None,
    bearings: BearingCycles | None = None,
) -> DetectionLog:
    """Return a log of read-only arrays."""
    return DetectionLog(
        stamps_ns=read_only(np.asarray(stamps_ns, dtype=np.int64)),
        scanners=read_only(np.asarray(scanners, dtype=np.int64)),
        offsets=read_only(np.asarray(offsets, dtype=np.int64)),
        range_bearing=read_only(np.asarray(range_bearing, dtype=np.float64)),
        beams=read_only(beams),
        expected=read_only(expected),
        status=read_only(status),
        tags=tags,
        bearings=bearings,
    )


@compiled
def _count(ranges: NDArray[np.float32], flags: BoolArray, beams: BeamColumns, model: DetectorModel) -> IntArray:
    """(K,) clusters in each scan."""
    counts = np.empty(len(ranges), dtype=np.int64)
    for k in range(len(ranges)):
        counts[k] = count_clusters(ranges[k], flags[k], beams_at(beams, k), model)
    return counts


@compiled_parallel
def _count_parallel(
    ranges: NDArray[np.float32], flags: BoolArray, beams: BeamColumns, model: DetectorModel
) -> IntArray:
    """`_count` on all cores."""
    counts = np.empty(len(ranges), dtype=np.int64)
    for k in parallel_range(len(ranges)):
        counts[k] = count_clusters(ranges[k], flags[k], beams_at(beams, k), model)
    return counts


@compiled
def _fill(  # noqa: PLR0917 - the columns of the log
    ranges: NDArray[np.float32],
    flags: BoolArray,
    beams: BeamColumns,
    model: DetectorModel,
    offsets: IntArray,
    range_bearing: FloatArray,
    widths: IntArray,
    expected: FloatArray,
    status: NDArray[np.int8],
) -> None:
    """Write the clusters of every scan to its rows."""
    for k in range(len(ranges)):
        row = int(offsets[k])
        detect_clusters(ranges[k], flags[k], beams_at(beams, k), model, row, range_bearing, widths, expected, status)


@compiled_parallel
def _fill_parallel(  # noqa: PLR0917 - the columns of the log
    ranges: NDArray[np.float32],
    flags: BoolArray,
    beams: BeamColumns,
    model: DetectorModel,
    offsets: IntArray,
    range_bearing: FloatArray,
    widths: IntArray,
    expected: FloatArray,
    status: NDArray[np.int8],
) -> None:
    """`_fill` on all cores."""
    for k in parallel_range(len(ranges)):
        row = int(offsets[k])
        detect_clusters(ranges[k], flags[k], beams_at(beams, k), model, row, range_bearing, widths, expected, status)
