"""Walkers stay on the free floor and out of the vehicle's way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.simulation.people import Crowd, WalkableFloor
from commission.simulation.people_kernels import KEEP_FROM_VEHICLE, LEG_RADIUS
from commission.site.floor_map import OCCUPIED, FloorMap
from commission.site.project import Project
from tests.simulation.halls import RESOLUTION, hall, room

FAR_AWAY = np.array([100.0, 100.0, 0.0])


def furnished() -> Project:
    cells = np.array(room().cells)
    cells[60:80, 100:140] = OCCUPIED
    return replace(hall(), floor_map=FloorMap(cells, RESOLUTION))


def test_fifty_people_never_walk_into_walls_or_reflectors() -> None:
    project = furnished()
    floor = WalkableFloor.of(project)
    crowd = Crowd(floor, 50, 1.0, np.random.default_rng(0))
    occupancy = project.floor_map.occupancy()
    for _ in range(1000):
        crowd.step(0.04, FAR_AWAY)
        assert floor.allows(crowd.positions).all()
        assert not occupancy.is_occupied(crowd.legs()[:, :2]).any()


def test_people_walk_at_about_the_mean_speed() -> None:
    crowd = Crowd(WalkableFloor.of(furnished()), 50, 1.2, np.random.default_rng(0))
    steps = []
    for _ in range(250):
        before = crowd.positions
        crowd.step(0.04, FAR_AWAY)
        steps.append(np.hypot(*(crowd.positions - before).T) / 0.04)
    # The spread between 50 people is 25 %, and slow ones walk longer.
    assert 0.8 < np.mean(steps[1:]) < 1.4


def test_people_make_room_for_the_vehicle() -> None:
    floor = WalkableFloor.of(hall())
    crowd = Crowd(floor, 50, 1.0, np.random.default_rng(1))
    vehicle = np.array([6.0, 4.0, 0.0])
    for _ in range(200):
        crowd.step(0.04, vehicle)
    nearest = np.min(np.hypot(*(crowd.positions - vehicle[:2]).T))
    # One step of a fast walker may still lead inside.
    assert nearest > KEEP_FROM_VEHICLE - 0.15


def test_a_person_is_two_legs() -> None:
    crowd = Crowd(WalkableFloor.of(hall()), 3, 1.0, np.random.default_rng(0))
    legs = crowd.legs()
    assert legs.shape == (6, 3)
    assert np.all(legs[:, 2] == LEG_RADIUS)
    assert 0.5 * (legs[:3, :2] + legs[3:, :2]) == pytest.approx(crowd.positions)


def test_the_same_seed_gives_the_same_walks() -> None:
    crowds = [Crowd(WalkableFloor.of(hall()), 10, 1.0, np.random.default_rng(5)) for _ in range(2)]
    for _ in range(100):
        for crowd in crowds:
            crowd.step(0.04, FAR_AWAY)
    assert np.array_equal(crowds[0].legs(), crowds[1].legs())


def test_people_walk_around_reflectors_and_routes_in_an_open_field() -> None:
    project = replace(hall(), floor_map=None)
    crowd = Crowd(WalkableFloor.of(project), 20, 1.0, np.random.default_rng(0))
    for _ in range(100):
        crowd.step(0.04, FAR_AWAY)
    assert np.all(crowd.positions > -3.0)
    assert np.all(crowd.positions < 15.0)


def test_hall_without_free_floor_has_no_people() -> None:
    full = replace(hall(), floor_map=FloorMap(np.full((20, 20), OCCUPIED, np.int8), RESOLUTION))
    crowd = Crowd(WalkableFloor.of(full), 5, 1.0, np.random.default_rng(0))
    crowd.step(0.04, FAR_AWAY)
    assert len(crowd.legs()) == 0
