"""Equations 1 to 12 against a weak-perspective camera by plain geometry, and the derivatives of the full camera."""

import math

import numpy as np
import pytest

from commission.localization.contour_bundle import expected_points, point_jacobians
from commission.localization.egomotion import motion_of, shape_matrix, shape_vector, why_degenerate
from tests.virtual_camera import Camera, board, drive, seen

DEPTH = 7.7


def weak(contour, turn, place):
    """Image of a board all of whose points are as deep as where the axis meets it, after a turn and a way."""
    c, s = math.cos(turn), math.sin(turn)
    R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    T = -R @ np.array(place)
    points = np.column_stack([contour, np.full(len(contour), DEPTH)]) @ R.T + T
    center = R @ [0.0, 0.0, DEPTH] + T
    return points[:, :2] / center[2]


@pytest.mark.parametrize("turn_deg", [-8.0, -1.0, 2.0, 15.0])
@pytest.mark.parametrize("place", [(0.0, 0.0, 3.5), (0.4, 0.05, 1.0), (-1.0, 0.0, -2.0)])
def test_the_closed_form_gives_back_the_motion_of_a_weak_perspective_camera(turn_deg, place):
    contour, turn = board() + np.array([0.2, -0.1]), math.radians(turn_deg)
    motion = motion_of(shape_vector(contour / DEPTH, weak(contour, turn, place)), turn)
    assert motion.rotation[0, 2] == pytest.approx(math.sin(turn), abs=1e-9)
    assert motion.rotation @ motion.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
    assert -motion.rotation.T @ motion.translation * DEPTH == pytest.approx(place, abs=1e-9)


def test_without_shear_a_vehicle_that_does_not_turn_is_told_by_four_numbers():
    contour = board()
    shape = shape_vector(contour / DEPTH, weak(contour, 0.0, (0.3, 0.0, 2.0)), with_shear=False)
    assert shape.shape == (4,)
    assert motion_of(shape, 0.0).translation * DEPTH == pytest.approx((-0.3, 0.0, -2.0), abs=1e-9)


def test_the_shape_matrix_is_that_of_equation_2():
    W = shape_matrix(np.array([[2.0, 3.0]]))
    assert W.tolist() == [[1, 0, 2, 0, 0, 3], [0, 1, 0, 3, 2, 0]]


def test_a_mirrored_contour_is_refused():
    with pytest.raises(ValueError, match="mirrored"):
        motion_of(np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0]), 0.0)


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (board()[:3] / 7.7, "3 points"),
        (np.column_stack([np.linspace(-0.1, 0.1, 20), np.linspace(-0.05, 0.05, 20)]), "is a line"),
        (board() * [1.0, 0.02] / 7.7, "is a line"),
        (board() * 1e-3, "focal lengths in extent"),
    ],
)
def test_degenerate_contours_are_named(points, reason):
    assert reason in why_degenerate(points)
    assert not why_degenerate(board() / 7.7)


def test_derivatives_are_those_of_finite_differences():
    rng = np.random.default_rng(4)
    contour, shared = rng.uniform(-0.1, 0.1, (5, 2)), np.array([0.1, -0.05, 0.03, -0.02])
    motions = np.column_stack([rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.3, 0.3, (3, 3))])
    by_motion, by_contour, by_shared = point_jacobians(contour, shared, motions)
    h = 1e-6

    def slope(change):
        one, other = (
            expected_points(contour + s * change[0], shared + s * change[1], motions + s * change[2]) for s in (h, -h)
        )
        return (one - other) / (2.0 * h)

    none = (np.zeros(2), np.zeros(4), np.zeros(4))
    for i in range(4):
        unit = np.eye(4)[i]
        assert by_motion[..., i] == pytest.approx(slope((none[0], none[1], unit)), abs=1e-8)
        assert by_shared[..., i] == pytest.approx(slope((none[0], unit, none[2])), abs=1e-8)
    for i in range(2):
        assert by_contour[..., i] == pytest.approx(slope((np.eye(2)[i], none[1], none[2])), abs=1e-8)


def test_the_full_model_sees_what_a_pinhole_camera_sees():
    base = drive(4)
    camera = Camera(forward=0.0, left=0.0, yaw=0.0, pitch=0.0, roll=0.0, noise=0.0)
    pixels = seen(base, camera, np.random.default_rng(0)) / camera.focal_length
    c, s = np.cos(base[:, 2]), np.sin(base[:, 2])
    right, ahead = -base[:, 1], base[:, 0]
    T = -np.column_stack([c * right + s * ahead, 0.0 * c, c * ahead - s * right]) / DEPTH
    shared = np.array([camera.slant_across, camera.slant_down, 0.0, 0.0])
    motions = np.column_stack([base[:, 2], T])
    assert expected_points(pixels[0], shared, motions) == pytest.approx(pixels, abs=1e-12)
