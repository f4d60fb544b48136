"""A cursor over a run that is there: play, step and seek, forward and back, cost nothing. Nothing is computed ahead.

It is called by the owner thread alone and knows neither widgets, files nor jobs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from commission.app.run.sightings import sightings_at
from commission.app.run.turn import turn_at
from commission.app.run.view import Accumulated, RunView
from commission.app.run.wall_points import wall_points
from commission.geometry import se2
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.estimate import Belief, Estimate, Mode, Status
from commission.localization.hypotheses import Hypothesis, hypotheses_of
from commission.localization.observation import project_detections, range_bearing
from commission.localization.run_columns import Checkpoint, RunColumns
from commission.localization.search_state import SearchMoment
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState
from commission.localization.sweep import points_at_stamp
from commission.localization.temporary_memory import TemporaryLandmarks
from commission.localization.validation import validation_ellipses, validation_outlines
from commission.localization.wheel_scale import as_driven
from commission.localization.whole_run import state_before
from commission.planning.visibility import faces
from commission.site.parameters import OdometryParameters
from commission.site.record_log import RecordLog
from commission.site.records import Scan
from commission.studies.run import RunResult

GATE_POINTS = 40
TWIST_NS = 50_000_000
"""Time before and after a scan over which its velocity is taken [ns]."""
MOST_POINTS = 40_000
"""Accumulated points of each kind that are drawn: of more, every second, third, ... one over the whole drive."""


class Playback:
    """A run, and where in it the page is.

    Parameters
    ----------
    result : the whole drive, localized and judged: at least one cycle.
    """

    def __init__(self, result: RunResult) -> None:
        log = result.inputs.log
        self.start_ns, self.end_ns = log.first_ns, log.last_ns
        self._at_ns = self.start_ns
        self.replace(result)

    @property
    def result(self) -> RunResult:
        """The whole drive."""
        return self._result

    @property
    def time(self) -> float:
        """The cursor: time after the start [s]."""
        return (self._at_ns - self.start_ns) * 1e-9

    @property
    def lived(self) -> int:
        """Number of cycles up to the cursor."""
        return int(np.searchsorted(self._result.columns.stamps_ns, self._at_ns, side="right"))

    @property
    def at_start(self) -> bool:
        """Whether the cursor is where the drive begins."""
        return self._at_ns <= self.start_ns

    @property
    def at_end(self) -> bool:
        """Whether the cursor is where the drive ends."""
        return self._at_ns >= self.end_ns

    def replace(self, result: RunResult) -> None:
        """Show another run over the same drive; the cursor stays."""
        self._result = result
        self._near: Checkpoint | None = None
        self._searched: tuple[SearchMoment, tuple[Hypothesis, ...]] | None = None
        self._inliers, self._outliers = (
            _Cloud(result.columns, chosen)
            for chosen in (result.columns.status == Status.INLIER, result.columns.status != Status.INLIER)
        )

    def grow(self, result: RunResult) -> None:
        """Show more of the same drive; a cursor at its end goes along."""
        was_at_end = self.at_end
        self.replace(result)
        # A live run of hours forgets where it began.
        self.start_ns, self.end_ns = result.inputs.log.first_ns, result.inputs.log.last_ns
        self._at_ns = max(self._at_ns, self.start_ns)
        if was_at_end:
            self._at_ns = self.end_ns

    def seek(self, seconds: float) -> None:
        """Go to a time after the start [s]; one before it or behind the end is the start or the end."""
        # Compared before it is rounded: a slider may ask for more nanoseconds than there are numbers.
        inside = min(max(seconds, 0.0), (self.end_ns - self.start_ns) * 1e-9)
        self._at_ns = min(self.start_ns + round(inside * 1e9), self.end_ns)

    def advance(self, seconds: float) -> None:
        """Move the cursor by a time [s], which may be negative."""
        self.seek(self.time + seconds)

    def step(self, cycles: int) -> None:
        """Go to the scan that lies some cycles ahead, or back where negative; beyond the first or last: there."""
        stamps = self._result.columns.stamps_ns
        wanted = self.lived - 1 + cycles
        self._at_ns = self.start_ns if wanted < 0 else int(stamps[min(wanted, len(stamps) - 1)])

    def view(self, *, covered: bool, whole: bool = True) -> RunView:
        """Return the run as it is at the cursor.

        Parameters
        ----------
        covered : whether every reflector is covered from the next cycle on, as asked for.
        whole : with every detection so far, which takes longest to copy and draw.
        """
        columns, lived = self._result.columns, self.lived
        seen = _newest_seen(columns, lived)
        estimate = columns.estimate(seen) if lived else None
        belief = columns.belief(lived - 1) if lived else columns.initial
        segment = columns.segment(max(lived - 1, 0))
        scans = self._scan_points(belief, segment.setup)
        areas = self._areas(seen, estimate, segment.setup)
        return RunView(
            result=self._result,
            lived=lived,
            time=self.time,
            pose=belief.mean,
            covariance=belief.covariance,
            mode=Mode(int(columns.modes[lived - 1])) if lived else Mode.OPERATIONAL,
            estimate=estimate,
            seen=seen,
            turn=turn_at(columns, lived, self._at_ns, segment.setup),
            walls=wall_points(columns, lived, np.concatenate(scans), segment.setup),
            sightings=sightings_at(columns, lived, self._at_ns, segment.setup),
            segment=segment,
            covered=covered,
            scan_map=np.concatenate(scans),
            first_scan=len(scans[0]),
            judged_map=_judged(estimate, segment.setup),
            areas=areas,
            gates=_gates(estimate, segment.setup, areas),
            accumulated=self._accumulated(lived) if whole else None,
            hypotheses=self._hypotheses(lived),
            temporary=self._temporary(lived, segment.setup),
        )

    def _areas(self, seen: int, estimate: Estimate | None, setup: LocalizerSetup) -> FloatArray:
        """(N, 2, 2) where on the floor each reflector was expected to be detected, 1-sigma [m^2]; none by bearings."""
        if estimate is None or estimate.bearing is not None:
            return np.empty((0, 2, 2))
        before, twist = None, np.zeros(3)
        if setup.constants is not None:
            before = self._state_before(seen)
            wheels, usual_ns = setup.parameters.odometry, before.tracking.motion.usual_ns
            twist = _twist_over(self._result.inputs.log, estimate.stamp_ns, usual_ns, wheels)
        return validation_ellipses(setup, estimate.prior, scanner=estimate.scanner, before=before, twist=twist)

    def _hypotheses(self, lived: int) -> tuple[Hypothesis, ...]:
        """Where the vehicle may be after the newest cycle; the same value as long as nothing of it has changed."""
        moment = self._result.columns.search(lived - 1)
        if moment is None:
            return ()
        if self._searched is None or self._searched[0] is not moment:
            self._searched = moment, hypotheses_of(moment)
        return self._searched[1]

    def _temporary(self, lived: int, setup: LocalizerSetup) -> TemporaryLandmarks | None:
        """Temporary landmarks after the newest cycle."""
        if setup.temporary is None or not lived:
            return None
        known = self._state_before(lived).temporary
        return known if known is not None and len(known) else None

    def _state_before(self, cycle: int) -> FilterState:
        """State before a cycle; while the vehicle drives on, from the one before it."""
        state = state_before(self._result.columns, self._result.inputs.log, cycle, self._near)
        self._near = Checkpoint(cycle, state)
        return state

    def _accumulated(self, lived: int) -> Accumulated:
        """Return every detection's place so far."""
        rows = int(self._result.columns.offsets[lived])
        return Accumulated(self._inliers.before(rows), self._outliers.before(rows))

    def _scan_points(self, belief: Belief, setup: LocalizerSetup) -> list[FloatArray]:
        """(B, 2) end points of the beams of each scanner's newest scan [m], map frame, in the order of the setup.

        Each beam is drawn from where the scanner was at the beam's own time.
        """
        log, columns = self._result.inputs.log, self._result.columns
        indices = setup.indices_of(log.scanners)
        points = [np.empty((0, 2)) for _ in setup.scanners]
        for scans in log.scans:
            newest = int(np.searchsorted(scans.stamps_ns, self._at_ns, side="right")) - 1
            if newest >= 0:
                scanner = setup.scanners[int(indices[scans.scanner])]
                stamp_ns = int(scans.stamps_ns[newest])
                cycle = int(np.searchsorted(columns.stamps_ns, stamp_ns, side="right")) - 1
                # Where the sensor itself detects, a scan is no cycle.
                is_cycle = cycle >= 0 and columns.stamps_ns[cycle] == stamp_ns
                T_map_base = columns.means[cycle] if is_cycle else belief.mean
                twist = _twist_at(log, stamp_ns, setup.parameters.odometry)
                seen = points_at_stamp(scanner, _returns(scans.scan(newest)), twist)
                T_map_scanner = se2.compose(T_map_base, scanner.mounting)
                points[int(indices[scans.scanner])] = se2.transform_points(T_map_scanner, seen)
        return points


