"""The picture of the floor lies as the map does."""

from __future__ import annotations

import numpy as np

from commission.app import theme
from commission.app.layers import floor
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap


def test_first_row_of_the_picture_is_the_lowest_of_the_map_because_viser_begins_there():
    cells = np.array([[OCCUPIED, FREE], [FREE, FREE], [UNKNOWN, UNKNOWN]], np.int8)
    image = floor.picture(FloorMap(cells, 0.1))
    assert tuple(image[0, 0]) == (*theme.WALL, 255)
    assert tuple(image[0, 1]) == (*theme.FREE, 255)
    assert image[2, 0, 3] == 0


def test_a_wall_of_one_cell_survives_the_thinning_of_a_huge_map():
    cells = np.zeros((40, 3 * floor.LONGEST_SIDE), np.int8)
    cells[17] = OCCUPIED
    image = floor.picture(FloorMap(cells, 0.1))
    assert max(image.shape) <= floor.LONGEST_SIDE
    assert (image[..., :3] == theme.WALL).all(axis=-1).any(axis=0).all()
