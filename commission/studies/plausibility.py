"""Whether a recording can be what it says: units, clocks, gaps, thresholds. Judged before anything is localized.

A finding names what was found, what it probably is, and how to correct it. Nothing is corrected here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.detector import threshold_at
from commission.progress import Progress, silent
from commission.site.parameters import DetectorParameters
from commission.site.project import Project
from commission.site.quantity import PERCENT, PLAIN_DEGREES, number_text
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanStore
from commission.site.recorded_mounting import LEANING
from commission.site.scanner import Scanner
from commission.studies.inputs import StudyInput
from commission.studies.recording_overview import beams_in_words, rates
from commission.studies.reference_headings import are_degrees

FASTEST = 15.0
"""Speed beyond which no vehicle of this kind drives [m/s]."""
FASTEST_TURN = 10.0
"""Rate beyond which none turns [rad/s]."""
LONGEST_GAP_S = 1.0
"""Pause of the odometry from which it is told [s], while scans go on."""
RATE_RATIO = 1.3
"""Factor by which the step of the beams, or a rate that is higher, may differ from the project's scanner."""
THINNED = 4.0
"""Factor by which the rate may be lower: recorders often keep each second or third scan only."""
_PERIODS_S = (0.0005, 5.0)
"""Usual time between two records of one kind [s]."""
FARTHEST = 200.0
"""Range beyond which no scanner of this kind measures [m]."""
MOUNTED_APART = 0.03
"""Distance between two mountings of one scanner from which it is told [m]."""
TURNED_APART = math.radians(1.0)
"""The same of their headings [rad]."""
SWEPT_APART_S = 0.002
"""Difference of two durations of a sweep from which it is told [s]; a tenth of the longer one where that is more."""
_SEEN = ("detections", "scans")
_FULL_SHARE = 0.99
_TOLD_GAPS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Something about a recording that cannot be as it says."""

    found: str
    """What was found, with figures and units."""
    probably: str
    """What it probably is."""
    remedy: str
    """How to correct it."""

    def __str__(self) -> str:
        """All of it in one line."""
        return f"{self.found}: {self.probably}; {self.remedy}"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlausibilityInput(StudyInput):
    """All that the study reads."""

    log: RecordLog
    """The recording."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    detector: DetectorParameters
    """Its thresholds: echo strength from which a beam counts as reflective."""

    @staticmethod
    def of(project: Project, log: RecordLog) -> PlausibilityInput:
        """Pick what the study reads from a project."""
        return PlausibilityInput(log=log, scanners=project.scanners, detector=project.parameters.detector)

    @staticmethod
    def alone(log: RecordLog) -> PlausibilityInput:
        """Return the input where no project is named: then nothing is said to be another scanner than the project's."""
        return PlausibilityInput(log=log, scanners=(), detector=DetectorParameters())


def plausibility(inputs: PlausibilityInput, progress: Progress = silent) -> tuple[Finding, ...]:
    """Judge a recording before it is localized.

    Parameters
    ----------
    inputs : the recording and what the project says about its scanner.
    progress : told which check is done; may raise to cancel.

    Returns
    -------
    findings : none for a sound recording.
    """
    checks: tuple[tuple[str, Callable[[PlausibilityInput], Iterator[Finding]]], ...] = (
        ("kinds of records", _missing_kinds),
        ("time units", _time_units),
        ("clocks", _clocks),
        ("odometry", _odometry),
        ("gaps", _gaps),
        ("silent scanners", _silent_scanners),
        ("detections", _detections),
        ("scans", _scans),
        ("reference", _reference),
        ("names of scanners", _unknown_scanners),
        ("mountings", _mountings),
        ("sweeps", _sweeps),
    )
    findings: list[Finding] = []
    for done, (name, check) in enumerate(checks):
        progress(done / len(checks), name)
        findings.extend(check(inputs))
    progress(1.0, "")
    return tuple(findings)


