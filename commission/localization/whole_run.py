"""The localizer over a whole recording in one compiled loop, through the same steps as `Localizer.feed`.

Detections are extracted beforehand (`detection_log`), so that a moved gate replays the filter alone. A run begins in
any state; what an earlier run of the same log has in common with it is taken over, to the last bit as computed again.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from commission.geometry.arrays import IntArray, read_only
from commission.localization.detection_log import (
    DetectionLog,
    cycle_stamps,
    extract_detections,
    joined,
    nothing_detected,
    reflex_cycles,
    tag_cycles,
)
from commission.localization.detector import passing_widths
from commission.localization.estimate import Belief
from commission.localization.priors import PriorRows, ReplayedPriors, prior_rows
from commission.localization.relocalization import forgotten
from commission.localization.run_columns import Checkpoint, RunColumns, RunSegment, firsts_of
from commission.localization.run_loop import CycleStretch, continued, cut, empty_columns, odometry_rows, take_over
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, state_at_start
from commission.localization.wheel_scale import as_driven
from commission.progress import Progress, part, silent
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

CHECKPOINT_CYCLES = 4096
"""Cycles between two checkpoints: to resume anywhere takes a few milliseconds, and a cancelled run stops as soon."""
DETECTION_SHARE = 0.7
"""Share of the progress that detecting in scans takes; where the sensor detects, it is done in no time."""


def run(
    log: RecordLog,
    setup: LocalizerSetup,
    start: Belief | FilterState,
    *,
    detected: DetectionLog | None = None,
) -> RunColumns:
    """Localize over a whole recording with one setup.

    Parameters
    ----------
    log : all records of a drive.
    setup : reflector map, scanner and parameters.
    start : belief before the first record, or the state that a `Localizer` or another run was in when the log began.
    detected : result of `extract_detections` for the same log and detector parameters; None extracts it now.

    Returns
    -------
    columns : every cycle and every detection, equal to the last bit to feeding the records to a `Localizer`.
    """
    state = state_at_start(start) if isinstance(start, Belief) else start
    if detected is None:
        detected = extract_detections(log, setup, sensor_detects=state.sensor_detects)
    return _filtered(log, (RunSegment(0, setup),), detected, (Checkpoint(0, state),))


def run_segments(
    log: RecordLog,
    segments: Sequence[RunSegment],
    start: Belief | FilterState,
    *,
    earlier: RunColumns | None = None,
    progress: Progress = silent,
) -> RunColumns:
    """Localize over a whole recording with setups that change on the way.

    Parameters
    ----------
    log : all records of a drive.
    segments : the first one begins at cycle 0, each later one after the one before; those that begin after the last
        cycle are left out.
    start : belief or state before the first record.
    earlier : another run of the same log; cycles up to where the two differ, and detections where detectors do not
        differ, are taken from it. The result is the same to the last bit.
    progress : called every few thousand cycles.

    Returns
    -------
    columns : equal to the last bit to a `Localizer` whose setup is replaced when the cycle before a segment is done.

    Raises
    ------
    ValueError
        the segments do not begin at cycle 0 and follow each other.
    """
    firsts_of(segments)
    state = state_at_start(start) if isinstance(start, Belief) else start
    stamps_ns = cycle_stamps(log, sensor_detects=state.sensor_detects)
    segments = tuple(segment for segment in segments if segment.first < max(len(stamps_ns), 1))
    kept = 0
    if earlier is not None and earlier.checkpoints[0].state == state:
        kept = _first_difference(earlier.segments, segments, len(stamps_ns))
    known: tuple[Checkpoint, ...] = (Checkpoint(0, state),)
    if earlier is not None and kept > 0:
        resumed = Checkpoint(kept, state_before(earlier, log, kept))
        known = (*(checkpoint for checkpoint in earlier.checkpoints if checkpoint.cycle < kept), resumed)
    detecting = part(progress, 0.0, DETECTION_SHARE)
    detected = _detected(log, segments, stamps_ns, earlier, progress=detecting, sensor_detects=state.sensor_detects)
    return _filtered(log, segments, detected, known, earlier=earlier, progress=part(progress, DETECTION_SHARE, 1.0))


def state_before(run: RunColumns, log: RecordLog, cycle: int, near: Checkpoint | None = None) -> FilterState:
    """State after the cycle before (odometry after it not yet taken in): from it, the run goes on from `cycle`.

    Parameters
    ----------
    run : over `log`.
    log : the records.
    cycle : 0 to K; K is the state after the last cycle, `run.final` the one after the last record.
    near : another checkpoint of the same run, perhaps a nearer one.
    """
    checkpoints = run.checkpoints if near is None else (*run.checkpoints, near)
    checkpoint = max((c for c in checkpoints if c.cycle <= cycle), key=lambda c: c.cycle)
    state = checkpoint.state
    for segment, first, last in _chunks(run.segments, checkpoint.cycle, cycle):
        detected = run.detected.part(first, last)
        columns = empty_columns(detected, (segment.setup,))
        rows = odometry_rows(log, run.stamps_ns, first, last)
        stretch = CycleStretch(first, rows, detected, columns, prior_rows(last - first))
        state = continued(log, segment.setup, _entered(segment, first, state), stretch)
    return state


def _entered(segment: RunSegment, cycle: int, state: FilterState) -> FilterState:
    """State with which a stretch of a segment begins: without a pose where it is thrown away there."""
    return forgotten(state, segment.setup) if segment.locate and segment.first == cycle else state


def _segment(segments: Sequence[RunSegment], cycle: int) -> RunSegment:
    """Return the segment of a cycle."""
    return next(segment for segment in reversed(segments) if segment.first <= cycle)


def _first_difference(a: Sequence[RunSegment], b: Sequence[RunSegment], cycles: int) -> int:
    """First cycle that two lists of segments treat differently; `cycles` when there is none."""
    for first in sorted({segment.first for segment in (*a, *b)}):
        one, other = _segment(a, first), _segment(b, first)
        locate = any(each.locate and each.first == first for each in (one, other)) and one != other
        if locate or one.covered != other.covered or one.setup != other.setup:
            return min(first, cycles)
    return cycles


def _detected(
    log: RecordLog,
    segments: Sequence[RunSegment],
    stamps_ns: IntArray,
    earlier: RunColumns | None,
    *,
    progress: Progress,
    sensor_detects: bool,
) -> DetectionLog:
    """Detections of each segment, from an earlier run where its detector was no other."""
    starts = {segment.first for segment in (*segments, *(() if earlier is None else earlier.segments))}
    bounds = (*sorted(start for start in starts if start < len(stamps_ns)), len(stamps_ns))
    # In pieces, so that it can be stopped; what the sensor has detected is only cut out of its columns.
    step = max(len(stamps_ns), 1) if not log.scans else CHECKPOINT_CYCLES
    tags = tag_cycles(log, sensor_detects=sensor_detects)
    reflexes = reflex_cycles(log, sensor_detects=sensor_detects)

    def parts() -> Iterator[DetectionLog]:
        for first, last in itertools.pairwise(bounds):
            segment = _segment(segments, first)
            if segment.covered:
                met = None if reflexes is None else reflexes.part(first, last).covered()
                yield nothing_detected(stamps_ns[first:last], None if tags is None else tags.part(first, last), met)
            elif earlier is not None and _detects_like(segment, earlier.segment(first)):
                yield earlier.detected.part(first, last)
            else:
                for piece in range(first, last, step):
                    progress(piece / len(stamps_ns), "detecting reflectors")
                    end = min(piece + step, last)
                    yield extract_detections(log, segment.setup, first=piece, last=end, sensor_detects=sensor_detects)

    return joined(parts()) if len(stamps_ns) else nothing_detected(stamps_ns)


def _detects_like(segment: RunSegment, earlier: RunSegment) -> bool:
    """Whether an earlier segment holds what is detected in this one, which is not covered."""
    return not earlier.covered and segment.setup.detects_like(earlier.setup)


def _filtered(
    log: RecordLog,
    segments: tuple[RunSegment, ...],
    detected: DetectionLog,
    known: tuple[Checkpoint, ...],
    *,
    earlier: RunColumns | None = None,
    progress: Progress = silent,
) -> RunColumns:
    """Run the filter from the last known checkpoint on; the cycles before it are taken from an earlier run."""
    (begin, state), cycles = known[-1], len(detected)
    columns = empty_columns(detected, [segment.setup for segment in segments])
    if earlier is not None:
        seen = 0 if detected.tags is None else int(detected.tags.offsets[begin])
        met = 0 if detected.bearings is None else detected.bearings.rows_before(begin)
        take_over(earlier, columns, (begin, int(detected.offsets[begin])), seen, met)
    checkpoints = list(known)
    searches = [] if earlier is None else [moment for moment in earlier.searches if moment.cycle < begin]
    kept = earlier.priors.known_before(begin) if earlier and isinstance(earlier.priors, ReplayedPriors) else {}
    room = prior_rows(CHECKPOINT_CYCLES)
    for segment, first, last in _chunks(segments, begin, cycles):
        progress((first - begin) / (cycles - begin), "localizing")
        rows = odometry_rows(log, detected.stamps_ns, first, last)
        part_of = cut(columns, detected, first, last)
        state, told = _entered(segment, first, state), len(searches)
        priors = PriorRows(room.means[: last - first], room.covariances[: last - first])
        is_sought = state.search is not None
        stretch = CycleStretch(first, rows, detected.part(first, last), part_of, priors, searches)
        state = continued(log, segment.setup, state, stretch)
        if is_sought or len(searches) > told:
            # To search again takes a hundred times as long as to filter again, and every study of the run would.
            kept[first] = PriorRows(read_only(priors.means), read_only(priors.covariances))
            room = prior_rows(CHECKPOINT_CYCLES)
        checkpoints.append(Checkpoint(last, state))
    for column in columns:
        column.setflags(write=False)
    return RunColumns(
        segments=segments,
        checkpoints=tuple(checkpoints),
        detected=detected,
        priors=_replayed(log, segments, detected, checkpoints, kept),
        means=columns.means,
        covariances=columns.covariances,
        modes=columns.modes,
        status=columns.status,
        reflector=columns.reflectors,
        d2=columns.d2,
        contours=columns.contours,
        tags=columns.tags,
        bearings=columns.bearings,
        levels=columns.levels,
        temporary=columns.temporary,
        searches=tuple(searches),
        range_bearing=columns.settled if len(columns.settled) else detected.range_bearing,
        final=_final(log, segments[-1].setup, detected.part(cycles, cycles), checkpoints[-1], detected.stamps_ns),
    )


def _replayed(
    log: RecordLog,
    segments: tuple[RunSegment, ...],
    detected: DetectionLog,
    checkpoints: Sequence[Checkpoint],
    kept: Mapping[int, PriorRows],
) -> ReplayedPriors:
    """Return the priors of a run, to be found again from its checkpoints, but for those that were kept."""
    states = {checkpoint.cycle: checkpoint.state for checkpoint in checkpoints}

    def replay(begin: int, end: int) -> PriorRows:
        state, written = states[begin], prior_rows(end - begin)
        for segment, first, last in _chunks(segments, begin, end):
            found, here = detected.part(first, last), slice(first - begin, last - begin)
            columns = empty_columns(found, (segment.setup,))
            priors = PriorRows(written.means[here], written.covariances[here])
            rows = odometry_rows(log, detected.stamps_ns, first, last)
            stretch = CycleStretch(first, rows, found, columns, priors)
            state = continued(log, segment.setup, _entered(segment, first, state), stretch)
        return PriorRows(read_only(written.means), read_only(written.covariances))

    return ReplayedPriors(tuple(states), len(detected), replay, kept)


def _final(
    log: RecordLog, setup: LocalizerSetup, nothing: DetectionLog, last: Checkpoint, stamps_ns: IntArray
) -> FilterState:
    """State after the last record: motion after the last scan is taken in, what is no cycle counts as a record."""
    begin, _ = odometry_rows(log, stamps_ns, last.cycle, last.cycle)
    rows = (begin, len(log.odometry_stamps_ns))
    stretch = CycleStretch(last.cycle, rows, nothing, empty_columns(nothing, ()), prior_rows(0))
    final = continued(log, setup, last.state, stretch)
    if len(log) == 0:
        return final
    own = final.sensor_detects or len(log.detection_stamps_ns) > 0
    return final._replace(tracking=final.tracking._replace(newest_ns=log.last_ns), sensor_detects=own)


def _chunks(segments: Sequence[RunSegment], begin: int, end: int) -> Iterator[tuple[RunSegment, int, int]]:
    """Stretches of cycles of one segment each, no longer than between two checkpoints."""
    lasts = (*(segment.first for segment in segments[1:]), end)
    for segment, last in zip(segments, lasts, strict=True):
        stop = min(last, end)
        for first in range(max(segment.first, begin), stop, CHECKPOINT_CYCLES):
            yield segment, first, min(first + CHECKPOINT_CYCLES, stop)


def warm_up() -> None:
    """Compile the loop and the detection of whole logs (the serial one), by running over one scan."""
    setup = LocalizerSetup(
        reflectors=ReflectorMap((Reflector(id="A", x=2.0, y=0.0),)), scanners=(Scanner(),), parameters=Parameters()
    )
    ranges = np.full((1, 4), 1.96, dtype=np.float32)
    flags = np.array([[False, False, True, False]])
    scans = ScanLog.even(np.array([2]), ranges, (-0.02, 0.01), reflector=flags)
    log = RecordLog(odometry_stamps_ns=np.array([0, 1]), displacements=np.zeros((2, 3)), scans=(scans,))
    run(log, setup, Belief(0, np.zeros(3), 1e-4 * np.eye(3))).points_map()
    as_driven(log.displacements, OdometryParameters(forward_scale=0.01))
    # What the page says of a rejected cluster.
    passing_widths(2.0, 0.01, 0, setup.detectors[0])