def _newest_seen(columns: RunColumns, lived: int) -> int:
    """Return the newest cycle that is no reflex of a goniometer; where all are, the newest; -1 before the first."""
    met = columns.detected.bearings
    if met is None or not lived:
        return lived - 1
    if met.rows_before(lived) == lived:
        return lived - 1
    back = int(np.argmin(met.is_reflex[:lived][::-1]))
    return lived - 1 - back


def _gates(estimate: Estimate | None, setup: LocalizerSetup, areas: FloatArray) -> FloatArray:
    """(R, n, 2) validation areas of the reflectors that the scanner could see if nothing stood in between."""
    if estimate is None or estimate.bearing is not None or not len(setup.reflectors):
        return np.empty((0, GATE_POINTS, 2))
    scanner = setup.scanners[estimate.scanner]
    seen = range_bearing(estimate.prior.mean, scanner.mounting, setup.reflectors.centers)
    in_view = faces(scanner, seen[:, 1]) & (seen[:, 0] <= min(scanner.reflector_range, scanner.range[1]))
    return validation_outlines(setup, areas, points=GATE_POINTS)[in_view]


def _judged(estimate: Estimate | None, setup: LocalizerSetup) -> FloatArray:
    """(N, 2) detections of a cycle seen from the belief before it [m], map frame."""
    if estimate is None:
        return np.empty((0, 2))
    return project_detections(
        estimate.prior.mean[np.newaxis],
        np.array([0, len(estimate.detections)]),
        estimate.detections,
        setup.observation_rows,
        scanners=np.array([estimate.scanner]),
    )


