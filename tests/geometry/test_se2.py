"""SE(2): group axioms, exponential map, and kernels that agree with the array functions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from commission.geometry import se2
from commission.geometry.angles import difference

Pose = NDArray[np.float64]
LENGTHS = st.floats(-1e3, 1e3)
POSES = st.tuples(LENGTHS, LENGTHS, st.floats(-10.0, 10.0)).map(np.array)
IDENTITY = np.zeros(3)


def assert_same_pose(a: Pose, b: Pose) -> None:
    """Equal to 1e-10: lengths up to 3e3 m, each rotation rounds to about 1e-13 of them."""
    np.testing.assert_allclose(a[..., :2], b[..., :2], atol=1e-10, rtol=0)
    np.testing.assert_allclose(difference(a[..., 2], b[..., 2]), 0.0, atol=1e-10)


@given(POSES, POSES, POSES)
def test_composition_is_associative(a: Pose, b: Pose, c: Pose) -> None:
    assert_same_pose(se2.compose(se2.compose(a, b), c), se2.compose(a, se2.compose(b, c)))


@given(POSES)
def test_identity_on_either_side_changes_nothing(a: Pose) -> None:
    assert_same_pose(se2.compose(a, IDENTITY), a)
    assert_same_pose(se2.compose(IDENTITY, a), a)


@given(POSES)
def test_inverse_on_either_side_gives_identity(a: Pose) -> None:
    assert_same_pose(se2.compose(a, se2.inverse(a)), IDENTITY)
    assert_same_pose(se2.compose(se2.inverse(a), a), IDENTITY)


@given(POSES, POSES)
def test_relative_pose_leads_from_one_to_the_other(a: Pose, b: Pose) -> None:
    assert_same_pose(se2.relative(a, b), se2.compose(se2.inverse(a), b))
    assert_same_pose(se2.compose(a, se2.relative(a, b)), b)


@given(POSES, POSES, LENGTHS, LENGTHS)
def test_points_transform_as_poses_compose(a: Pose, b: Pose, x: float, y: float) -> None:
    stepwise = se2.transform_points(a, se2.transform_points(b, [x, y]))
    np.testing.assert_allclose(se2.transform_points(se2.compose(a, b), [x, y]), stepwise, atol=1e-10, rtol=0)


@given(LENGTHS, LENGTHS, st.floats(-3.14, 3.14))
def test_log_undoes_exp(vx: float, vy: float, w: float) -> None:
    np.testing.assert_allclose(se2.log(se2.exp([vx, vy, w])), [vx, vy, w], atol=1e-10, rtol=0)


@given(POSES)
def test_exp_undoes_log(pose: Pose) -> None:
    # Near a half turn a length is divided by the chord 2/pi of its arc: still no amplification beyond 2.
    assert_same_pose(se2.exp(se2.log(pose)), pose)


@pytest.mark.parametrize("w", [0.0, 1e-300, 1e-9, 0.999e-3, 1.001e-3, -1e-3, 0.1])
def test_exp_follows_the_arc_through_the_switch_to_its_series(w: float) -> None:
    # 20,000 tiny steps of the twist, composed as a matrix power with mid-point rule: O(1e-10).
    n = 20_000
    middle = (np.arange(n) + 0.5) * w / n
    expected = [
        np.cos(middle).mean() * 2.0 - np.sin(middle).mean(),
        np.sin(middle).mean() * 2.0 + np.cos(middle).mean(),
    ]
    np.testing.assert_allclose(se2.exp([2.0, 1.0, w])[:2], expected, atol=1e-10, rtol=0)


@given(POSES, POSES)
def test_kernels_agree_with_array_functions(a: Pose, b: Pose) -> None:
    # libm and numpy may round sine and cosine differently in the last bit.
    assert_same_pose(np.array(se2.compose_scalars(*a, *b)), se2.compose(a, b))
    assert_same_pose(np.array(se2.inverse_scalars(*a)), se2.inverse(a))
    assert_same_pose(np.array(se2.exp_scalars(*a)), se2.exp(a))
    np.testing.assert_allclose(se2.log_scalars(*a), se2.log(a), rtol=1e-12, atol=1e-9)


def test_poses_and_points_broadcast() -> None:
    poses = np.zeros((5, 1, 3))
    poses[:, 0, 0] = np.arange(5)
    assert se2.transform_points(poses, np.ones((7, 2))).shape == (5, 7, 2)
    assert se2.compose(poses, np.zeros((4, 3))).shape == (5, 4, 3)
    assert se2.compose(np.zeros(3), np.zeros((0, 3))).shape == (0, 3)


def test_quarter_turn_maps_forward_to_left() -> None:
    np.testing.assert_allclose(se2.transform_points([1.0, 2.0, math.pi / 2], [3.0, 0.0]), [1.0, 5.0], atol=1e-15)


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(ValueError, match=r"poses have shape \(2,\); expected \(\.\.\., 3\)"):
        se2.inverse([1.0, 2.0])
    with pytest.raises(ValueError, match=r"points have shape \(3,\); expected \(\.\.\., 2\)"):
        se2.transform_points([0.0, 0.0, 0.0], [1.0, 2.0, 3.0])


def test_headings_stay_within_half_a_turn() -> None:
    turned = np.array([0.0, 0.0, 3.0])
    for pose in (se2.relative(turned, -turned), se2.compose(turned, turned), se2.inverse([0.0, 0.0, -math.pi])):
        assert -math.pi <= pose[2] < math.pi
    assert se2.relative(turned, -turned)[2] == pytest.approx(2.0 * math.pi - 6.0)
    assert se2.inverse_scalars(0.0, 0.0, -math.pi)[2] == -math.pi
    assert se2.compose_scalars(0.0, 0.0, 3.0, 0.0, 0.0, 3.0)[2] == pytest.approx(6.0 - 2.0 * math.pi)


@pytest.mark.parametrize("w", [9.99e-4, -9.99e-4, 3e-4, 1e-5])
def test_series_near_zero_are_the_closed_forms_to_the_last_bits(w: float) -> None:
    # sin(w) / w and (1 - cos w) / w = w/2 (sin(w/2) / (w/2))^2 lose nothing to cancellation; w/2 cot(w/2) neither.
    along, across = math.sin(w) / w, 2.0 * math.sin(0.5 * w) ** 2 / w
    cotangent = 0.5 * w / math.tan(0.5 * w)
    for found in (se2.exp([1.0, 0.0, w]), se2.exp_scalars(1.0, 0.0, w)):
        assert found[:2] == pytest.approx([along, across], rel=1e-15)
    for found in (se2.log([1.0, 0.0, w]), se2.log_scalars(1.0, 0.0, w)):
        assert found[:2] == pytest.approx([cotangent, -0.5 * w], rel=1e-15)
