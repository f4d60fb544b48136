"""What contours say for and against a pose, over whole drives at standstill in halls with no reflector in sight."""

# pyright: basic

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.geometry import se2
from commission.localization.contour import ACCEPTED, CONTRADICTED, ROWS, UNMATCHED, USE
from commission.localization.contour_sight import share_through_walls
from commission.localization.contour_tables import contour_tables
from commission.localization.estimate import Belief, Mode
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_at_start
from commission.site.parameters import ContourParameters, Parameters
from commission.site.records import Odometry, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.contour_halls import corridor, grid_pose, points_of, room, scan_from

BEAMS, PERIOD_NS = 720, 100_000_000
FULL_TURN = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.5, range=(0.05, 20.0))
TRUTH = np.array((4.0, 3.6, 0.4))
KNOWN = np.diag(np.square((0.03, 0.03, 0.01)))
FAR_AWAY = ReflectorMap((Reflector(id="A", x=-50.0, y=-50.0),))


def localizer_in(floor, start, *, reflectors=None, to_confirm=False, **supervisor) -> Localizer:
    parameters = Parameters(contour=ContourParameters(enabled=True))
    parameters = dataclasses.replace(parameters, supervisor=dataclasses.replace(parameters.supervisor, **supervisor))
    setup = LocalizerSetup(
        reflectors=reflectors or ReflectorMap(), scanners=(FULL_TURN,), parameters=parameters, floor=floor
    )
    state = state_at_start(Belief(0, np.array(start, dtype=np.float64), KNOWN))
    if to_confirm:
        evidence = state.tracking.evidence._replace(confirmed=0.0)
        state = state._replace(tracking=state.tracking._replace(mode=int(Mode.FAIL), evidence=evidence))
    return Localizer(setup, state)


def stand(localizer, floor, pose, scans, *, first=0, bright=(), crowd=()):
    """Estimates of a vehicle at rest; `bright` and `crowd` are ranges and bearings of things that the map lacks."""
    rng, estimates = np.random.default_rng(first), []
    ranges, bearings = scan_from(floor, pose, beams=BEAMS)
    for k in range(first, first + scans):
        seen, shiny = ranges + 0.01 * rng.standard_normal(BEAMS), np.zeros(BEAMS, dtype=bool)
        for distance, bearing in bright:
            where = np.abs(bearings - bearing) * distance < 0.04
            seen[where], shiny[where] = distance, True
        for distance, bearing in crowd:
            where = np.abs(bearings - bearing) * distance < 0.02
            seen[where] = np.minimum(seen[where], distance)
        seen = np.where(np.isfinite(seen), seen, np.nan).astype(np.float32)
        localizer.feed(Odometry(k * PERIOD_NS, np.zeros(3)))
        estimates += localizer.feed(
            Scan(
                stamp_ns=k * PERIOD_NS,
                ranges=seen,
                angle_min=-math.pi,
                angle_increment=2.0 * math.pi / BEAMS,
                reflector=shiny,
            )
        )
    return estimates


def test_a_corridor_does_not_confirm_the_place_along_it():
    floor = corridor()
    localizer = localizer_in(floor, (25.0, 1.2, 0.0), to_confirm=True, position_limit=0.15)
    estimates = stand(localizer, floor, (30.0, 1.2, 0.0), 40)
    assert all(each.contours[USE] == ACCEPTED and each.contours[ROWS] == 2 for each in estimates)
    assert not any(each.mode == Mode.OPERATIONAL for each in estimates)


def test_a_vehicle_that_was_carried_across_or_turned_in_a_corridor_is_lost_after_ten_scans():
    floor = corridor()
    for off in ((0.0, 0.4, 0.0), (0.0, 0.0, 0.2)):
        localizer = localizer_in(floor, (25.0, 1.2, 0.0))
        assert stand(localizer, floor, (25.0, 1.2, 0.0), 20)[-1].mode == Mode.OPERATIONAL
        moved = stand(localizer, floor, np.add((25.0, 1.2, 0.0), off), 30, first=20)
        assert all(each.contours[ROWS] == 2 for each in moved)
        modes = [each.mode for each in moved]
        assert modes.index(Mode.LOST) in (9, 10)
        assert Mode.OPERATIONAL not in modes[10:]


def test_a_room_confirms_a_pose_after_twenty_scans():
    floor = room()
    estimates = stand(localizer_in(floor, TRUTH, to_confirm=True), floor, TRUTH, 25)
    modes = [each.mode for each in estimates]
    assert modes.index(Mode.OPERATIONAL) == 19