def _kinds(log: RecordLog) -> tuple[tuple[str, IntArray], ...]:
    """Name and stamps [ns] of each kind of record that the recording has."""
    kinds = (
        ("odometry", log.odometry_stamps_ns),
        *_by_scanner(log, "detections", log.detection_stamps_ns, log.detection_scanners),
        *((scans_name(log, scans), scans.stamps_ns) for scans in log.scans),
        ("frames with tags", log.tags.stamps_ns),
        ("bearings", log.bearings.stamps_ns),
        ("reference poses", log.reference_stamps_ns),
    )
    return tuple((name, stamps) for name, stamps in kinds if len(stamps))


def scans_name(log: RecordLog, scans: ScanStore) -> str:
    """What the scans of one scanner are called: `scans`, of several `scans of front left`."""
    return "scans" if len(log.scanners) == 1 else f"scans of {log.scanners[scans.scanner]}"


def _by_scanner(log: RecordLog, name: str, stamps: IntArray, scanners: IntArray) -> Iterator[tuple[str, IntArray]]:
    """Records of each scanner."""
    for index, scanner in enumerate(log.scanners):
        called = name if len(log.scanners) == 1 else f"{name} of {scanner}"
        yield called, stamps[scanners == index]


def _scanner_of(inputs: PlausibilityInput, name: str) -> Scanner | None:
    """The project's scanner of a name in the log; None where there is none of that name."""
    if len(inputs.scanners) == len(inputs.log.scanners) == 1:
        return inputs.scanners[0]
    return next((each for each in inputs.scanners if each.name == name), None)


def _unknown_scanners(inputs: PlausibilityInput) -> Iterator[Finding]:
    for name in inputs.log.scanners if inputs.scanners else ():
        if _scanner_of(inputs, name) is None:
            yield Finding(
                found=f"the recording's scanner {name!r} is none of the project's",
                probably="it is called otherwise there",
                remedy="name it as there (a bag: --channel scan.NAME=TOPIC; a CSV folder: scans_NAME.npz); "
                f"expected one of: {', '.join(each.name for each in inputs.scanners)}",
            )


def _missing_kinds(inputs: PlausibilityInput) -> Iterator[Finding]:
    """Find recordings in which nothing is seen, or nothing tells how the vehicle moved."""
    log = inputs.log
    others = len(log.detection_stamps_ns) + len(log.tags) + len(log.bearings)
    if not any(len(scans) for scans in log.scans) and not others:
        yield Finding(
            found="the recording holds no scan and no detection",
            probably="the scanner's topic or file was not recorded, or another one was named",
            remedy="record the scanner; in a bag name its topic: --channel scan=TOPIC",
        )
    # A reader may have made up the first row, from which on motion counts.
    if not has_motion(log):
        yield Finding(
            found="the recording holds no odometry",
            probably="it was not recorded, or is in a topic that is not read",
            remedy="record it, or in a bag name its topic: --channel odometry=TOPIC",
        )


def has_motion(log: RecordLog) -> bool:
    """Whether a recording tells how the vehicle moved between what it saw: a single row is a begin, and no motion."""
    others = log.tags.stamps_ns, log.bearings.stamps_ns
    seen = np.concatenate([log.detection_stamps_ns, log.scan_stamps_ns, *others])
    return len(log.odometry_stamps_ns) > 1 or (len(log.odometry_stamps_ns) == 1 and len(np.unique(seen)) < 2)


def _time_units(inputs: PlausibilityInput) -> Iterator[Finding]:
    for name, stamps in _kinds(inputs.log):
        period = _period_s(stamps)
        if math.isnan(period) or _PERIODS_S[0] <= period <= _PERIODS_S[1]:
            continue
        units = {"microseconds": 1e3, "milliseconds": 1e6, "seconds": 1e9, "picoseconds": 1e-3}
        unit = next((u for u, f in units.items() if _PERIODS_S[0] <= period * f <= _PERIODS_S[1]), None)
        yield Finding(
            found=f"{name} come every {number_text(period)} s by their stamps",
            probably=f"the stamps are in {unit}" if unit else "the stamps are no times",
            remedy=f"expected nanoseconds{f' (multiply by {units[unit]:g})' if unit else ''}",
        )


