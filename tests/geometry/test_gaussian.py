"""Gates and ellipses against tables and against an eigenvalue solver."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import chi2

from commission.geometry import gaussian

SIGMAS = st.floats(1e-4, 1e2)


@pytest.mark.parametrize(
    ("probability", "dof", "gate"), [(0.95, 1, 3.841), (0.95, 2, 5.991), (0.99, 2, 9.210), (0.95, 3, 7.815)]
)
def test_gate_matches_the_printed_chi_square_table(probability: float, dof: int, gate: float) -> None:
    assert gaussian.chi_square_gate(probability, dof) == pytest.approx(gate, abs=5e-4)


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1, math.nan])
def test_gate_refuses_a_probability_outside_the_open_interval(probability: float) -> None:
    with pytest.raises(ValueError, match="gate probability is"):
        gaussian.chi_square_gate(probability, 2)


@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95, 0.999])
@pytest.mark.parametrize("dof", [1, 2, 3, 7])
def test_the_mean_behind_a_gate_is_the_integral_up_to_it(probability: float, dof: int) -> None:
    gate = float(chi2.ppf(probability, dof))
    integral, _ = quad(lambda x: x * chi2.pdf(x, dof), 0.0, gate)
    assert gaussian.truncated_chi_square_mean(gate, dof) == pytest.approx(integral / probability, rel=1e-6)


def test_the_mean_behind_a_gate_of_two_degrees_of_freedom_has_a_formula_and_without_a_gate_is_their_number() -> None:
    beyond = math.exp(-0.5 * 5.991464547)
    expected = 2.0 - 5.991464547 * beyond / (1.0 - beyond)
    assert gaussian.truncated_chi_square_mean(5.991464547, 2) == pytest.approx(expected, rel=1e-12)
    assert gaussian.truncated_chi_square_mean(math.inf, 3) == 3.0
    with pytest.raises(ValueError, match="gate is 0"):
        gaussian.truncated_chi_square_mean(0.0, 2)


def covariance(major: float, minor: float, angle: float) -> np.ndarray:
    """Covariance with the given sigmas along and across `angle`."""
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return rotation @ np.diag([major**2, minor**2]) @ rotation.T


@given(SIGMAS, st.floats(1.01, 100.0), st.floats(-1.57, 1.57))
def test_axes_return_the_sigmas_and_angle_that_made_the_covariance(minor: float, ratio: float, angle: float) -> None:
    semi_axes, found = gaussian.ellipse_axes(covariance(minor * ratio, minor, angle))
    # The smaller variance is a difference of two numbers up to ratio^2 = 1e4 times larger: 1e-16 * 1e4.
    np.testing.assert_allclose(semi_axes, [minor * ratio, minor], rtol=1e-10)
    assert math.sin(float(found) - angle) == pytest.approx(0.0, abs=1e-10)


def test_axes_agree_with_the_eigenvalue_solver_in_a_batch() -> None:
    factors = np.random.default_rng(1).normal(size=(50, 2, 2))
    covariances = factors @ np.swapaxes(factors, 1, 2)
    semi_axes, angle = gaussian.ellipse_axes(covariances)
    np.testing.assert_allclose(semi_axes[:, ::-1] ** 2, np.linalg.eigvalsh(covariances), atol=1e-12)
    assert ((angle >= -math.pi / 2) & (angle < math.pi / 2)).all()


def test_singular_covariance_gives_a_line() -> None:
    semi_axes, angle = gaussian.ellipse_axes([[1.0, 1.0], [1.0, 1.0]])
    np.testing.assert_allclose(semi_axes, [math.sqrt(2.0), 0.0], atol=1e-7)
    assert angle == pytest.approx(math.pi / 4)


@given(SIGMAS, st.floats(1.0, 30.0), st.floats(-3.0, 3.0), st.floats(0.1, 5.0))
def test_outline_lies_at_the_mahalanobis_distance_it_was_drawn_for(
    minor: float, ratio: float, angle: float, scale: float
) -> None:
    cov = covariance(minor * ratio, minor, angle)
    center = np.array([3.0, -2.0])
    outline = gaussian.ellipse_points([center], [cov], scale, 16)[0]
    # Offsets are recovered from coordinates of about 3 m: 4e-16 m over sigmas down to 1e-4 m, times the ratio.
    np.testing.assert_allclose(gaussian.mahalanobis_squared(outline - center, cov), scale**2, rtol=1e-7)


def test_outlines_come_in_a_batch_with_one_scale_each() -> None:
    outlines = gaussian.ellipse_points(np.zeros((2, 2)), np.stack([np.eye(2)] * 2), [1.0, 3.0], 12)
    assert outlines.shape == (2, 12, 2)
    np.testing.assert_allclose(np.linalg.norm(outlines, axis=-1), [[1.0] * 12, [3.0] * 12])
    assert gaussian.ellipse_points(np.zeros((0, 2)), np.zeros((0, 2, 2))).shape == (0, 48, 2)


def test_outline_goes_round_once_counterclockwise_from_the_end_of_the_longer_axis() -> None:
    outline = gaussian.ellipse_points([[1.0, 1.0]], [np.diag([4.0, 1.0])], 2.0, 4)[0]
    np.testing.assert_allclose(outline, [[5.0, 1.0], [1.0, 3.0], [-3.0, 1.0], [1.0, -1.0]], atol=1e-12)
