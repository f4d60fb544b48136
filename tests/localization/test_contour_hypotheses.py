"""Vehicles with contours alone: found where they are after some way, or not at all."""

# pyright: basic

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.raycast import RayCaster
from commission.localization.contour_hypotheses import FEWEST_POINTS
from commission.localization.estimate import Mode
from commission.localization.hypotheses import hypotheses_of
from commission.localization.localizer import Localizer
from commission.localization.relocalization import CONFIRMED_BY_CONTOURS
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, state_unlocated
from commission.localization.whole_run import run, state_before
from commission.site.floor_map import FREE, FloorMap
from commission.site.parameters import ContourParameters, Parameters
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, Record, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from tests.acceptance.office import LASER, Office, drive, ranges_from
from tests.localization.contour_halls import divided_room, room

BY_CONTOURS = Parameters(contour=ContourParameters(enabled=True))


@functools.cache
def hall_drive(seed: int = 1, metres: float = 25.0) -> Office:
    return drive(divided_room(), seed, metres)


def setup_in(floor: FloorMap, parameters: Parameters = BY_CONTOURS, **others) -> LocalizerSetup:
    known = {"reflectors": ReflectorMap(), "scanners": (LASER,), **others}
    return LocalizerSetup(parameters=parameters, floor=floor, **known)


def unlocated(setup: LocalizerSetup) -> FilterState:
    return state_unlocated(0, search_map(setup).anywhere)


def off(columns, poses: np.ndarray) -> np.ndarray:
    return np.hypot(*(columns.means - poses)[:, :2].T)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_vehicle_that_nobody_has_located_is_found_by_the_contours_of_the_hall(seed: int) -> None:
    office = hall_drive(seed)
    setup = setup_in(office.floor)
    columns = run(RecordLog.collect(office.records), setup, unlocated(setup))
    located = int(np.flatnonzero(columns.modes != Mode.INITIALIZING)[0])
    # Not by one view: some metres of way, at half a metre a second.
    assert 3.0 < located / LASER.rate < 15.0
    assert (off(columns, office.poses)[located:] < 0.25).all()
    assert columns.modes[-1] == Mode.OPERATIONAL


def test_a_vehicle_that_is_carried_away_is_lost_and_found_where_it_is() -> None:
    whole = hall_drive(2, 40.0)
    far = int(np.argmax(np.hypot(*(whole.poses[:, :2] - whole.poses[100, :2]).T)[150:300])) + 150
    office = whole.carried(100, far)
    columns, poses = office.localized(), office.poses
    error = off(columns, poses)
    assert np.hypot(*(poses[100] - poses[99])[:2]) > 5.0
    lost = int(np.flatnonzero(columns.modes == Mode.LOST)[0])
    assert 100 <= lost <= 115
    again = int(np.flatnonzero((columns.modes == Mode.OPERATIONAL) & (np.arange(len(error)) > lost))[0])
    assert again - lost < 25.0 * LASER.rate
    assert (error[again:] < 0.3).all()


def test_in_a_hall_that_is_the_same_turned_round_both_places_are_told_and_none_is_believed() -> None:
    cells = room(20.0, 14.0).cells.copy()
    cells[10:-10, 10:-10] = FREE
    bare = FloorMap(cells, 0.05, np.zeros(3))
    inside = drive(bare, 5, 25.0)
    setup = setup_in(bare)
    columns = run(RecordLog.collect(inside.records), setup, unlocated(setup))
    assert (columns.modes == Mode.INITIALIZING).all()
    told = hypotheses_of(columns.search(len(columns) - 1))
    truth = inside.poses[-1]
    middle = np.array(cells.shape[::-1]) * 0.05 / 2.0
    for place in (truth[:2], 2.0 * middle - truth[:2]):
        assert min(np.hypot(*(each.pose[:2] - place)) for each in told[:2]) < 0.2
    assert told[0].by_contours
    assert told[0].fits > 80
    assert told[0].probability < 0.99
    # What it says meanwhile is as wide as both.
    assert 2.0 * np.sqrt(np.linalg.eigvalsh(columns.covariances[-1][:2, :2])[-1]) > 2.0


def test_in_another_hall_nobody_is_found() -> None:
    office = hall_drive()
    setup = setup_in(room(9.0, 16.0))
    columns = run(RecordLog.collect(office.records), setup, unlocated(setup))
    assert not (columns.modes == Mode.OPERATIONAL).any()


