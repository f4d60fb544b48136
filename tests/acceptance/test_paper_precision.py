"""Sobreira et al. 2016, section 5.1: precision in the laboratory, with fields of view of 360 and of 180 degrees.

As in the paper, the narrow field of view is the same drive with every measurement beyond 90 degrees ignored.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import load_project
from commission.simulation.scenario import virtual_drive
from tests.acceptance.judged import Judged, judge, seen_within
from tests.conftest import Seeds
from tests.planning.driven import EXACT

DRIVES = 20
FEW_DRIVES = 4

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def drives(repository: Path, seeds: Seeds) -> dict[int, list[Judged]]:
    """The drives, judged with each field of view [deg]."""
    # Nothing but noise is drawn: map, mounting, range and clock are exact, and known to be.
    project = replace(load_project(repository / "maps" / "laboratory"), uncertainty=EXACT)
    route = project.routes[0].name
    judged: dict[int, list[Judged]] = {360: [], 180: []}
    for seed in seeds(FEW_DRIVES, DRIVES):
        log = virtual_drive(project, route, seed)
        judged[360].append(judge(project, route, log))
        judged[180].append(judge(project, route, seen_within(log, 90.0)))
    return judged


def rmse(distances: np.ndarray) -> float:
    return float(np.sqrt(np.mean(distances**2)))


def test_position_rmse_is_below_ten_millimetres_with_a_full_turn(drives: dict[int, list[Judged]]) -> None:
    for drive in drives[360]:
        assert drive.statistics.position_rmse < 0.010
    assert rmse(np.concatenate([drive.distances for drive in drives[360]])) < 0.004


def test_half_a_turn_is_as_precise_wherever_two_reflectors_are_seen(drives: dict[int, list[Judged]]) -> None:
    two = np.concatenate([drive.distances[settled(drive.inliers)] for drive in drives[180]])
    fewer = np.concatenate([drive.distances[~settled(drive.inliers)] for drive in drives[180]])
    assert rmse(two) < 0.010
    # Where the paper sees the error grow: one reflector or none, odometry only.
    assert rmse(fewer) > 1.5 * rmse(two)
    assert len(fewer) > 0.05 * (len(two) + len(fewer))


@pytest.mark.parametrize("field_of_view", [360, 180])
def test_covariance_is_consistent_with_the_errors(
    drives: dict[int, list[Judged]], field_of_view: int, seeds: Seeds
) -> None:
    for of in ("anees", "anees_position"):
        values = np.array([getattr(drive.statistics, of) for drive in drives[field_of_view]])
        # The bounds are for the mean of 20 drives; that of a few may lie two standard errors beside it.
        margin = 0.0 if seeds.all else 2.0 * float(values.std(ddof=1)) / np.sqrt(len(values))
        assert 0.8 - margin < values.mean() < 1.25 + margin


def test_nothing_is_wrong_while_operational(drives: dict[int, list[Judged]]) -> None:
    assert all(drive.statistics.wrong_while_operational == 0 for drive in drives[360] + drives[180])


def settled(inliers: np.ndarray) -> np.ndarray:
    """(K,) cycles in which, and for one second before which, at least two reflectors were used."""
    window = 25
    enough = np.concatenate([np.ones(window - 1, bool), inliers >= 2])
    return np.lib.stride_tricks.sliding_window_view(enough, window).all(axis=1)