def _returns(scan: Scan) -> FloatArray:
    """(B, 2) range [m] and bearing [rad] of the beams of a scan that came back, as the scanner reports them."""
    hit = np.isfinite(scan.ranges)
    return np.stack((scan.ranges[hit].astype(np.float64), scan.bearings[hit]), axis=1)


def _twist_at(log: RecordLog, stamp_ns: int, wheels: OdometryParameters) -> FloatArray:
    """(3,) velocity of base by the odometry about a time [m/s, m/s, rad/s]; zeros where there is none."""
    stamps = log.odometry_stamps_ns
    first, last = np.searchsorted(stamps, (stamp_ns - TWIST_NS, stamp_ns + TWIST_NS), side="right").tolist()
    first = max(first, 1)
    if last <= first:
        return np.zeros(3)
    x = y = theta = 0.0
    # Number by number: with each picture, arrays of three would take longest of all that a scan needs.
    for dx, dy, dtheta in as_driven(log.displacements[first:last], wheels).tolist():
        x, y, theta = se2.compose_scalars(x, y, theta, dx, dy, dtheta)
    return np.array(se2.log_scalars(x, y, theta)) / ((stamps[last - 1] - stamps[first - 1]) * 1e-9)


def _twist_over(log: RecordLog, stamp_ns: int, usual_ns: int, wheels: OdometryParameters) -> FloatArray:
    """(3,) velocity of base that the filter takes for a scan [m/s, m/s, rad/s]: that of the odometry around it.

    Where the record behind the scan came too late to be waited for, the one before goes on.
    """
    stamps = log.odometry_stamps_ns
    row = int(np.searchsorted(stamps, stamp_ns))
    if row == len(stamps) or stamps[row] > stamp_ns + usual_ns:
        row -= 1
    if row < 1:
        return np.zeros(3)
    return se2.log(as_driven(log.displacements[row : row + 1], wheels)[0]) / ((stamps[row] - stamps[row - 1]) * 1e-9)


class _Cloud:
    """Places of some detections of a whole run, at most MOST_POINTS of them; computed when they are first asked for."""

    def __init__(self, columns: RunColumns, chosen: NDArray[np.bool_]) -> None:
        self._columns, self._chosen = columns, chosen
        self._rows: IntArray | None = None
        self._points = np.empty((0, 2))

    def before(self, row: int) -> FloatArray:
        """(N, 2) places [m], map frame, of those before a row of the detections."""
        if self._rows is None:
            rows = np.flatnonzero(self._chosen)
            self._rows = rows[:: max(1, -(-len(rows) // MOST_POINTS))]
            self._points = _points_of(self._columns, self._rows)
        return self._points[: int(np.searchsorted(self._rows, row))]


def _points_of(columns: RunColumns, rows: IntArray) -> FloatArray:
    """(N, 2) places [m], map frame, of some detections, seen from the posteriors of their cycles."""
    cycles = np.searchsorted(columns.offsets, rows, side="right") - 1
    points = np.empty((len(rows), 2))
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        here = slice(*np.searchsorted(cycles, (segment.first, end)).tolist())
        alone = np.arange(len(rows[here]) + 1, dtype=np.int64)
        points[here] = project_detections(
            columns.means[cycles[here]],
            alone,
            columns.range_bearing[rows[here]],
            segment.setup.observation_rows,
            scanners=columns.detected.scanners[cycles[here]],
        )
    return points
