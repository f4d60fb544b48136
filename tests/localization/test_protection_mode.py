"""Supervisor by protection level: what it holds against its limits, and that live is the whole run to the last bit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.estimate import Belief, Mode
from commission.localization.growing_run import GrowingRun
from commission.localization.observation import observation_model
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.protection import EVERY, NEWEST, ProtectionModel, new_bank, protect_cycle
from commission.localization.run_columns import RunColumns, RunSegment
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_unlocated
from commission.localization.whole_run import run, run_segments, state_before
from commission.site.parameters import (
    AssociationParameters,
    FilterParameters,
    IntegrityParameters,
    ObservationParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.integrity import protection
from tests.conftest import Seeds
from tests.localization.drives import Drive, Plan, random_drive, random_map
from tests.localization.plain_protection import levels
from tests.localization.test_whole_run import assert_same_estimate

ALL_ROUND = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=15.0)
GIVEN = IntegrityParameters(risk=1e-4, fault_probability=1e-3)


def by_level(limit: float = 0.1, *, consider: bool = False, **more: object) -> Parameters:
    return Parameters(
        supervisor=SupervisorParameters(held="protection_level", position_limit=limit, **more),
        filter=FilterParameters(consider=consider),
        association=AssociationParameters(gate_probability=0.9999),
        integrity=GIVEN,
    )


def setup_of(reflectors: ReflectorMap, parameters: Parameters) -> LocalizerSetup:
    return LocalizerSetup(reflectors=reflectors, scanners=(ALL_ROUND,), parameters=parameters)


def driven(parameters: Parameters, seed: int = 3, plan: Plan | None = None) -> tuple[LocalizerSetup, Drive]:
    rng = np.random.default_rng(seed)
    setup = setup_of(random_map(rng, 8), parameters)
    return setup, random_drive(setup, rng, plan or Plan(scans=150))


def modes_by(held: np.ndarray, parameters: SupervisorParameters) -> list[Mode]:
    """Algorithm 4 over what is held against its limits."""
    limits = np.array([parameters.position_limit, parameters.heading_limit])
    mode, found = Mode.OPERATIONAL, []
    for row in held:
        bound = limits if mode is Mode.OPERATIONAL else limits / parameters.recovery_ratio
        mode = Mode.OPERATIONAL if (row <= bound).all() else Mode.FAIL
        found.append(mode)
    return found


@pytest.mark.parametrize("consider", [False, True], ids=["white noise alone", "constants considered"])
def test_the_level_is_that_of_textbook_filters_and_the_mode_follows_it(consider: bool) -> None:
    setup, drive = driven(
        by_level(0.0309 if consider else 0.027, consider=consider, rejection_enabled=False, recovery_ratio=1.01)
    )
    columns = run(drive.log, setup, drive.initial)
    plain = levels(columns, GIVEN.risk, GIVEN.fault_probability)
    # Jacobians of the plain filters are differences, over 1e-6 of a metre.
    np.testing.assert_allclose(columns.levels, plain, rtol=1e-5)
    expected = modes_by(plain, setup.parameters.supervisor)
    assert columns.modes.tolist() == expected
    assert {Mode.OPERATIONAL, Mode.FAIL} == set(expected)
    # The study of a finished run comes to the same, from its columns alone.
    study = protection(columns)
    np.testing.assert_array_equal(columns.levels, np.column_stack((study.position, study.heading)))


def test_four_reflectors_around_a_vehicle_at_rest_give_the_level_of_the_closed_form() -> None:
    # Ranges alone tell: two of them east and west, so that x is the mean of both, its variance sigma^2 / 2 after one
    # scan and sigma^2 / 2k after k. Without the eastern one, which stands b farther east than the map says, it is the
    # western one alone: sigma^2 / k, and b / 2 apart.
    sigma, b, far, scans = 0.01, 0.03, 8.0, 25
    places = {"E": (far, 0.0), "N": (0.0, far), "W": (-far, 0.0), "S": (0.0, -far)}
    reflectors = ReflectorMap(tuple(Reflector(id=name, x=x, y=y) for name, (x, y) in places.items()))
    noise = ObservationParameters(range_sigma=sigma, bearing_sigma=0.3)
    open_gate = AssociationParameters(gate_probability=0.999999)
    parameters = replace(by_level(rejection_enabled=False), observation=noise, association=open_gate)
    seen = np.array([[far + b, 0.0], [far, 0.5 * math.pi], [far, math.pi], [far, -0.5 * math.pi]])
    log = RecordLog.collect([Odometry(0, np.zeros(3)), *(Detections(k, seen) for k in range(1, scans + 1))])
    start = Belief(0, np.zeros(3), np.diag([1.0, 1.0, 1e-12]))
    columns = run(log, setup_of(reflectors, parameters), start)
    k = np.arange(1, scans + 1)
    alone = math.sqrt(-2.0 * math.log(0.5 * GIVEN.risk / (4.0 * GIVEN.fault_probability)))
    expected = 0.5 * b + alone * sigma / np.sqrt(k)
    # What start and bearings tell, to 1 m and 2.4 m, is nothing beside a range.
    np.testing.assert_allclose(columns.levels[:, 0], expected, rtol=2e-3)


@pytest.mark.parametrize("others", [True, False], ids=["by contours or tags", "where goods may be remembered"])
def test_what_corrects_where_no_reflector_does_corrects_each_filter_by_its_own_innovation(others: bool) -> None:
    rng = np.random.default_rng(7)

    def drawn() -> tuple[np.ndarray, np.ndarray]:
        root = 0.03 * rng.standard_normal((3, 3))
        return 0.05 * rng.standard_normal(3), root @ root.T + 1e-5 * np.eye(3)

    H, R, z = rng.standard_normal((2, 3)), np.diag([2e-4, 5e-4]), 0.02 * rng.standard_normal(2)

    def told(mean: np.ndarray, P: np.ndarray) -> np.ndarray:
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        return row_of(mean + K @ (z - H @ mean), (np.eye(3) - K @ H) @ P)

    def row_of(mean: np.ndarray, P: np.ndarray) -> np.ndarray:
        return np.concatenate((mean, P[np.triu_indices(3)]))

    own, every, one = drawn(), drawn(), drawn()
    bank = new_bank()
    bank.begun[0] = True
    for row, belief in ((NEWEST, own), (EVERY, every), (0, one)):
        bank.beliefs[row] = row_of(*belief)
    bank.owner[0] = 5
    nothing = np.empty(0, dtype=np.int64)
    model = ProtectionModel(1e-5, 1e-3, np.empty((0, 3)), nothing, others)
    mounted = observation_model(ALL_ROUND, ObservationParameters())
    before, after = PoseGaussian(*row_of(*own)), PoseGaussian(*told(*own))
    protect_cycle(bank, before, after, 0, 0, np.empty((0, 2)), nothing.astype(np.int8), nothing, mounted, model)
    for row, belief in ((EVERY, every), (0, one)):
        np.testing.assert_allclose(bank.beliefs[row], told(*belief) if others else row_of(*belief), atol=1e-10)


def split_at(half: int) -> list[RunSegment]:
    """2-sigma, then levels with another map, then 2-sigma, then levels again."""
    setup, _ = driven(by_level())
    fewer = ReflectorMap(setup.reflectors.reflectors[2:][::-1])
    sigma = replace(setup, parameters=replace(setup.parameters, supervisor=SupervisorParameters()))
    return [
        RunSegment(0, setup),
        RunSegment(half, replace(setup, reflectors=fewer)),
        RunSegment(half + 20, sigma),
        RunSegment(half + 40, setup),
    ]


@pytest.mark.parametrize("lost", [False, True], ids=["known", "sought at first"])
@pytest.mark.parametrize("consider", [False, True], ids=["white noise alone", "constants considered"])
def test_live_is_the_whole_run_to_the_last_bit(lost: bool, consider: bool) -> None:
    setup, drive = driven(by_level(consider=consider), plan=Plan(scans=120, slip=0.3, scan_offset_ns=7_000_000))
    start = state_unlocated(0, search_map(setup).anywhere) if lost else drive.initial
    whole = run(drive.log, setup, start)
    growing = GrowingRun(setup, start)
    estimates = [each for record in drive.log.records() for each in growing.feed(record)]
    estimates += growing.flush()
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, whole.estimate(cycle))
    assert growing.state == whole.final
    assert growing.columns().levels.tobytes() == whole.levels.tobytes()
    assert state_before(whole, drive.log, 50).protection == run_to(drive, setup, start, 50)
    sought = np.isin(whole.modes, (Mode.LOST, Mode.INITIALIZING))
    assert np.isinf(whole.levels[sought]).all()
    assert sought.any()
    study = protection(whole)
    np.testing.assert_array_equal(whole.levels, np.column_stack((study.position, study.heading)))


def run_to(drive: Drive, setup: LocalizerSetup, start: object, cycles: int) -> object:
    """Filters of a localizer that is fed up to a cycle."""
    growing = GrowingRun(setup, start)
    for record in drive.log.records():
        growing.push(record)
        while len(growing) < cycles and growing.pull() is not None:
            pass
        if len(growing) == cycles:
            break
    return growing.state.protection


def test_levels_outlive_a_change_of_the_map_and_are_dropped_where_nobody_asks() -> None:
    _, drive = driven(by_level())
    segments = split_at(60)
    whole = run_segments(drive.log, segments, drive.initial)
    assert np.isnan(whole.levels[80:100]).all()
    assert np.isfinite(np.delete(whole.levels, range(80, 100), axis=0)).all()
    # Filters go on without the two reflectors that are gone: nothing jumps where the map changes.
    assert (np.abs(np.diff(whole.levels[55:65, 0])) < 0.2 * whole.levels[55:64, 0]).all()
    resumed = run_segments(drive.log, segments, drive.initial, earlier=run(drive.log, segments[0].setup, drive.initial))
    assert resumed.levels.tobytes() == whole.levels.tobytes()
    assert resumed.final == whole.final


def misled(seed: int, parameters: Parameters, kind: str) -> tuple[RunColumns, Drive]:
    """A drive among five reflectors with one fault: a moved one, a false one in place of a true one, biased ranges."""
    rng = np.random.default_rng((seed, 11))
    reflectors = random_map(rng, 5)
    drive = random_drive(setup_of(reflectors, parameters), rng, Plan(scans=100, clutter=0.3))
    fault, which, turn = rng.uniform(0.02, 0.2), int(rng.integers(5)), rng.uniform(0.0, 2.0 * math.pi)
    every = list(reflectors.reflectors)
    at, off = np.array([every[which].x, every[which].y]), fault * np.array([math.cos(turn), math.sin(turn)])
    if kind == "moved":
        every[which] = replace(every[which], x=at[0] + off[0], y=at[1] + off[1])
    records = [otherwise(record, drive, at, off, kind, rng) for record in drive.records]
    drive = replace(drive, records=records)
    return run(drive.log, setup_of(ReflectorMap(tuple(every)), parameters), drive.initial), drive


def otherwise(
    record: object, drive: Drive, at: np.ndarray, off: np.ndarray, kind: str, rng: np.random.Generator
) -> object:
    """A record of a drive with the fault in it: as it is, if it is of another kind."""
    if not isinstance(record, Detections) or kind == "moved" or not len(record.range_bearing):
        return record
    k = round((record.stamp_ns) / 40_000_000)
    x, y, theta = drive.truth[min(k, len(drive.truth) - 1)]
    seen = record.range_bearing
    points = np.column_stack((x + seen[:, 0] * np.cos(theta + seen[:, 1]), y + seen[:, 0] * np.sin(theta + seen[:, 1])))
    near = np.hypot(*(points - at).T) < 0.3
    if kind == "biased":
        return Detections(record.stamp_ns, seen + np.outer(near, [np.hypot(*off), 0.0]), record.scanner)
    d = at + off - [x, y] + rng.normal(0.0, 0.01, 2)
    false = np.array([[np.hypot(*d), math.remainder(math.atan2(d[1], d[0]) - theta, 2.0 * math.pi)]])
    return Detections(record.stamp_ns, np.concatenate((seen[~near], false)), record.scanner)


@pytest.mark.parametrize("kind", ["moved", "false", "biased"])
def test_errors_are_beyond_the_level_no_more_often_than_the_risk_and_nobody_drives_beyond_the_limit(
    kind: str, seeds: Seeds
) -> None:
    # Each drive has one fault among five reflectors, and the probability says so: the share is that of the stated risk.
    given = IntegrityParameters(risk=1e-3, fault_probability=0.2)
    parameters = replace(by_level(0.08), integrity=given)
    cycles = beyond = turned = misled_by_sigma = operational = 0
    for seed in seeds(8, 400):
        columns, drive = misled(seed, parameters, kind)
        error = np.hypot(*(columns.means - drive.truth)[:, :2].T)
        heading = np.abs([math.remainder(turn, 2.0 * math.pi) for turn in (columns.means - drive.truth)[:, 2]])
        position, heading_level = columns.levels.T
        drives = columns.modes == Mode.OPERATIONAL
        assert not (drives & ((position > 0.08) | (heading_level > parameters.supervisor.heading_limit))).any()
        cycles += int(np.count_nonzero(np.isfinite(position)))
        beyond += int(np.count_nonzero(error > position))
        turned += int(np.count_nonzero(heading > heading_level))
        two_sigma = 2.0 * np.sqrt(np.linalg.eigvalsh(columns.covariances[:, :2, :2])[:, -1])
        misled_by_sigma += int(np.count_nonzero(error > two_sigma))
        operational += int(np.count_nonzero(drives))
    assert beyond <= given.risk * cycles
    assert turned <= given.risk * cycles
    # The faults are no small ones, and it is no level that stops every vehicle.
    assert misled_by_sigma > 0.2 * cycles
    assert operational > 0.5 * cycles
