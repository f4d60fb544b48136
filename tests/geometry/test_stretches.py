"""Stretches of flags against flags looked at one by one."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry.stretches import stretches_of


@pytest.mark.parametrize(
    ("flags", "expected"),
    [([], []), ([0], []), ([1], [[0, 1]]), ([1, 1, 0, 1], [[0, 2], [3, 4]]), ([0, 0, 1, 0], [[2, 3]])],
)
def test_stretches_begin_at_the_first_true_and_end_after_the_last(flags: list[int], expected: list[list[int]]) -> None:
    assert stretches_of(np.array(flags, bool)).tolist() == expected


@given(st.lists(st.booleans(), max_size=30))
def test_stretches_hold_all_that_is_true_nothing_else_and_never_touch(flags: list[bool]) -> None:
    found = stretches_of(np.array(flags, bool)).tolist()
    assert [i for first, end in found for i in range(first, end)] == [i for i, flag in enumerate(flags) if flag]
    assert all(end < first for (_, end), (first, _) in itertools.pairwise(found))
