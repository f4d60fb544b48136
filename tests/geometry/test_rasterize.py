import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry.rasterize import draw_segments

COORDINATE = st.floats(-3.0, 11.0).map(lambda value: round(value, 3))


def drawn(*segments, shape=(8, 8)):
    cells = np.zeros(shape, dtype=np.bool_)
    draw_segments(cells, np.array(segments, dtype=np.float64))
    return cells


def test_horizontal_vertical_and_diagonal_lines_touch_the_cells_they_pass():
    assert np.argwhere(drawn((1.5, 2.5, 4.5, 2.5))).tolist() == [[2, 1], [2, 2], [2, 3], [2, 4]]
    assert np.argwhere(drawn((1.5, 4.5, 1.5, 2.5))).tolist() == [[2, 1], [3, 1], [4, 1]]
    assert np.argwhere(drawn((0.2, 0.4, 1.8, 1.4))).tolist() == [[0, 0], [0, 1], [1, 1]]
    assert drawn((3.2, 3.7, 3.2, 3.7)).sum() == 1


@given(ends=st.tuples(COORDINATE, COORDINATE, COORDINATE, COORDINATE))
def test_every_cell_that_a_dense_sampling_of_the_line_meets_is_drawn_and_no_other(ends):
    cells = drawn(ends)
    t = np.linspace(0.0, 1.0, 2001)[:, np.newaxis]
    start, end = np.array(ends[:2]), np.array(ends[2:])
    points = start + t * (end - start)
    met = np.floor(points).astype(int)
    inside = ((met >= 0) & (met < 8)).all(axis=1)
    # A sample may round across a border which the line only touches: count those that lie clearly inside a cell.
    clear = inside & (np.abs(points - np.rint(points)) > 1e-6).all(axis=1)
    assert all(cells[row, column] for column, row in met[clear])
    # No drawn cell lies farther from the line than half its diagonal.
    length = np.linalg.norm(end - start)
    for row, column in np.argwhere(cells):
        center = np.array([column + 0.5, row + 0.5])
        along = 0.0 if length == 0.0 else np.clip((center - start) @ (end - start) / length**2, 0.0, 1.0)
        assert np.linalg.norm(center - start - along * (end - start)) <= np.sqrt(0.5) + 1e-9


def test_lines_outside_the_grid_and_lines_that_are_no_numbers_draw_nothing():
    nan, far = float("nan"), 1e300
    assert not drawn((-5, -5, -1, -1), (nan, 1, 2, 2), (1, nan, 2, 2), (far, 0, far, 5), (9, 0, 9, 7)).any()
    assert drawn((-far, 2.5, far, 2.5))[2].all()
