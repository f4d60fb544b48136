"""The localizer over a whole recording in one compiled loop, through the same steps as `Localizer.feed`.

Detections are extracted beforehand (`detection_log`), so that a moved gate replays the filter alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.cycle import process_scan
from commission.localization.detection_log import DetectionLog, extract_detections
from commission.localization.estimate import Belief, Estimate, Mode, Status
from commission.localization.observation import ObservationModel, project_detections
from commission.localization.odometry import AT_REST, Motion, advance
from commission.localization.pose_gaussian import PoseGaussian, from_belief, to_belief
from commission.localization.setup import FilterModel, LocalizerSetup
from commission.site.parameters import Parameters
from commission.site.record_log import RecordLog, ScanLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner


class Columns(NamedTuple):
    """Where the loop writes: a row per cycle, then a row per detection."""

    prior_means: FloatArray
    prior_covariances: FloatArray
    means: FloatArray
    covariances: FloatArray
    modes: NDArray[np.int8]
    status: NDArray[np.int8]
    reflectors: IntArray
    d2: FloatArray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunArrays:
    """A whole run as columns: K cycles (one per scan) with n detections in total. All arrays are read-only."""

    initial: Belief
    """Belief before the first record."""
    detected: DetectionLog
    """Stamps of the cycles, rows of their detections, and the detections as measured."""
    gate: float
    """Largest squared Mahalanobis distance of an inlier (chi-square, 2 degrees of freedom)."""
    observation: ObservationModel
    """Scanner mounting and range bias of the run."""
    prior_means: FloatArray
    """(K, 3) `T_map_base` after *predict* [m, m, rad]."""
    prior_covariances: FloatArray
    """(K, 3, 3) after *predict*."""
    means: FloatArray
    """(K, 3) `T_map_base` after *correct*: the filter's own state [m, m, rad]."""
    covariances: FloatArray
    """(K, 3, 3) after *correct*."""
    modes: NDArray[np.int8]
    """(K,) a `Mode` each."""
    status: NDArray[np.int8]
    """(n,) a `Status` each."""
    reflector: IntArray
    """(n,) index into the reflector map; -1: none."""
    d2: FloatArray
    """(n,) squared Mahalanobis distance to that reflector; NaN: none."""
    final: Belief
    """Belief after the last record, odometry included."""

    def __len__(self) -> int:
        """Return the number of cycles."""
        return len(self.detected)

    @property
    def stamps_ns(self) -> IntArray:
        """(K,) time of each scan [ns]."""
        return self.detected.stamps_ns

    @property
    def offsets(self) -> IntArray:
        """(K + 1,) detections of cycle k: offsets[k] to offsets[k + 1]."""
        return self.detected.offsets

    @property
    def range_bearing(self) -> FloatArray:
        """(n, 2) range [m] and bearing [rad] of each detection, scanner frame."""
        return self.detected.range_bearing

    @property
    def beams(self) -> IntArray:
        """(n,) width of each cluster [beams]; 0 where the sensor itself detected."""
        return self.detected.beams

    def counts(self, status: Status) -> IntArray:
        """(K,) detections of one status in each cycle."""
        totals = np.concatenate(([0], np.cumsum(self.status == status, dtype=np.int64)))
        return totals[self.offsets[1:]] - totals[self.offsets[:-1]]

    def nis_sums(self) -> FloatArray:
        """(K,) sum of the squared Mahalanobis distances of each cycle's inliers; 2 degrees of freedom each."""
        totals = np.concatenate(([0.0], np.cumsum(np.where(self.status == Status.INLIER, self.d2, 0.0))))
        return totals[self.offsets[1:]] - totals[self.offsets[:-1]]

    def output_cycles(self) -> IntArray:
        """(K,) cycle whose posterior the vehicle is given: the last operational one; -1: the initial belief."""
        cycles = np.where(self.modes == Mode.OPERATIONAL, np.arange(len(self), dtype=np.int64), -1)
        return np.maximum.accumulate(cycles)

    def points_map(self) -> FloatArray:
        """(n, 2) every detection seen from the posterior of its cycle [m], map frame."""
        return project_detections(self.means, self.offsets, self.range_bearing, self.observation)

    def estimate(self, cycle: int) -> Estimate:
        """Return one cycle as `Localizer.feed` gives it, to the last bit."""
        stamp_ns = int(self.stamps_ns[cycle])
        rows = slice(int(self.offsets[cycle]), int(self.offsets[cycle + 1]))
        detections = self.range_bearing[rows]
        offsets = np.array((0, len(detections)), dtype=np.int64)
        points = project_detections(self.means[cycle : cycle + 1], offsets, detections, self.observation)
        given = int(self.output_cycles()[cycle])
        return Estimate(
            stamp_ns=stamp_ns,
            prior=Belief(stamp_ns, self.prior_means[cycle], self.prior_covariances[cycle]),
            posterior=self._posterior(cycle),
            output=self.initial if given < 0 else self._posterior(given),
            mode=Mode(int(self.modes[cycle])),
            detections=detections,
            beams=self.beams[rows],
            points_map=points,
            status=self.status[rows],
            reflector=self.reflector[rows],
            d2=self.d2[rows],
            gate=self.gate,
        )

    def _posterior(self, cycle: int) -> Belief:
        return Belief(int(self.stamps_ns[cycle]), self.means[cycle], self.covariances[cycle])


