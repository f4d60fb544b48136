"""Prediction does not depend on how finely odometry is sampled, and its noise is what a drawn one shows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry import se2
from commission.localization.estimate import Belief
from commission.localization.odometry import AT_REST, OdometryNoise, advance, arc_length, predict, reach
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, from_belief, mean_of

NOISE = OdometryNoise(1e-4, 1e-5, 4e-5, 1e-4, 3e-6, 1e-6)
START = PoseGaussian(1.0, -2.0, 0.7, 4e-4, 1e-5, 2e-5, 3e-4, -1e-5, 1e-4)
SECOND = 1_000_000_000


def arrays(belief: PoseGaussian) -> tuple[np.ndarray, np.ndarray]:
    return mean_of(belief), covariance_of(belief)


def split(twist: np.ndarray, parts: int) -> PoseGaussian:
    step = se2.exp(twist / parts)
    belief = START
    for _ in range(parts):
        belief = predict(belief, *step, 1.0 / parts, NOISE)
    return belief


@given(st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.integers(2, 7))
def test_straight_motion_split_anyhow_gives_the_same_belief(forward: float, left: float, parts: int) -> None:
    twist = np.array([forward, left, 0.0])
    (mean, cov), (mean_split, cov_split) = arrays(predict(START, *twist, 1.0, NOISE)), arrays(split(twist, parts))
    np.testing.assert_allclose(mean_split, mean, atol=1e-12)
    np.testing.assert_allclose(cov_split, cov, rtol=1e-9, atol=1e-15)


@given(st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_curved_motion_split_in_two_gives_nearly_the_same_belief(forward: float, turn: float) -> None:
    twist = np.array([forward, 0.0, turn])
    (mean, cov), (mean_split, cov_split) = arrays(predict(START, *se2.exp(twist), 1.0, NOISE)), arrays(split(twist, 2))
    np.testing.assert_allclose(mean_split, mean, atol=1e-12)
    # The direction of the noise follows the arc in two steps rather than one: second order in the turn, 0.25^2 / 3.
    assert np.abs(cov_split - cov).max() <= 0.03 * np.abs(cov).max()


def test_covariance_is_that_of_drawn_errors_along_the_way() -> None:
    rng = np.random.default_rng(0)
    twist, parts, draws = np.array([1.5, 0.0, 0.3]), 40, 20_000
    step = se2.exp(twist / parts)
    poses = np.zeros((draws, 3))
    distance, seconds = arc_length(*step), 1.0 / parts
    sigma = np.sqrt(
        [
            NOISE.forward_per_m * distance + NOISE.forward_per_s * seconds,
            NOISE.lateral_per_m * distance,
            NOISE.heading_per_m * distance + NOISE.heading_per_rad * abs(step[2]) + NOISE.heading_per_s * seconds,
        ]
    )
    for _ in range(parts):
        poses = se2.compose(se2.compose(poses, step), rng.normal(size=(draws, 3)) * sigma)
    still = PoseGaussian(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    cov = covariance_of(predict(still, *se2.exp(twist), 1.0, NOISE))
    drawn = np.cov(poses.T)
    # 20,000 draws: 1 % each; one step for a turn of 0.3 rad: another percent.
    assert np.abs(drawn - cov).max() < 0.05 * np.abs(cov).max()


@pytest.mark.parametrize("dtheta", [0.0, 1e-6, 0.0999, 0.1001, 1.0, -3.0])
def test_arc_is_as_long_as_the_way_driven(dtheta: float) -> None:
    assert arc_length(*se2.exp(np.array([2.0, 0.0, dtheta]))) == pytest.approx(2.0, rel=1e-13)


@given(st.lists(st.integers(1, 2 * SECOND), max_size=4))
def test_scans_between_odometry_change_nothing_of_a_steady_motion(offsets: list[int]) -> None:
    step = se2.exp(np.array([0.5, 0.0, 0.2]))
    belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, NOISE)
    belief, motion = advance(belief, motion, SECOND, *step, NOISE)
    expected = predict(predict(START, *step, 1.0, NOISE), *step, 1.0, NOISE)
    for offset in sorted({min(offset, SECOND) for offset in offsets}):
        belief, motion = reach(belief, motion, SECOND + offset, NOISE)
    belief, motion = advance(belief, motion, 2 * SECOND, *step, NOISE)
    np.testing.assert_allclose(mean_of(belief), mean_of(expected), atol=1e-12)
    # Up to five steps for one: as in the test of curved motion.
    cov, plain = covariance_of(belief), covariance_of(expected)
    assert np.abs(cov - plain).max() <= 0.01 * np.abs(plain).max()


def test_time_passes_on_while_odometry_is_silent() -> None:
    belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, NOISE)
    belief, motion = reach(belief, motion, 4 * SECOND, NOISE)
    assert belief.tt == pytest.approx(START.tt + 4.0 * NOISE.heading_per_s)
    assert (belief.x, belief.y, belief.theta) == (START.x, START.y, START.theta)


def test_equal_stamps_leave_the_belief_alone() -> None:
    belief, motion = advance(START, AT_REST, 5, 0.0, 0.0, 0.0, NOISE)
    assert reach(belief, motion, 5, NOISE) == (belief, motion)


def test_belief_that_is_no_pose_is_refused() -> None:
    with pytest.raises(ValueError, match=r"expected finite \(3,\) and \(3, 3\)"):
        from_belief(Belief(0, np.array([0.0, np.nan, 0.0]), np.eye(3)))
