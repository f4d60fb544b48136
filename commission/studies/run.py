"""A run, judged: the localizer over a drive, and every figure of it that page and command show.

From frozen inputs to a frozen result; nothing is kept, read or drawn. A figure that is wanted twice is computed here.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization import whole_run
from commission.localization.detection_log import cycle_stamps
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns, RunSegment
from commission.localization.setup import LocalizerSetup
from commission.localization.supervisor import position_two_sigma
from commission.localization.whole_run import run_segments
from commission.progress import Progress, part, silent
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.bearing_figures import bearing_figures
from commission.studies.consistency import Consistency, Recent, consistency, recent
from commission.studies.contour_figures import contour_figures
from commission.studies.inputs import StudyInput
from commission.studies.metrics import (
    ROWS_AT_ONCE,
    ErrorStatistics,
    FailEpisode,
    error_statistics,
    fail_episodes,
    nees,
    pose_errors,
    reference_at,
    without_reference,
)
from commission.studies.reference_headings import in_radians
from commission.studies.scanner_figures import ScannerFigures, scanner_figures
from commission.studies.scanner_figures import warm_up as scanner_figures_warm_up
from commission.studies.start import Start
from commission.studies.tag_figures import tag_figures
from commission.studies.tallies import tallies_of
from commission.studies.tallies import warm_up as tallies_warm_up
from commission.studies.temporary_figures import temporary_figures

Number = int | float | None
JUDGING_SHARE = 0.1
"""Share of the progress that the figures take."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunInput(StudyInput):
    """All that a run depends on."""

    log: RecordLog
    """The drive."""
    start: Start
    """Belief before the first record, and who says so."""
    segments: tuple[RunSegment, ...]
    """Setups, from which cycle on, and whether reflectors are covered; the first one begins at cycle 0."""

    @staticmethod
    def of(project: Project, log: RecordLog, start: Start) -> RunInput:
        """Return the input of a run with the setup of a project from start to end.

        Parameters
        ----------
        project : reflectors, scanner and parameters.
        log : all records of the drive.
        start : belief before the first record, and where it comes from.
        """
        return RunInput(log=log, start=start, segments=(RunSegment(0, LocalizerSetup.of(project)),))

    def with_setup(self, setup: LocalizerSetup, first: int = 0) -> RunInput:
        """Return the input of the same run with another setup from a cycle on; what is covered stays covered.

        Parameters
        ----------
        setup : the other setup.
        first : first cycle with it.
        """
        return self._changed(first, lambda segment: replace(segment, setup=setup))

    def with_cover(self, first: int, *, covered: bool) -> RunInput:
        """Return the input of the same run with all reflectors covered, or none, from a cycle on; setups stay.

        Parameters
        ----------
        first : first cycle of that.
        covered : whether all reflectors are covered.
        """
        return self._changed(first, lambda segment: replace(segment, covered=covered))

    def with_locate(self, first: int) -> RunInput:
        """Return the input of the same run whose pose is thrown away before a cycle, so that the vehicle looks for it.

        Parameters
        ----------
        first : that cycle.
        """
        return self._changed(first, lambda segment: replace(segment, locate=segment.locate or segment.first == first))

    def segment(self, cycle: int) -> RunSegment:
        """Return the segment of a cycle."""
        return next(segment for segment in reversed(self.segments) if segment.first <= cycle)

    def _changed(self, first: int, change: Callable[[RunSegment], RunSegment]) -> RunInput:
        """Change all segments from a cycle on; where one no longer differs from the one before, they are one."""
        here = self.segment(first)
        here = here if here.first == first else replace(here, first=first, locate=False)
        split = (*(s for s in self.segments if s.first < first), here)
        later = (segment for segment in self.segments if segment.first > first)
        changed = [change(segment) if segment.first >= first else segment for segment in (*split, *later)]
        kept = [changed[0]]
        for segment in changed[1:]:
            if segment.locate or (segment.setup, segment.covered) != (kept[-1].setup, kept[-1].covered):
                kept.append(segment)
        return replace(self, segments=tuple(kept))


TWO_SIGMA = "2σ"
"""What the supervisor goes by unless it is told otherwise."""


