"""Equation 2 once more, plain and slow: numpy matrices, derivatives by differences. Oracle; calls none of the package.

A pose and the `mounting` of the scanner in the base frame are [x, y, theta]; `places` are (N, 2) points in the map.
"""

from __future__ import annotations

import math

import numpy as np

Array = np.ndarray


def matrix(pose: Array) -> Array:
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.array([[c, -s, pose[0]], [s, c, pose[1]], [0.0, 0.0, 1.0]])


def turned(angle: Array) -> Array:
    return np.arctan2(np.sin(angle), np.cos(angle))


def observed(pose: Array, mounting: Array, places: Array) -> Array:
    """(N, 2) range and bearing of each place."""
    in_map = np.column_stack((places, np.ones(len(places))))
    x, y, _ = np.linalg.inv(matrix(pose) @ matrix(mounting)) @ in_map.T
    return np.column_stack((np.hypot(x, y), np.arctan2(y, x)))


def innovations(pose: Array, mounting: Array, places: Array, measured: Array) -> Array:
    """(N, 2) measured range and bearing minus those expected of each place."""
    v = measured - observed(pose, mounting, places)
    return np.column_stack((v[:, 0], turned(v[:, 1])))


def jacobians(pose: Array, mounting: Array, places: Array) -> Array:
    """(N, 2, 3) central differences: independent of the analytic ones, good to about 1e-10."""
    columns = []
    for step in 1e-5 * np.eye(3):
        ahead, behind = observed(pose + step, mounting, places), observed(pose - step, mounting, places)
        columns.append(np.column_stack((ahead[:, 0] - behind[:, 0], turned(ahead[:, 1] - behind[:, 1]))) / 2e-5)
    return np.stack(columns, axis=2)


def noises(sigmas: tuple[float, float], surveyed: Array, ranges: Array) -> Array:
    """(N, 2, 2) R [m^2, rad^2] of reflectors whose places are known to 1-sigma `surveyed` [m] each axis."""
    R = np.zeros((len(ranges), 2, 2))
    R[:, 0, 0] = sigmas[0] ** 2 + np.square(surveyed)
    R[:, 1, 1] = sigmas[1] ** 2 + np.square(surveyed / ranges)
    return R


def innovation_covariances(
    pose: Array, cov: Array, mounting: Array, places: Array, sigmas: tuple[float, float], surveyed: Array | float = 0.0
) -> Array:
    """(N, 2, 2) S of Algorithm 1, line 8."""
    H = jacobians(pose, mounting, places)
    return H @ cov @ H.transpose(0, 2, 1) + noises(sigmas, surveyed, observed(pose, mounting, places)[:, 0])


def log_likelihoods(v: Array, S: Array) -> tuple[Array, Array]:
    """(N,) squared Mahalanobis distances, and ln of the density (Algorithm 3, line 4, with its power -1/2)."""
    d2 = np.sum(v * np.linalg.solve(S, v[..., np.newaxis])[..., 0], axis=-1)
    return d2, -0.5 * d2 - 0.5 * np.linalg.slogdet(2.0 * math.pi * S)[1]
