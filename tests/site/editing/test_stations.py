from __future__ import annotations

import math

import numpy as np
import pytest

from commission.site.editing import stations as edits
from commission.site.routes import Direction, Route, Segment
from commission.site.stations import Station


def there_and_back() -> Route:
    """Five metres east, and in reverse five metres back to the west, 1 m farther north at its end."""
    there = Segment(control_points=np.array([[0.0, 0.0], [5.0, 0.0]]), degree=1)
    back = Segment(control_points=np.array([[5.0, 0.0], [3.0, 0.0], [0.0, 1.0]]), direction=Direction.REVERSE, degree=2)
    return Route("r", (there, back))


def test_a_place_near_a_route_gets_the_pose_of_the_vehicle_on_it():
    pose = edits.on_route((there_and_back(),), (2.0, -0.2), 0.5)
    assert pose is not None
    np.testing.assert_allclose(pose, (2.0, 0.0, 0.0), atol=1e-9)
    assert edits.on_route((there_and_back(),), (2.0, -0.6), 0.5) is None
    assert edits.on_route((), (2.0, 0.0), math.inf) is None


def test_in_reverse_the_vehicle_looks_back_along_the_way():
    route = there_and_back()
    foot = route.segments[1].spline().point(0.9)
    pose = edits.on_route((route,), (float(foot[0]), float(foot[1])), 0.1)
    assert pose is not None
    np.testing.assert_allclose(pose[:2], foot, atol=1e-6)
    assert abs(pose[2]) < math.pi / 4


def test_of_several_routes_the_nearest_one_has_it():
    other = Route("other", (Segment(control_points=np.array([[2.0, -5.0], [2.0, -0.3]]), degree=1),))
    pose = edits.on_route((there_and_back(), other), (2.02, -0.25), math.inf)
    assert pose is not None
    assert pose[2] == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("heading", "expected"),
    [(0.3, 0.0), (math.pi - 0.3, -math.pi), (-math.pi + 0.1, -math.pi), (math.pi / 2, math.pi / 2)],
)
def test_a_station_put_onto_a_route_keeps_the_way_it_looks(heading: float, expected: float):
    moved = edits.aligned(Station(name="S", x=9.0, y=9.0, heading=heading), np.array([1.0, 2.0, 0.0]))
    assert (moved.x, moved.y) == (1.0, 2.0)
    assert math.cos(moved.heading - expected) == pytest.approx(1.0)