class Held(NamedTuple):
    """What the supervisor holds against its limits."""

    name: str
    """What it is: 2-sigma, or the protection level."""
    position: float
    """[m]; inf where there is no level."""
    heading: float
    """[rad]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunResult:
    """A drive localized, and judged against its reference where it has one: K cycles."""

    inputs: RunInput
    """What it was made of."""
    columns: RunColumns
    """Every cycle and every detection."""
    duration: float
    """Time from the first to the last record [s]."""
    times: FloatArray
    """(K,) time of each cycle after the first record [s]."""
    errors: FloatArray
    """(K, 3) estimate minus reference [m, m, rad], map frame; NaN where there is none."""
    position_errors: FloatArray
    """(K,) distance to the reference [m]; NaN where there is none."""
    two_sigma: FloatArray
    """(K, 3) 2-sigma of x [m], y [m] and heading [rad] after each cycle."""
    position_two_sigma: FloatArray
    """(K,) 2-sigma of the position that the supervisor holds against its limit [m]."""
    consistency: Consistency
    """How well the detections of the whole drive fit."""
    recent: Recent
    """The same over the last second before each cycle."""
    counts: NDArray[np.int32]
    """(K, 3) detections of each `Status` in each cycle."""
    nis: FloatArray
    """(K,) largest squared Mahalanobis distance of an inlier of the cycle (2 degrees of freedom); NaN without one."""
    statistics: ErrorStatistics | None
    """Errors in numbers; None without a reference."""
    episodes: tuple[FailEpisode, ...]
    """Stretches in fail mode."""
    scanners: tuple[ScannerFigures, ...]
    """What each scanner contributed; empty where nobody asked."""
    microseconds_per_cycle: float
    """Time that the localizer took per cycle, detection in scans included where it was done [us]."""

    @property
    def cycles(self) -> int:
        """Number of scans processed."""
        return len(self.columns)

    @property
    def operational_fraction(self) -> float:
        """Share of the cycles that the vehicle was allowed to drive [0..1]."""
        return float(np.mean(self.columns.modes == Mode.OPERATIONAL))

    @property
    def lost_fraction(self) -> float:
        """Share of the cycles in which the supervisor says that the vehicle is lost [0..1]."""
        return float(np.mean(self.columns.modes == Mode.LOST))

    @property
    def without_reference(self) -> tuple[int, int]:
        """Cycles outside of the time of the reference, and in its gaps."""
        return without_reference(self.columns.stamps_ns, self.inputs.log.reference_times_ns, self.errors)

    def held(self, cycle: int) -> Held:
        """Return what the supervisor held against its limits in a cycle."""
        levels = self.columns.levels
        if len(levels) and not math.isnan(levels[cycle, 0]):
            return Held("protection", float(levels[cycle, 0]), float(levels[cycle, 1]))
        return Held(TWO_SIGMA, float(self.position_two_sigma[cycle]), float(self.two_sigma[cycle, 2]))

    def reference_places(self, cycles: IntArray) -> FloatArray:
        """(N, 2) places of base at some cycles by the reference [m], map frame; NaN where there is none."""
        return self.columns.means[cycles, :2] - self.errors[cycles, :2]

    def count(self, status: Status) -> int:
        """Return the number of detections of one status."""
        return int(self.counts[:, status].sum())


def warm_up() -> None:
    """Compile everything that a run needs."""
    whole_run.warm_up()
    nees(np.zeros((1, 3)), np.eye(3)[np.newaxis])
    tallies_warm_up()
    scanner_figures_warm_up()


def judged_run(
    inputs: RunInput,
    progress: Progress = silent,
    *,
    earlier: RunResult | None = None,
    of_scanners: bool = True,
    clock: Callable[[], float] = time.perf_counter,
) -> RunResult:
    """Localize a drive and judge the result.

    Parameters
    ----------
    inputs : drive, start, and setups along the way.
    progress : called every few thousand cycles.
    earlier : result of other inputs; what the two have in common is taken from it. All figures are the same to the last
        bit, but for the time per cycle, which is that of the cycles that were computed.
    of_scanners : whether the figures of each scanner are wanted; they take almost as long as all others together.
    clock : returns seconds.

    Raises
    ------
    UsageError
        the drive holds neither scans nor detections, so that there is nothing to localize by.
    """
    log, known = inputs.log, earlier is not None and earlier.inputs.log is inputs.log
    if len(cycle_stamps(log)) == 0:
        raise UsageError("the recording holds no scan and no detection; expected at least one to localize by")
    before = clock()
    columns = run_segments(
        log,
        inputs.segments,
        inputs.start.state(),
        earlier=earlier.columns if earlier is not None and known else None,
        progress=part(progress, 0.0, 1.0 - JUDGING_SHARE),
    )
    microseconds_per_cycle = (clock() - before) * 1e6 / len(columns)
    progress(1.0 - JUDGING_SHARE, "judging the run")
    return judge(inputs, columns, microseconds_per_cycle, of_scanners=of_scanners)


def judge(
    inputs: RunInput, columns: RunColumns, microseconds_per_cycle: float, *, of_scanners: bool = True
) -> RunResult:
    """Compute every figure of a run that is there; a live one may go on.

    Parameters
    ----------
    inputs : what it was made of, and the reference poses of its drive.
    columns : the run.
    microseconds_per_cycle : time that the localizer took [us].
    of_scanners : as in `judged_run`; without them, `scanners` is empty.
    """
    log = inputs.log
    references, tallies = references_of(log, columns), tallies_of(columns)
    scanners: tuple[ScannerFigures, ...] = ()
    if of_scanners:
        # Of hours, half of the figures take as long as the others: a core each.
        with ThreadPoolExecutor(1) as beside:
            pending = beside.submit(scanner_figures, columns, references, tallies)
            errors, statistics = _errors_of(log, columns, references)
            scanners = pending.result()
    else:
        errors, statistics = _errors_of(log, columns, references)
    # Each is a column of the whole run: it goes before the others come.
    del references
    whole, newest = consistency(columns, tallies=tallies), recent(columns, tallies=tallies)
    counts, largest_d2 = tallies.counts, tallies.largest_d2
    del tallies
    first_ns = log.first_ns
    times = np.asarray((columns.stamps_ns - first_ns) * 1e-9, dtype=np.float64)
    return RunResult(
        inputs=inputs,
        columns=columns,
        duration=(log.last_ns - first_ns) / 1e9,
        times=read_only(times),
        errors=read_only(errors),
        position_errors=read_only(np.hypot(errors[:, 0], errors[:, 1])),
        two_sigma=read_only(two_sigma_of(columns.covariances)),
        position_two_sigma=read_only(supervised_two_sigma(columns)),
        consistency=whole,
        recent=newest,
        counts=read_only(counts),
        nis=read_only(largest_d2),
        statistics=statistics,
        episodes=fail_episodes(columns.stamps_ns, columns.modes),
        scanners=scanners,
        microseconds_per_cycle=microseconds_per_cycle,
    )


def _errors_of(
    log: RecordLog, columns: RunColumns, references: FloatArray
) -> tuple[FloatArray, ErrorStatistics | None]:
    """(K, 3) errors against the reference, and what they come to."""
    errors, operational = pose_errors(columns.means, references), columns.modes == Mode.OPERATIONAL
    covariances = _of_places_known(columns, log, references)
    return errors, error_statistics(errors, covariances, operational, _position_limits(columns))


def _of_places_known(columns: RunColumns, log: RecordLog, references: FloatArray) -> FloatArray:
    """(K, 3, 3) covariances of what errors are of: where only an antenna's place is known, of its place."""
    at_antenna = np.isnan(references[:, 2]) & np.isfinite(references[:, 0])
    if not at_antenna.any() or log.reference_mount.is_at_base:
        return columns.covariances
    return np.where(
        at_antenna[:, np.newaxis, np.newaxis],
        log.reference_mount.at_antenna(columns.covariances, columns.means[:, 2]),
        columns.covariances,
    )


