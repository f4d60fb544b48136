"""Where a detection of each reflector must lie to be an inlier, as people see it; none of the filter's steps.

With constants considered it is what the filter's own gate is only together with its covariance with them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import ellipse_points
from commission.localization.consider import PER_REFLECTOR, PER_SCANNER
from commission.localization.cross_covariance import columns_of
from commission.localization.estimate import Belief
from commission.localization.observation import innovation_covariances, jacobians, laid_on_the_floor
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState

AT_REST = (0.0, 0.0, 0.0)


def validation_ellipses(
    setup: LocalizerSetup,
    belief: Belief,
    *,
    scanner: int = 0,
    before: FilterState | None = None,
    twist: Sequence[float] | FloatArray = AT_REST,
) -> FloatArray:
    """(N, 2, 2) 1-sigma region [m^2] on the floor in which a scanner is expected to detect each reflector.

    Parameters
    ----------
    setup : map, scanners and noise.
    belief : pose and covariance before the scan.
    scanner : index of the scanner that measures.
    before : state before the scan: its covariance with the considered constants counts. None: there is none.
    twist : velocity of base at the scan [m/s, m/s, rad/s].
    """
    model, centers = setup.observations[scanner], setup.reflectors.centers
    if setup.constants is None:
        white = innovation_covariances(belief, model, centers, setup.survey_sigmas)
        return laid_on_the_floor(belief, model, centers, white)
    with_constants = innovation_covariances(belief, model, centers)
    with_constants += _of_constants(setup, belief, scanner, before, twist)
    return laid_on_the_floor(belief, model, centers, with_constants)


def validation_outlines(setup: LocalizerSetup, ellipses: FloatArray, *, points: int = 48) -> FloatArray:
    """(N, points, 2) outline [m] of the validation gate around each reflector, map frame (the paper's Fig. 12).

    Parameters
    ----------
    setup : map and gate.
    ellipses : (N, 2, 2) `validation_ellipses` of all its reflectors [m^2].
    points : of each outline.
    """
    return ellipse_points(setup.reflectors.centers, ellipses, setup.filter.gate.d2**0.5, points)


def _of_constants(
    setup: LocalizerSetup, belief: Belief, scanner: int, before: FilterState | None, twist: ArrayLike
) -> FloatArray:
    """(N, 2, 2) what the constants add to S: H C J^T + (H C J^T)^T + J P_p J^T, see `consider`."""
    count, known = len(setup.reflectors), setup.uncertainty
    mounting = setup.scanners[scanner].mounting
    H = jacobians(belief.mean, mounting, setup.reflectors.centers)
    c, s = np.cos(belief.mean[2]), np.sin(belief.mean[2])
    J = np.zeros((count, 2, PER_REFLECTOR + PER_SCANNER))
    J[:, :, :2] = -H[:, :, :2]
    J[:, :, 2:4] = H[:, :, :2] @ np.array([[c, -s], [s, c]])
    J[:, 1, 4], J[:, 0, 5] = -1.0, 1.0
    J[:, :, 6] = -np.concatenate((J[:, :, 2:4], H[:, :, 2:]), axis=2) @ np.asarray(twist, dtype=np.float64)
    of_scanner = (
        known.mounting_position,
        known.mounting_position,
        known.mounting_heading,
        known.range_bias,
        known.clock,
    )
    sigmas = np.empty((count, PER_REFLECTOR + PER_SCANNER))
    sigmas[:, :2], sigmas[:, 2:] = setup.survey_sigmas[:, np.newaxis], of_scanner
    S = (J * np.square(sigmas)[:, np.newaxis]) @ np.swapaxes(J, 1, 2)
    columns = columns_of(None if before is None else before.cross, setup.constants)
    if before is None or columns is None:
        return S
    F = np.eye(3)
    F[:2, 2] = before.tracking.pivot[1] - belief.mean[1], belief.mean[0] - before.tracking.pivot[0]
    columns = F @ columns
    C = np.empty((count, 3, PER_REFLECTOR + PER_SCANNER))
    order = setup.index.places[:, 3].astype(np.int64)
    C[order, :, :2] = columns[:, : PER_REFLECTOR * count].reshape(3, count, PER_REFLECTOR).swapaxes(0, 1)
    start = PER_REFLECTOR * count + PER_SCANNER * scanner
    C[:, :, 2:] = columns[:, start : start + PER_SCANNER]
    HCJ = H @ C @ np.swapaxes(J, 1, 2)
    return S + HCJ + np.swapaxes(HCJ, 1, 2)
