"""Uncertainty supervisor (Sobreira et al. 2016, Algorithm 4): says whether the vehicle may drive on this belief.

In fail mode the *output* is withheld while the filter goes on with its own state; were the state withheld too, as a
literal reading of lines 18 and 19 has it, the covariance could never shrink again and the mode never recover.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.localization.estimate import Mode
from commission.localization.pose_gaussian import PoseGaussian
from commission.site.parameters import SupervisorParameters

OPERATIONAL = int(Mode.OPERATIONAL)
FAIL = int(Mode.FAIL)
LOST = int(Mode.LOST)


class SupervisorLimits(NamedTuple):
    """Limits of 2-sigma, for kernels."""

    enabled: bool
    position: float
    heading: float
    recovery_ratio: float


def supervisor_limits(parameters: SupervisorParameters) -> SupervisorLimits:
    """Return Err_p, Err_o and R_B for the kernel."""
    return SupervisorLimits(
        bool(parameters.enabled),
        float(parameters.position_limit),
        float(parameters.heading_limit),
        float(parameters.recovery_ratio),
    )


@compiled_inline
def supervise(mode: int, belief: PoseGaussian, limits: SupervisorLimits) -> int:
    """Mode after a scan.

    Fails when any 2-sigma passes its limit; recovers when all are below their limit divided by R_B, so that the mode
    does not flicker. A covariance that is not a number fails.

    Parameters
    ----------
    mode : before the scan.
    belief : after *correct*.
    limits : Err_p, Err_o and R_B.

    Notes
    -----
    fail if 2 sqrt(P_ii) > Err_i, operational again if all 2 sqrt(P_ii) < Err_i / R_B: Sobreira et al. 2016,
    Algorithm 4, lines 5 and 11.
    """
    if not limits.enabled:
        return OPERATIONAL
    if mode == OPERATIONAL:
        limit_p, limit_o = limits.position, limits.heading
    else:
        limit_p, limit_o = limits.position / limits.recovery_ratio, limits.heading / limits.recovery_ratio
    x, y, heading = 2.0 * math.sqrt(belief.xx), 2.0 * math.sqrt(belief.yy), 2.0 * math.sqrt(belief.tt)
    if mode == OPERATIONAL:
        return OPERATIONAL if x <= limit_p and y <= limit_p and heading <= limit_o else FAIL
    return OPERATIONAL if x < limit_p and y < limit_p and heading < limit_o else FAIL
