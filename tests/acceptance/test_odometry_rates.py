"""A drive is localized as well with odometry at 2 Hz as at 100 Hz: between two records its motion is interpolated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.geometry import se2
from commission.io.project_file import load_project
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import virtual_drive
from commission.site.record_log import RecordLog
from tests.acceptance.judged import Judged, judge
from tests.conftest import Seeds, few_of

DRIVES = 20
FEW_DRIVES = 3
FASTEST = 100
RATES = (100, 50, 20, 10, 5, 2)

pytestmark = pytest.mark.slow


def thinned(log: RecordLog, every: int) -> RecordLog:
    """The same drive with fewer odometry records: each holds the motion since the one before it."""
    kept = np.arange(0, len(log.odometry_stamps_ns), every)
    displacements = np.zeros((len(kept), 3))
    for number, row in enumerate(kept[1:], start=1):
        for step in log.displacements[kept[number - 1] + 1 : row + 1]:
            displacements[number] = se2.compose(displacements[number], step)
    return replace(log, odometry_stamps_ns=log.odometry_stamps_ns[kept], displacements=displacements)


@pytest.fixture(scope="module", params=few_of(("laboratory", "shop_floor"), ("laboratory",)))
def drives(request: pytest.FixtureRequest, repository: Path, seeds: Seeds) -> dict[int, list[Judged]]:
    """The drives of a site by odometry rate [1/s], scans at 25 Hz."""
    project = load_project(repository / "maps" / request.param)
    route = project.routes[0].name
    options = DriveOptions(odometry_rate=float(FASTEST), whole_scans=False)
    judged: dict[int, list[Judged]] = {rate: [] for rate in RATES}
    for seed in seeds(FEW_DRIVES, DRIVES):
        log = virtual_drive(project, route, seed, options=options)
        for rate in RATES:
            judged[rate].append(judge(project, route, thinned(log, FASTEST // rate)))
    return judged


@pytest.mark.parametrize("rate", RATES)
def test_errors_are_as_small_and_no_larger_than_the_filter_says(drives: dict[int, list[Judged]], rate: int) -> None:
    def rmse(of: int) -> float:
        return float(np.sqrt(np.mean(np.concatenate([drive.distances for drive in drives[of]]) ** 2)))

    # Slow odometry is smoothed, and so a little better, until the interpolation along an arc no longer holds.
    assert 0.85 * rmse(FASTEST) < rmse(rate) < 1.10 * rmse(FASTEST)
    assert np.mean([drive.statistics.anees for drive in drives[rate]]) <= 1.0
    assert all(drive.statistics.wrong_while_operational == 0 for drive in drives[rate])
