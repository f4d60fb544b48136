"""Protection levels: what they are by hand, and that errors are beyond them no more often than the stated risk."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_unlocated
from commission.localization.whole_run import run
from commission.site.parameters import (
    AssociationParameters,
    FilterParameters,
    IntegrityParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.record_log import RecordLog
from commission.site.records import Detections
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.integrity import Protection, protection
from tests.conftest import Seeds
from tests.localization.drives import Drive, Plan, random_drive, random_map

ALL_ROUND = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=15.0)
PLAIN = Parameters(
    filter=FilterParameters(consider=False),
    supervisor=SupervisorParameters(rejection_enabled=False),
    association=AssociationParameters(gate_probability=0.9999),
)


def setup_of(reflectors: ReflectorMap) -> LocalizerSetup:
    return LocalizerSetup(reflectors=reflectors, scanners=(ALL_ROUND,), parameters=PLAIN)


def without(drive: Drive, columns: RunColumns, reflector: int) -> RecordLog:
    """The records of a drive without the detections of one reflector."""
    records, cycle = [], 0
    for record in drive.records:
        if isinstance(record, Detections):
            rows = slice(int(columns.offsets[cycle]), int(columns.offsets[cycle + 1]))
            kept = columns.reflector[rows] != reflector
            records.append(Detections(record.stamp_ns, record.range_bearing[kept], record.scanner))
            cycle += 1
        else:
            records.append(record)
    return RecordLog.collect(records)


def test_a_level_is_the_separation_from_runs_without_each_reflector_and_their_sigmas() -> None:
    setup = setup_of(random_map(np.random.default_rng(3), 5))
    drive = random_drive(setup, np.random.default_rng(4), Plan(scans=40, clutter=0.0, reach=30.0))
    columns = run(drive.log, setup, drive.initial)
    given = IntegrityParameters(risk=1e-4, fault_probability=1e-2)
    found = protection(columns, given)
    separate = [run(without(drive, columns, each), setup, drive.initial) for each in range(5)]
    for cycle in (0, 7, 39):
        own = columns.covariances[cycle]
        largest = math.sqrt(np.linalg.eigvalsh(own[:2, :2])[-1])
        position = math.sqrt(-2.0 * math.log(0.5e-4)) * largest
        heading = math.sqrt(-2.0 * math.log(0.5e-4)) * math.sqrt(own[2, 2])
        factor = math.sqrt(-2.0 * math.log(0.5e-4 / (5 * 1e-2)))
        for other in separate:
            apart = np.hypot(*(columns.means[cycle, :2] - other.means[cycle, :2]))
            sigma = math.sqrt(np.linalg.eigvalsh(other.covariances[cycle, :2, :2])[-1])
            position = max(position, apart + factor * max(sigma, largest))
            turned = abs(columns.means[cycle, 2] - other.means[cycle, 2])
            heading = max(heading, turned + factor * math.sqrt(max(other.covariances[cycle, 2, 2], own[2, 2])))
        # Both filters are linearized a little apart.
        assert found.position[cycle] == pytest.approx(position, rel=0.01)
        assert found.heading[cycle] == pytest.approx(heading, rel=0.01)


def judged(
    seed: int, fault: float, given: IntegrityParameters
) -> tuple[np.ndarray, np.ndarray, Protection, np.ndarray]:
    """A drive among eight reflectors, of which one stands elsewhere by `fault` [m] than the map says."""
    rng = np.random.default_rng((seed, 5))
    reflectors = random_map(rng, 8)
    setup = setup_of(reflectors)
    drive = random_drive(setup, rng, Plan(scans=150, clutter=0.3))
    turn, which = rng.uniform(0.0, 2.0 * math.pi), int(rng.integers(8))
    wrong = list(reflectors.reflectors)
    off = fault * np.array([math.cos(turn), math.sin(turn)])
    wrong[which] = replace(wrong[which], x=wrong[which].x + off[0], y=wrong[which].y + off[1])
    columns = run(drive.log, setup_of(ReflectorMap(tuple(wrong))), drive.initial)
    error = np.hypot(*(columns.means[:, :2] - drive.truth[:, :2]).T)
    turned = np.abs(np.remainder(columns.means[:, 2] - drive.truth[:, 2] + math.pi, 2.0 * math.pi) - math.pi)
    levels = protection(columns, given)
    operational = columns.modes == Mode.OPERATIONAL
    two_sigma = 2.0 * np.sqrt(np.linalg.eigvalsh(columns.covariances[:, :2, :2])[:, -1])
    return error[operational], turned[operational], levels, two_sigma[operational]


def test_errors_are_beyond_the_level_no_more_often_than_the_risk_although_a_reflector_misleads(seeds: Seeds) -> None:
    # Every drive has a fault, which the stated probability makes one of a thousand for each of eight reflectors: what
    # is left to each fault is 0.5 * 1e-4 / (8 * 1e-3) of the cycles.
    given = IntegrityParameters(risk=1e-4, fault_probability=1e-3)
    allowed = 0.5 * given.risk / (8 * given.fault_probability)
    cycles = beyond = turned = misled = available = 0
    for seed in seeds(12, 2_000):
        fault = (0.02, 0.05, 0.1, 0.2, 0.4)[seed % 5]
        error, heading, levels, two_sigma = judged(seed, fault, given)
        here = levels.position[np.isfinite(levels.position)]
        assert len(here) == len(error)
        cycles += len(error)
        beyond += int(np.count_nonzero(error > levels.position))
        turned += int(np.count_nonzero(heading > levels.heading))
        misled += int(np.count_nonzero(error > two_sigma))
        available += int(np.count_nonzero(levels.position < 0.1))
    # Errors of neighboring cycles are alike: few drives may hold a bunch of them.
    assert beyond <= allowed * cycles
    assert turned <= allowed * cycles
    # The faults are no small ones: the filter's own claim is broken as often as one time in ten.
    assert misled > 0.1 * cycles
    assert available > 0.5 * cycles


def test_nothing_is_promised_of_a_vehicle_that_is_not_located() -> None:
    setup = setup_of(random_map(np.random.default_rng(3), 2))
    drive = random_drive(setup, np.random.default_rng(4), Plan(scans=10, clutter=0.0))
    columns = run(drive.log, setup, state_unlocated(0, search_map(setup).anywhere))
    assert (columns.modes == Mode.INITIALIZING).all()
    assert np.isinf(protection(columns).position).all()
    assert not protection(columns).within(np.full((10, 2), 1e9)).any()
    assert (columns.status != Status.INLIER).all()
