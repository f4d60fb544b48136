"""Gaussian regions of the plane and of innovations: gates, distances, ellipses. No filter and no drawing in here."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammainc, gammaincinv  # pyright: ignore[reportMissingTypeStubs]

from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray


def chi_square_gate(probability: float, dof: int) -> float:
    """Squared Mahalanobis distance below which a Gaussian vector lies with the given probability.

    Parameters
    ----------
    probability : strictly between 0 and 1.
    dof : degrees of freedom, at least 1.

    Returns
    -------
    gate : quantile of the chi-square distribution; chi_square_gate(0.95, 2) = 5.991.

    Notes
    -----
    Inverse of the regularized gamma function; `scipy.stats` gives the same and takes a second to import.
    """
    if not 0.0 < probability < 1.0:
        raise ValueError(f"gate probability is {probability}; expected a number between 0 and 1, both excluded")
    if dof < 1:
        raise ValueError(f"degrees of freedom is {dof}; expected at least 1")
    return 2.0 * float(gammaincinv(0.5 * dof, probability))


def truncated_chi_square_mean(gate: float, dof: int) -> float:
    """Mean of a squared Mahalanobis distance of those Gaussian vectors that lie inside a gate.

    Parameters
    ----------
    gate : largest squared Mahalanobis distance that passes, more than 0; infinite without a gate.
    dof : degrees of freedom, at least 1.

    Returns
    -------
    mean : 1.685 for two degrees of freedom and the gate of 95 %; `dof` without a gate.

    Notes
    -----
    With F_n the chi-square distribution, x f_n(x) = n f_n+2(x), so that E[x | x < g] = n F_n+2(g) / F_n(g). For n = 2:
    2 - g e^(-g/2) / (1 - e^(-g/2)).
    """
    if not gate > 0.0:
        raise ValueError(f"gate is {gate}; expected more than 0")
    if math.isinf(gate):
        return float(dof)
    return dof * float(gammainc(0.5 * dof + 1.0, 0.5 * gate)) / float(gammainc(0.5 * dof, 0.5 * gate))


def mahalanobis_squared(deviations: ArrayLike, covariances: ArrayLike) -> FloatArray:
    """Squared Mahalanobis distance d^T S^-1 d, by solving and not inverting.

    Parameters
    ----------
    deviations : (..., n) array; angles already wrapped.
    covariances : (..., n, n) array, positive definite; leading axes broadcast.

    Returns
    -------
    d2 : (...) array.

    Raises
    ------
    numpy.linalg.LinAlgError
        when a covariance is singular.
    """
    d = np.asarray(deviations, dtype=np.float64)
    solved = np.linalg.solve(np.asarray(covariances, dtype=np.float64), d[..., np.newaxis])
    return np.einsum("...i,...i->...", d, solved[..., 0])


def ellipse_axes(covariances: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Semi-axes of the 1-sigma ellipse and direction of the longer one.

    Parameters
    ----------
    covariances : (..., 2, 2) array [m^2], symmetric positive semi-definite.

    Returns
    -------
    semi_axes : (..., 2) array [m], longer first; zero along a direction without spread.
    angle : (...) array [rad] in [-pi/2, pi/2); 0 for a circle.
    """
    cov = np.asarray(covariances, dtype=np.float64)
    if cov.shape[-2:] != (2, 2):
        raise ValueError(f"covariances have shape {cov.shape}; expected (..., 2, 2)")
    half_sum = 0.5 * (cov[..., 0, 0] + cov[..., 1, 1])
    half_difference = 0.5 * (cov[..., 0, 0] - cov[..., 1, 1])
    covariance_xy = 0.5 * (cov[..., 0, 1] + cov[..., 1, 0])
    spread = np.hypot(half_difference, covariance_xy)
    variances = np.stack((half_sum + spread, half_sum - spread), axis=-1)
    # Rounding makes the smaller eigenvalue of a flat ellipse slightly negative.
    semi_axes = np.sqrt(np.maximum(variances, 0.0))
    return semi_axes, 0.5 * wrap(np.arctan2(covariance_xy, half_difference))


def ellipse_points(centers: ArrayLike, covariances: ArrayLike, scale: ArrayLike = 1.0, n: int = 48) -> FloatArray:
    """Outlines of confidence ellipses as closed polygons (the first point is not repeated).

    Parameters
    ----------
    centers : (N, 2) array [m].
    covariances : (N, 2, 2) array [m^2], same frame.
    scale : number of sigmas, one for all or (N,); for a gate it is `sqrt(chi_square_gate(p, 2))`.
    n : points on each outline, at least 3.

    Returns
    -------
    points : (N, n, 2) array [m], counterclockwise from the end of the longer axis.
    """
    if n < 3:
        raise ValueError(f"an outline of {n} points was asked for; expected at least 3")
    mid = np.asarray(centers, dtype=np.float64)
    semi_axes, angle = ellipse_axes(covariances)
    radii = semi_axes * np.asarray(scale, dtype=np.float64)[..., np.newaxis]
    turn = np.arange(n) * (2.0 * math.pi / n)
    along = radii[:, 0, np.newaxis] * np.cos(turn)
    across = radii[:, 1, np.newaxis] * np.sin(turn)
    c, s = np.cos(angle)[:, np.newaxis], np.sin(angle)[:, np.newaxis]
    return mid[:, np.newaxis] + np.stack((c * along - s * across, s * along + c * across), axis=-1)