def states_of(localizer: Localizer, records: list[Record]) -> list[FilterState]:
    states = [localizer.state]
    for record in records:
        localizer.push(record)
        while localizer.pull() is not None:
            states.append(localizer.state)
    for _ in localizer.flush():
        states.append(localizer.state)
    return states


@pytest.mark.parametrize("reflectors", [0, 4])
def test_live_and_whole_run_agree_to_the_last_bit_while_contours_are_searched(reflectors: int) -> None:
    office = hall_drive()
    # Too far away to be seen: who has reflectors searches by both.
    placed = tuple(Reflector(id=f"R{i}", x=300.0 + i * i, y=300.0 - 3.0 * i) for i in range(reflectors))
    setup = setup_in(office.floor, reflectors=ReflectorMap(placed))
    log = RecordLog.collect(office.records)
    whole = run(log, setup, unlocated(setup))
    states = states_of(Localizer(setup, unlocated(setup)), office.records)
    assert states[-1] == whole.final
    searching = [cycle for cycle, state in enumerate(states) if state.search is not None]
    assert max(state.search.agreed.by_contours for state in states if state.search) >= CONFIRMED_BY_CONTOURS - 2
    assert states[-1].search is None
    for cycle in searching[:: max(len(searching) // 4, 1)]:
        assert state_before(whole, log, cycle) == states[cycle]


BEHIND = dataclasses.replace(LASER, name="behind", mounting=np.array((-0.4, 0.0, np.pi)))


def seen_by_both(poses: np.ndarray, office: Office) -> RecordLog:
    """A drive of a vehicle with two scanners, which take turns."""
    caster = RayCaster(divided_room().occupancy())
    bearings = LASER.angle_min + LASER.angle_increment * np.arange(LASER.beam_count)
    scan = office.records[1]
    assert isinstance(scan, Scan)
    records: list[Record] = []
    for k, pose in enumerate(poses):
        stamp_ns = round(k * 1e9 / LASER.rate)
        records.append(Odometry(stamp_ns, se2.relative(poses[max(k - 1, 0)], pose)))
        number = k // 2 % 2  # an attempt every 0.4 s meets both
        at = se2.compose(pose, (LASER, BEHIND)[number].mounting)
        ranges = ranges_from(caster, at, bearings).astype(np.float32)
        records.append(dataclasses.replace(scan, stamp_ns=stamp_ns + 1, ranges=ranges, scanner=number))
    return RecordLog.collect(records, (LASER.name, BEHIND.name))


def test_two_scanners_that_look_elsewhere_find_the_vehicle_together() -> None:
    office = hall_drive(3)
    setup = setup_in(office.floor, scanners=(LASER, BEHIND))
    columns = run(seen_by_both(office.poses, office), setup, unlocated(setup))
    located = int(np.flatnonzero(columns.modes != Mode.INITIALIZING)[0])
    assert (off(columns, office.poses)[located:] < 0.25).all()
    assert columns.modes[-1] == Mode.OPERATIONAL


def test_two_scanners_of_a_vehicle_that_stands_are_no_new_view_each_time() -> None:
    office = hall_drive(3)
    setup = setup_in(office.floor, scanners=(LASER, BEHIND))
    standing = np.repeat(office.poses[:1], 40, axis=0)
    columns = run(seen_by_both(standing, office), setup, unlocated(setup))
    # Eight seconds are twenty attempts, by the one that was first: one view, and nineteen times half of it.
    search = columns.final.search
    assert search is not None
    assert search.contours.scanner == 0
    assert search.agreed.by_contours < CONFIRMED_BY_CONTOURS
    assert len(search.told) > 0
    assert (search.contours.past == 0.0).all()


def test_a_scan_of_a_few_points_is_no_view() -> None:
    office = hall_drive()
    setup = setup_in(office.floor)
    records: list[Record] = []
    for record in office.records:
        if isinstance(record, Scan):
            few = np.where(np.arange(len(record.ranges)) < FEWEST_POINTS - 1, record.ranges, np.nan)
            records.append(dataclasses.replace(record, ranges=few.astype(np.float32)))
        else:
            records.append(record)
    columns = run(RecordLog.collect(records), setup, unlocated(setup))
    assert (columns.modes == Mode.INITIALIZING).all()
    assert columns.final.search is not None
    assert len(columns.final.search.told) == 0


def test_where_contours_are_off_a_vehicle_without_reflectors_cannot_search() -> None:
    on, without = setup_in(hall_drive().floor), setup_in(hall_drive().floor, Parameters())
    assert on.filter.limits.find_again
    assert not without.filter.limits.find_again
    assert search_map(without).contours is None
