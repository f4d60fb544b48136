"""A virtual drive localized and judged against its truth, for the acceptance tests."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from commission.localization import whole_run
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.simulation.scenario import start_of
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.metrics import ErrorStatistics, error_statistics, pose_errors, reference_at


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """One run and its errors."""

    run: RunColumns
    errors: np.ndarray
    """(K, 3) [m, m, rad]."""
    statistics: ErrorStatistics

    @property
    def distances(self) -> np.ndarray:
        """(K,) position error [m]."""
        return np.hypot(self.errors[:, 0], self.errors[:, 1])

    @property
    def inliers(self) -> np.ndarray:
        """(K,) reflectors used in each cycle."""
        return self.run.counts(Status.INLIER)


def judge(project: Project, route: str, log: RecordLog) -> Judged:
    """Localize a virtual drive from what was known of its start."""
    start = start_of(project, route)
    initial = Belief(0, start.pose, np.diag(start.sigmas**2))
    run = whole_run.run(log, LocalizerSetup.of(project), initial)
    references = reference_at(run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
    errors = pose_errors(run.means, references)
    limit = project.parameters.supervisor.position_limit
    statistics = error_statistics(errors, run.covariances, run.modes == Mode.OPERATIONAL, limit)
    assert statistics is not None
    return Judged(run, errors, statistics)


def with_filters(project: Project, detector: bool, association: bool) -> Project:
    """The project with its two outlier filters on or off."""
    given = project.parameters
    parameters = replace(
        given,
        detector=replace(given.detector, enabled=detector),
        association=replace(given.association, enabled=association),
    )
    return replace(project, parameters=parameters)


def seen_within(log: RecordLog, half_angle_deg: float) -> RecordLog:
    """The recording with every reflector flag beyond a bearing ignored: a narrower field of view by software."""
    (scans,) = log.scans
    assert scans.reflector is not None
    bearings = np.degrees(scans.scan(0).bearings)
    inside = np.abs(bearings) <= half_angle_deg
    return replace(log, scans=(replace(scans, reflector=scans.reflector & inside),))
