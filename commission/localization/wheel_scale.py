"""What odometry should have said: displacements of wheels whose scale is known better than the vehicle knows it.

Live and whole runs correct every record here before anything else reads it. No noise and no belief in here.
"""

from __future__ import annotations

import numpy as np

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray, read_only
from commission.geometry.se2 import exp_scalars, log_scalars
from commission.site.parameters import OdometryParameters


def as_driven(displacements: FloatArray, parameters: OdometryParameters) -> FloatArray:
    """Displacements of base, of those that odometry reports.

    Parameters
    ----------
    displacements : (M, 3) motion since the row before [m, m, rad], in base of the row before.
    parameters : scale of way and turn, and turn with the way.

    Returns
    -------
    driven : (M, 3) [m, m, rad]; the same array where nothing is to be corrected.

    Notes
    -----
    exp((1 + a) f, (1 + a) l, (1 + b) w + c f) of the twist (f, l, w) = log(displacement), derived: to first order all
    errors of two wheels are of this form.
    """
    scales = parameters.forward_scale, parameters.turn_scale, parameters.turn_per_m
    if not any(scales):
        return displacements
    driven = np.empty((len(displacements), 3))
    _scale(read_only(displacements), *scales, driven)
    return read_only(driven)


@compiled
def _scale(
    displacements: FloatArray, forward_scale: float, turn_scale: float, turn_per_m: float, driven: FloatArray
) -> None:
    """Write `as_driven` of displacements.

    Parameters
    ----------
    displacements : (M, 3) as reported [m, m, rad].
    forward_scale, turn_scale : shares by which way and turn are larger.
    turn_per_m : turn with the way [rad/m].
    driven : (M, 3) output.

    Notes
    -----
    No formula: that of `as_driven`.
    """
    for row in range(len(displacements)):
        forward, left, turn = log_scalars(displacements[row, 0], displacements[row, 1], displacements[row, 2])
        driven[row, 0], driven[row, 1], driven[row, 2] = exp_scalars(
            (1.0 + forward_scale) * forward,
            (1.0 + forward_scale) * left,
            (1.0 + turn_scale) * turn + turn_per_m * forward,
        )
