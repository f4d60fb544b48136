"""Uncertainty supervisor (Sobreira et al. 2016, Algorithm 4): says whether the vehicle may drive on this belief.

In fail mode the *output* is withheld while the filter goes on with its own state; were the state withheld too, as a
literal reading of lines 18 and 19 has it, the covariance could never shrink again and the mode never recover.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Mode
from commission.localization.pose_gaussian import PoseGaussian, position_variance
from commission.site.parameters import SupervisorParameters

OPERATIONAL = int(Mode.OPERATIONAL)
FAIL = int(Mode.FAIL)
LOST = int(Mode.LOST)
INITIALIZING = int(Mode.INITIALIZING)


class SupervisorLimits(NamedTuple):
    """Limits of 2-sigma, for kernels."""

    enabled: bool
    by_axes: bool
    position: float
    heading: float
    recovery_ratio: float
    find_again: bool = True
    """Whether a lost vehicle is searched for."""


def supervisor_limits(parameters: SupervisorParameters) -> SupervisorLimits:
    """Return Err_p, Err_o and R_B for the kernel."""
    return SupervisorLimits(
        bool(parameters.enabled),
        parameters.position_sigma == "axes",
        float(parameters.position_limit),
        float(parameters.heading_limit),
        float(parameters.recovery_ratio),
        bool(parameters.find_again),
    )


@compiled_inline
def supervise(mode: int, belief: PoseGaussian, limits: SupervisorLimits) -> int:
    """Mode after a scan.

    Fails when a 2-sigma passes its limit; recovers when all are below their limit divided by R_B, so that the mode
    does not flicker. A covariance that is not a number fails.

    Parameters
    ----------
    mode : before the scan.
    belief : after *correct*.
    limits : Err_p, Err_o and R_B.

    Notes
    -----
    fail if 2 sqrt(P_ii) > Err_i, operational again if all 2 sqrt(P_ii) < Err_i / R_B: Sobreira et al. 2016,
    Algorithm 4, lines 5 and 11. The paper takes x and y; along the ellipse's longer axis the position may be 41 % less
    certain than along either, so that by default its largest eigenvalue is taken (the paper's section 6, future work).
    """
    if not limits.enabled:
        return OPERATIONAL
    variance = max(belief.xx, belief.yy) if limits.by_axes else position_variance(belief)
    if not math.isfinite(variance + belief.xx + belief.yy):
        return FAIL
    return judge(mode, 2.0 * math.sqrt(variance), 2.0 * math.sqrt(belief.tt), limits)


@compiled_inline
def judge(mode: int, position: float, heading: float, limits: SupervisorLimits) -> int:
    """Mode after a scan, by what is held against the limits, 2-sigma or protection level.

    Parameters
    ----------
    mode : before the scan.
    position, heading : what is held against them [m], [rad].
    limits : Err_p, Err_o and R_B.

    Notes
    -----
    fail beyond Err, operational again below Err / R_B: Sobreira et al. 2016, Algorithm 4, lines 5 and 11.
    """
    if mode == OPERATIONAL:
        return OPERATIONAL if position <= limits.position and heading <= limits.heading else FAIL
    limit_p, limit_o = limits.position / limits.recovery_ratio, limits.heading / limits.recovery_ratio
    return OPERATIONAL if position < limit_p and heading < limit_o else FAIL


def position_directions(covariances: FloatArray, parameters: SupervisorParameters) -> FloatArray:
    """Directions whose 2-sigma the supervisor holds against its limit of the position.

    Parameters
    ----------
    covariances : (K, 3, 3) of x [m], y [m] and heading [rad].
    parameters : say whether the largest in any direction counts, or the larger one of x and y.

    Returns
    -------
    directions : (K, 2) unit vectors, map frame; along x where all directions are alike.
    """
    xx, xy, yy = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    if parameters.position_sigma == "axes":
        return np.stack((xx >= yy, xx < yy), axis=1).astype(np.float64)
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    return np.stack((np.cos(angle), np.sin(angle)), axis=1)


def position_variances(covariances: FloatArray, directions: FloatArray) -> FloatArray:
    """Variance of the position along a direction each: (K,) array [m^2].

    Parameters
    ----------
    covariances : (K, 3, 3) of x [m], y [m] and heading [rad]; or with further axes before the last two.
    directions : (K, 2) unit vectors, map frame.
    """
    return np.maximum(np.einsum("ki,k...ij,kj->k...", directions, covariances[..., :2, :2], directions), 0.0)


def position_two_sigma(covariances: FloatArray, parameters: SupervisorParameters) -> FloatArray:
    """2-sigma of the position that the supervisor holds against its limit: (K,) array [m].

    Parameters
    ----------
    covariances : (K, 3, 3) of x [m], y [m] and heading [rad].
    parameters : say which one counts.
    """
    xx, xy, yy = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    if parameters.position_sigma == "axes":
        return 2.0 * np.sqrt(np.maximum(np.maximum(xx, yy), 0.0))
    # `larger_eigenvalue`, as the supervisor itself has it: of hours, angles and their directions take long.
    half_difference = 0.5 * (xx - yy)
    largest = 0.5 * (xx + yy) + np.sqrt(half_difference * half_difference + xy * xy)
    return 2.0 * np.sqrt(np.maximum(largest, 0.0))
