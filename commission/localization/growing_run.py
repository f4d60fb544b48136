"""A run that is being driven: the live localizer, and the columns that grow with every scan. Not for finished logs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.bearing_cycles import BearingCycles, bearing_cycles
from commission.localization.bearings import COLUMNS as BEARING_COLUMNS
from commission.localization.contour import COLUMNS
from commission.localization.detection_log import DetectionLog
from commission.localization.detector import INLIER
from commission.localization.estimate import Belief, Estimate, SeenBearing, SeenTags, Status
from commission.localization.localizer import Localizer
from commission.localization.priors import KeptPriors, PriorRows
from commission.localization.run_columns import Checkpoint, RunColumns, RunSegment
from commission.localization.search_state import SearchMoment
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState
from commission.localization.tag_frames import TagCycles
from commission.localization.tags import COLUMNS as TAG_COLUMNS
from commission.localization.temporary_model import COLUMNS as TEMPORARY_COLUMNS
from commission.localization.whole_run import CHECKPOINT_CYCLES
from commission.site.records import Record

FIRST_ROWS = 1024
"""Rows that there is room for at first; when they are full, there is room for twice as many."""


class Cycles(NamedTuple):
    """A row per cycle."""

    stamps_ns: IntArray
    scanners: IntArray
    prior_means: FloatArray
    prior_covariances: FloatArray
    means: FloatArray
    covariances: FloatArray
    modes: NDArray[np.int8]
    contours: FloatArray
    temporary: FloatArray
    is_frame: BoolArray
    """Whether the cycle is a frame of the camera that looks for tags."""
    is_reflex: BoolArray
    """Whether the cycle is a reflex of the goniometer."""
    levels: FloatArray
    """NaN where the supervisor goes by 2-sigma."""


class DetectionRows(NamedTuple):
    """A row per detection."""

    range_bearing: FloatArray
    measured: FloatArray
    beams: IntArray
    expected_beams: FloatArray
    detected: NDArray[np.int8]
    status: NDArray[np.int8]
    reflectors: IntArray
    d2: FloatArray


class SightingRows(NamedTuple):
    """A row per sighting of a tag."""

    sightings: FloatArray
    figures: FloatArray


class ReflexRows(NamedTuple):
    """A row per reflex."""

    bearings: FloatArray
    figures: FloatArray


class GrowingRun:
    """A localizer that is fed record by record and remembers every cycle.

    Parameters
    ----------
    setup : reflector map, scanner and parameters; `begin_segment` changes them between two records.
    start : belief before the first record, or the state in which another run was left.
    """

    def __init__(self, setup: LocalizerSetup, start: Belief | FilterState) -> None:
        self._localizer = Localizer(setup, start)
        self._segments = [RunSegment(0, setup)]
        self._checkpoints = [Checkpoint(0, self._localizer.state)]
        self._count = 0
        self._searches: list[SearchMoment] = []
        n = FIRST_ROWS
        covariances = (np.empty((n, 3, 3)), np.empty((n, 3, 3)))
        self._cycles = Cycles(
            np.empty(n, np.int64),
            np.empty(n, np.int64),
            np.empty((n, 3)),
            covariances[0],
            np.empty((n, 3)),
            covariances[1],
            np.empty(n, np.int8),
            np.zeros((n, COLUMNS)),
            np.zeros((n, TEMPORARY_COLUMNS)),
            np.zeros(n, np.bool_),
            np.zeros(n, np.bool_),
            np.empty((n, 2)),
        )
        self._reflexes = ReflexRows(np.empty(n), np.empty((n, BEARING_COLUMNS)))
        self._named: list[str] = []
        self._tag_offsets: IntArray = np.zeros(n + 1, np.int64)
        self._sightings = SightingRows(np.empty((n, 6)), np.empty((n, TAG_COLUMNS)))
        self._ids: list[str] = []
        self._offsets: IntArray = np.zeros(n + 1, np.int64)
        self._detections = DetectionRows(
            np.empty((n, 2)),
            np.empty((n, 2)),
            np.empty(n, np.int64),
            np.empty(n),
            np.empty(n, np.int8),
            np.empty(n, np.int8),
            np.empty(n, np.int64),
            np.empty(n),
        )

    def __len__(self) -> int:
        """Return the number of cycles so far."""
        return self._count

    @property
    def state(self) -> FilterState:
        """State after the newest record."""
        return self._localizer.state

    def begin_segment(self, setup: LocalizerSetup, *, locate: bool = False) -> None:
        """Use another setup from the next record on; the state stays, and the columns say where it began.

        Where the vehicle is to be located, its pose is thrown away.

        Before what was pushed after the newest cycle is pulled, the columns are those of a whole run with this segment;
        odometry that has been taken in since was taken in as it was.
        """
        self._localizer.replace_setup(setup)
        if locate:
            self._localizer.locate()
        if self._segments[-1].first == self._count:
            locate |= self._segments.pop().locate
        self._segments.append(RunSegment(self._count, setup, locate=locate))

    def feed(self, record: Record) -> tuple[Estimate, ...]:
        """Take in one record; arguments, result and errors are those of `Localizer.feed`."""
        self._localizer.push(record)
        return tuple(iter(self.pull, None))

    def push(self, record: Record) -> None:
        """Take in one record without processing it, see `Localizer.push`."""
        self._localizer.push(record)

    def pull(self) -> Estimate | None:
        """Process records up to the next scan, see `Localizer.pull`, and append its cycle."""
        estimate = self._localizer.pull()
        if estimate is not None:
            self._append(estimate)
            search = self._localizer.state.search
            if search is not None:
                self._searches.append(search.moment(self._count - 1))
            if self._count % CHECKPOINT_CYCLES == 0:
                self._checkpoints.append(Checkpoint(self._count, self._localizer.state))
        return estimate

    def flush(self) -> tuple[Estimate, ...]:
        """Process everything that waits, since no more records come; returns the estimates of its scans."""
        self._localizer.release()
        return tuple(iter(self.pull, None))

    def forget_before(self, cycle: int) -> tuple[FilterState, int] | None:
        """Forget what was before the last checkpoint at or before a cycle; what was given out stays as it is.

        Parameters
        ----------
        cycle : number of a cycle; from the checkpoint on, cycles count from 0.

        Returns
        -------
        state, stamp_ns : state from which the rest goes on, and stamp of the newest cycle that is forgotten [ns]; None
            where no checkpoint tells cycles apart by their stamps.
        """
        stamps = self._cycles.stamps_ns
        usable = [c for c in self._checkpoints if 0 < c.cycle <= min(cycle, self._count - 1)]
        usable = [c for c in usable if stamps[c.cycle] > stamps[c.cycle - 1]]
        if not usable:
            return None
        first, state = usable[-1]
        stamp_ns = int(stamps[first - 1])
        rows, sightings = int(self._offsets[first]), int(self._tag_offsets[first])
        reflexes = int(np.count_nonzero(self._cycles.is_reflex[:first]))
        self._detections = DetectionRows._make(map(_later, self._detections, [rows] * len(self._detections)))
        self._sightings = SightingRows._make(map(_later, self._sightings, [sightings] * len(self._sightings)))
        self._reflexes = ReflexRows._make(map(_later, self._reflexes, [reflexes] * len(self._reflexes)))
        self._ids, self._named = self._ids[sightings:], self._named[reflexes:]
        self._cycles = Cycles._make(map(_later, self._cycles, [first] * len(self._cycles)))
        self._offsets = _later(self._offsets, first) - rows
        self._tag_offsets = _later(self._tag_offsets, first) - sightings
        self._count -= first
        self._checkpoints = [c._replace(cycle=c.cycle - first) for c in self._checkpoints if c.cycle >= first]
        self._searches = [s._replace(cycle=s.cycle - first) for s in self._searches if s.cycle >= first]
        before = [s for s in self._segments if s.first < first]
        later = [replace(s, first=s.first - first) for s in self._segments if s.first >= first]
        # Where one begins just there, it is the first one; else the one before goes on, its pose long thrown away.
        self._segments = (
            later if later and later[0].first == 0 else [replace(before[-1], first=0, locate=False), *later]
        )
        return state, stamp_ns

    def columns(self) -> RunColumns:
        """Return the run so far: views of rows that never change again."""
        n = self._count
        cycles = Cycles._make(read_only(column[:n]) for column in self._cycles)
        offsets = read_only(self._offsets[: n + 1])
        rows = DetectionRows._make(read_only(column[: int(offsets[-1])]) for column in self._detections)
        detected = DetectionLog(
            stamps_ns=cycles.stamps_ns,
            scanners=cycles.scanners,
            offsets=offsets,
            range_bearing=rows.measured,
            beams=rows.beams,
            expected=rows.expected_beams,
            status=rows.detected,
            tags=self._tags(cycles.is_frame),
            bearings=self._met(cycles.is_reflex),
        )
        segments = tuple(segment for segment in self._segments if segment.first < max(n, 1))
        looking = any(segment.setup.tag_model is not None for segment in segments)
        turning = any(segment.setup.bearing_model is not None for segment in segments)
        matching = any(segment.setup.contour is not None for segment in segments)
        protecting = any(segment.setup.protection is not None for segment in segments)
        remembering = any(segment.setup.temporary is not None for segment in segments)
        return RunColumns(
            segments=segments,
            checkpoints=tuple(self._checkpoints),
            detected=detected,
            range_bearing=rows.range_bearing,
            priors=KeptPriors(PriorRows(cycles.prior_means, cycles.prior_covariances)),
            means=cycles.means,
            covariances=cycles.covariances,
            modes=cycles.modes,
            status=rows.status,
            reflector=rows.reflectors,
            d2=rows.d2,
            contours=cycles.contours if matching else cycles.contours[:0],
            temporary=cycles.temporary if remembering else cycles.temporary[:0],
            tags=read_only(self._sightings.figures[: len(self._ids) if looking else 0]),
            bearings=read_only(self._reflexes.figures[: len(self._named) if turning else 0]),
            levels=cycles.levels if protecting else cycles.levels[:0],
            searches=tuple(self._searches),
            final=self._localizer.state,
        )

    def _tags(self, is_frame: BoolArray) -> TagCycles | None:
        """What the camera has seen of tags so far; None where there was no frame."""
        if not is_frame.any():
            return None
        count = len(self._ids)
        offsets = read_only(self._tag_offsets[: len(is_frame) + 1])
        ids = read_only(np.array(self._ids, dtype=np.str_))
        numbers = read_only(np.cumsum(is_frame) - is_frame)
        return TagCycles(
            is_frame=is_frame,
            offsets=offsets,
            sightings=read_only(self._sightings.sightings[:count]),
            ids=ids,
            numbers=numbers,
        )

    def _met(self, is_reflex: BoolArray) -> BearingCycles | None:
        """What the goniometer has met so far; None where there was no reflex."""
        if not is_reflex.any():
            return None
        return bearing_cycles(is_reflex, self._reflexes.bearings[: len(self._named)], tuple(self._named))

    def _append_bearing(self, row: int, seen: SeenBearing | None) -> None:
        """Write what a reflex told, and what became of it."""
        self._cycles.is_reflex[row] = seen is not None
        if seen is None:
            return
        at = len(self._named)
        if at == len(self._reflexes.bearings):
            self._reflexes = ReflexRows._make(_longer(column, at + 1) for column in self._reflexes)
        self._reflexes.bearings[at] = seen.bearing
        self._reflexes.figures[at] = 0.0 if seen.figures is None else seen.figures
        self._named.append(seen.reflector)

    def _append_tags(self, row: int, seen: SeenTags | None) -> None:
        """Write what a frame saw of tags, and what became of it."""
        first = len(self._ids)
        last = first + (0 if seen is None else len(seen.ids))
        if last > len(self._sightings.figures):
            self._sightings = SightingRows._make(_longer(column, last) for column in self._sightings)
        if seen is not None:
            self._sightings.sightings[first:last] = seen.sightings
            self._sightings.figures[first:last] = 0.0 if seen.figures is None else seen.figures
            self._ids.extend(seen.ids)
        self._cycles.is_frame[row] = seen is not None
        self._tag_offsets[row + 1] = last

    def _append(self, estimate: Estimate) -> None:
        """Write one cycle and its detections."""
        row, first = self._count, int(self._offsets[self._count])
        last = first + len(estimate.status)
        if row == len(self._cycles.modes):
            self._cycles = Cycles._make(_longer(column, row + 1) for column in self._cycles)
            self._offsets = _longer(self._offsets, row + 2)
            self._tag_offsets = _longer(self._tag_offsets, row + 2)
        if last > len(self._detections.d2):
            self._detections = DetectionRows._make(_longer(column, last) for column in self._detections)
        cycles, found = self._cycles, self._detections
        cycles.stamps_ns[row], cycles.scanners[row] = estimate.stamp_ns, estimate.scanner
        cycles.prior_means[row], cycles.prior_covariances[row] = estimate.prior.mean, estimate.prior.covariance
        cycles.means[row], cycles.covariances[row] = estimate.posterior.mean, estimate.posterior.covariance
        cycles.modes[row] = estimate.mode
        cycles.contours[row] = 0.0 if estimate.contours is None else estimate.contours
        cycles.levels[row] = math.nan if estimate.levels is None else estimate.levels
        cycles.temporary[row] = 0.0 if estimate.temporary is None else estimate.temporary
        self._append_tags(row, estimate.tags)
        self._append_bearing(row, estimate.bearing)
        rejected = estimate.status == Status.OUTLIER_DETECTOR
        found.range_bearing[first:last], found.beams[first:last] = estimate.detections, estimate.beams
        found.measured[first:last] = estimate.measured
        found.expected_beams[first:last] = estimate.expected_beams
        found.detected[first:last] = np.where(rejected, estimate.status, INLIER)
        found.status[first:last], found.reflectors[first:last] = estimate.status, estimate.reflector
        found.d2[first:last] = estimate.d2
        self._offsets[row + 1] = last
        self._count = row + 1


def _later(column: NDArray[Any], first: int) -> NDArray[Any]:
    """Return a copy of the rows from `first` on, with the room that is left behind them."""
    return column[first:].copy()


def _longer(column: NDArray[Any], rows: int) -> NDArray[Any]:
    """Return a copy with room for twice the rows, at least as many as asked for."""
    longer = np.empty((max(2 * len(column), rows), *column.shape[1:]), column.dtype)
    longer[: len(column)] = column
    return longer
