"""Vehicles that nobody has located, and such that are lost: found where they are, or not at all."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from commission.geometry import se2
from commission.localization.estimate import Mode, Status
from commission.localization.hypotheses import hypotheses_of
from commission.localization.localizer import Localizer
from commission.localization.run_columns import RunColumns
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, state_unlocated
from commission.localization.whole_run import run, state_before
from commission.site.parameters import OdometryParameters, Parameters, SupervisorParameters
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Record
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.drives import Drive, Plan, detections, random_drive, random_map

ALL_ROUND = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=15.0)


def setup_of(seed: int, count: int = 25, **supervisor: bool) -> LocalizerSetup:
    parameters = Parameters(supervisor=SupervisorParameters(**supervisor))
    return LocalizerSetup(
        reflectors=random_map(np.random.default_rng(seed), count), scanners=(ALL_ROUND,), parameters=parameters
    )


def unlocated(setup: LocalizerSetup) -> FilterState:
    return state_unlocated(0, search_map(setup).anywhere)


def errors(columns: RunColumns, drive: Drive) -> np.ndarray:
    return np.hypot(*(columns.means[:, :2] - drive.truth[:, :2]).T)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5, 7, 8])
def test_a_vehicle_that_nobody_has_located_is_found_among_false_detections(seed: int) -> None:
    setup = setup_of(seed)
    # Three of ten detections are false: some six reflectors in reach.
    drive = random_drive(setup, np.random.default_rng(seed), Plan(scans=100, reach=8.0, clutter=4.0))
    columns = run(drive.log, setup, unlocated(setup))
    located = int(np.flatnonzero(columns.modes != Mode.INITIALIZING)[0])
    assert located * 0.04 < 1.5
    assert (columns.modes[:located] == Mode.INITIALIZING).all()
    assert (errors(columns, drive)[located:] < 0.15).all()
    assert columns.modes[-1] == Mode.OPERATIONAL
    # Before it is found no detection belongs to any reflector.
    before = slice(0, int(columns.offsets[located]))
    assert (columns.status[before] == Status.OUTLIER_ASSOCIATION).all()
    assert (columns.reflector[before] == -1).all()
    assert np.isnan(columns.d2[before]).all()


def lattice(side: float) -> ReflectorMap:
    places = [(side * i, side * j) for i in range(12) for j in range(12)]
    return ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(places)))


def test_a_place_that_looks_like_others_is_never_confirmed_and_all_hypotheses_are_kept() -> None:
    setup = LocalizerSetup(
        reflectors=lattice(2.0),
        scanners=(dataclasses.replace(ALL_ROUND, reflector_range=4.5),),
        parameters=Parameters(),
    )
    # Ten seconds: the way as a whole does not tell it either.
    drive = random_drive(setup, np.random.default_rng(5), Plan(scans=250, reach=4.5, clutter=0.0))
    columns = run(drive.log, setup, unlocated(setup))
    assert (columns.modes == Mode.INITIALIZING).all()
    assert columns.final.search is not None
    assert len(columns.final.search.hypotheses) > 5
    # What it says meanwhile is as wide as all of them.
    assert 2.0 * np.sqrt(columns.covariances[-1, 0, 0]) > 2.0


def test_what_belongs_to_another_map_is_not_found() -> None:
    setup = setup_of(1)
    drive = random_drive(setup_of(2), np.random.default_rng(3), Plan(scans=250, reach=8.0, clutter=1.0))
    columns = run(drive.log, setup, unlocated(setup))
    assert (columns.modes == Mode.INITIALIZING).all()


def kidnapped(drive: Drive, at: int, pose: np.ndarray, setup: LocalizerSetup) -> tuple[list[Record], np.ndarray]:
    """The drive with all that is seen from a scan on seen from elsewhere: the vehicle is carried there unnoticed."""
    move = se2.compose(pose, se2.inverse(drive.truth[at]))
    truth = drive.truth.copy()
    truth[at:] = se2.compose(move, truth[at:])
    rng, records, scan = np.random.default_rng(0), [], 0
    for record in drive.records:
        if isinstance(record, Detections):
            seen = detections(truth[scan], setup, rng, Plan())
            records.append(Detections(record.stamp_ns, seen))
            scan += 1
        else:
            records.append(record)
    return records, truth


@pytest.mark.parametrize("seed", [0, 2, 3, 4, 5])
def test_a_kidnapped_vehicle_is_lost_soon_and_operational_only_where_it_is(seed: int) -> None:
    setup = setup_of(seed)
    drive = random_drive(setup, np.random.default_rng(seed), Plan(scans=200))
    records, truth = kidnapped(drive, 50, np.array([12.0, 13.0, 2.0]), setup)
    columns = run(RecordLog.collect(records), setup, drive.initial)
    wrong = np.hypot(*(columns.means[:, :2] - truth[:, :2]).T) > 0.5
    dangerous = np.flatnonzero(wrong & (columns.modes == Mode.OPERATIONAL))
    # Ten scans in a row that reject nearly all they see tell that it was carried away.
    assert len(dangerous) <= 15
    assert (dangerous >= 50).all()
    assert (columns.modes == Mode.LOST).any()
    last = int(np.flatnonzero(columns.modes == Mode.LOST)[-1])
    assert (columns.modes[last + 1 :] != Mode.INITIALIZING).all()
    assert not wrong[last + 1 :].any()
    # Two seconds after it was carried away.
    assert columns.modes[50 + 50] == Mode.OPERATIONAL


def test_a_lost_vehicle_that_may_not_search_is_believed_again_when_its_detections_fit() -> None:
    setup = setup_of(3, find_again=False)
    drive = random_drive(setup, np.random.default_rng(3), Plan(scans=120, slip=0.15, reach=8.0))
    columns = run(drive.log, setup, drive.initial)
    assert columns.final.search is None
    assert not any(checkpoint.state.search for checkpoint in columns.checkpoints)


@pytest.mark.parametrize(
    ("carried", "sweep", "forward_scale", "beams"),
    [
        (False, 0.0, 0.0, 0),
        (True, 0.0, 0.0, 0),
        (False, 0.03, 0.0, 0),
        (True, 0.03, 0.0, 0),
        (False, 0.03, 0.01, 0),
        (True, 0.03, 0.01, 0),
        (False, 0.0, 0.0, 1440),
    ],
)
def test_live_and_whole_run_agree_to_the_last_bit_while_the_vehicle_is_searched(
    carried: bool, sweep: float, forward_scale: float, beams: int
) -> None:
    setup = setup_of(4)
    scanner = dataclasses.replace(ALL_ROUND, sweep_duration=sweep)
    parameters = dataclasses.replace(setup.parameters, odometry=OdometryParameters(forward_scale=forward_scale))
    setup = LocalizerSetup(reflectors=setup.reflectors, scanners=(scanner,), parameters=parameters)
    drive = random_drive(
        setup, np.random.default_rng(4), Plan(scans=130, reach=8.0, scan_offset_ns=7_000_000, beams=beams)
    )
    records: list[Record] = list(drive.records)
    start: FilterState | None = unlocated(setup)
    if carried:
        records, _ = kidnapped(drive, 40, np.array([12.0, 13.0, 2.0]), setup)
        start = None
    log = RecordLog.collect(records)
    whole = run(log, setup, start or drive.initial)
    localizer = Localizer(setup, start or drive.initial)
    states, estimates = [localizer.state], []
    for record in log.records():
        localizer.push(record)
        while (estimate := localizer.pull()) is not None:
            states.append(localizer.state)
            estimates.append(estimate)
    for estimate in localizer.flush():
        states.append(localizer.state)
        estimates.append(estimate)
    assert localizer.state == whole.final
    assert any(state.search for state in states)
    assert any(np.isfinite(state.search.ends).any() for state in states if state.search) == (beams > 0)
    assert states[-1].search is None
    for cycle, live in enumerate(estimates):
        there = whole.estimate(cycle)
        assert (live.mode, live.posterior.mean.tobytes()) == (there.mode, there.posterior.mean.tobytes())
        assert live.posterior.covariance.tobytes() == there.posterior.covariance.tobytes()
        assert live.prior.mean.tobytes() == there.prior.mean.tobytes()
        assert live.status.tolist() == there.status.tolist()
        assert live.detections.tobytes() == there.detections.tobytes()
        if not any(state.search for state in states[cycle : cycle + 2]):
            assert live.output.mean.tobytes() == there.output.mean.tobytes()
    # A run resumes in the middle of a search.
    searching = [cycle for cycle, state in enumerate(states) if state.search]
    for cycle in searching[:: max(len(searching) // 3, 1)]:
        assert state_before(whole, log, cycle) == states[cycle]


def test_odometry_without_a_search_is_no_business_of_the_search() -> None:
    from commission.localization.relocalization import searching_odometry

    setup = setup_of(0)
    state = unlocated(setup)._replace(search=None)
    with pytest.raises(ValueError, match="expected one of a vehicle that is lost"):
        searching_odometry(state, 0, (0.0, 0.0, 0.0), setup.filter.odometry)


def test_a_vehicle_that_sees_nothing_keeps_looking() -> None:
    setup = setup_of(0)
    records: list[Record] = []
    for cycle in range(40):
        records += [Odometry(cycle * 40_000_000, np.zeros(3)), Detections(cycle * 40_000_000, np.empty((0, 2)))]
    columns = run(RecordLog.collect(records), setup, unlocated(setup))
    assert (columns.modes == Mode.INITIALIZING).all()
    np.testing.assert_allclose(columns.covariances[-1], np.diag(np.diag(columns.covariances[0])))


def two_halls_alike(seed: int) -> ReflectorMap:
    """A hall, and 40 m beside it one whose southern reflectors stand alike; in the north of that one there is none."""
    rng = np.random.default_rng((seed, 3))
    south = rng.uniform((3.0, 0.0), (17.0, 10.5), (9, 2))
    north = rng.uniform((3.0, 13.5), (17.0, 20.0), (7, 2))
    places = [*south, *north, *(south + np.array((40.0, 0.0)))]
    return ReflectorMap(tuple(Reflector(id=f"R{i}", x=float(x), y=float(y)) for i, (x, y) in enumerate(places)))


@pytest.mark.parametrize("seed", range(6))
def test_a_place_that_repeats_is_named_as_ambiguous_and_resolved_by_driving_never_wrongly(seed: int) -> None:
    setup = LocalizerSetup(
        reflectors=two_halls_alike(seed),
        scanners=(dataclasses.replace(ALL_ROUND, reflector_range=6.5),),
        parameters=Parameters(),
    )
    plan = Plan(scans=200, reach=6.5, clutter=0.3, speed=1.6)
    drive = random_drive(setup, np.random.default_rng(seed), plan)
    columns = run(drive.log, setup, unlocated(setup))
    located = int(np.flatnonzero(columns.modes != Mode.INITIALIZING)[0])
    # In the south, both halls are listed, 40 m apart, each with half of the probability, and none is believed.
    moment = columns.search(20)
    assert moment is not None
    one, other = hypotheses_of(moment)[:2]
    assert one.pose[0] - other.pose[0] == pytest.approx(np.sign(one.pose[0] - other.pose[0]) * 40.0, abs=0.1)
    assert min(one.probability, other.probability) > 0.3
    assert one.agreed == other.agreed == 0
    assert located > 50
    # Reflectors of the north, which only one of them has, tell them apart.
    assert drive.truth[located, 1] > 7.0
    assert (errors(columns, drive)[located:] < 0.15).all()
    assert columns.modes[-1] == Mode.OPERATIONAL
