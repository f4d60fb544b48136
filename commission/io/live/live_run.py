"""The localizer on a vehicle that drives now: records in, columns of a run out, as of a recording of the same.

It reads no clock and opens no connection: a session feeds it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, read_only
from commission.io.live.spooled_scans import SpooledScans
from commission.localization.estimate import Belief, Estimate, Mode
from commission.localization.growing_run import GrowingRun
from commission.localization.setup import LocalizerSetup
from commission.localization.state import belief_of
from commission.site.bearing_log import BearingLog
from commission.site.parameters import SupervisorParameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Record, ReferencePose, Reflex, Scan, TagSightings
from commission.site.tag_log import TagLog
from commission.site.walls import walls_of
from commission.studies.run import RunInput, RunResult, judge
from commission.studies.start import Start, StartOrigin, belief_at, route_start, unknown_start_at

UNKNOWN_SPEED = 1.0
"""Speed that a vehicle of which nothing is heard may have, where the project has no route that says one [m/s]."""
UNKNOWN_TURN = 0.5
"""The same of its turning [rad/s]."""
NOTHING_HEARD_NS = 200_000_000
"""Time without odometry from which on the vehicle may be anywhere that it can have driven to [ns]."""
HELD_CYCLES = 180_000
"""Cycles that a live run holds at most, of which it then forgets the older half: one to two hours at 25 scans per
second, 0.4 to 0.6 GB. A page is left open for days, and judging a run takes as long as the run is."""
FIRST_ROWS = 1_024


@dataclass(frozen=True, slots=True, eq=False)
class LiveResult:
    """A live run so far."""

    result: RunResult | None
    """The run up to the newest cycle; None before the first."""
    belief: Belief | None
    """What is known of the pose by the newest odometry; None before the first record."""
    mode: Mode
    """State of the supervisor."""
    forgotten_s: float = 0.0
    """Time of the drive that is not held any more, before the run so far [s]."""


class LiveRun:
    """A run that grows: fed by one thread, looked at by any.

    Parameters
    ----------
    project : reflectors, scanners, parameters; `use` takes another one.
    pose : (3,) pose of base at the first record [m, m, rad], map frame; None: the start of the first route, and where
        the project has none, the vehicle looks where it is.
    sigmas : (3,) 1-sigma of it [m, m, rad]; None: the usual ones.
    held : cycles that it holds at most.
    """

    def __init__(
        self,
        project: Project,
        pose: Sequence[float] | None = None,
        sigmas: Sequence[float] | None = None,
        held: int = HELD_CYCLES,
    ) -> None:
        self._held, self._try_at, self._began_ns, self._forgotten_ns = held, held, 0, 0
        self._origin = StartOrigin.ROUTE if pose is None else StartOrigin.GIVEN
        if pose is None:
            pose = route_start(project.routes[0]) if project.routes else None
        self._pose = None if pose is None else tuple(pose)
        self._sigmas = sigmas
        self._speed = max((route.speed for route in project.routes), default=UNKNOWN_SPEED)
        self._setup = LocalizerSetup.of(project)
        self._names = tuple(scanner.name for scanner in project.scanners)
        self._lock = threading.Lock()
        self._run: GrowingRun | None = None
        self._start: Start | None = None
        self._spools: dict[int, SpooledScans] = {}
        self._odometry = _StampedRows(3)
        self._reference = _StampedRows(3)
        self._detections = _StampedRows(2)
        self._seen = _StampedRows(2)
        self._tags: list[TagSightings] = []
        self._reflexes: list[Reflex] = []
        self._newest_ns = self._odometry_ns = 0
        self._spent = 0.0
        self._cycles = 0

    @property
    def scanner_names(self) -> tuple[str, ...]:
        """Names of the scanners that it began with."""
        return self._names

    @property
    def supervisor(self) -> SupervisorParameters:
        """Limits of the supervisor, as they are now."""
        return self._setup.parameters.supervisor

    def prepare(self) -> None:
        """Get ready: the first scan of a search else waits for walls of a large floor to be made ready for rays."""
        walls_of(self._setup.floor)

    def take(self, record: Record) -> tuple[Estimate, ...]:
        """Take in one record in its order; returns the estimates that follow."""
        with self._lock:
            # A run without a cycle is empty, and yet the one that was begun.
            run = self._run = self._begun(record) if self._run is None else self._run
            before = time.perf_counter()
            # No estimate depends on a reference, and one may come when later records have been taken.
            estimates = () if isinstance(record, ReferencePose) else run.feed(record)
            self._spent += time.perf_counter() - before
            self._cycles += len(estimates)
            self._keep(record)
            if len(run) >= self._try_at:
                self._forget(run)
            return estimates

    def belief_before(self, record: Record) -> Belief | None:
        """Return what is known of the pose before a record that is taken in next; None while odometry still waits."""
        with self._lock:
            if self._run is None:
                return self._start_at(record.stamp_ns).belief
            belief = belief_of(self._run.state)
            return belief if belief.stamp_ns >= self._odometry_ns else None

    @property
    def is_sought(self) -> bool:
        """Whether the vehicle looks where it is."""
        with self._lock:
            return self._pose is None if self._run is None else self._run.state.search is not None

    def end(self) -> tuple[Estimate, ...]:
        """Process what waits, since no more comes; returns the estimates that follow."""
        with self._lock:
            last = () if self._run is None else self._run.flush()
            self._cycles += len(last)
            return last

    def use(self, project: Project) -> None:
        """Localize with another project's reflectors and parameters from the next record on."""
        setup = LocalizerSetup.of(project)
        with self._lock:
            self._setup = setup
            if self._run is not None:
                self._run.begin_segment(setup)

    def locate(self) -> None:
        """Throw the pose away: from the next scan on the vehicle looks where it is."""
        with self._lock:
            self._pose = None
            if self._run is not None:
                self._run.begin_segment(self._setup, locate=True)

    def so_far(self, now_ns: int | None = None, *, judged: RunResult | None = None) -> LiveResult:
        """Return the run so far; its figures are those of a recording of the same drive.

        Parameters
        ----------
        now_ns : time by the host's clock [ns]: where no odometry came for a moment, the belief grows as far as the
            vehicle may have driven; None: it does not.
        judged : a result of before that is given out again, since judging hours takes long; None: it is judged anew.
        """
        with self._lock:
            run, start = self._run, self._start
            if run is None or start is None:
                return LiveResult(None, None, Mode.OPERATIONAL)
            belief, mode, forgotten_s = belief_of(run.state), Mode(run.state.tracking.mode), self._forgotten_ns * 1e-9
            columns = run.columns() if len(run) and judged is None else None
            log, spent = (self._log() if columns is not None else None), self._spent
            cycles = max(self._cycles, 1)
        silent_ns = 0 if now_ns is None else now_ns - max(self._odometry_ns, belief.stamp_ns)
        if silent_ns > NOTHING_HEARD_NS:
            belief = self.grown(belief, silent_ns * 1e-9)
        if columns is None or log is None:
            return LiveResult(judged, belief, mode, forgotten_s)
        inputs = RunInput(log=log, start=start, segments=columns.segments)
        result = judge(inputs, columns, spent * 1e6 / cycles)
        return LiveResult(result, belief, mode, forgotten_s)

    def grown(self, belief: Belief, seconds: float) -> Belief:
        """Return a belief after a time in which nothing was heard: 2-sigma is as far as the vehicle can have driven.

        Parameters
        ----------
        belief : the last one.
        seconds : time since then [s].
        """
        way, turn = 0.5 * self._speed * seconds, min(0.5 * UNKNOWN_TURN * seconds, np.pi)
        grown = belief.covariance + np.diag([way**2, way**2, turn**2])
        return Belief(belief.stamp_ns + round(seconds * 1e9), belief.mean, read_only(grown))

    def _begun(self, record: Record) -> GrowingRun:
        """Return the run that begins with a record."""
        self._start = self._start_at(record.stamp_ns)
        self._began_ns = record.stamp_ns
        return GrowingRun(self._setup, self._start.state())

    def _start_at(self, stamp_ns: int) -> Start:
        """Return where the vehicle starts, if it does at a time [ns]."""
        if self._pose is None:
            return unknown_start_at(stamp_ns, self._setup.reflectors.centers, self._setup.contour_floor)
        return Start(belief_at(stamp_ns, self._pose, self._sigmas), self._origin)

    def _forget(self, run: GrowingRun) -> None:
        """Forget the older half; the rest is a run that goes on from the state there."""
        found = run.forget_before(self._held // 2)
        self._try_at = max(self._held, len(run) + self._held // 8)
        if found is None:
            return
        state, stamp_ns = found
        self._start = Start(belief_of(state), StartOrigin.CONTINUED, state)
        for rows in (self._odometry, self._reference, self._detections, self._seen):
            rows.forget_until(stamp_ns)
        for spool in self._spools.values():
            spool.forget_until(stamp_ns)
        self._tags = [each for each in self._tags if each.stamp_ns > stamp_ns]
        self._reflexes = [each for each in self._reflexes if each.stamp_ns > stamp_ns]
        self._forgotten_ns = stamp_ns - self._began_ns

    def _keep(self, record: Record) -> None:
        """Remember a record: small ones in memory, scans in a file."""
        self._newest_ns = record.stamp_ns
        match record:
            case Odometry():
                self._odometry_ns = record.stamp_ns
                self._odometry.append(record.stamp_ns, record.displacement[np.newaxis])
            case ReferencePose():
                self._reference.append(record.stamp_ns, record.pose[np.newaxis])
            case Detections():
                self._seen.append(record.stamp_ns, np.array([[len(record.range_bearing), record.scanner]]))
                self._detections.append(record.stamp_ns, record.range_bearing)
            case TagSightings():
                self._tags.append(record)
            case Reflex():
                self._reflexes.append(record)
            case Scan():
                if record.scanner not in self._spools:
                    self._spools[record.scanner] = SpooledScans(record.scanner)
                self._spools[record.scanner].append(record)

    def _log(self) -> RecordLog:
        """Return the records so far as columns."""
        seen = self._seen.values.astype(np.int64)
        return RecordLog(
            odometry_stamps_ns=self._odometry.stamps_ns,
            displacements=self._odometry.values,
            scanners=self._names,
            scans=tuple(self._spools[scanner].so_far() for scanner in sorted(self._spools)),
            detection_stamps_ns=self._seen.stamps_ns,
            detection_offsets=np.concatenate([[0], np.cumsum(seen[:, 0])]).astype(np.int64),
            range_bearing=self._detections.values,
            detection_scanners=seen[:, 1],
            tags=TagLog.of(self._tags),
            bearings=BearingLog.of(self._reflexes),
            reference_stamps_ns=self._reference.stamps_ns,
            reference_poses=self._reference.values,
        )


class _StampedRows:
    """Stamped rows that grow; what was given out never changes again."""

    def __init__(self, width: int) -> None:
        self._stamps = np.empty(FIRST_ROWS, np.int64)
        self._values = np.empty((FIRST_ROWS, width))
        self._count = 0

    @property
    def stamps_ns(self) -> NDArray[np.int64]:
        return read_only(self._stamps[: self._count])

    @property
    def values(self) -> FloatArray:
        return read_only(self._values[: self._count])

    def append(self, stamp_ns: int, rows: NDArray[Any]) -> None:
        last = self._count + len(rows)
        while last > len(self._stamps):
            self._stamps = np.concatenate([self._stamps, np.empty_like(self._stamps)])
            self._values = np.concatenate([self._values, np.empty_like(self._values)])
        self._stamps[self._count : last] = stamp_ns
        self._values[self._count : last] = rows
        self._count = last

    def forget_until(self, stamp_ns: int) -> None:
        """Forget the rows up to a stamp [ns]; a reference may have come late, and stands behind newer ones."""
        stays = self._stamps[: self._count] > stamp_ns
        # Room as at first behind them.
        self._stamps = np.concatenate([self._stamps[: self._count][stays], np.empty(FIRST_ROWS, np.int64)])
        self._values = np.concatenate([self._values[: self._count][stays], np.empty_like(self._values[:FIRST_ROWS])])
        self._count = int(np.count_nonzero(stays))
