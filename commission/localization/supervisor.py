"""Uncertainty supervisor (Sobreira et al. 2016, Algorithm 4): says whether the vehicle may drive on this belief.

In fail mode the *output* is withheld while the filter goes on with its own state; were the state withheld too, as a
literal reading of lines 18 and 19 has it, the covariance could never shrink again and the mode never recover.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.localization.estimate import Mode
from commission.localization.pose_gaussian import PoseGaussian, position_variance
from commission.site.parameters import SupervisorParameters

OPERATIONAL = int(Mode.OPERATIONAL)
FAIL = int(Mode.FAIL)
LOST = int(Mode.LOST)


class SupervisorLimits(NamedTuple):
    """Limits of 2-sigma, for kernels."""

    enabled: bool
    by_axes: bool
    position: float
    heading: float
    recovery_ratio: float


def supervisor_limits(parameters: SupervisorParameters) -> SupervisorLimits:
    """Return Err_p, Err_o and R_B for the kernel."""
    return SupervisorLimits(
        bool(parameters.enabled),
        parameters.position_sigma == "axes",
        float(parameters.position_limit),
        float(parameters.heading_limit),
        float(parameters.recovery_ratio),
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
    position, heading = 2.0 * math.sqrt(variance), 2.0 * math.sqrt(belief.tt)
    if mode == OPERATIONAL:
        return OPERATIONAL if position <= limits.position and heading <= limits.heading else FAIL
    limit_p, limit_o = limits.position / limits.recovery_ratio, limits.heading / limits.recovery_ratio
    return OPERATIONAL if position < limit_p and heading < limit_o else FAIL