def _period_s(stamps_ns: IntArray) -> float:
    """Median time between two different stamps [s]; NaN of fewer than two."""
    steps = np.diff(stamps_ns)
    steps = steps[steps > 0]
    return float(np.median(steps)) * 1e-9 if len(steps) else math.nan


def _clocks(inputs: PlausibilityInput) -> Iterator[Finding]:
    # A single record, which a reader may have made up, tells of no clock.
    kinds = tuple((name, stamps) for name, stamps in _kinds(inputs.log) if len(stamps) > 1)
    first = int(kinds[0][1][0]) if kinds else 0
    for name, stamps in kinds[1:]:
        begin, end = kinds[0][1][[0, -1]].tolist()
        its_begin, its_end = int(stamps[0]), int(stamps[-1])
        shift_s = (begin - its_begin) * 1e-9
        if stamps[0] <= end and stamps[-1] >= begin:
            continue
        yield Finding(
            found=f"{kinds[0][0]} last {_span(begin, end, first)}, {name} {_span(its_begin, its_end, first)}",
            probably="they were stamped by two clocks, since they do not overlap in time",
            remedy=f"if both began together, shift the stamps of the {name} by {shift_s:+.3f} s",
        )


def _span(begin_ns: int, end_ns: int, zero_ns: int) -> str:
    return f"from {(begin_ns - zero_ns) * 1e-9:.1f} to {(end_ns - zero_ns) * 1e-9:.1f} s"


def _odometry(inputs: PlausibilityInput) -> Iterator[Finding]:
    stamps, rows = inputs.log.odometry_stamps_ns, inputs.log.displacements
    seconds = np.diff(stamps) * 1e-9
    if (seconds > 0.0).sum() < 2 or not _PERIODS_S[0] <= _period_s(stamps) <= _PERIODS_S[1]:
        return
    speeds = rates(stamps, np.hypot(rows[:, 0], rows[:, 1]))
    speed, turn = _high(speeds), _high(rates(stamps, np.abs(rows[:, 2])))
    if speed > FASTEST:
        yield Finding(
            found=f"the odometry moves at up to {np.max(speeds):.0f} m/s",
            probably=_instead_of_displacements(rows, stamps),
            remedy="expected dx, dy [m] and dtheta [rad] since the row before, in the base frame of the row before",
        )
    elif turn > FASTEST_TURN:
        in_degrees = math.radians(turn) <= FASTEST_TURN
        yield Finding(
            found=f"the odometry turns at up to {turn:.0f} rad/s",
            probably="dtheta is in degrees" if in_degrees else "dtheta is no motion since the row before",
            remedy="expected dtheta in radians since the row before",
        )


def _instead_of_displacements(rows: FloatArray, stamps_ns: IntArray) -> str:
    """What rows that are no displacements [m, m, rad] probably hold."""
    dt = np.maximum(np.diff(stamps_ns) * 1e-9, 1e-9)
    steps = np.diff(rows, axis=0)
    length = np.hypot(steps[:, 0], steps[:, 1])
    size = np.hypot(rows[1:, 0], rows[1:, 1])
    # What is measured in the vehicle's own frame points ahead; a way across the hall hardly does so all the time, and
    # where it does, it grows.
    is_ahead = np.mean(rows[:, 1] ** 2) < 0.01 * np.mean(rows[:, 0] ** 2)
    is_growing = abs(float(rows[-1, 0] - rows[0, 0])) > 0.9 * float(np.ptp(rows[:, 0])) > 0.0
    if (not is_ahead or is_growing) and _high(length / dt) <= FASTEST:
        # A vehicle moves along its heading: that of a pose and the way to the next one agree, forward or in reverse.
        moving = length > 0.25 * np.quantile(length, 0.9)
        course = np.arctan2(steps[moving, 1], steps[moving, 0])
        if moving.any() and np.median(np.abs(np.sin(course - rows[:-1][moving, 2]))) < 0.3:
            return "dx, dy, dtheta hold poses, not the motion since the row before"
    if _high(size) <= FASTEST / 3.0:
        return "dx, dy, dtheta hold velocities, not displacements (multiply each row by its time since the row before)"
    if _high(size / dt) <= 1000.0 * FASTEST:
        return "dx and dy are in millimetres"
    return "dx, dy, dtheta hold something else than motion"


