import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from commission.app.floor_map.wall_layer import merged_boxes


@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.booleans()))
def test_boxes_cover_exactly_the_occupied_cells_once(occupied: np.ndarray) -> None:
    covered = np.zeros(occupied.shape, int)
    for row0, row1, column0, column1 in merged_boxes(occupied):
        covered[row0:row1, column0:column1] += 1
    np.testing.assert_array_equal(covered, occupied.astype(int))


def test_a_plain_wall_is_one_box() -> None:
    occupied = np.zeros((20, 30), bool)
    occupied[3:6, 4:25] = True
    np.testing.assert_array_equal(merged_boxes(occupied), [[3, 6, 4, 25]])
