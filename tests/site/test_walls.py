"""Walls for rays: one table for one floor map, however often it is asked for."""

from __future__ import annotations

import numpy as np

from commission.site.floor_map import FloorMap
from commission.site.walls import walls_of


def test_the_same_floor_map_is_prepared_once_and_an_equal_one_for_itself() -> None:
    cells = np.zeros((4, 6), dtype=np.int8)
    cells[:, 3] = 100
    floor, equal = FloorMap(cells, 0.5), FloorMap(cells.copy(), 0.5)
    assert walls_of(floor) is walls_of(floor)
    assert walls_of(equal) is not walls_of(floor)
    assert walls_of(equal) == walls_of(floor)
    assert not walls_of(floor).line_of_sight([[1.0, 1.0]], [[2.5, 1.0]]).any()
    assert walls_of(None).line_of_sight([[1.0, 1.0]], [[2.5, 1.0]]).all()


def test_another_floor_map_is_never_taken_for_one_that_is_gone() -> None:
    for column in range(6):
        cells = np.zeros((4, 6), dtype=np.int8)
        cells[:, column] = 100
        assert walls_of(FloorMap(cells, 0.5)).grid.occupied[:, column].all()
