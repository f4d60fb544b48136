"""A recording replayed through the localizer, and what came of it: the numbers of `localize` and of the page alike.

Extracting the reflectors from the scans is a step of its own, so that a moved gate replays the filter alone. No clock
is read here: whoever calls measures the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.localization.detection_log import DetectionLog
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.metrics import (
    ErrorStatistics,
    FailEpisode,
    error_statistics,
    fail_episodes,
    pose_errors,
    reference_at,
)

Number = int | float | None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ReplayResult:
    """One recording localized, judged against its reference where it has one."""

    run: RunColumns
    """Every cycle and every detection."""
    duration: float
    """Time from the first to the last record [s]."""
    references: FloatArray
    """(K, 3) reference pose at each cycle [m, m, rad], map frame; NaN where there is none."""
    errors: FloatArray
    """(K, 3) estimate minus reference [m, m, rad], map frame; NaN where there is none."""
    statistics: ErrorStatistics | None
    """Errors in numbers; None without a reference."""
    episodes: tuple[FailEpisode, ...]
    """Stretches in fail mode."""

    @property
    def cycles(self) -> int:
        """Number of scans processed."""
        return len(self.run)

    @property
    def operational_fraction(self) -> float:
        """Share of the cycles that the vehicle was allowed to drive [0..1]."""
        return float(np.mean(self.run.modes == Mode.OPERATIONAL))

    @property
    def nis_mean(self) -> float:
        """Mean squared Mahalanobis distance of the inliers (2 degrees of freedom); NaN without inliers.

        The gate cuts off the tail: for a consistent filter and a gate of 95 % it is 1.68, not 2.
        """
        inlier = self.run.status == Status.INLIER
        return float(np.mean(self.run.d2[inlier])) if inlier.any() else math.nan

    def count(self, status: Status) -> int:
        """Return the number of detections of one status."""
        return int(np.count_nonzero(self.run.status == status))


def replay(project: Project, log: RecordLog, initial: Belief, *, detected: DetectionLog | None = None) -> ReplayResult:
    """Localize a whole recording and judge the result: `localize`, then `judge`.

    Parameters
    ----------
    project, log, initial, detected : as in `localize`.
    """
    return judge(project, log, localize(project, log, initial, detected=detected))


def localize(project: Project, log: RecordLog, initial: Belief, *, detected: DetectionLog | None = None) -> RunColumns:
    """Run the localizer over a recording.

    Parameters
    ----------
    project : reflectors, scanner and parameters of the localizer.
    log : the recording.
    initial : belief before the first record.
    detected : result of `extract_detections` for the same recording, map, scanner and detector parameters; None
        extracts it now.

    Raises
    ------
    UsageError
        the recording holds neither scans nor detections, so that there is nothing to localize by.
    """
    arrays = run(log, LocalizerSetup.of(project), initial, detected=detected)
    if len(arrays) == 0:
        raise UsageError("the recording holds no scan and no detection; expected at least one to localize by")
    return arrays


def judge(project: Project, log: RecordLog, arrays: RunColumns) -> ReplayResult:
    """Compare a finished run with the reference poses of its recording.

    Parameters
    ----------
    project : the one that the run was made with; its alarm limit decides what is wrong while operational.
    log : the recording.
    arrays : the run, at least one cycle.
    """
    references = reference_at(arrays.stamps_ns, log.reference_stamps_ns, log.reference_poses)
    errors = pose_errors(arrays.means, references)
    return ReplayResult(
        run=arrays,
        duration=float(log.stamps_ns[-1] - log.stamps_ns[0]) / 1e9,
        references=references,
        errors=errors,
        statistics=error_statistics(
            errors,
            arrays.covariances,
            arrays.modes == Mode.OPERATIONAL,
            project.parameters.supervisor.position_limit,
        ),
        episodes=fail_episodes(arrays.stamps_ns, arrays.modes),
    )


def summary(result: ReplayResult, microseconds_per_cycle: float) -> dict[str, Number]:
    """Entries of `summary.json`, by their keys.

    Parameters
    ----------
    result : of `replay`.
    microseconds_per_cycle : time that the caller measured for `localize`, detection in scans included [us].

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
        "fail_episodes": len(result.episodes),
        "nis_mean": result.nis_mean,
        "microseconds_per_cycle": microseconds_per_cycle,
    }
    if result.statistics is not None:
        entries |= {
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