def test_a_vehicle_that_was_carried_away_in_a_room_without_reflectors_is_lost_after_ten_scans_and_found():
    floor = room()
    localizer = localizer_in(floor, TRUTH)
    assert stand(localizer, floor, TRUTH, 20)[-1].mode == Mode.OPERATIONAL
    moved = stand(localizer, floor, np.add(TRUTH, (0.5, 0.3, 0.0)), 40, first=20)
    modes = [each.mode for each in moved]
    assert modes.index(Mode.LOST) in (9, 10)
    # Its belief grows until the gate opens: it is operational again where it is, and nowhere else.
    assert modes[-1] == Mode.OPERATIONAL
    for each in moved[10:]:
        if each.mode == Mode.OPERATIONAL:
            assert np.hypot(*(each.posterior.mean - TRUTH)[:2] - (0.5, 0.3)) < 0.01
    # Carried back, it is found again.
    back = stand(localizer, floor, TRUTH, 40, first=60)[-1]
    assert back.mode == Mode.OPERATIONAL
    assert np.hypot(*(back.posterior.mean - TRUTH)[:2]) < 0.01


def test_a_lost_vehicle_is_not_found_where_too_few_points_lie_on_contours_or_too_many_go_through_them():
    floor = room()
    localizer = localizer_in(floor, TRUTH)
    stand(localizer, floor, TRUTH, 20)
    far = np.array((6.5, 2.5, 0.0))
    modes = [each.mode for each in stand(localizer, floor, far, 120, first=20)]
    # The room has no place within reach of the belief that looks like this one.
    assert Mode.OPERATIONAL not in modes[15:]


def test_beams_go_through_walls_where_a_ray_caster_meets_one_earlier():
    floor, tables, rng = room(), contour_tables(room()), np.random.default_rng(3)
    for _ in range(20):
        true, believed = (
            np.array((rng.uniform(4.0, 8.0), rng.uniform(3.2, 6.0), rng.uniform(-3.0, 3.0))) for _ in "ab"
        )
        ranges, bearings = scan_from(floor, true, beams=90)
        expected, _ = scan_from(floor, believed, beams=90)
        points = points_of(ranges, bearings) / floor.resolution
        through = share_through_walls(grid_pose(floor, believed), points, 0.0, 0.0, tables)
        # A beam along a face, or one that ends just half a metre behind it, is decided by less than a cell.
        assert through == pytest.approx(np.mean(ranges > expected + 0.5), abs=3.0 / 90.0)
        mounted = se2.compose(true, (0.3, -0.1, 0.2))
        ranges, bearings = scan_from(floor, mounted, beams=90)
        points = se2.transform_points((0.3, -0.1, 0.2), points_of(ranges, bearings)) / floor.resolution
        assert share_through_walls(grid_pose(floor, true), points, 6.0, -2.0, tables) == 0.0


def test_a_vehicle_that_is_elsewhere_in_the_room_is_lost_and_one_behind_a_crowd_is_not():
    floor = room()
    carried = stand(localizer_in(floor, TRUTH), floor, (6.5, 2.5, 0.0), 30)
    assert all(each.contours[USE] == CONTRADICTED for each in carried)
    assert [each.mode for each in carried].index(Mode.LOST) in (9, 10)
    # Legs half a metre to three metres away, on all but every fifth beam.
    rng, localizer = np.random.default_rng(1), localizer_in(floor, TRUTH)
    crowd = tuple((rng.uniform(0.5, 3.0), bearing) for bearing in np.linspace(-math.pi, math.pi, 400))
    behind = stand(localizer, floor, TRUTH, 40, crowd=crowd)
    assert all(each.contours[USE] == UNMATCHED for each in behind)
    assert all(each.mode == Mode.OPERATIONAL for each in behind)


def test_things_that_the_map_lacks_do_not_lose_a_vehicle_whose_contours_match():
    floor, bright = room(), ((0.8, 0.5), (1.0, 1.5), (0.9, -1.0))
    for reflectors in (ReflectorMap(), FAR_AWAY):
        localizer = localizer_in(floor, TRUTH, reflectors=reflectors)
        estimates = stand(localizer, floor, TRUTH, 60, bright=bright)
        assert all(len(each.status) == 3 for each in estimates[1:])
        assert all(each.mode == Mode.OPERATIONAL for each in estimates)


def test_a_vehicle_that_was_lost_is_operational_again_once_contours_match():
    floor = room()
    localizer = localizer_in(floor, TRUTH, reflectors=FAR_AWAY)
    moved = stand(localizer, floor, np.add(TRUTH, (0.5, 0.3, 0.0)), 30, bright=((0.8, 0.5), (1.0, 1.5), (0.9, -1.0)))
    assert moved[-1].mode == Mode.LOST
    assert stand(localizer, floor, TRUTH, 80, first=30)[-1].mode == Mode.OPERATIONAL
