from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.planning.route_check import FloorDistances
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.routes import Route, Segment
from commission.site.vehicle import DifferentialVehicle, TricycleVehicle, Vehicle
from commission.studies.violations import Violation, ViolationKind, check_route

BOX = DifferentialVehicle(outline=((0.5, 0.3), (-0.5, 0.3), (-0.5, -0.3), (0.5, -0.3)))


def corridor() -> FloorDistances:
    """12 x 4 m; a wall of 0.2 m reaches up to y = 1.9 m at x = 6 m, the floor ends at y = 1.4 m from x = 9 m on."""
    cells = np.full((80, 240), FREE, np.int8)
    cells[:38, 118:122] = OCCUPIED
    cells[:28, 180:] = OCCUPIED
    return FloorDistances(FloorMap(cells, 0.05))


FLOOR = corridor()


def route_violations(
    route: Route, vehicle: Vehicle, floor: FloorDistances | None, room: float
) -> tuple[Violation, ...]:
    return check_route(route, vehicle, floor, room).violations


def line(*points: tuple[float, float]) -> Route:
    return Route("r", (Segment(control_points=np.array(points, float), degree=1),))


def test_each_stretch_says_where_along_the_route_it_is_and_where_it_is_worst():
    wall, little = route_violations(line((1, 2), (4, 2), (7.5, 1.7), (11, 1.75)), BOX, FLOOR, 0.1)[-2:]
    assert (wall.kind, wall.is_fatal) == (ViolationKind.WALL, True)
    assert wall.where.worst_pose[0] == pytest.approx(6.0, abs=0.1)
    begin, end = wall.where.metres
    # The outline of 1 m cuts the wall of 0.2 m about 5 m after the start of the route.
    assert begin == pytest.approx(4.4, abs=0.1)
    assert end - begin == pytest.approx(1.2, abs=0.1)
    assert (little.kind, little.is_fatal) == (ViolationKind.ROOM, False)
    assert 0.0 < little.found < little.expected == 0.1
    assert little.where.poses[:, 0].min() > 8.0


def test_a_stretch_holds_its_poses_and_the_length_between_its_metres():
    (wall,) = route_violations(line((1, 2), (11, 2)), BOX, FLOOR, 0.05)
    steps = np.hypot(*np.diff(wall.where.poses[:, :2], axis=0).T)
    assert wall.where.length == pytest.approx(steps.sum())
    assert wall.where.metres[0] == pytest.approx(wall.where.poses[0, 0] - 1.0)


def test_corners_stop_a_vehicle_that_cannot_turn_and_only_displease_one_that_can():
    route = line((1, 3), (3, 3), (3, 1))
    (displeasing,) = route_violations(route, BOX, None, 0.1)
    (fatal,) = route_violations(route, TricycleVehicle(), None, 0.1)
    for violation in (displeasing, fatal):
        assert violation.kind is ViolationKind.CORNER
        assert violation.found == pytest.approx(np.pi / 2)
        np.testing.assert_allclose(violation.where.worst_pose[:2], (3.0, 3.0), atol=0.06)
    assert (displeasing.is_fatal, fatal.is_fatal) == (False, True)


def test_without_walls_room_is_not_asked_for():
    assert route_violations(line((1, 2), (11, 2)), replace(BOX), None, 0.1) == ()
