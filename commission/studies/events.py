"""What happened on a drive, moment by moment: where the supervisor stopped the vehicle, and what a person looks for.

Moments and figures; `told` says them in words. What is wrong with the whole drive, `consistency_findings` says.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from commission.compiled import compiled
from commission.geometry.angles import difference
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.stretches import stretches_of
from commission.localization import bearings
from commission.localization.estimate import Mode, Status
from commission.localization.observation import project_detections
from commission.localization.relocalization import CONFIRMATIONS, CONFIRMED_BY_CONTOURS
from commission.localization.run_columns import RunColumns
from commission.localization.search_state import Agreed
from commission.localization.tags import USE, TagUse
from commission.localization.trail_search import CONFIRMED
from commission.progress import Progress, silent
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT
from commission.studies.bearing_figures import leaning
from commission.studies.curves import longest_regular
from commission.studies.inputs import StudyInput
from commission.studies.kinds import OF_THE_MAP, corrected_by
from commission.studies.reflector_figures import numbered
from commission.studies.run import RunResult, limits_along

JUMP_SHARE = 0.5
"""A correction of more than this share of a limit of the supervisor is a jump."""
BLIND_S = 1.0
"""A longer time between two accepted detections, with scans in between, is a blind stretch [s]."""
SAME_PLACE = 0.1
"""What lies this near to what the same scanner accepted one scan earlier is the same thing [m]."""
MOST_OF_A_KIND = 500
"""Events of one kind that are listed; of more, the first."""


class EventKind(StrEnum):
    """What happened."""

    FAIL = "fail"
    """The supervisor withholds the output: the covariance is too large, or nothing confirms the pose."""
    RECOVERED = "recovered"
    """The vehicle may drive again."""
    LOST = "lost"
    """Too many detections fit no reflector."""
    SEARCHING = "not located"
    """Nobody has said where the vehicle is: it looks for itself."""
    LOCATE = "locate"
    """Someone has thrown the pose away: the vehicle looks where it is."""
    FOUND = "found"
    """Of all places in the map, one is left; the output is still withheld until detections confirm it."""
    JUMP = "jump"
    """One scan moved the estimate far."""
    BLIND = "blind"
    """Nothing was accepted for long, though there were scans."""
    GAP = "gap"
    """No scan came for long."""
    DISAGREE = "bearings disagree"
    """Innovations of bearings do not average out: the supervisor withholds the output, whatever the covariance is."""
    CHANGED = "other reflector"
    """A thing that was one reflector is another one from now on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunEvent:
    """One moment of a drive; figures that its kind does not have are NaN."""

    kind: EventKind
    """What happened."""
    time: float
    """When, after the first record [s]."""
    lasts: float = math.nan
    """How long: of a stretch its own length, of a recovery that of the time before it [s]."""
    position: float = math.nan
    """What was held against the limit of the position in a fail, length of a jump, way of a blind stretch [m]."""
    heading: float = math.nan
    """What was held against the limit of the heading in a fail, turn of a jump, by how much the bearings of the first
    reflector are off [rad]."""
    held: str = "2σ"
    """What was held against the limits of a fail: 2-sigma or protection level."""
    share: float = math.nan
    """Share of the detections of the last second that were rejected, where the vehicle is lost [0..1]."""
    limits: tuple[float, float] = (math.nan, math.nan)
    """Limits of the supervisor at that time: position [m], heading [rad]."""
    names: tuple[str, str] = ("", "")
    """The reflector before and the one after, of a changed association; the two that are off most, of bearings."""
    found_by: str = ""
    """What told where a vehicle is that was found, in words."""


@dataclass(frozen=True, slots=True, eq=False)
class EventsInput(StudyInput):
    """All that the study reads."""

    run: RunResult
    """The drive, localized and judged."""


@dataclass(frozen=True, slots=True, eq=False)
class EventsResult:
    """What happened."""

    inputs: EventsInput
    """Where it happened."""
    events: tuple[RunEvent, ...]
    """In the order of time."""
    left_out: int
    """Number of events that are not listed, as there are so many of their kind."""


