from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import UsageError
from commission.geometry.angles import difference
from commission.geometry.occupancy import OccupancyGrid
from commission.site.editing import snapping
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

CELL = 0.05


def half_plane(angle: float, yaw: float = 0.0) -> OccupancyGrid:
    """A wall that fills what lies behind the line through (5 m, 5 m) with a normal of `angle`, grid frame."""
    rows, columns = np.mgrid[0:200, 0:200]
    x, y = (columns + 0.5) * CELL - 5.0, (rows + 0.5) * CELL - 5.0
    return OccupancyGrid(math.cos(angle) * x + math.sin(angle) * y < 0.0, CELL, [0.0, 0.0, yaw])


@given(st.floats(-math.pi, math.pi), st.floats(0.05, 0.9), st.floats(-1.0, 1.0))
@settings(max_examples=300)
def test_a_slanted_wall_is_met_where_it_is_and_faces_where_it_faces(angle, distance, along):
    c, s = math.cos(angle), math.sin(angle)
    point = (5.0 + distance * c - along * s, 5.0 + distance * s + along * c)
    wall = snapping.nearest_wall(half_plane(angle), point, 1.0)
    assert wall is not None
    # Cells know the surface to a cell's diagonal, and its direction over 0.8 m to a cell at each end.
    assert abs(c * (wall.x - 5.0) + s * (wall.y - 5.0)) < 0.75 * CELL
    assert abs(float(difference(wall.heading, angle))) < math.radians(7.0)
    assert wall.distance == pytest.approx(distance, abs=0.75 * CELL)


@pytest.mark.parametrize("yaw", [0.0, 0.3])
def test_a_straight_wall_is_met_exactly_in_a_turned_grid_too(yaw):
    grid = half_plane(0.0, yaw)
    c, s = math.cos(yaw), math.sin(yaw)
    wall = snapping.nearest_wall(grid, (c * 5.3 - s * 4.0, s * 5.3 + c * 4.0))
    assert wall is not None
    assert (wall.x, wall.y) == pytest.approx((c * 5.0 - s * 4.0, s * 5.0 + c * 4.0))
    assert wall.heading == pytest.approx(yaw)
    assert wall.distance == pytest.approx(0.3)


def test_a_thin_wall_is_met_on_the_side_of_the_click():
    occupied = np.zeros((40, 40), dtype=np.bool_)
    occupied[:, 20] = True
    grid = OccupancyGrid(occupied, CELL)
    left, right = (snapping.nearest_wall(grid, (x, 1.0)) for x in (0.8, 1.2))
    assert left is not None
    assert right is not None
    assert (left.x, abs(left.heading)) == pytest.approx((1.0, math.pi))
    assert (right.x, right.heading) == pytest.approx((1.05, 0.0))


def test_beside_the_corner_of_a_pillar_the_nearest_face_counts():
    occupied = np.zeros((60, 60), dtype=np.bool_)
    occupied[20:26, 20:26] = True
    wall = snapping.nearest_wall(OccupancyGrid(occupied, CELL), (1.6, 1.28))
    assert wall is not None
    assert (wall.x, wall.y, wall.heading) == pytest.approx((1.3, 1.28, 0.0))


def test_a_click_inside_a_wall_comes_out_at_its_surface():
    wall = snapping.nearest_wall(half_plane(0.0), (4.8, 5.0))
    assert wall is not None
    assert (wall.x, wall.heading) == pytest.approx((5.0, 0.0))


@pytest.mark.parametrize("point", [(8.0, 5.0), (-50.0, 5.0), (1e6, -1e6)])
def test_no_wall_within_reach_is_none(point):
    assert snapping.nearest_wall(half_plane(0.0), point) is None


def test_the_edge_of_the_grid_is_a_surface_towards_the_free_outside():
    wall = snapping.nearest_wall(half_plane(0.0), (-0.2, 5.0))
    assert wall is not None
    assert (wall.x, abs(wall.heading)) == pytest.approx((0.0, math.pi))


