"""Edits of the floor map against plain geometry: points in polygons, distances to lines, in maps that lie anyhow."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.raycast import RayCaster
from commission.site.editing.floor_map import NEW_RESOLUTION, draw_obstacle, draw_wall, fill
from commission.site.floor_map import FREE, MOST_CELLS, OCCUPIED, UNKNOWN, FloorMap

CELL = 0.25
"""Edge of a cell in these tests [m]: a number that a computer holds exactly."""
SHAPE = (13, 17)


def blank(origin: tuple[float, float, float] = (0.0, 0.0, 0.0), value: int = UNKNOWN) -> FloorMap:
    return FloorMap(np.full(SHAPE, value, np.int8), CELL, np.array(origin))


def in_polygon(x: Fraction, y: Fraction, polygon: list[tuple[Fraction, Fraction]]) -> bool:
    """Whether a point lies in a polygon: crossings of a ray to the right (Franklin, PNPOLY), without rounding."""
    inside = False
    for (x1, y1), (x2, y2) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        if (y1 > y) != (y2 > y) and x < x1 + (x2 - x1) * (y - y1) / (y2 - y1):
            inside = not inside
    return inside


# Corners on quarters of cells, in and around the grid: edges through centers, corners on centers, spikes and crossings.
CORNERS = st.lists(
    st.tuples(st.integers(-8, 4 * SHAPE[1] + 8), st.integers(-8, 4 * SHAPE[0] + 8)), min_size=3, max_size=9, unique=True
)


@example(quarters=[(0, 0), (4, 33), (48, 11)])
@given(quarters=CORNERS)
def test_exactly_the_cells_with_centers_in_the_polygon_are_set(quarters: list[tuple[int, int]]) -> None:
    polygon = [(Fraction(x, 4), Fraction(y, 4)) for x, y in quarters]
    edited = fill(blank(), [(float(x) * CELL, float(y) * CELL) for x, y in polygon], FREE)
    half = Fraction(1, 2)
    expected = [
        [FREE if in_polygon(column + half, row + half, polygon) else UNKNOWN for column in range(SHAPE[1])]
        for row in range(SHAPE[0])
    ]
    np.testing.assert_array_equal(edited.cells, expected)


@given(
    quarters=CORNERS,
    yaw=st.floats(-math.pi, math.pi),
    x=st.floats(-100.0, 100.0),
    y=st.floats(-100.0, 100.0),
)
def test_a_map_that_is_moved_and_turned_is_edited_alike(
    quarters: list[tuple[int, int]], yaw: float, x: float, y: float
) -> None:
    # Odd eighths: no edge passes so near to a center that rounding decides.
    polygon = (np.array(quarters) + 0.5) * CELL / 4.0 + 1e-4 * np.arange(2 * len(quarters)).reshape(-1, 2)
    upright = fill(blank(), polygon, OCCUPIED)
    turned = fill(blank((x, y, yaw)), se2.transform_points(np.array([x, y, yaw]), polygon), OCCUPIED)
    differs = np.argwhere(upright.cells != turned.cells)
    centers = (differs[:, ::-1] + 0.5) * CELL
    for center in centers:
        # Only a center that an edge passes within rounding may go either way.
        assert min(distance_to(center, a, b) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)) < 1e-9


def distance_to(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Distance from a point to a line between two others."""
    along = end - start
    share = np.clip((point - start) @ along / (along @ along), 0.0, 1.0) if along.any() else 0.0
    return float(np.hypot(*(start + share * along - point)))


def test_a_straight_wall_is_as_thick_and_long_as_it_was_drawn() -> None:
    wall = draw_wall(blank(value=FREE), [(1.0, 1.5), (3.0, 1.5)], 1.0)
    expected = np.full(SHAPE, FREE, np.int8)
    expected[4:8, 4:12] = OCCUPIED
    # The middle line ends on the border of a cell, which it touches.
    expected[6, 12] = OCCUPIED
    np.testing.assert_array_equal(wall.cells, expected)