def covariances_of_errors(result: RunResult) -> FloatArray:
    """(K, 3, 3) covariances of what the errors of a run are of: of base, or of the reference's antenna."""
    return _of_places_known(result.columns, result.inputs.log, result.errors)


def references_of(log: RecordLog, columns: RunColumns) -> FloatArray:
    """(K, 3) pose of base at each cycle by the reference [m, m, rad], map frame; NaN where there is none.

    Where the reference measures the place of an antenna and no heading, the estimate's takes it to base: the difference
    to the estimate is then that of the antenna's places.
    """
    mount = log.reference_mount
    found = reference_at(columns.stamps_ns, log.reference_times_ns, in_radians(log.reference_poses))
    return mount.at_base(found, columns.means[:, 2])


def two_sigma_of(covariances: FloatArray) -> FloatArray:
    """(K, 3) 2-sigma of x [m], y [m] and heading [rad] of (K, 3, 3) covariances."""
    sigmas = np.diagonal(covariances, axis1=1, axis2=2).copy()
    # In place: of a drive of hours each copy is as large as a column of the run.
    np.maximum(sigmas, 0.0, out=sigmas)
    np.sqrt(sigmas, out=sigmas)
    sigmas *= 2.0
    return sigmas


def supervised_two_sigma(columns: RunColumns) -> FloatArray:
    """(K,) 2-sigma of the position [m], in each cycle the one that its supervisor holds against the limit."""
    ends = (*columns.firsts[1:].tolist(), len(columns))
    found = np.empty(len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        for first in range(segment.first, end, ROWS_AT_ONCE):
            rows = slice(first, min(first + ROWS_AT_ONCE, end))
            found[rows] = position_two_sigma(columns.covariances[rows], segment.setup.parameters.supervisor)
    return found


def _position_limits(columns: RunColumns) -> float | FloatArray:
    """Limit of the position [m]; (K,) array where it changes on the way."""
    limits = {segment.setup.parameters.supervisor.position_limit for segment in columns.segments}
    return limits.pop() if len(limits) == 1 else limits_along(columns)[:, 0]


def limits_along(columns: RunColumns) -> FloatArray:
    """(K, 2) limits of the supervisor in each cycle: of the position [m] and of the heading [rad]."""
    limits = np.array(
        [
            (segment.setup.parameters.supervisor.position_limit, segment.setup.parameters.supervisor.heading_limit)
            for segment in columns.segments
        ]
    )
    return np.repeat(limits, np.diff((*columns.firsts, len(columns))), axis=0)


def summary(result: RunResult) -> dict[str, Number]:
    """Entries of `summary.json`, by their keys.

    Returns
    -------
    entries : the error's entries only where a reference exists; None where a number is undefined (no inlier, a
        reference without headings, a singular covariance).
    """
    entries: dict[str, Number] = {
        "cycles": result.cycles,
        "duration_s": result.duration,
        "inliers": result.count(Status.INLIER),
        "outliers_detector": result.count(Status.OUTLIER_DETECTOR),
        "outliers_association": result.count(Status.OUTLIER_ASSOCIATION),
        "operational_fraction": result.operational_fraction,
        "lost_fraction": result.lost_fraction,
        "fail_episodes": len(result.episodes),
        "nis_mean": result.consistency.nis_mean,
        "nis_expected": result.consistency.nis_expected,
        "nis_before_gate_mean": result.consistency.nis_before_gate_mean,
        "rejected_fraction": result.consistency.rejected_fraction,
        "unseen_fraction": result.consistency.unseen_fraction,
        "longest_unseen_s": result.consistency.longest_unseen,
        "microseconds_per_cycle": result.microseconds_per_cycle,
    }
    entries |= contour_figures(result.columns)
    entries |= tag_figures(result.columns)
    entries |= bearing_figures(result.columns)
    entries |= temporary_figures(result.columns)
    if result.statistics is not None:
        entries |= {
            "reference_cycles": result.statistics.compared,
            "outside_reference_cycles": result.without_reference[0],
            "reference_gap_cycles": result.without_reference[1],
            "position_rmse_m": result.statistics.position_rmse,
            "position_median_m": result.statistics.position_median,
            "position_p95_m": result.statistics.position_p95,
            "position_max_m": result.statistics.position_max,
            "heading_rmse_rad": result.statistics.heading_rmse,
            "anees": result.statistics.anees,
            "anees_position": result.statistics.anees_position,
            "wrong_while_operational": result.statistics.wrong_while_operational,
        }
    return {key: value if value is None or math.isfinite(value) else None for key, value in entries.items()}
