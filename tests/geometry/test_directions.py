"""Directions as unit vectors agree with the sines, cosines and arctangents of their angles."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from commission.geometry.directions import SERIES_TURN, direction_of, turn_to, turned_by

TURNS = st.one_of(st.floats(-3.0, 3.0), st.floats(-0.06, 0.06), st.floats(-0.011, 0.011), st.just(0.05))


@given(st.floats(-7.0, 7.0), TURNS)
def test_turn_to_a_direction_is_the_difference_of_the_angles(angle: float, turn: float) -> None:
    found = turn_to(math.cos(angle), math.sin(angle), direction_of(angle + turn))
    # The sum of the angles is rounded, their sines and cosines are, and two products of these.
    assert found == pytest.approx(turn, abs=2e-15)


def test_turn_away_from_nowhere_is_finite() -> None:
    assert math.isfinite(turn_to(0.0, 0.0, direction_of(1.0)))


@given(st.floats(-7.0, 7.0), TURNS)
def test_direction_turned_by_an_angle_is_that_of_the_sum(angle: float, turn: float) -> None:
    found = turned_by(direction_of(angle), turn)
    assert found == pytest.approx((math.cos(angle + turn), math.sin(angle + turn)), abs=2e-15)


@given(st.floats(-60.0, 60.0))
@example(0.0)
@example(0.5 * math.pi)
@example(-math.pi)
@example(0.25 * math.pi)
@example(SERIES_TURN)
def test_direction_of_an_angle_is_its_cosine_and_sine(angle: float) -> None:
    # Two last bits of 1.
    assert direction_of(angle) == pytest.approx((math.cos(angle), math.sin(angle)), rel=0.0, abs=4.5e-16)


@given(st.integers(-30, 30))
def test_cosine_keeps_its_digits_beside_a_quarter_turn(quarters: int) -> None:
    angle = (quarters + 0.5) * math.pi
    # What a cosine is where it is nearly zero: the rounding of the angle, which the library knows to the last bit.
    assert direction_of(angle).cos == pytest.approx(math.cos(angle), rel=1e-7)


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_direction_of_no_angle_is_not_a_number(angle: float) -> None:
    assert all(math.isnan(each) for each in direction_of(angle))