@given(
    ends=st.lists(st.tuples(st.floats(0.3, 3.9), st.floats(0.3, 2.9)), min_size=2, max_size=4, unique=True),
    thickness=st.floats(0.01, 1.0),
)
def test_a_wall_covers_its_line_and_nothing_beyond_its_thickness(
    ends: list[tuple[float, float]], thickness: float
) -> None:
    points = np.array(ends)
    wall = draw_wall(blank(value=FREE), points, thickness)
    grid = wall.occupancy()
    # Half the thickness, or half the diagonal of a cell that the middle line touches.
    reach = max(0.5 * thickness, math.sqrt(0.5) * CELL)
    pieces = list(itertools.pairwise(points))
    for cell in np.argwhere(wall.cells == OCCUPIED):
        assert min(distance_to(grid.cell_centers(cell), a, b) for a, b in pieces) <= reach + 1e-9
    along = np.concatenate([a + np.linspace(0.0, 1.0, 200)[:, np.newaxis] * (b - a) for a, b in pieces])
    assert grid.is_occupied(along).all()


def test_a_wall_thinner_than_a_cell_has_no_gap_for_a_ray() -> None:
    wall = draw_wall(blank(value=FREE), [(0.1, 0.3), (4.0, 2.7)], 0.001)
    targets = [(x, 0.1) for x in np.linspace(1.0, 3.9, 60)]
    assert not RayCaster(wall.occupancy()).line_of_sight([(0.2, 2.9)], targets).any()


def test_a_corner_of_a_thick_wall_is_filled() -> None:
    wall = draw_wall(blank(value=FREE), [(1.0, 1.0), (3.0, 1.0), (3.0, 2.5)], 0.8)
    # Outside of both straight pieces, 395 mm from the corner of the line.
    assert wall.occupancy().is_occupied([(3.375, 0.875), (3.125, 0.625)]).all()


def test_what_is_drawn_beyond_the_map_makes_it_larger_and_moves_nothing() -> None:
    before = draw_wall(blank((2.0, 3.0, 0.5), FREE), [(3.0, 4.5), (3.5, 4.5)], 0.3)
    after = draw_obstacle(before, [(-2.0, 3.0), (-1.0, 3.0), (-1.0, 4.0), (-2.0, 4.0)])
    assert after.resolution == before.resolution
    assert after.cells.size > before.cells.size
    grid = after.occupancy()
    assert grid.is_occupied([(-1.5, 3.5), (3.2, 4.5)]).all()
    old = np.argwhere(before.cells == OCCUPIED)
    assert grid.is_occupied(before.occupancy().cell_centers(old)).all()
    new = grid.cells_at([(-1.5, 2.5)])[0]
    assert after.cells[tuple(new)] == UNKNOWN


def test_the_first_wall_begins_a_map() -> None:
    begun = draw_wall(None, [(10.0, 20.0), (14.0, 20.0)], 0.2)
    assert begun.resolution == NEW_RESOLUTION
    assert begun.occupancy().is_occupied([(10.1, 20.0), (13.9, 20.05)]).all()
    assert set(np.unique(begun.cells)) == {FREE, OCCUPIED}
    np.testing.assert_allclose(begun.size, (6.2, 2.2), atol=2 * NEW_RESOLUTION)


def test_an_edit_that_changes_nothing_is_none_and_the_original_is_never_touched() -> None:
    before = blank(value=FREE)
    square = [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)]
    assert fill(before, square, FREE) is before
    assert fill(before, [(50.0, 50.0), (51.0, 50.0), (51.0, 51.0)], OCCUPIED) is before
    after = fill(before, square, OCCUPIED)
    assert (before.cells == FREE).all()
    assert (after.cells == OCCUPIED).sum() == 16


@pytest.mark.parametrize(
    ("draw", "said"),
    [
        (lambda m: fill(m, [(0, 0), (0, 0), (1, 1)], FREE), "2 different points are too few; expected 3 or more"),
        (lambda m: draw_wall(m, [(0, 0), (0, 0)], 0.1), "1 different points are too few; expected 2 or more"),
        (lambda m: draw_obstacle(m, [(0, 0), (0.1, 0), (0.1, 0.1)]), "smaller than a cell of 250 mm"),
        (lambda m: draw_wall(m, [(0, 0), (1e6, 1e6)], 0.1), f"expected at most {MOST_CELLS}"),
        (lambda m: draw_wall(m, [(0, 0), (math.nan, 1)], 0.1), "is not finite"),
    ],
)
def test_a_shape_that_cannot_be_drawn_says_why(draw: Callable[[FloorMap], FloorMap], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        draw(blank())


def test_a_thickness_out_of_range_is_refused() -> None:
    with pytest.raises(ValueError, match=r"thickness is 0; expected 0\.001 to 10 m"):
        draw_wall(blank(), [(0, 0), (1, 1)], 0.0)
