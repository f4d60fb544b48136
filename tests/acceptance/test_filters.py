"""Sobreira et al. 2016, its hard case: a long way by odometry alone, then one reflector in sight; by kind of filter.

Odometry errs as the filter assumes (10 and 3 mm and 0.34 degrees per square root of a metre, as on the bundled sites,
or what `Parameters` begin with), detections by 20 mm and 4 mrad; which reflector it is, is known. NEES is that of the
error as a motion of the plane, for all kinds alike: after a turn, an error lies on an arc, and no ellipse of x and y
holds it. With `--acceptance` 400 drives each, a few in the test command.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
import pytest

from commission.geometry import se2
from commission.localization import whole_run
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import (
    FILTER_KINDS,
    AssociationParameters,
    FilterParameters,
    OdometryParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from tests.conftest import Seeds

DRIVES, FEW_DRIVES = 400, 60
IN_SIGHT = 20.0
STEP, PERIOD_NS = 0.1, 100_000_000
START = np.array([0.01, 0.01, 0.001])
GOOD = OdometryParameters(forward_per_sqrt_m=0.01, lateral_per_sqrt_m=0.003, heading_per_sqrt_m=0.006)
BAD = OdometryParameters()
BLIND_WAYS = (20.0, 60.0, 120.0)

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Figures:
    """Of many drives: RMS error of the place at the end [m], and ANEES with the first detection and at the end."""

    rms: float
    first: float
    last: float
    spread: float
    """Standard error of the last."""


def setup_of(kind: str, blind: float, odometry: OdometryParameters) -> LocalizerSetup:
    parameters = Parameters(
        odometry=odometry,
        filter=FilterParameters(kind=kind, consider=False),
        association=AssociationParameters(enabled=False),
        supervisor=SupervisorParameters(enabled=False, rejection_enabled=False),
    )
    alone = Reflector(id="A", x=blind + 12.0, y=3.0)
    return LocalizerSetup(reflectors=ReflectorMap((alone,)), scanners=(Scanner(),), parameters=parameters)


@functools.cache
def drive(blind: float, odometry: OdometryParameters, seed: int) -> tuple[RecordLog, Belief, np.ndarray]:
    """Straight on: what is measured, where the filter begins, and the true poses of the scans."""
    rng = np.random.default_rng(seed)
    steps = round((blind + IN_SIGHT) / STEP)
    # Half of an error before the motion and half after it, as the filter's noise is derived.
    errors = (
        rng.normal(size=(steps, 3))
        * np.sqrt(STEP)
        * [
            odometry.forward_per_sqrt_m,
            odometry.lateral_per_sqrt_m,
            odometry.heading_per_sqrt_m,
        ]
    )
    half = np.array([0.5 * STEP, 0.0, 0.0])
    moves = se2.compose(se2.compose(half, errors), half)
    moves[:, 1] += rng.normal(size=steps) * math.sqrt(STEP / 12.0) * odometry.heading_per_sqrt_m * STEP
    stamps = PERIOD_NS * np.arange(steps + 1, dtype=np.int64)
    seen = np.arange(round(blind / STEP), steps + 1)
    truth = np.column_stack((STEP * seen, np.zeros((len(seen), 2))))
    to_x, to_y = blind + 12.0 - truth[:, 0], 3.0
    noise = rng.normal(size=(len(seen), 2)) * [0.02, 0.004]
    log = RecordLog(
        odometry_stamps_ns=stamps,
        displacements=np.vstack((np.zeros(3), moves)),
        detection_stamps_ns=stamps[seen],
        detection_offsets=np.arange(len(seen) + 1, dtype=np.int64),
        range_bearing=np.column_stack((np.hypot(to_x, to_y), np.arctan2(to_y, to_x))) + noise,
    )
    start = Belief(0, rng.normal(size=3) * START, np.diag(np.square(START)))
    return log, start, truth


def nees(mean: np.ndarray, covariance: np.ndarray, truth: np.ndarray) -> float:
    """Per degree of freedom, of the motion about the mean that leads to the truth."""
    turn = math.remainder(float(truth[2] - mean[2]), 2.0 * math.pi)
    # The twist of a pose seen in axes of the map, by the definition of the exponential.
    error = se2.log(np.array([*(truth[:2] - mean[:2]), turn]))
    return float(error @ np.linalg.solve(covariance, error)) / 3.0


def judged(kind: str, blind: float, odometry: OdometryParameters, drives: range) -> Figures:
    setup = setup_of(kind, blind, odometry)
    squares, first, last = [], [], []
    for seed in drives:
        log, start, truth = drive(blind, odometry, seed)
        columns = whole_run.run(log, setup, start)
        squares.append(float(np.sum((columns.means[-1] - truth[-1])[:2] ** 2)))
        first.append(nees(columns.means[0], columns.covariances[0], truth[0]))
        last.append(nees(columns.means[-1], columns.covariances[-1], truth[-1]))
    spread = float(np.std(last) / math.sqrt(len(last)))
    return Figures(math.sqrt(float(np.mean(squares))), float(np.mean(first)), float(np.mean(last)), spread)


@pytest.fixture(scope="module")
def table(seeds: Seeds) -> dict[tuple[str, float], Figures]:
    drives = seeds(FEW_DRIVES, DRIVES)
    return {(kind, blind): judged(kind, blind, GOOD, drives) for kind in FILTER_KINDS for blind in BLIND_WAYS}


@pytest.mark.with_all_seeds
def test_the_right_invariant_filter_is_consistent_after_one_reflector_whatever_the_way(
    table: dict[tuple[str, float], Figures], seeds: Seeds
) -> None:
    for blind in BLIND_WAYS:
        figures = table["invariant", blind]
        # A mean of a few drives scatters: two standard errors of it.
        margin = 0.0 if seeds.all else 2.0 * max(figures.spread, math.sqrt(2.0 / 3.0 / FEW_DRIVES))
        # Over 120 m the error along the way is that of an arc, skewed: no covariance holds it.
        most = 1.2 if blind < 100.0 else 1.7
        assert 0.8 - margin < figures.first < most + margin, (blind, figures)
        assert 0.8 - margin < figures.last < most + margin, (blind, figures)


@pytest.mark.with_all_seeds
def test_others_are_overconfident_after_sixty_metres_and_the_extended_one_most(
    table: dict[tuple[str, float], Figures],
) -> None:
    ekf, ukf, ckf = (table[kind, 60.0] for kind in ("ekf", "ukf", "ckf"))
    assert ekf.first > 3.0
    assert ekf.last > 2.0
    assert ekf.last > max(ukf.last, ckf.last)
    for blind in (60.0, 120.0):
        assert table["invariant", blind].rms < 0.8 * table["ekf", blind].rms


@pytest.mark.with_all_seeds
def test_with_bad_odometry_the_invariant_filter_still_is_the_best_by_far(seeds: Seeds) -> None:
    drives = seeds(FEW_DRIVES, DRIVES)
    ekf, invariant = (judged(kind, 60.0, BAD, drives) for kind in ("ekf", "invariant"))
    assert invariant.rms < 0.5 * ekf.rms
    assert invariant.last < 0.2 * ekf.last


def print_table(drives: int = DRIVES) -> None:
    """The table of the README: `python -c 'from tests.acceptance.test_filters import *; print_table()'`."""
    for name, odometry in (("good", GOOD), ("bad", BAD)):
        for blind in BLIND_WAYS:
            for kind in FILTER_KINDS:
                f = judged(kind, blind, odometry, range(drives))
                print(f"{name} {blind:5.0f} m {kind:9s} {1e3 * f.rms:6.0f} mm, ANEES {f.first:8.2f} {f.last:8.2f}")  # noqa: T201
