"""The belief as nine scalars, the form in which kernels hand it to each other. Users see `estimate.Belief`.

Only the upper triangle of the covariance exists, so that it is symmetric by construction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Belief


class PoseGaussian(NamedTuple):
    """A Gaussian over `T_map_base`: mean, then the upper triangle of its covariance."""

    x: float
    y: float
    theta: float
    xx: float
    xy: float
    xt: float
    yy: float
    yt: float
    tt: float


@compiled_inline
def position_variance(pose: PoseGaussian) -> float:
    """Largest variance of the position, along whichever direction it lies [m^2].

    Parameters
    ----------
    pose : its covariance.

    Notes
    -----
    No formula: `larger_eigenvalue` of the position's covariance.
    """
    return larger_eigenvalue(pose.xx, pose.xy, pose.yy)


@compiled_inline
def larger_eigenvalue(xx: float, xy: float, yy: float) -> float:
    """Larger eigenvalue of [[xx, xy], [xy, yy]].

    Parameters
    ----------
    xx, xy, yy : elements of a symmetric matrix.

    Notes
    -----
    (xx + yy) / 2 + sqrt(((xx - yy) / 2)^2 + xy^2), by definition.
    """
    half_difference = 0.5 * (xx - yy)
    return 0.5 * (xx + yy) + math.sqrt(half_difference * half_difference + xy * xy)


@compiled_inline
def pose_in(row: FloatArray) -> PoseGaussian:
    """Pose that stands in a row.

    Parameters
    ----------
    row : (9,) x, y, theta, xx, xy, xt, yy, yt, tt.

    Notes
    -----
    No formula: it reads numbers.
    """
    return PoseGaussian(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])


@compiled_inline
def write_pose(row: FloatArray, p: PoseGaussian) -> None:
    """Write a pose to a row.

    Parameters
    ----------
    row : (9,) out, see `pose_in`.
    p : pose.

    Notes
    -----
    No formula: it writes numbers.
    """
    row[0], row[1], row[2] = p.x, p.y, p.theta
    row[3], row[4], row[5], row[6], row[7], row[8] = p.xx, p.xy, p.xt, p.yy, p.yt, p.tt


def from_belief(belief: Belief) -> PoseGaussian:
    """Return the scalars of a belief; raises ValueError when its arrays are no pose and covariance."""
    mean, cov = np.asarray(belief.mean, dtype=np.float64), np.asarray(belief.covariance, dtype=np.float64)
    if mean.shape != (3,) or cov.shape != (3, 3) or not (np.isfinite(mean).all() and np.isfinite(cov).all()):
        raise ValueError(f"belief has mean {mean} and covariance {cov}; expected finite (3,) and (3, 3)")
    upper = (cov[0, 0], cov[0, 1], cov[0, 2], cov[1, 1], cov[1, 2], cov[2, 2])
    return PoseGaussian(*(float(value) for value in (*mean, *upper)))


def mean_of(pose: PoseGaussian) -> FloatArray:
    """(3,) mean, read-only."""
    mean = np.array((pose.x, pose.y, pose.theta))
    mean.setflags(write=False)
    return mean


def covariance_of(pose: PoseGaussian) -> FloatArray:
    """(3, 3) covariance, read-only."""
    cov = np.array(
        (
            (pose.xx, pose.xy, pose.xt),
            (pose.xy, pose.yy, pose.yt),
            (pose.xt, pose.yt, pose.tt),
        )
    )
    cov.setflags(write=False)
    return cov


def to_belief(pose: PoseGaussian, stamp_ns: int) -> Belief:
    """Return the belief about a stamp."""
    return Belief(stamp_ns, mean_of(pose), covariance_of(pose))
