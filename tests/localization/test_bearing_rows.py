"""Bearings alone: derivatives by finite differences, correction by matrices, evolution by the paper's integrals."""

import math

import numpy as np
import pytest

from commission.geometry.gaussian import chi_square_gate
from commission.localization.bearing_rows import bearing_row, correct_by_bearing, row_nis, whose
from commission.localization.dynamic_triangulation import evolve
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, mean_of
from commission.localization.triangulation import intersect_circles, most_informative
from tests.conftest import REPOSITORY

MODEL = ObservationModel(0.3, -0.1, 0.2, math.inf, 1e-4**2, 0.0)
BELIEF = PoseGaussian(1.0, 2.0, 0.7, 4e-4, 1e-5, 2e-5, 3e-4, -1e-5, 1e-4)


def expected(pose, x, y):
    c, s = math.cos(pose[2]), math.sin(pose[2])
    sx, sy = pose[0] + c * 0.3 + s * 0.1, pose[1] + s * 0.3 - c * 0.1
    return math.atan2(y - sy, x - sx) - pose[2] - 0.2


def test_a_row_is_the_derivative_of_the_expected_bearing():
    row = bearing_row(BELIEF, 0.1, 4.0, -3.0, 0.01**2, MODEL)
    pose, h = np.array([1.0, 2.0, 0.7]), 1e-6
    slopes = [(expected(pose + d, 4.0, -3.0) - expected(pose - d, 4.0, -3.0)) / (2 * h) for d in h * np.eye(3)]
    assert (row.x, row.y, row.theta) == pytest.approx(slopes, abs=1e-8)
    off = 0.1 - expected(pose, 4.0, -3.0)
    assert row.residual == pytest.approx(math.atan2(math.sin(off), math.cos(off)))


def test_the_correction_is_that_of_matrices():
    row = bearing_row(BELIEF, expected((1.0, 2.0, 0.7), 4.0, -3.0) + 0.01, 4.0, -3.0, 0.0, MODEL)
    after, nis = correct_by_bearing(BELIEF, row)
    H, P = np.array([[row.x, row.y, row.theta]]), covariance_of(BELIEF)
    S = H @ P @ H.T + row.variance
    K = P @ H.T / S
    assert mean_of(after) == pytest.approx(mean_of(BELIEF) + K[:, 0] * row.residual, abs=1e-12)
    assert covariance_of(after) == pytest.approx((np.eye(3) - K @ H) @ P, abs=1e-12)
    assert nis == pytest.approx(row.residual**2 / S[0, 0]) == pytest.approx(row_nis(BELIEF, row))


def test_a_bearing_without_a_name_is_of_the_only_landmark_in_its_direction():
    gate = chi_square_gate(0.99, 1)
    landmarks = np.array([[6.0, 2.0, 0.0], [9.0, 2.0, 0.0], [1.0, 8.0, 0.0]])
    sharp = PoseGaussian(0.0, 2.1, -0.2, 1e-6, 0.0, 0.0, 1e-6, 0.0, 1e-6)
    assert whose(sharp, expected((0.0, 2.1, -0.2), 1.0, 8.0), landmarks, gate, 30.0, MODEL) == 2
    assert whose(sharp, 3.0, landmarks, gate, 30.0, MODEL) == -1
    wide = sharp._replace(tt=1.0)
    assert whose(wide, expected((0.0, 2.1, -0.2), 6.0, 2.0), landmarks, gate, 30.0, MODEL) == -1
    assert whose(sharp, expected((0.0, 2.1, -0.2), 1.0, 8.0), landmarks, gate, 3.0, MODEL) == -1


def test_evolution_is_the_papers_integral():
    v1, v2, turn, seconds = 1.0, -0.2, 0.4, 0.5
    rho, theta, steps = 3.0, 0.8, 200_000
    for _ in range(steps):
        dt = seconds / steps
        rho, theta = (
            rho - (v1 * math.cos(theta) + v2 * math.sin(theta)) * dt,
            theta + ((v1 * math.sin(theta) - v2 * math.cos(theta)) / rho - turn) * dt,
        )
    ranges, bearings = np.array([3.0]), np.array([0.8])
    for _ in range(1000):
        evolve(ranges, bearings, v1 * seconds / 1000, v2 * seconds / 1000, turn * seconds / 1000)
    assert ranges[0] == pytest.approx(rho, abs=2e-3)
    assert bearings[0] == pytest.approx(theta, abs=2e-3)


def test_a_real_goniometer_is_triangulated_as_well_as_its_bearings_are():
    folder = REPOSITORY.parent / "shared" / "data" / "goniometer"
    if not folder.exists():
        pytest.skip("the recordings of a real goniometer are not here")
    marks = np.loadtxt(folder / "landmark.csv", delimiter=",")
    for path in sorted(folder.glob("X*_Y*.csv")):
        place, facing = np.array([float(path.stem[1:4]), float(path.stem[6:9])]), math.pi / 2
        three, _ = most_informative(marks - place, np.ones(4))
        d = marks[three] - place
        H = np.column_stack([d[:, 1], -d[:, 0], -np.square(d).sum(axis=1)]) / np.square(d).sum(axis=1)[:, np.newaxis]
        fixes, linear = [], []
        for row in np.radians(np.loadtxt(path, delimiter=","))[:, three]:
            fix = intersect_circles(marks[three], row)
            fixes.append((fix.x - place[0], fix.y - place[1]))
            off = row - (np.arctan2(d[:, 1], d[:, 0]) - facing)
            linear.append(np.linalg.solve(H, np.arctan2(np.sin(off), np.cos(off)))[:2])
        away = np.linalg.norm(fixes, axis=1)
        # Its bearings are off by degrees, and fixes by what that makes to first order.
        assert np.median(away) < 0.2
        assert np.median(np.linalg.norm(np.subtract(fixes, linear), axis=1)) < 0.25 * np.median(away)
