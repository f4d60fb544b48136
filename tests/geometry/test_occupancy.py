"""The grid in the map: rotated origin, borders, and distances by brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry.occupancy import OccupancyGrid

POSES = st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(-3.2, 3.2))


def corridor(origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> OccupancyGrid:
    """3 rows x 5 columns of 0.5 m with one wall cell at row 2, column 4 (the upper right)."""
    occupied = np.zeros((3, 5), dtype=bool)
    occupied[2, 4] = True
    return OccupancyGrid(occupied, 0.5, np.array(origin))


def test_row_zero_is_the_lowest_y() -> None:
    grid = corridor()
    np.testing.assert_array_equal(grid.cells_at([[0.1, 0.1], [2.4, 1.4], [2.4, 0.1]]), [[0, 0], [2, 4], [0, 4]])
    np.testing.assert_array_equal(grid.is_occupied([[2.4, 1.4], [2.4, 0.1]]), [True, False])


def test_rotated_origin_turns_the_grid_about_its_corner() -> None:
    # Turned left by 90 degrees about (10, 20): columns run along +y, rows along -x.
    grid = corridor((10.0, 20.0, math.pi / 2))
    np.testing.assert_allclose(grid.corners(), [[10, 20], [10, 22.5], [8.5, 22.5], [8.5, 20]], atol=1e-12)
    np.testing.assert_allclose(grid.bounds(), [8.5, 20.0, 10.0, 22.5], atol=1e-12)
    assert grid.is_occupied([8.6, 22.4])
    assert grid.size == (2.5, 1.5)


@given(POSES, st.integers(-5, 10), st.integers(-5, 10))
def test_center_of_a_cell_lies_in_that_cell(origin: tuple[float, float, float], row: int, column: int) -> None:
    grid = corridor(origin)
    np.testing.assert_array_equal(grid.cells_at(grid.cell_centers([row, column])), [row, column])


def test_everything_outside_is_free() -> None:
    grid = OccupancyGrid(np.ones((2, 2), dtype=bool), 1.0)
    outside = [[-0.1, 0.5], [2.0, 0.5], [0.5, 2.1], [1e6, -1e6]]
    assert not grid.is_occupied(outside).any()
    assert not grid.contains(outside).any()
    assert grid.is_occupied([[0.0, 0.0], [1.9, 1.9]]).all()


def test_distance_field_matches_all_pairs() -> None:
    occupied = np.random.default_rng(2).random((13, 17)) < 0.05
    grid = OccupancyGrid(occupied, 0.2)
    walls, cells = np.argwhere(occupied), np.argwhere(np.ones_like(occupied))
    expected = 0.2 * np.linalg.norm(cells[:, np.newaxis] - walls, axis=-1).min(axis=1).reshape(occupied.shape)
    np.testing.assert_allclose(grid.distance_field(), expected, atol=1e-12)


def test_distance_is_infinite_without_any_obstacle() -> None:
    assert np.isinf(OccupancyGrid(np.zeros((2, 3), dtype=bool), 1.0).distance_field()).all()


def test_grid_keeps_its_own_copy_of_the_cells() -> None:
    cells = np.zeros((2, 3), dtype=bool)
    grid = OccupancyGrid(cells, 1.0)
    cells[0, 0] = True
    assert not grid.occupied.any()
    with pytest.raises(ValueError, match="read-only"):
        grid.occupied[0, 0] = True
    assert grid == OccupancyGrid(np.zeros((2, 3), dtype=bool), 1.0)


@pytest.mark.parametrize("resolution", [0.0, -1.0, math.nan, math.inf])
def test_impossible_resolution_is_refused(resolution: float) -> None:
    with pytest.raises(ValueError, match=r"resolution is .*; expected meters per cell > 0"):
        OccupancyGrid(np.zeros((2, 2), dtype=bool), resolution)


@pytest.mark.parametrize("shape", [(3,), (0, 3), (2, 2, 2)])
def test_impossible_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="expected rows x columns"):
        OccupancyGrid(np.zeros(shape, dtype=bool), 1.0)
