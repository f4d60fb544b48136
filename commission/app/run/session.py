"""One run of the localizer over a drive: play clock, step, seek, and what is remembered for the page.

It is called by the owner thread alone, a slice of time per call, and knows neither widgets nor files.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from commission.app.run.history import History, Measured, episodes
from commission.app.run.view import RunView
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Belief, Estimate, Mode
from commission.localization.localizer import Localizer
from commission.localization.observation import range_bearing
from commission.localization.setup import LocalizerSetup
from commission.simulation.faults import cover
from commission.site.record_log import RecordLog
from commission.site.records import Scan
from commission.studies.metrics import reference_at

SLICE_S = 0.02
"""Time that one call may spend on records, so that the page stays responsive during a seek [s]."""
GATE_POINTS = 40
PREDICTED_FROM_NOW = 1e-6


@dataclass(frozen=True, slots=True)
class Drive:
    """What a run goes over."""

    log: RecordLog
    """All records."""
    initial: Belief
    """Where the vehicle is said to be at the start, and how well that is known."""


class Session:
    """A run over one drive.

    Parameters
    ----------
    drive : what to go over.
    setup : reflector map, scanner and parameters of the localizer.
    clock : returns seconds; another one only in tests.
    """

    def __init__(self, drive: Drive, setup: LocalizerSetup, clock: Callable[[], float] = time.perf_counter) -> None:
        self.drive = drive
        self.setup = setup
        self.covered = False
        self.predicted: tuple[tuple[float, float], ...] = ()
        self._clock = clock
        stamps = drive.log.stamps_ns
        self.start_ns, self.end_ns = (int(stamps[0]), int(stamps[-1])) if len(stamps) else (0, 0)
        self._cycle_stamps = _cycle_stamps(drive.log)
        self._reference = reference_at(self._cycle_stamps, drive.log.reference_stamps_ns, drive.log.reference_poses)
        self._seek_from_ns = self.start_ns
        self._target_ns: int | None = None
        self._begin()

    def _begin(self) -> None:
        """Go back to the start."""
        self._localizer = Localizer(self.setup, self.drive.initial)
        self._history = History(len(self._cycle_stamps), self.start_ns)
        self._position = 0
        self._play_ns = float(self.start_ns)
        self._estimate: Estimate | None = None
        self._scan: Scan | None = None

    @property
    def at_end(self) -> bool:
        """Whether every record is processed."""
        return self._position >= len(self.drive.log)

    @property
    def seeking(self) -> float | None:
        """Share of a seek that is done [0..1]; none when none is under way."""
        if self._target_ns is None:
            return None
        whole = max(1, self._target_ns - self._seek_from_ns)
        return float(np.clip((self._play_ns - self._seek_from_ns) / whole, 0.0, 1.0))

    @property
    def cycles(self) -> int:
        """Number of scans processed."""
        return len(self._history)

    def set_setup(self, setup: LocalizerSetup) -> None:
        """Use other parameters from the next scan on; the filter's state stays."""
        self.setup = setup
        self._localizer.replace_setup(setup)

    def seek(self, seconds: float, *, afresh: bool = False) -> None:
        """Start to go to a time after the start [s]; `advance` does the work, a slice per call.

        A time ahead is reached by processing what lies between, one behind (or `afresh`) by replaying from the start
        with the parameters of now.
        """
        target = min(self.start_ns + round(seconds * 1e9), self.end_ns)
        if afresh or target < self._play_ns:
            self._begin()
        self._seek_from_ns = round(self._play_ns)
        self._target_ns = target

    def advance(self, elapsed_s: float) -> int:
        """Move the play clock and process what is due.

        Parameters
        ----------
        elapsed_s : time by which the play clock moves [s]; ignored while a seek is under way.

        Returns
        -------
        cycles : number of scans processed.
        """
        due_ns = self._target_ns if self._target_ns is not None else self._play_ns + elapsed_s * 1e9
        before = self.cycles
        stop = self._clock() + SLICE_S
        stamps = self.drive.log.stamps_ns
        while self._position < len(stamps) and stamps[self._position] <= due_ns:
            if self._feed_next() and self._clock() > stop:
                break
        caught_up = self.at_end or stamps[self._position] > due_ns
        # A machine that is too slow plays slower; it does not fall behind further and further.
        self._play_ns = float(min(due_ns, self.end_ns) if caught_up else stamps[self._position])
        if caught_up:
            self._target_ns = None
        return self.cycles - before

    def step(self) -> bool:
        """Process records up to and including the next scan; return whether there was one."""
        while not self.at_end:
            cycle = self._feed_next()
            self._play_ns = float(self.drive.log.stamps_ns[self._position - 1])
            if cycle:
                return True
        return False

    def _feed_next(self) -> bool:
        """Process one record; return whether it was a cycle."""
        record = self.drive.log.record(self._position)
        self._position += 1
        if self.covered:
            record = cover(record)
        if isinstance(record, Scan):
            self._scan = record
        started = self._clock()
        estimate = self._localizer.feed(record)
        took = self._clock() - started
        if estimate is None:
            return False
        self._estimate = estimate
        self._history.add(estimate, Measured(took * 1e6, self._error_of(estimate)))
        return True

    def _error_of(self, estimate: Estimate) -> float:
        """Position error of the newest cycle [m]."""
        truth = self._reference[len(self._history)]
        return float(np.hypot(*(estimate.posterior.mean[:2] - truth[:2])))

    def view(self, *, whole: bool = True) -> RunView:
        """Return the run as it is now; `whole` with every detection so far, which takes longest to copy and draw."""
        estimate = self._estimate
        belief = self.drive.initial if estimate is None else estimate.posterior
        series = self._history.series()
        count = len(series)
        now = (self._play_ns - self.start_ns) * 1e-9
        truth = self._reference[:count]
        known = truth[np.isfinite(truth[:, 0]), :2]
        return RunView(
            time=now,
            duration=(self.end_ns - self.start_ns) * 1e-9,
            pose=belief.mean,
            covariance=belief.covariance,
            mode=Mode.OPERATIONAL if estimate is None else estimate.mode,
            estimate=estimate,
            scan_map=self._scan_points(belief),
            gates=self._gates(estimate),
            reference=truth[-1] if count and np.isfinite(truth[-1, 0]) else None,
            references=known,
            series=series,
            accumulated=self._history.accumulated() if whole else None,
            episodes=self._episodes(now),
            seeking=self.seeking,
            at_end=self.at_end,
        )

    def _episodes(self, now: float) -> tuple[tuple[float, float], ...]:
        """Fail episodes as lived up to now, as predicted for the rest."""
        series = self._history.series()
        lived = episodes(series.times, series.failed)
        ahead = ((max(start, now), end) for start, end in self.predicted if end > now + PREDICTED_FROM_NOW)
        return (*lived, *ahead)

    def _scan_points(self, belief: Belief) -> FloatArray:
        """(B, 2) end points of the newest scan's beams [m], map frame."""
        scan = self._scan
        if scan is None:
            return np.empty((0, 2))
        hit = np.isfinite(scan.ranges)
        ranges, bearings = scan.ranges[hit].astype(np.float64), scan.bearings[hit]
        points_scanner = ranges[:, np.newaxis] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
        T_map_scanner = se2.compose(belief.mean, self.setup.scanner.mounting)
        return se2.transform_points(T_map_scanner, points_scanner)

    def _gates(self, estimate: Estimate | None) -> FloatArray:
        """(R, n, 2) validation areas of the reflectors that the scanner could see if nothing stood in between."""
        setup = self.setup
        if estimate is None or not len(setup.reflectors):
            return np.empty((0, GATE_POINTS, 2))
        scanner = setup.scanner
        seen = range_bearing(estimate.prior.mean, scanner.mounting, setup.reflectors.centers)
        first, last = (math.radians(limit) for limit in scanner.field_of_view_deg)
        inside = np.mod(seen[:, 1] - first, 2.0 * math.pi) <= last - first
        in_view = inside & (seen[:, 0] <= min(scanner.reflector_range, scanner.range[1]))
        return setup.validation_outlines(estimate.prior, GATE_POINTS)[in_view]


def _cycle_stamps(log: RecordLog) -> np.ndarray:
    """(K,) stamps of the scans that the localizer answers with an estimate: the sensor's own detections win."""
    if len(log.detection_stamps_ns):
        scans = np.empty(0, np.int64) if log.scans is None else log.scans.stamps_ns
        before = scans[scans < log.detection_stamps_ns[0]]
        return np.concatenate([before, log.detection_stamps_ns])
    return np.empty(0, np.int64) if log.scans is None else log.scans.stamps_ns