def _high(values: FloatArray) -> float:
    """Value that all but a hundredth stay below: single wild rows are no unit."""
    return float(np.quantile(values, 0.99)) if len(values) else 0.0


def _gaps(inputs: PlausibilityInput) -> Iterator[Finding]:
    """Stretches in which scans go on and odometry does not."""
    stamps = inputs.log.odometry_stamps_ns
    seen = np.concatenate([s for name, s in _kinds(inputs.log) if name.startswith(_SEEN)] or [stamps[:0]])
    if len(stamps) < 2 or not len(seen) or seen.max() < stamps[0] or seen.min() > stamps[-1]:
        return
    longest = max(LONGEST_GAP_S, 5.0 * _period_s(stamps))
    times = np.concatenate([[min(seen.min(), stamps[0])], stamps, [max(seen.max(), stamps[-1])]])
    long = np.flatnonzero(np.diff(times) * 1e-9 > longest)
    start = int(min(seen.min(), stamps[0]))
    for gap in long[:_TOLD_GAPS]:
        begin, end = int(times[gap]), int(times[gap + 1])
        is_end = gap == len(times) - 2
        yield Finding(
            found=f"the odometry {'ends at' if is_end else 'pauses from'} {(begin - start) * 1e-9:.1f} s"
            f"{'' if is_end else f' to {(end - start) * 1e-9:.1f} s'}, and scans go on"
            f"{f' to {(end - start) * 1e-9:.1f} s' if is_end else ''}",
            probably="records are lost; how the vehicle drove meanwhile is not known",
            remedy="record the odometry throughout, or cut the recording there",
        )
    if len(long) > _TOLD_GAPS:
        yield Finding(
            found=f"the odometry has {len(long) - _TOLD_GAPS} more pauses of over {longest:.1f} s",
            probably="records are lost",
            remedy="record the odometry throughout",
        )


def _silent_scanners(inputs: PlausibilityInput) -> Iterator[Finding]:
    """Find scanners that begin long after the others, or end long before them.

    Detections of sensors that detect themselves may be missing where there is nothing to see.
    """
    kinds = [(name, stamps) for name, stamps in _kinds(inputs.log) if name.startswith("scans")]
    if len(kinds) < 2:
        return
    begin, end = min(int(stamps[0]) for _, stamps in kinds), max(int(stamps[-1]) for _, stamps in kinds)
    for name, stamps in kinds:
        longest = LONGEST_GAP_S + 5.0 * np.nan_to_num(_period_s(stamps))
        first, last = int(stamps[0]), int(stamps[-1])
        for missing, at, word in ((first - begin, first, "begin"), (end - last, last, "end")):
            if missing * 1e-9 > longest:
                yield Finding(
                    found=f"the {name} {word} at {(at - begin) * 1e-9:.1f} s of {(end - begin) * 1e-9:.1f} s",
                    probably="that scanner was off, its connection was lost, or the recording was cut",
                    remedy="until then or from then on the vehicle sees with the others alone; record all throughout",
                )


def _detections(inputs: PlausibilityInput) -> Iterator[Finding]:
    ranges, bearings = inputs.log.range_bearing.T
    if not len(ranges):
        return
    if np.abs(bearings).max() > 2.0 * math.pi + 1e-6:
        yield Finding(
            found=f"bearings reach {np.abs(bearings).max():.1f} rad",
            probably="they are in degrees",
            remedy="expected radians, counter-clockwise",
        )
    log = inputs.log
    scanners = np.repeat(log.detection_scanners, np.diff(log.detection_offsets))
    for index, name in enumerate(log.scanners):
        scanner = _scanner_of(inputs, name)
        called = "detections" if len(log.scanners) == 1 else f"detections of {name}"
        yield from _ranges(called, ranges[scanners == index], scanner)