def run(
    log: RecordLog,
    setup: LocalizerSetup,
    initial: Belief,
    *,
    detected: DetectionLog | None = None,
) -> RunArrays:
    """Localize over a whole recording.

    Parameters
    ----------
    log : all records of a drive.
    setup : reflector map, scanner and parameters.
    initial : belief before the first record.
    detected : result of `extract_detections` for the same log and detector parameters; None extracts it now.

    Returns
    -------
    arrays : every cycle and every detection, equal to the last bit to feeding the records to a `Localizer`.
    """
    if detected is None:
        detected = extract_detections(log, setup)
    cycles, total = len(detected), len(detected.range_bearing)
    columns = Columns(
        np.empty((cycles, 3)),
        np.empty((cycles, 3, 3)),
        np.empty((cycles, 3)),
        np.empty((cycles, 3, 3)),
        np.empty(cycles, dtype=np.int8),
        detected.status.copy(),
        np.empty(total, dtype=np.int64),
        np.empty(total),
    )
    start = from_belief(initial)
    final = _run(
        read_only(log.odometry_stamps_ns),
        read_only(log.displacements),
        detected.stamps_ns,
        detected.offsets,
        detected.range_bearing,
        setup.filter,
        setup.index.places,
        setup.index.offsets,
        start,
        AT_REST,
        columns,
    )
    for column in columns:
        column.setflags(write=False)
    newest = [int(column[-1]) for column in (log.odometry_stamps_ns, detected.stamps_ns) if len(column)]
    return RunArrays(
        initial=to_belief(start, initial.stamp_ns),
        detected=detected,
        gate=setup.filter.gate.d2,
        observation=setup.filter.observation,
        prior_means=columns.prior_means,
        prior_covariances=columns.prior_covariances,
        means=columns.means,
        covariances=columns.covariances,
        modes=columns.modes,
        status=columns.status,
        reflector=columns.reflectors,
        d2=columns.d2,
        final=to_belief(final, max(newest, default=initial.stamp_ns)),
    )


def warm_up() -> None:
    """Compile the loop and the detection of whole logs (the serial one), by running over one scan."""
    setup = LocalizerSetup(ReflectorMap((Reflector(id="A", x=2.0, y=0.0),)), Scanner(), Parameters())
    ranges = np.full((1, 4), 1.96, dtype=np.float32)
    flags = np.array([[False, False, True, False]])
    scans = ScanLog(
        stamps_ns=np.array([2]),
        ranges=ranges,
        angle_min=-0.02,
        angle_increment=0.01,
        intensities=None,
        reflector=flags,
    )
    log = RecordLog(odometry_stamps_ns=np.array([0, 1]), displacements=np.zeros((2, 3)), scans=scans)
    run(log, setup, Belief(0, np.zeros(3), 1e-4 * np.eye(3))).points_map()


@compiled
def _run(  # noqa: PLR0917 - the columns of the log
    odometry_stamps: IntArray,
    displacements: FloatArray,
    scan_stamps: IntArray,
    offsets: IntArray,
    detections: FloatArray,
    model: FilterModel,
    places: FloatArray,
    cell_offsets: IntArray,
    belief: PoseGaussian,
    motion: Motion,
    columns: Columns,
) -> PoseGaussian:
    """Deliver odometry and scans in the order of their stamps, odometry first; return the belief after the last."""
    prior_means, prior_covariances, means, covariances, modes, status, reflectors, d2 = columns
    mode = 0
    rows = 0
    for k in range(len(scan_stamps)):
        while rows < len(odometry_stamps) and odometry_stamps[rows] <= scan_stamps[k]:
            dx, dy, dtheta = displacements[rows, 0], displacements[rows, 1], displacements[rows, 2]
            belief, motion = advance(belief, motion, odometry_stamps[rows], dx, dy, dtheta, model.odometry)
            rows += 1
        cycle = process_scan(
            belief,
            motion,
            mode,
            scan_stamps[k],
            offsets[k],
            offsets[k + 1],
            detections,
            model,
            places,
            cell_offsets,
            status,
            reflectors,
            d2,
        )
        belief, motion, mode = cycle.posterior, cycle.motion, cycle.mode
        _store(cycle.prior, k, prior_means, prior_covariances)
        _store(belief, k, means, covariances)
        modes[k] = mode
    while rows < len(odometry_stamps):
        dx, dy, dtheta = displacements[rows, 0], displacements[rows, 1], displacements[rows, 2]
        belief, motion = advance(belief, motion, odometry_stamps[rows], dx, dy, dtheta, model.odometry)
        rows += 1
    return belief


@compiled_inline
def _store(belief: PoseGaussian, row: int, means: FloatArray, covariances: FloatArray) -> None:
    """Write a belief to its row."""
    means[row, 0], means[row, 1], means[row, 2] = belief.x, belief.y, belief.theta
    covariances[row, 0, 0], covariances[row, 0, 1], covariances[row, 0, 2] = belief.xx, belief.xy, belief.xt
    covariances[row, 1, 0], covariances[row, 1, 1], covariances[row, 1, 2] = belief.xy, belief.yy, belief.yt
    covariances[row, 2, 0], covariances[row, 2, 1], covariances[row, 2, 2] = belief.xt, belief.yt, belief.tt
