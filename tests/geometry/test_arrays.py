"""Blocks are gathered in order, and nobody writes to what was gathered."""

from __future__ import annotations

import numpy as np
import pytest

from commission.geometry.arrays import Growing


def test_blocks_of_rows_are_gathered_in_their_order_and_type():
    rows = Growing(np.float64, 2)
    rows.append(np.array([[1.0, 2.0], [3.0, 4.0]]))
    rows.append(np.empty((0, 2)))
    rows.append(np.array([[5.0, 6.0], [7.0, 8.0]])[:, ::-1])
    assert rows.array().tolist() == [[1.0, 2.0], [3.0, 4.0], [6.0, 5.0], [8.0, 7.0]]
    stamps = Growing(np.int64)
    stamps.append(np.array([3, 5], dtype=np.int32))
    assert stamps.array().dtype == np.int64
    assert stamps.array().tolist() == [3, 5]


def test_nothing_gathered_is_no_rows_of_the_right_shape():
    assert Growing(np.float64, 3).array().shape == (0, 3)
    assert Growing(np.int64).array().shape == (0,)


def test_what_was_gathered_is_read_only():
    rows = Growing(np.int8)
    rows.append(np.array([1], dtype=np.int8))
    with pytest.raises(ValueError, match="read-only"):
        rows.array()[0] = 2
