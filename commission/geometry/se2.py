"""Rigid motions of the plane as arrays [x, y, theta]: `T_a_b` is the pose of frame b in frame a.

Neighbors cancel when composed: `T_a_c = compose(T_a_b, T_b_c)`. There is no pose class; covariances live elsewhere.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from commission.compiled import compiled
from commission.geometry.angles import wrap, wrap_scalar
from commission.geometry.arrays import FloatArray

# Below this angle the series of sin(w)/w and of its inverse, cut after w^4, are exact to the last bit: the first
# term left out is w^6 / 5040 < 2e-22.
SMALL_ANGLE = 1e-3


def compose(T_a_b: ArrayLike, T_b_c: ArrayLike) -> FloatArray:
    """Pose of c in a.

    Parameters
    ----------
    T_a_b, T_b_c : (..., 3) arrays [m, m, rad] that broadcast against each other.

    Returns
    -------
    T_a_c : (..., 3) array [m, m, rad], heading in [-pi, pi).
    """
    ab, bc = _poses(T_a_b), _poses(T_b_c)
    xy = transform_points(ab, bc[..., :2])
    ac = np.empty((*xy.shape[:-1], 3))
    ac[..., :2], ac[..., 2] = xy, wrap(ab[..., 2] + bc[..., 2])
    return ac


def inverse(T_a_b: ArrayLike) -> FloatArray:
    """Pose of a in b.

    Parameters
    ----------
    T_a_b : (..., 3) array [m, m, rad].

    Returns
    -------
    T_b_a : (..., 3) array [m, m, rad], heading in [-pi, pi).
    """
    ab = _poses(T_a_b)
    x, y, theta = ab[..., 0], ab[..., 1], ab[..., 2]
    c, s = np.cos(theta), np.sin(theta)
    return np.stack((-(c * x + s * y), s * x - c * y, wrap(-theta)), axis=-1)


def relative(T_a_b: ArrayLike, T_a_c: ArrayLike) -> FloatArray:
    """Pose of c in b, from the poses of both in a.

    Subtracts before it rotates, so two close poses far from the origin keep their digits.

    Parameters
    ----------
    T_a_b, T_a_c : (..., 3) arrays [m, m, rad] that broadcast against each other.

    Returns
    -------
    T_b_c : (..., 3) array [m, m, rad], heading in [-pi, pi).
    """
    ab, ac = _poses(T_a_b), _poses(T_a_c)
    delta = ac - ab
    c, s = np.cos(ab[..., 2]), np.sin(ab[..., 2])
    dx, dy = delta[..., 0], delta[..., 1]
    return np.stack((c * dx + s * dy, c * dy - s * dx, wrap(delta[..., 2])), axis=-1)


def transform_points(T_a_b: ArrayLike, points_b: ArrayLike) -> FloatArray:
    """Points given in b, expressed in a.

    Parameters
    ----------
    T_a_b : (..., 3) array [m, m, rad].
    points_b : (..., 2) array [m], frame b; leading axes broadcast against those of `T_a_b`. For all pairs of M poses
        and N points, pass `T_a_b[:, np.newaxis]`.

    Returns
    -------
    points_a : (..., 2) array [m], frame a.
    """
    ab, points = _poses(T_a_b), np.asarray(points_b, dtype=np.float64)
    if points.ndim == 0 or points.shape[-1] != 2:
        raise ValueError(f"points have shape {points.shape}; expected (..., 2)")
    c, s = np.cos(ab[..., 2]), np.sin(ab[..., 2])
    px, py = points[..., 0], points[..., 1]
    x, y = ab[..., 0] + (c * px - s * py), ab[..., 1] + (s * px + c * py)
    points_a = np.empty((*np.shape(x), 2))
    points_a[..., 0], points_a[..., 1] = x, y
    return points_a


def exp(twist: ArrayLike) -> FloatArray:
    """Pose reached from the origin by moving one second at a constant twist: an arc, or a straight line.

    Parameters
    ----------
    twist : (..., 3) array [m, m, rad]: forward, left, turn.

    Returns
    -------
    pose : (..., 3) array [m, m, rad], heading in [-pi, pi).

    Notes
    -----
    Solà, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, equations 156 and 158.
    """
    given = _poses(twist)
    vx, vy, w = given[..., 0], given[..., 1], given[..., 2]
    small = np.abs(w) < SMALL_ANGLE
    safe = np.where(small, 1.0, w)
    w2 = w * w
    along = np.where(small, 1.0 - w2 / 6.0 * (1.0 - w2 / 20.0), np.sin(w) / safe)
    # 1 - cos(w) as 2 sin^2(w / 2): no cancellation.
    half_sin = np.sin(0.5 * w)
    across = np.where(small, w * (0.5 - w2 / 24.0), 2.0 * half_sin * half_sin / safe)
    return np.stack((along * vx - across * vy, across * vx + along * vy, wrap(w)), axis=-1)


def log(pose: ArrayLike) -> FloatArray:
    """Twist that reaches a pose in one second: the inverse of `exp` for turns in [-pi, pi).

    Parameters
    ----------
    pose : (..., 3) array [m, m, rad].

    Returns
    -------
    twist : (..., 3) array [m, m, rad]: forward, left, turn.

    Notes
    -----
    Solà, Deray, Atchuthan 2018, equation 157, with the inverse of V written by w/2 cot(w/2).
    """
    given = _poses(pose)
    x, y, w = given[..., 0], given[..., 1], wrap(given[..., 2])
    small = np.abs(w) < SMALL_ANGLE
    w2 = w * w
    half = 0.5 * w
    cotangent = np.where(small, 1.0 - w2 / 12.0 * (1.0 + w2 / 60.0), half / np.tan(np.where(small, 1.0, half)))
    return np.stack((cotangent * x + half * y, cotangent * y - half * x, w), axis=-1)


@compiled
def compose_scalars(  # noqa: PLR0917 - two poses, number by number
    x: float, y: float, t: float, dx: float, dy: float, dt: float
) -> tuple[float, float, float]:
    """Pose of c in a from the six numbers of T_a_b and T_b_c: `compose` for kernels.

    Parameters
    ----------
    x, y, t : T_a_b [m, m, rad].
    dx, dy, dt : T_b_c [m, m, rad].

    Notes
    -----
    (p + R(t) d, wrap(t + dt)) with R the rotation matrix: the product of the two homogeneous matrices, by definition.
    """
    c, s = math.cos(t), math.sin(t)
    return x + (c * dx - s * dy), y + (s * dx + c * dy), wrap_scalar(t + dt)


@compiled
def inverse_scalars(x: float, y: float, t: float) -> tuple[float, float, float]:
    """Pose of a in b from the three numbers of T_a_b: `inverse` for kernels.

    Parameters
    ----------
    x, y, t : T_a_b [m, m, rad].

    Notes
    -----
    (-R(t)^T p, wrap(-t)): the inverse of the homogeneous matrix, by definition.
    """
    c, s = math.cos(t), math.sin(t)
    return -(c * x + s * y), s * x - c * y, wrap_scalar(-t)


@compiled
def exp_scalars(vx: float, vy: float, w: float) -> tuple[float, float, float]:
    """Pose reached by a constant twist for one second: `exp` for kernels.

    Parameters
    ----------
    vx, vy, w : forward, left, turn [m, m, rad].

    Notes
    -----
    (V(w) v, wrap(w)) with V = [[sin w, cos w - 1], [1 - cos w, sin w]] / w: Solà et al. 2018, equations 156 and 158.
    """
    if abs(w) < SMALL_ANGLE:
        w2 = w * w
        along = 1.0 - w2 / 6.0 * (1.0 - w2 / 20.0)
        across = w * (0.5 - w2 / 24.0)
    else:
        half_sin = math.sin(0.5 * w)
        along = math.sin(w) / w
        across = 2.0 * half_sin * half_sin / w
    return along * vx - across * vy, across * vx + along * vy, wrap_scalar(w)


@compiled
def log_scalars(x: float, y: float, t: float) -> tuple[float, float, float]:
    """Twist that reaches a pose in one second: `log` for kernels.

    Parameters
    ----------
    x, y, t : pose [m, m, rad].

    Notes
    -----
    (V(w)^-1 p, w) with w = wrap(t) and V^-1 = w/2 [[cot w/2, 1], [-1, cot w/2]]: Solà et al. 2018, equation 157.
    """
    w = wrap_scalar(t)
    half = 0.5 * w
    if abs(w) < 0.1:
        # The first term left out is w^10 / 47900160 < 3e-18.
        w2 = w * w
        cotangent = 1.0 - w2 * (1.0 / 12.0 + w2 * (1.0 / 720.0 + w2 * (1.0 / 30240.0 + w2 * (1.0 / 1209600.0))))
    else:
        cotangent = half / math.tan(half)
    return cotangent * x + half * y, cotangent * y - half * x, w


def warm_up() -> None:
    """Compile the kernels of this module."""
    compose_scalars(0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    inverse_scalars(1.0, 0.0, 0.0)
    exp_scalars(1.0, 0.0, 0.1)
    log_scalars(1.0, 0.0, 0.1)


def _poses(poses: ArrayLike) -> FloatArray:
    """View as float64 whose last axis is [x, y, theta]."""
    array = np.asarray(poses, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"poses have shape {array.shape}; expected (..., 3)")
    return array
