"""Wrapping of angles: one interval, closed below and open above."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry.angles import difference, wrap, wrap_scalar

ANGLES = st.floats(-1e4, 1e4)


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(math.pi, -math.pi), (-math.pi, -math.pi), (0.0, 0.0), (3 * math.pi, -math.pi), (1.5 * math.pi, -0.5 * math.pi)],
)
def test_ends_of_the_interval_are_one_angle(angle: float, expected: float) -> None:
    assert wrap(angle) == pytest.approx(expected, abs=1e-15)


@given(ANGLES)
def test_wrapped_angle_is_inside_and_points_the_same_way(angle: float) -> None:
    wrapped = float(wrap(angle))
    assert -math.pi <= wrapped < math.pi
    # 1e4 rad are 1,600 turns; each rounds 2 pi by 2.4e-16.
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-12)


@given(ANGLES)
def test_wrapping_twice_changes_nothing(angle: float) -> None:
    assert wrap(wrap(angle)) == wrap(angle)


@pytest.mark.parametrize("angle", [1e-300, -1e-300, math.nextafter(math.pi, 0.0), -math.pi])
def test_angle_inside_is_kept_to_the_last_bit(angle: float) -> None:
    assert wrap(angle) == angle
    assert wrap_scalar(angle) == angle


@given(ANGLES)
def test_kernel_gives_the_bits_of_the_array_function(angle: float) -> None:
    assert wrap_scalar(angle) == wrap(angle)


def test_difference_takes_the_short_way_round() -> None:
    assert difference(math.radians(-179), math.radians(179)) == pytest.approx(math.radians(2))
    np.testing.assert_allclose(difference([0.1, -3.1], [-0.1, 3.1]), [0.2, 2 * math.pi - 6.2], atol=1e-15)
