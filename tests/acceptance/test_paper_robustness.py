"""Sobreira et al. 2016, section 5.2 and Fig. 13: people and false reflectors; and the supervisor of Algorithm 4."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import load_project
from commission.localization.estimate import Mode
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import CoveredPeriod
from commission.site.project import Project
from commission.studies.metrics import fail_episodes
from tests.acceptance.judged import Judged, judge, with_filters
from tests.conftest import Seeds
from tests.planning.driven import EXACT

DRIVES = 20
FEW_DRIVES = 4
"""Every bound holds for each drive, or compares means that are far apart: it is the same for few and for all."""
ROUTE = "P0-P1-P2"
COVERED = CoveredPeriod(start=12.0, duration=20.0)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def shop_floor(repository: Path) -> Project:
    # Nothing but noise and what people do: map, mounting, range and clock are exact, and known to be.
    return replace(load_project(repository / "maps" / "shop_floor"), uncertainty=EXACT)


@pytest.fixture(scope="module")
def fig_13(shop_floor: Project, seeds: Seeds) -> dict[str, list[Judged]]:
    """The same drives under the three settings of Fig. 13."""
    settings = {"none": (False, False), "detector": (True, False), "both": (True, True)}
    judged: dict[str, list[Judged]] = {name: [] for name in settings}
    for seed in seeds(FEW_DRIVES, DRIVES):
        log = virtual_drive(shop_floor, ROUTE, seed)
        for name, filters in settings.items():
            judged[name].append(judge(with_filters(shop_floor, *filters), ROUTE, log))
    return judged


@pytest.fixture(scope="module")
def covered(shop_floor: Project, seeds: Seeds) -> list[Judged]:
    """Drives during which all reflectors are covered for 20 s."""
    project = replace(shop_floor, disturbances=replace(shop_floor.disturbances, covered=(COVERED,)))
    drives = seeds(FEW_DRIVES, DRIVES)
    return [judge(project, ROUTE, virtual_drive(project, ROUTE, seed)) for seed in drives]


def test_drives_meet_people_and_false_reflectors(shop_floor: Project, fig_13: dict[str, list[Judged]]) -> None:
    assert shop_floor.disturbances.people == 50
    for drive in fig_13["both"]:
        outliers = np.count_nonzero(drive.run.status)
        assert outliers > 0.2 * len(drive.run.status)


def test_each_filter_lowers_the_error_and_its_largest_jump(fig_13: dict[str, list[Judged]]) -> None:
    rmse = {name: np.mean([d.statistics.position_rmse for d in drives]) for name, drives in fig_13.items()}
    jump = {name: np.mean([d.statistics.largest_jump for d in drives]) for name, drives in fig_13.items()}
    assert rmse["none"] > rmse["detector"] > rmse["both"]
    assert jump["none"] > jump["detector"] > jump["both"]


def test_with_both_filters_no_jump_and_no_error_is_large(fig_13: dict[str, list[Judged]]) -> None:
    for drive in fig_13["both"]:
        assert drive.statistics.largest_jump < 0.030
        assert drive.statistics.position_rmse < 0.015
        assert drive.statistics.wrong_while_operational == 0


def test_supervisor_fails_within_one_cycle_of_the_limit_and_recovers_by_itself(
    shop_floor: Project, covered: list[Judged]
) -> None:
    limits = shop_floor.parameters.supervisor
    for drive in covered:
        # Along whichever direction it is largest: more than along x or y, so that it stops the vehicle before them.
        position = 2.0 * np.sqrt(np.linalg.eigvalsh(drive.run.covariances[:, :2, :2])[:, -1])
        heading = 2.0 * np.sqrt(drive.run.covariances[:, 2, 2])
        passed = (position > limits.position_limit) | (heading > limits.heading_limit)
        first_passed = int(np.flatnonzero(passed)[0])
        first_failed = int(np.flatnonzero(drive.run.modes == Mode.FAIL)[0])
        assert first_passed <= first_failed <= first_passed + 1
        (episode,) = fail_episodes(drive.run.stamps_ns, drive.run.modes)
        assert episode.recovered
        uncovered = COVERED.start + COVERED.duration
        assert uncovered - 1.0 < 1e-9 * episode.end_ns < uncovered + 5.0
        assert drive.distances[-1] < 0.03


def test_true_error_never_passes_the_limit_while_operational(covered: list[Judged]) -> None:
    assert all(drive.statistics.wrong_while_operational == 0 for drive in covered)