def events(inputs: EventsInput, progress: Progress = silent) -> EventsResult:
    """Find what happened on a drive.

    Parameters
    ----------
    inputs : the drive.
    progress : told how far it is; may raise to cancel.
    """
    run = inputs.run
    found: list[RunEvent] = []
    left_out = 0
    for share, some in (
        (0.0, _modes(run)),
        (0.1, _blind(run)),
        (0.2, _gaps(run)),
        (0.25, _disagreements(run)),
        (0.3, _corrections(run, progress)),
    ):
        progress(share, "what happened")
        kinds: dict[EventKind, int] = {}
        for event in some:
            kinds[event.kind] = kinds.get(event.kind, 0) + 1
            if kinds[event.kind] <= MOST_OF_A_KIND:
                found.append(event)
            else:
                left_out += 1
    progress(1.0, "what happened")
    return EventsResult(inputs, tuple(sorted(found, key=lambda event: event.time)), left_out)


def _modes(run: RunResult) -> Iterator[RunEvent]:
    """Every change of the supervisor's mode; a drive that does not begin operational begins with one."""
    modes, times, limits = run.columns.modes, run.times, limits_along(run.columns)
    before = np.concatenate(([Mode.OPERATIONAL], modes[:-1]))
    stopped_at = searched_from = 0.0
    for cycle in np.flatnonzero(modes != before).tolist():
        time, mode = float(times[cycle]), Mode(int(modes[cycle]))
        if mode is Mode.OPERATIONAL:
            yield RunEvent(kind=EventKind.RECOVERED, time=time, lasts=time - stopped_at)
            continue
        if before[cycle] == Mode.OPERATIONAL:
            stopped_at = time
        if mode is Mode.LOST:
            searched_from = time
            yield RunEvent(kind=EventKind.LOST, time=time, share=float(run.recent.rejected[cycle]))
            continue
        if mode is Mode.INITIALIZING:
            searched_from = time
            segment = run.columns.segment(cycle)
            asked = segment.locate and segment.first == cycle
            yield RunEvent(kind=EventKind.LOCATE if asked else EventKind.SEARCHING, time=time)
            continue
        if before[cycle] == Mode.INITIALIZING or (before[cycle] == Mode.LOST and _searches(run, cycle)):
            by = _found_by(run.columns, cycle)
            yield RunEvent(kind=EventKind.FOUND, time=time, lasts=time - searched_from, found_by=by)
            continue
        held = run.held(cycle)
        yield RunEvent(
            kind=EventKind.FAIL,
            time=time,
            held=held.name,
            position=held.position,
            heading=held.heading,
            limits=(float(limits[cycle, 0]), float(limits[cycle, 1])),
        )


def _found_by(columns: RunColumns, cycle: int) -> str:
    """What told where the vehicle is, in words; the attempt of the cycle itself is the last one."""
    tags, sought = columns.detected.tags, columns.search(cycle - 1)
    if tags is not None and len(columns.tags) and tags.is_frame[cycle]:
        rows = slice(int(tags.offsets[cycle]), int(tags.offsets[cycle + 1]))
        if (columns.tags[rows, USE] == TagUse.LOCATED).any():
            return "by a tag whose id was read"
    by_things, by_way, by_contours = Agreed() if sought is None else sought.agreed
    if by_things + 1 >= CONFIRMATIONS:
        return f"the only place left in {CONFIRMATIONS} attempts"
    if by_way + 1 >= CONFIRMED:
        return f"the only place left in {int(CONFIRMED)} attempts by the whole way"
    if by_contours + 1 >= CONFIRMED_BY_CONTOURS:
        return f"the only place left in {int(CONFIRMED_BY_CONTOURS)} views by the contours of the hall"
    return "the only place left"


def _searches(run: RunResult, cycle: int) -> bool:
    """Whether a lost vehicle looks for its place in the map."""
    return run.columns.segment(cycle).setup.parameters.supervisor.find_again


def _blind(run: RunResult) -> Iterator[RunEvent]:
    """Stretches in which nothing that is on the map was accepted, of whatever kind."""
    stamps, means = run.columns.stamps_ns, run.columns.means
    others = np.any(corrected_by(run.columns)[:, OF_THE_MAP][:, 1:], axis=1)
    for first, after in stretches_of((run.counts[:, Status.INLIER] == 0) & np.logical_not(others)).tolist():
        # From the last scan with an accepted detection to the next one with one.
        begin, end = max(first - 1, 0), min(after, len(stamps) - 1)
        # Whole nanoseconds: exactly a second is not more than one.
        lasts = int(stamps[end] - stamps[begin]) * 1e-9
        if lasts > BLIND_S:
            way = float(np.hypot(*np.diff(means[begin : end + 1, :2], axis=0).T).sum())
            yield RunEvent(kind=EventKind.BLIND, time=float(run.times[first]), lasts=lasts, position=way)