def _ranges(name: str, ranges: FloatArray, scanner: Scanner | None) -> Iterator[Finding]:
    """Ranges beyond what the scanner measures, or any does; `ranges` holds no NaN."""
    farthest = FARTHEST if scanner is None else scanner.range[1]
    beyond = float(np.mean(ranges > 1.05 * farthest)) if len(ranges) else 0.0
    if beyond <= 0.01:
        return
    typical = float(np.median(ranges))
    in_millimetres = typical > 10.0 * farthest
    yield Finding(
        found=f"{PERCENT.text(beyond)} of the ranges of {name} are beyond the scanner's {farthest:g} m"
        f" (typical: {number_text(typical, 4)} m)",
        probably="they are in millimetres" if in_millimetres else "another scanner was recorded",
        remedy="expected metres" if in_millimetres else "correct the project's scanner (range)",
    )


def _scans(inputs: PlausibilityInput) -> Iterator[Finding]:
    for scans in inputs.log.scans:
        scanner = _scanner_of(inputs, inputs.log.scanners[scans.scanner])
        if len(scans):
            yield from _scans_of(inputs, scans, scanner)


def _scans_of(inputs: PlausibilityInput, scans: ScanStore, scanner: Scanner | None) -> Iterator[Finding]:
    """Scans of one scanner that are not what the project says of it."""
    called = scans_name(inputs.log, scans)
    # A few scans spread over the drive tell as much as all of them.
    chosen = np.unique(np.linspace(0, len(scans.stamps_ns) - 1, 200).astype(int))
    some = scans.chosen(chosen)
    ranges = np.asarray(some.ranges, dtype=np.float64)
    returned = np.isfinite(ranges)
    yield from _ranges(called, ranges[returned], scanner)
    if not returned.any():
        yield Finding(
            found=f"no beam of the {called} has a range",
            probably="its window is covered, or what was recorded in place of ranges is none (0, inf, all too far)",
            remedy="look at the scanner's own display, and at the limits (range_max) and the unit of what was recorded",
        )
    if some.intensities is not None and some.reflector is None and returned.any():
        strengths = np.asarray(some.intensities, dtype=np.float64)[returned]
        yield from _intensities(called, strengths, ranges[returned], inputs.detector)
    if scanner is None:
        return
    step, expected = float(np.median(np.abs(scans.angle_increment))), scanner.angle_increment
    if not expected / RATE_RATIO <= step <= expected * RATE_RATIO:
        yield Finding(
            found=f"the {called} have {beams_in_words(scans.beams)} {PLAIN_DEGREES.text(step, '.3g')} apart",
            probably=f"another scanner was recorded than the project's ({scanner.resolution_deg:g} deg)",
            remedy="correct the project's scanner (resolution_deg), by which the detector counts beams",
        )
    period = _period_s(scans.stamps_ns)
    if not math.isnan(period) and not scanner.rate / THINNED <= 1.0 / period <= scanner.rate * RATE_RATIO:
        yield Finding(
            found=f"the {called} come {number_text(1.0 / period)} times a second",
            probably=f"the project's scanner ({scanner.rate:g} per second) is another one, or scans are lost",
            remedy="correct the project's scanner (rate) for virtual drives and predictions",
        )