def test_a_cylinder_touches_the_wall_and_a_plate_lies_on_it_and_faces_the_hall():
    pair = ReflectorMap(
        (
            Reflector(id="C", x=5.4, y=4.0, radius=0.04, heading=1.0),
            Reflector(id="F", x=5.4, y=6.0, radius=0.04, kind=ReflectorKind.FLAT, heading=1.0),
            Reflector(id="L", x=5.4, y=7.0, locked=True),
            Reflector(id="far", x=9.0, y=5.0),
        )
    )
    snapped = snapping.snap_to_wall(pair, ["C", "F", "L", "far"], half_plane(0.0))
    cylinder, plate, locked, far = snapped.reflectors
    assert (cylinder.x, cylinder.heading) == (pytest.approx(5.04), 1.0)
    assert (plate.x, plate.heading) == pytest.approx((5.0 + snapping.PLATE_DEPTH, 0.0))
    assert (locked, far) == pair.reflectors[2:]


def test_snapping_to_a_grid_twice_changes_nothing_more():
    once = snapping.to_grid([(1.26, -0.74), (3.3, 0.0)], 0.5)
    assert once.tolist() == [[1.5, -0.5], [3.5, 0.0]]
    assert np.array_equal(snapping.to_grid(once, 0.5), once)


def test_a_point_lines_up_with_the_nearest_row_and_column():
    others = ReflectorMap(
        (Reflector(id="A", x=1.0, y=5.0), Reflector(id="B", x=7.0, y=2.0), Reflector(id="own", x=1.04, y=2.04))
    )
    aligned = snapping.align(others, (1.05, 2.05), 0.1, ["own"])
    assert (aligned.x, aligned.x_of, aligned.y, aligned.y_of) == (1.0, "A", 2.0, "B")
    assert snapping.align(ReflectorMap(), (1.0, 2.0), 0.1) == snapping.LinedUp(1.0, 2.0, None, None)


def test_a_row_attracts_up_to_its_reach_and_not_beyond():
    others = ReflectorMap((Reflector(id="A", x=1.0, y=5.0),))
    assert snapping.align(others, (1.25, 0.0), 0.25).x_of == "A"
    assert snapping.align(others, (1.25001, 0.0), 0.25).x_of is None


def test_a_reach_or_spacing_of_nothing_is_refused():
    with pytest.raises(UsageError, match="reach is 0 m"):
        snapping.nearest_wall(half_plane(0.0), (5.0, 5.0), 0.0)
    with pytest.raises(UsageError, match="spacing of the grid is 0 m"):
        snapping.to_grid([1.0, 1.0], 0.0)


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_corners_of_a_block_are_met_exactly_from_inside_and_outside(yaw: float):
    occupied = np.zeros((100, 100), dtype=bool)
    occupied[40:60, 30:70] = True
    # A notch of 5 x 5 cells makes a corner that points inward.
    occupied[55:60, 65:70] = False
    grid = OccupancyGrid(occupied, CELL, [1.0, 2.0, yaw])
    c, s = math.cos(yaw), math.sin(yaw)
    for x, y in ((1.5, 2.0), (3.5, 2.0), (1.5, 3.0), (3.25, 3.0), (3.25, 2.75), (3.5, 2.75)):
        corner = np.array([1.0 + c * x - s * y, 2.0 + s * x + c * y])
        for off in ((0.08, 0.03), (-0.05, 0.09)):
            found = snapping.nearest_corner(grid, tuple(corner + off), 0.15)
            assert found is not None
            np.testing.assert_allclose(found, corner, atol=1e-9)
    assert snapping.nearest_corner(grid, (1.0 + c * 2.5 - s * 2.0, 2.0 + s * 2.5 + c * 2.0), 0.5) is None


@pytest.mark.parametrize("angle", [0.1, 0.5, math.pi / 4, 1.2])
def test_the_steps_of_a_slanted_wall_are_no_corners(angle: float):
    assert snapping.nearest_corner(half_plane(angle), (5.0, 5.0), 0.5) is None