def _disagreements(run: RunResult) -> Iterator[RunEvent]:
    """Stretches in which innovations of bearings do not average out."""
    met = run.columns.detected.bearings
    if met is None or not len(run.columns.bearings):
        return
    cycles = np.flatnonzero(met.is_reflex)
    for first, after in stretches_of(run.columns.bearings[:, bearings.LASTING] > 0.0).tolist():
        begin, end = float(run.times[cycles[first]]), float(run.times[cycles[min(after, len(cycles) - 1)]])
        # By the mean of which the vehicle was stopped: of the time before.
        window = run.columns.segment(int(cycles[first])).setup.parameters.bearing.lasting_window
        since = int(np.searchsorted(run.times[cycles], begin - window))
        (one, off), (other, _), *_ = (*leaning(run.columns, since, first + 1), ("", math.nan), ("", math.nan))
        yield RunEvent(kind=EventKind.DISAGREE, time=begin, lasts=end - begin, heading=off, names=(one, other))


def _gaps(run: RunResult) -> Iterator[RunEvent]:
    """Times without a scan."""
    times, longest = run.times, longest_regular(run.times)
    between = np.diff(times)
    for cycle in np.flatnonzero(between > longest).tolist():
        yield RunEvent(kind=EventKind.GAP, time=float(times[cycle]), lasts=float(between[cycle]))


def _corrections(run: RunResult, progress: Progress) -> Iterator[RunEvent]:
    """Jumps, and things that were taken for another reflector: both need the belief before each scan."""
    columns, limits = run.columns, limits_along(run.columns)
    numbers, names = _numbers(columns)
    earlier = _scan_before(columns.detected.scanners)
    first = 0
    for rows in columns.priors.blocks():
        after = first + len(rows.means)
        progress(0.3 + 0.7 * first / len(columns), "what happened")
        here = slice(first, after)
        moved = np.hypot(*(columns.means[here, :2] - rows.means[:, :2]).T)
        turned = np.abs(difference(columns.means[here, 2], rows.means[:, 2]))
        jumps = (moved > JUMP_SHARE * limits[here, 0]) | (turned > JUMP_SHARE * limits[here, 1])
        for index in np.flatnonzero(jumps).tolist():
            yield RunEvent(
                kind=EventKind.JUMP,
                time=float(run.times[first + index]),
                position=float(moved[index]),
                heading=float(turned[index]),
                limits=(float(limits[first + index, 0]), float(limits[first + index, 1])),
            )
        for cycle, old, new in _changes(columns, rows.means, (first, earlier), numbers).tolist():
            yield RunEvent(kind=EventKind.CHANGED, time=float(run.times[cycle]), names=(names[old], names[new]))
        first = after


def _numbers(columns: RunColumns) -> tuple[IntArray, tuple[str, ...]]:
    """(n,) number of the reflector of each detection, the same in all segments, and the names by these numbers."""
    names, _, own = numbered(columns)
    numbers = np.full(len(columns.reflector), -1, dtype=np.int64)
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end, known in zip(columns.segments, ends, own, strict=True):
        rows = slice(int(columns.offsets[segment.first]), int(columns.offsets[end]))
        numbers[rows] = known[columns.reflector[rows]]
    return numbers, names


def _scan_before(scanners: IntArray) -> IntArray:
    """(K,) cycle of the same scanner's scan before each; -1: there is none."""
    earlier = np.full(len(scanners), -1, dtype=np.int64)
    for scanner in np.unique(scanners):
        its = np.flatnonzero(scanners == scanner)
        earlier[its[1:]] = its[:-1]
    return earlier


def _changes(columns: RunColumns, priors: FloatArray, at: tuple[int, IntArray], numbers: IntArray) -> IntArray:
    """(N, 3) cycle, reflector before and after, of each thing that is another reflector than one scan earlier.

    Both are laid on the floor by what was believed before the later scan: what it makes of them does not matter.

    Parameters
    ----------
    columns : the run.
    priors : (B, 3) beliefs before a block of cycles [m, m, rad].
    at : first cycle of the block, and (K,) the same scanner's scan before each cycle.
    numbers : (n,) number of the reflector of each detection.
    """
    first, earlier = at
    after = first + len(priors)
    before = earlier[first:after]
    start = int(min(before[before >= 0], default=first))
    old = _places(columns, columns.means[start:after], (start, after))
    new = _places(columns, priors, (first, after))
    accepted = read_only(columns.status == Status.INLIER)
    offsets = columns.offsets
    shifts = int(offsets[start]), int(offsets[first])
    found = np.empty((len(new), 3), dtype=np.int64)
    count = _compare(before, offsets, first, shifts, old, new, accepted, read_only(numbers), found)
    return found[:count]