def _intensities(name: str, values: FloatArray, ranges: FloatArray, detector: DetectorParameters) -> Iterator[Finding]:
    known = np.isfinite(values)
    if not known.any():
        yield Finding(
            found=f"no beam of the {name} has an intensity that is a number",
            probably="the scanner was not told to send intensities",
            remedy="switch them on in the scanner; without them no reflector can be detected",
        )
        return
    values, ranges = values[known], ranges[known]
    share, threshold = float(np.mean(values >= threshold_at(ranges, detector))), detector.intensity_threshold
    low, high = float(values.min()), float(values.max())
    between = f"{number_text(low, 4)} to {number_text(high, 4)}"
    where = f"detector.intensity_threshold {number_text(threshold, 6)} (intensities are {between})"
    if share > _FULL_SHARE:
        yield Finding(
            found=f"{PERCENT.text(share)} of the beams of the {name} reach {where}",
            probably="every wall counts as a reflector",
            remedy="set the threshold between the intensities of walls and of reflectors",
        )
    elif share == 0.0:
        yield Finding(
            found=f"no beam of the {name} reaches {where}",
            probably="no reflector can be detected",
            remedy="set the threshold between the intensities of walls and of reflectors",
        )


def _mountings(inputs: PlausibilityInput) -> Iterator[Finding]:
    """Find scanners that the recording's transforms put elsewhere than the project."""
    for said in inputs.log.mountings:
        scanner = _scanner_of(inputs, said.scanner)
        if scanner is None or said.lean > LEANING:
            continue
        x, y, heading = scanner.mounting.tolist()
        is_far = math.hypot(said.x - x, said.y - y) > MOUNTED_APART
        if not is_far and abs(wrap(said.heading - heading)) <= TURNED_APART and said.upside_down == scanner.upside_down:
            continue
        down = {True: ", upside down", False: ""}
        own = f"[{x:.4g}, {y:.4g}, {heading:.4g}]{down[scanner.upside_down]}"
        at = f"[{said.x:.4g}, {said.y:.4g}, {said.heading:.4g}]{down[said.upside_down]}"
        yield Finding(
            found=f"{scanner.name} is mounted at {at} in {said.base} of the recording, at {own} in the project"
            " (x [m], y [m], heading [rad])",
            probably=f"one of the two is wrong, or {said.base} is not the base whose motion the odometry tells",
            remedy="correct the mounting in the project, or see to it that both count from the same point",
        )


def _sweeps(inputs: PlausibilityInput) -> Iterator[Finding]:
    """Find scanners that turn otherwise than the project says, or in no time that can be."""
    for said in inputs.log.sweeps:
        scanner = _scanner_of(inputs, said.scanner)
        stamps = next(each.stamps_ns for each in inputs.log.scans if inputs.log.scanners[each.scanner] == said.scanner)
        period = _period_s(stamps) if len(stamps) > 1 else math.inf
        if said.duration > 1.1 * period:
            yield Finding(
                found=f"a scan of {said.scanner} takes {said.duration * 1e3:.4g} ms from beam to beam by its"
                f" time_increment, and the next one comes after {period * 1e3:.4g} ms",
                probably="the driver fills in another time",
                remedy="set how long the sweep takes by the scanner's manual; nothing was taken from the recording",
            )
            continue
        if scanner is None:
            continue
        apart = abs(said.duration - scanner.sweep_duration)
        turns_back = scanner.sweep_duration > 0.0 and said.direction != scanner.sweep_direction
        if apart > max(SWEPT_APART_S, 0.1 * max(said.duration, scanner.sweep_duration)) or turns_back:
            ways = {1: "counter-clockwise", -1: "clockwise"}
            yield Finding(
                found=f"a scan of {said.scanner} takes {said.duration * 1e3:.4g} ms from the first to the last beam,"
                f" {ways[said.direction]}, by its time_increment; the project says"
                f" {scanner.sweep_duration * 1e3:.4g} ms, {ways[scanner.sweep_direction]}",
                probably="at 1 m/s each ms is 1 mm, and a turning vehicle bends the scan",
                remedy="set sweep_duration and sweep_direction of the scanner in the project, or check the driver's",
            )


def _reference(inputs: PlausibilityInput) -> Iterator[Finding]:
    """Find headings in degrees."""
    poses = inputs.log.reference_poses
    if are_degrees(poses):
        yield Finding(
            found=f"headings of the reference reach {np.nanmax(np.abs(poses[:, 2])):.1f} rad, not the way it drives",
            probably="they are in degrees",
            remedy="expected theta in radians; start and errors take them for degrees",
        )
