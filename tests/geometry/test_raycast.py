"""Rays against plain cell-by-cell traversal: the same cell, the same range, to the last bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from commission.geometry import raycast
from commission.geometry.arrays import read_only
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.ray_kernels import cast_ray, free_rectangles
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import transform_points

Hit = tuple[float, int, int]
MISS: Hit = (math.inf, -1, -1)


def traverse(
    occupied: NDArray[np.bool_], start: tuple[float, float], direction: tuple[float, float], limit: float
) -> Hit:
    """Cell by cell (Amanatides, Woo 1987), horizontal border first on a tie; unit: cells."""
    rows, columns = occupied.shape
    x, y = start
    # 1 / d overflows for smaller components; growing them moves no border into range and keeps their side.
    dx, dy = (math.copysign(max(abs(d), 1e-300), d) if d else 0.0 for d in direction)
    row, column, t = math.floor(y), math.floor(x), 0.0
    while t <= limit:
        if 0 <= row < rows and 0 <= column < columns and occupied[row, column]:
            return t, row, column
        time_x = ((column + 1 if dx > 0 else column) - x) * (1 / dx) if dx else math.inf
        time_y = ((row + 1 if dy > 0 else row) - y) * (1 / dy) if dy else math.inf
        t = min(time_x, time_y)
        if time_x < time_y:
            column += 1 if dx > 0 else -1
        else:
            row += 1 if dy > 0 else -1
    return MISS


def random_map(seed: int, rows: int = 37, columns: int = 50, share: float = 0.04) -> NDArray[np.bool_]:
    return np.random.default_rng(seed).random((rows, columns)) < share


def assert_same_hit(
    caster: RayCaster, start: tuple[float, float], direction: tuple[float, float], limit: float
) -> None:
    """Bitwise: a resolution of 1 m at the origin makes meters and cells one."""
    expected = traverse(caster.grid.occupied, start, direction, limit)
    assert cast_ray(caster.tables, *start, *direction, limit) == expected


@pytest.mark.parametrize("share", [0.0, 0.002, 0.02, 0.2, 0.7])
def test_random_rays_stop_at_the_cell_that_traversal_stops_at(share: float) -> None:
    caster = RayCaster(OccupancyGrid(random_map(1, share=share), 1.0))
    rng = np.random.default_rng(2)
    for _ in range(1000):
        start = (float(rng.uniform(-8, 58)), float(rng.uniform(-8, 45)))
        heading = rng.uniform(-math.pi, math.pi)
        direction = (math.cos(heading), math.sin(heading))
        assert_same_hit(caster, start, direction, float(rng.choice([3.0, 20.0, 200.0])))


# Multiples of 1/4 start on borders and corners; exact slopes cross corner after corner.
GRID_POINTS = st.tuples(st.integers(-20, 220), st.integers(-20, 170)).map(lambda p: (p[0] / 4, p[1] / 4))
SLOPES = st.tuples(st.integers(-4, 4), st.integers(-4, 4)).filter(lambda d: d != (0, 0))


@given(st.integers(0, 20), GRID_POINTS, SLOPES, st.sampled_from([1.0, 0.125]), st.floats(0.0, 90.0))
def test_rays_through_exact_corners_follow_traversal(
    seed: int, start: tuple[float, float], slope: tuple[int, int], scale: float, limit: float
) -> None:
    caster = RayCaster(OccupancyGrid(random_map(seed), 1.0))
    assert_same_hit(caster, start, (slope[0] * scale, slope[1] * scale), limit)


@settings(max_examples=400)
@example(0, (0.0, 0.0), -2.225073858507e-311, 0.0, False)
@example(0, (3.0, 3.0), -2.225073858507e-311, -5e-324, True)
@given(st.integers(0, 20), GRID_POINTS, st.floats(-math.pi, math.pi), st.floats(-2e-15, 2e-15), st.booleans())
def test_rays_within_rounding_of_an_axis_or_a_border_follow_traversal(
    seed: int, start: tuple[float, float], heading: float, nudge: float, upright: bool
) -> None:
    caster = RayCaster(OccupancyGrid(random_map(seed), 1.0))
    direction = (nudge, math.copysign(1.0, heading)) if upright else (math.cos(heading), math.sin(heading))
    assert_same_hit(caster, (start[0] + nudge, start[1] - nudge), direction, 100.0)


@pytest.mark.parametrize(
    ("start", "direction", "expected"),
    [
        ((0.5, 2.5), (1.0, 0.0), (3.5, 2, 4)),
        ((0.5, 2.5), (1.0, -0.0), (3.5, 2, 4)),
        ((8.5, 2.5), (-1.0, 0.0), (3.5, 2, 4)),
        ((4.5, 0.0), (0.0, 1.0), (2.0, 2, 4)),
        ((4.5, 5.0), (0.0, -1.0), (2.0, 2, 4)),
        ((4.5, 2.5), (0.6, 0.8), (0.0, 2, 4)),
        ((4.0, 2.0), (-1.0, 0.0), (0.0, 2, 4)),
        ((5.0, 2.5), (-1.0, 0.0), (0.0, 2, 4)),
        ((5.0, 2.5), (1.0, 0.0), MISS),
        ((-3.0, 2.5), (1.0, 0.0), (7.0, 2, 4)),
        ((12.0, 2.5), (-1.0, 0.0), (7.0, 2, 4)),
        ((4.5, 9.0), (0.0, -1.0), (6.0, 2, 4)),
        ((4.5, -2.0), (0.0, 1.0), (4.0, 2, 4)),
        ((-3.0, 2.5), (-1.0, 0.0), MISS),
        ((4.5, 9.0), (0.0, 1.0), MISS),
        ((-3.0, 7.5), (1.0, 0.0), MISS),
        ((-3.0, 2.5), (0.0, 1.0), MISS),
    ],
)
def test_axis_parallel_rays_hit_the_one_wall(
    start: tuple[float, float], direction: tuple[float, float], expected: Hit
) -> None:
    occupied = np.zeros((5, 9), dtype=bool)
    occupied[2, 4] = True
    assert cast_ray(RayCaster(OccupancyGrid(occupied, 1.0)).tables, *start, *direction, 100.0) == expected


def test_ray_through_an_exact_corner_enters_the_cell_across_the_horizontal_border() -> None:
    occupied = np.zeros((4, 4), dtype=bool)
    occupied[2, 1] = True
    caster = RayCaster(OccupancyGrid(occupied, 1.0))
    # The diagonal from the origin crosses corner (2, 2) by way of row 2, column 1.
    assert cast_ray(caster.tables, 0.0, 0.0, 1.0, 1.0, 9.0) == (2.0, 2, 1)


def test_wall_exactly_at_the_maximum_range_is_hit_and_beyond_is_not() -> None:
    occupied = np.zeros((1, 10), dtype=bool)
    occupied[0, 8] = True
    caster = RayCaster(OccupancyGrid(occupied, 1.0))
    np.testing.assert_array_equal(caster.cast([0.0, 0.5, 0.0], 8.0), 8.0)
    np.testing.assert_array_equal(caster.cast([0.0, 0.5, 0.0], math.nextafter(8.0, 0.0)), math.inf)


def test_rectangles_longer_than_a_byte_are_walked_in_several_jumps() -> None:
    occupied = np.zeros((600, 900), dtype=bool)
    occupied[590, 890] = True
    caster = RayCaster(OccupancyGrid(occupied, 1.0))
    for start in [(3.2, 2.7), (0.0, 590.5), (890.5, 0.25)]:
        length = math.hypot(890.5 - start[0], 590.5 - start[1])
        direction = ((890.5 - start[0]) / length, (590.5 - start[1]) / length)
        assert_same_hit(caster, start, direction, 2000.0)
        assert cast_ray(caster.tables, *start, *direction, 2000.0)[1:] == (590, 890)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
def test_impossible_rays_hit_nothing_and_return(bad: float) -> None:
    tables = RayCaster(OccupancyGrid(random_map(3), 1.0)).tables
    for place in range(4):
        numbers = [20.0, 20.0, 0.6, 0.8]
        numbers[place] = bad
        assert cast_ray(tables, *numbers, 50.0) == MISS
    assert cast_ray(tables, 20.0, 20.0, 0.6, 0.8, math.nan) == MISS
    assert cast_ray(tables, -5.0, 20.0, 0.0, 1.0, math.inf) == MISS


def free_from(occupied: NDArray[np.bool_], row: int, column: int) -> list[tuple[int, int]]:
    """Columns and rows of every free rectangle from a cell to higher rows and columns, by looking into all cells."""
    rows, columns = occupied.shape
    return [
        (w, h)
        for h in range(1, rows - row + 1)
        for w in range(1, columns - column + 1)
        if not occupied[row : row + h, column : column + w].any()
    ]


@pytest.mark.parametrize(("down", "left"), [(False, False), (False, True), (True, False), (True, True)])
def test_rectangles_are_free_and_on_average_nearly_as_large_as_the_best(down: bool, left: bool) -> None:
    occupied = random_map(5, 12, 15, 0.08)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    rectangles = free_rectangles(read_only(occupied), down, left)
    # Turned so that all of them extend to higher rows and columns.
    turned = occupied[::-1] if down else occupied
    turned, rectangles = (turned[:, ::-1], rectangles[:, ::-1]) if left else (turned, rectangles)
    rectangles = rectangles[::-1] if down else rectangles
    np.testing.assert_array_equal(rectangles == 0, turned)
    found, best = [], []
    for row, column in np.argwhere(~turned):
        w, h = int(rectangles[row, column]) & 0xFF, int(rectangles[row, column]) >> 8
        free = free_from(turned, row, column)
        assert (w, h) in free
        found.append(w * h / (w + h))
        best.append(max(w * h / (w + h) for w, h in free))
    assert np.mean(found) >= 0.97 * np.mean(best)


def test_a_rectangle_that_reaches_out_of_the_grid_is_as_large_as_can_be() -> None:
    occupied = np.zeros((4, 5), dtype=bool)
    occupied[1, 3] = True
    rectangles = free_rectangles(read_only(occupied), False, False)
    assert rectangles[2, 0] == 255 + (255 << 8)
    assert rectangles[1, 4] == 255 + (255 << 8)
    assert rectangles[1, 2] == 1 + (255 << 8)
    assert rectangles[1, 3] == 0


POSES = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1))


@given(POSES, st.floats(0.02, 0.5), st.floats(1.0, 36.0), st.floats(1.0, 49.0), st.floats(-3.1, 3.1))
def test_range_ends_on_the_wall_wherever_the_grid_is_placed(
    origin: tuple[float, float, float], resolution: float, row: float, column: float, heading: float
) -> None:
    grid = OccupancyGrid(random_map(7), resolution, np.array(origin))
    start = transform_points(origin, [column * resolution, row * resolution])
    distance = float(RayCaster(grid).cast([*start, heading], 100.0))
    direction = np.array([math.cos(heading), math.sin(heading)])
    # Rays that graze a cell may be judged either way once the grid is rotated: allow a micrometer.
    around = 1e-6 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]])
    if math.isfinite(distance):
        assert grid.is_occupied(start + direction * distance + around).any()
    walked = np.arange(0.0, min(distance, 60 * resolution), 0.05 * resolution)
    deep = grid.is_occupied(start + direction * walked[:, np.newaxis, np.newaxis] + around).all(axis=-1)
    assert not deep.any()


def test_batches_keep_their_shape_and_parallel_gives_the_same_bits() -> None:
    caster = RayCaster(OccupancyGrid(random_map(9), 0.1, np.array([3.0, -2.0, 0.4])))
    rng = np.random.default_rng(4)
    rays = rng.uniform([1, -4, -3], [7, 4, 3], (20, 11, 3))
    ranges = caster.cast(rays, 4.0)
    assert ranges.shape == (20, 11)
    assert np.isfinite(ranges).any()
    np.testing.assert_array_equal(caster.cast_parallel(rays, 4.0), ranges)
    one_by_one = [cast_ray(caster.tables, x, y, math.cos(h), math.sin(h), 4.0)[0] for x, y, h in rays.reshape(-1, 3)]
    np.testing.assert_array_equal(ranges.reshape(-1), one_by_one)
    many = np.tile(rays.reshape(-1, 3), (10, 1))
    np.testing.assert_array_equal(caster.cast_parallel(many, 4.0), np.tile(ranges.reshape(-1), 10))
    assert caster.cast(np.zeros((0, 3)), 4.0).shape == (0,)
    assert caster.cast([0.0, 0.0, 0.0], 1.0).shape == ()


def test_line_of_sight_sees_over_free_cells_and_not_through_walls() -> None:
    occupied = np.zeros((5, 9), dtype=bool)
    occupied[2, 4] = True
    caster = RayCaster(OccupancyGrid(occupied, 0.5))
    scanner = [0.25, 1.25]
    np.testing.assert_array_equal(
        caster.line_of_sight(scanner, [[1.9, 1.25], [2.1, 1.25], [4.0, 1.25], [4.0, 2.4], [0.25, 1.25], [9.0, 9.0]]),
        [True, False, False, True, True, True],
    )
    assert not caster.line_of_sight([2.25, 1.25], [2.25, 1.25])
    assert caster.line_of_sight(np.zeros((4, 1, 2)), np.ones((3, 2))).shape == (4, 3)


@given(st.integers(0, 20), GRID_POINTS, GRID_POINTS)
def test_line_of_sight_agrees_with_traversal(seed: int, a: tuple[float, float], b: tuple[float, float]) -> None:
    caster = RayCaster(OccupancyGrid(random_map(seed), 1.0))
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    scale = 1.0 / length if length else 0.0
    direction = ((b[0] - a[0]) * scale, (b[1] - a[1]) * scale)
    assert caster.line_of_sight(a, b) == (traverse(caster.grid.occupied, a, direction, length) == MISS)


def test_casters_of_equal_grids_are_equal() -> None:
    assert RayCaster(OccupancyGrid(random_map(1), 1.0)) == RayCaster(OccupancyGrid(random_map(1), 1.0))
    assert RayCaster(OccupancyGrid(random_map(1), 1.0)) != RayCaster(OccupancyGrid(random_map(2), 1.0))


def test_wrong_shape_is_named() -> None:
    with pytest.raises(ValueError, match=r"array has shape \(2,\); expected \(\.\.\., 3\)"):
        RayCaster(OccupancyGrid(random_map(1), 1.0)).cast([0.0, 1.0], 5.0)


def test_warm_up_runs() -> None:
    raycast.warm_up()