def _places(columns: RunColumns, poses: FloatArray, cycles: tuple[int, int]) -> FloatArray:
    """(m, 2) the detections of some cycles seen from their (B, 3) poses [m], map frame."""
    first, after = cycles
    bounds = [first, *(bound for bound in columns.firsts.tolist() if first < bound < after), after]
    parts = [np.empty((0, 2))]
    for begin, end in itertools.pairwise(bounds):
        offsets = columns.offsets[begin : end + 1]
        parts.append(
            project_detections(
                poses[begin - first : end - first],
                offsets - offsets[0],
                columns.range_bearing[offsets[0] : offsets[-1]],
                columns.segment(begin).setup.observation_rows,
                scanners=columns.detected.scanners[begin:end],
            )
        )
    return read_only(np.concatenate(parts))


@compiled
def _compare(  # noqa: PLR0917 - the columns of a run
    before: IntArray,
    offsets: IntArray,
    first: int,
    shifts: tuple[int, int],
    old: FloatArray,
    new: FloatArray,
    accepted: BoolArray,
    numbers: IntArray,
    found: IntArray,
) -> int:
    """Write the changes of a block of cycles to `found` and return how many there are."""
    count = 0
    for k in range(len(before)):
        if before[k] < 0:
            continue
        cycle = first + k
        for i in range(offsets[cycle], offsets[cycle + 1]):
            if not accepted[i]:
                continue
            nearest, which = SAME_PLACE**2, -1
            for j in range(offsets[before[k]], offsets[before[k] + 1]):
                dx = new[i - shifts[1], 0] - old[j - shifts[0], 0]
                dy = new[i - shifts[1], 1] - old[j - shifts[0], 1]
                if accepted[j] and dx * dx + dy * dy < nearest:
                    nearest, which = dx * dx + dy * dy, j
            if which >= 0 and numbers[which] != numbers[i]:
                found[count, 0], found[count, 1], found[count, 2] = cycle, numbers[which], numbers[i]
                count += 1
    return count


def told(event: RunEvent) -> str:
    """Figures of an event in words, each with its unit."""
    match event.kind:
        case EventKind.FAIL:
            heading = DEGREES.against(event.heading, event.limits[1], (".2f", ".1f"))
            text = f"{event.held} {MILLIMETRES.against(event.position, event.limits[0])}, {heading}"
            text = text if math.isfinite(event.position) else f"no {event.held} level yet"
        case EventKind.RECOVERED:
            text = f"after {event.lasts:.2f} s"
        case EventKind.LOST:
            known = math.isfinite(event.share)
            text = f"{PERCENT.text(event.share)} rejected in 1 s" if known else "nothing seen in 1 s"
        case EventKind.JUMP:
            text = f"by {MILLIMETRES.text(event.position)}, {DEGREES.text(event.heading, '.2f')}"
        case EventKind.SEARCHING:
            text = "looks for its place in the map"
        case EventKind.LOCATE:
            text = "asked for: the pose is thrown away, the vehicle looks for its place in the map"
        case EventKind.FOUND:
            text = f"after {event.lasts:.2f} s, {event.found_by}"
        case EventKind.BLIND:
            text = f"nothing accepted for {event.lasts:.2f} s, {event.position:.2f} m"
        case EventKind.GAP:
            text = f"no scan for {event.lasts:.2f} s"
        case EventKind.DISAGREE:
            off = DEGREES.text(event.heading, "+.2f")
            text = f"for {event.lasts:.2f} s, most of {event.names[0]} (by {off}) and {event.names[1]}"
        case EventKind.CHANGED:
            text = f"{event.names[0]} → {event.names[1]}"
    return text


def warm_up() -> None:
    """Compile what the study needs."""
    rows, offsets = np.zeros(1, np.int64), read_only(np.array([0, 0], np.int64))
    nothing = read_only(np.empty((0, 2)))
    found = np.empty((0, 3), np.int64)
    _compare(rows, offsets, 0, (0, 0), nothing, nothing, read_only(np.empty(0, np.bool_)), read_only(rows[:0]), found)
