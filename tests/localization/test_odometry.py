"""Prediction does not depend on how finely odometry is sampled, and its noise is what a drawn one shows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry import se2
from commission.localization.estimate import Belief
from commission.localization.odometry import (
    AT_REST,
    NOT_YET,
    NextOdometry,
    OdometryNoise,
    advance,
    arc_length,
    predict,
    reach,
    waits_until,
)
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
        belief, motion = reach(belief, motion, SECOND + offset, NOT_YET, NOISE)
    belief, motion = advance(belief, motion, 2 * SECOND, *step, NOISE)
    np.testing.assert_allclose(mean_of(belief), mean_of(expected), atol=1e-12)
    # Up to five steps for one: as in the test of curved motion.
    cov, plain = covariance_of(belief), covariance_of(expected)
    assert np.abs(cov - plain).max() <= 0.01 * np.abs(plain).max()


def test_time_passes_on_while_odometry_is_silent() -> None:
    belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, NOISE)
    belief, motion = reach(belief, motion, 4 * SECOND, NOT_YET, NOISE)
    assert belief.tt == pytest.approx(START.tt + 4.0 * NOISE.heading_per_s)
    assert (belief.x, belief.y, belief.theta) == (START.x, START.y, START.theta)


@given(st.lists(st.integers(1, SECOND), max_size=4), st.integers(0, 4))
def test_the_motion_between_two_records_is_interpolated_wherever_the_belief_has_gone(
    offsets: list[int], guessed: int
) -> None:
    before, step = se2.exp(np.array([0.4, 0.0, -0.1])), np.array([0.5, 0.02, 0.2])
    belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, NOISE)
    belief, motion = advance(belief, motion, SECOND, *before, NOISE)
    at_record = mean_of(belief)
    for number, offset in enumerate(sorted(set(offsets))):
        # The first ones are reached before the record that follows is known.
        following = NOT_YET if number < guessed else NextOdometry(True, 2 * SECOND, *step)
        belief, motion = reach(belief, motion, SECOND + offset, following, NOISE)
        if following.known:
            expected = se2.compose(at_record, se2.exp(offset / SECOND * se2.log(step)))
            np.testing.assert_allclose(mean_of(belief), expected, atol=1e-12)
    belief, motion = advance(belief, motion, 2 * SECOND, *step, NOISE)
    np.testing.assert_allclose(mean_of(belief), se2.compose(at_record, step), atol=1e-12)


UNKNOWN = NOISE._replace(forward_per_s4=0.25 * 0.5**2, heading_per_s4=0.25, missing_per_s2=3.0, turning_per_s2=0.75)
"""Accelerations of 0.5 m/s^2 and 1 rad/s^2; speeds up to 3 m/s and 1.5 rad/s."""


def added(stamps: list[int], noise: OdometryNoise) -> np.ndarray:
    """Covariance in the vehicle's axes that the unmeasured adds on the way to the last stamp, odometry every second."""
    found = []
    for own in (noise, NOISE):
        belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, own)
        belief, motion = advance(belief, motion, SECOND, 0.0, 0.0, 0.0, own)
        for stamp in stamps:
            belief, motion = reach(belief, motion, stamp, NOT_YET, own)
        c, s = np.cos(START.theta), np.sin(START.theta)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        found.append(turn.T @ covariance_of(belief) @ turn)
    return found[0] - found[1]


@pytest.mark.parametrize(
    ("seconds", "along", "across", "heading"),
    [
        (0.5, 0.0625**2, 0.0, 0.125**2),  # a t^2 / 2
        (1.0, 0.25**2, 0.0, 0.5**2),
        (3.0, 0.25**2 + 12.0, 12.0, 0.5**2 + 3.0),  # and for two seconds more: (limit t)^2 / 3
    ],
)
def test_what_odometry_has_not_told_yet_spreads_the_belief(
    seconds: float, along: float, across: float, heading: float
) -> None:
    last = SECOND + round(seconds * SECOND)
    at_once = added([last], UNKNOWN)
    np.testing.assert_allclose(at_once, np.diag([along, across, heading]), atol=1e-12)
    in_steps = added([SECOND + round(share * seconds * SECOND) for share in (0.1, 0.4, 0.9, 1.0)], UNKNOWN)
    np.testing.assert_allclose(in_steps, at_once, atol=1e-12)


@pytest.mark.parametrize("stamps", [[], [2_500_000_000, 4_500_000_000]])
@pytest.mark.parametrize(("interval", "is_gap"), [(3 * SECOND, False), (3 * SECOND + 1, True)])
def test_a_gap_in_odometry_spreads_the_belief_whatever_the_next_record_says(
    interval: int, is_gap: bool, stamps: list[int]
) -> None:
    sizes = []
    for own in (UNKNOWN._replace(forward_per_s4=0.0, heading_per_s4=0.0), NOISE):
        belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, own)
        belief, motion = advance(belief, motion, SECOND, 0.0, 0.0, 0.0, own)
        for stamp in stamps if is_gap else ():
            belief, motion = reach(belief, motion, min(stamp, SECOND + interval), NOT_YET, own)
        belief, motion = advance(belief, motion, SECOND + interval, 0.0, 0.0, 0.0, own)
        assert motion.usual_ns == (SECOND if is_gap else 3 * SECOND), "a gap makes no interval usual"
        sizes.append(covariance_of(belief))
    spread = np.diag([12.0, 12.0, 3.0]) if is_gap else np.zeros((3, 3))
    np.testing.assert_allclose(sizes[0] - sizes[1], spread, atol=1e-6)


def test_short_pauses_of_fast_odometry_are_no_gap() -> None:
    belief, motion = advance(START, AT_REST, 0, 0.0, 0.0, 0.0, UNKNOWN)
    for stamp in (SECOND // 100, SECOND // 100 + SECOND // 5):
        belief, motion = advance(belief, motion, stamp, 0.0, 0.0, 0.0, UNKNOWN)
    assert belief.xx - START.xx < 1e-5
    belief, motion = advance(belief, motion, motion.odometry_ns + 3 * SECOND // 5 + 1, 0.0, 0.0, 0.0, UNKNOWN)
    assert belief.xx - START.xx > 0.1


def test_a_scan_waits_one_usual_interval_and_half_a_second_before_one_is_known() -> None:
    assert waits_until(AT_REST, 5) == 5
    _, motion = advance(START, AT_REST, 10, 0.0, 0.0, 0.0, NOISE)
    assert (waits_until(motion, 10), waits_until(motion, 12)) == (10, 12 + SECOND // 2)
    _, motion = advance(START, motion, 110, 0.0, 0.0, 0.0, NOISE)
    _, motion = advance(START, motion, 126, 0.0, 0.0, 0.0, NOISE)
    # The longest of late, forgotten by a sixteenth per record.
    assert waits_until(motion, 130) == 130 + 94


def test_equal_stamps_leave_the_belief_alone() -> None:
    belief, motion = advance(START, AT_REST, 5, 0.0, 0.0, 0.0, NOISE)
    assert reach(belief, motion, 5, NOT_YET, NOISE) == (belief, motion)


def test_belief_that_is_no_pose_is_refused() -> None:
    with pytest.raises(ValueError, match=r"expected finite \(3,\) and \(3, 3\)"):
        from_belief(Belief(0, np.array([0.0, np.nan, 0.0]), np.eye(3)))
