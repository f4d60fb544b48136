"""Wheels to motion and back, against the printed equations of Dixon et al. 2010 and against geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.localization.kinematics import body_twist, displacement, wheel_speeds
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle

SPEEDS = st.floats(-3.0, 3.0)
FOUR_WHEELS = OmnidirectionalVehicle(wheel_radius=0.05, center_distance=0.3)


@given(SPEEDS, SPEEDS)
def test_differential_and_tricycle_wheels_give_back_the_twist(forward: float, turn: float) -> None:
    twist = [forward, 0.0, turn]
    for vehicle in (DifferentialVehicle(0.6), TricycleVehicle(1.3), TricycleVehicle(-0.9)):
        np.testing.assert_allclose(body_twist(vehicle, wheel_speeds(vehicle, twist)), twist, atol=1e-12)


@given(SPEEDS, SPEEDS, SPEEDS, st.sampled_from([(0.0, 120.0, 240.0), (0.0, 90.0, 180.0, 270.0), (10.0, 80.0, 200.0)]))
def test_omnidirectional_wheels_give_back_the_twist(
    forward: float, left: float, turn: float, angles: tuple[float, ...]
) -> None:
    vehicle = OmnidirectionalVehicle(wheel_angles_deg=angles)
    twist = [forward, left, turn]
    np.testing.assert_allclose(body_twist(vehicle, wheel_speeds(vehicle, twist)), twist, atol=1e-11)


def test_four_wheels_follow_equation_6_of_dixon() -> None:
    r, R = FOUR_WHEELS.wheel_radius, FOUR_WHEELS.center_distance
    # Equation 6 at theta = 0, as printed.
    printed = r / 2.0 * np.array([[0, -1, 0, 1], [1, 0, -1, 0], [1 / (2 * R)] * 4])
    wheels = np.array([1.0, 2.5, -3.0, 0.7])
    np.testing.assert_allclose(body_twist(FOUR_WHEELS, wheels), printed @ wheels, atol=1e-15)


def test_equation_3_of_dixon_fits_its_pseudoinverse_only_with_its_third_row_corrected() -> None:
    r, R = FOUR_WHEELS.wheel_radius, FOUR_WHEELS.center_distance
    # Equation 3 at theta = 0, as printed: the third row says cos(theta) where equation 5 needs -cos(theta).
    printed = np.array([[0, 1, R], [-1, 0, R], [0, 1, R], [1, 0, R]]) / r
    ours = np.stack([wheel_speeds(FOUR_WHEELS, axis) for axis in np.eye(3)], axis=1)
    np.testing.assert_allclose(ours[[0, 1, 3]], printed[[0, 1, 3]], atol=1e-12)
    np.testing.assert_allclose(ours[2], [0.0, -1.0 / r, R / r], atol=1e-12)


def test_slipping_wheels_are_averaged_by_least_squares() -> None:
    wheels = wheel_speeds(FOUR_WHEELS, [0.5, 0.0, 0.0])
    # All wheels a little faster against the pattern (+, -, +, -) cannot be any motion of the body.
    np.testing.assert_allclose(body_twist(FOUR_WHEELS, wheels + np.array([1, -1, 1, -1])), [0.5, 0.0, 0.0], atol=1e-12)


def test_tricycle_reverses_its_drive_wheel_rather_than_steer_beyond_a_quarter_turn() -> None:
    speed, steering = wheel_speeds(TricycleVehicle(1.0), [-0.5, 0.0, 0.2])
    assert speed < 0.0
    assert abs(steering) < math.pi / 2


def test_wheels_rolling_for_a_time_follow_the_arc() -> None:
    vehicle = DifferentialVehicle(0.5)
    wheels = wheel_speeds(vehicle, [1.0, 0.0, math.pi / 2])
    # A quarter of a circle of radius 2 / pi.
    np.testing.assert_allclose(displacement(vehicle, wheels, 1.0), [2 / math.pi, 2 / math.pi, math.pi / 2], atol=1e-12)


def test_wrong_number_of_wheels_is_named() -> None:
    with pytest.raises(ValueError, match=r"wheels has shape \(3,\); expected \(4\)"):
        body_twist(FOUR_WHEELS, [1.0, 2.0, 3.0])
