"""Filters of other kinds once more, plain and slow: each correction as its paper has it, in numpy matrices.

Oracle; calls none of the package. Derivatives are by differences; motions of the plane are matrix exponentials.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from tests.localization.plain_observation import Array, jacobians, matrix, observed, turned

SMALL_TURN = 2e-3
"""A correction that turns by less is not linearized again [rad]."""


def ekf(mean: Array, cov: Array, z: Array, place: Array, mounting: Array, R: Array) -> tuple[Array, Array]:
    H = jacobians(mean, mounting, place[np.newaxis])[0]
    v = z - observed(mean, mounting, place[np.newaxis])[0]
    v[1] = turned(v[1])
    K = cov @ H.T @ np.linalg.inv(H @ cov @ H.T + R)
    return moved(mean, K @ v), cov - K @ H @ cov


def by_points(
    mean: Array,
    cov: Array,
    z: Array,
    place: Array,
    mounting: Array,
    R: Array,
    *,
    alpha: float,
    beta: float,
    kappa: float,
) -> tuple[Array, Array]:
    """Wan and van der Merwe 2000: scaled unscented transformation; alpha 1, beta 0, kappa 0 is the cubature rule."""
    n = len(mean)
    scale = alpha**2 * (n + kappa)
    root = np.sqrt(scale) * np.linalg.cholesky(cov).T
    points = np.vstack((mean, mean + root, mean - root))
    of_mean = np.full(2 * n + 1, 0.5 / scale)
    of_mean[0] = 1.0 - n / scale
    of_cov = of_mean.copy()
    of_cov[0] += 1.0 - alpha**2 + beta
    seen = np.array([observed(each, mounting, place[np.newaxis])[0] for each in points])
    seen[:, 1] = seen[0, 1] + turned(seen[:, 1] - seen[0, 1])
    expected = of_mean @ seen
    off_z, off_x = seen - expected, points - mean
    S = off_z.T @ (of_cov[:, np.newaxis] * off_z) + R
    K = off_x.T @ (of_cov[:, np.newaxis] * off_z) @ np.linalg.inv(S)
    v = z - expected
    v[1] = turned(v[1])
    return moved(mean, K @ v), cov - K @ S @ K.T


def ukf(*given: Array) -> tuple[Array, Array]:
    return by_points(*given, alpha=1.0, beta=2.0, kappa=0.0)


def ckf(*given: Array) -> tuple[Array, Array]:
    return by_points(*given, alpha=1.0, beta=0.0, kappa=0.0)


def hat(xi: Array) -> Array:
    return np.array([[0.0, -xi[2], xi[0]], [xi[2], 0.0, xi[1]], [0.0, 0.0, 0.0]])


def adjoint(T: Array) -> Array:
    """Ad of a motion for twists (x, y, turn): T hat(xi) T^-1, column by column."""
    columns = [T @ hat(unit) @ np.linalg.inv(T) for unit in np.eye(3)]
    return np.array([[each[0, 2], each[1, 2], each[1, 0]] for each in columns]).T


def invariant(mean: Array, cov: Array, z: Array, place: Array, mounting: Array, R: Array) -> tuple[Array, Array]:
    """Barrau and Bonnabel 2017 with errors about the origin of the map, X = exp(xi) X', Gauss-Newton."""
    about_mean = adjoint(matrix(np.array([*mean[:2], 0.0])))
    P = about_mean @ cov @ about_mean.T
    start, xi = matrix(mean), np.zeros(3)
    local = matrix(mounting) @ np.array([z[0] * np.cos(z[1]), z[0] * np.sin(z[1]), 1.0])
    home = np.array([*place, 1.0])
    for _ in range(8):
        X = expm(hat(xi)) @ start
        ray = X @ matrix(mounting) @ np.array([np.cos(z[1]), np.sin(z[1]), 0.0])
        axes = np.array([ray[:2], np.array([-ray[1], ray[0]]) / z[0]])

        def lands(step: Array, X: Array = X, axes: Array = axes) -> Array:
            # The place of the reflector moves against the pose: its derivative is at the place, of any pose.
            return axes @ ((X @ local) - expm(hat(step)) @ home)[:2]

        v = lands(np.zeros(3))
        H = np.array([(lands(s) - lands(-s)) / 2e-6 for s in 1e-6 * np.eye(3)]).T
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        before, xi = xi, K @ (v + H @ xi)
        if abs(xi[2] - before[2]) < SMALL_TURN:
            break
    X = expm(hat(xi)) @ start
    after = np.array([X[0, 2], X[1, 2], np.arctan2(X[1, 0], X[0, 0])])
    back = np.linalg.inv(adjoint(matrix(np.array([*after[:2], 0.0]))))
    return after, back @ (P - K @ H @ P) @ back.T


def moved(mean: Array, step: Array) -> Array:
    after = mean + step
    after[2] = turned(after[2])
    return after


KINDS = {"ekf": ekf, "ukf": ukf, "ckf": ckf, "invariant": invariant}
