"""A bearing alone as a row of the filter: residual, Jacobian, variance; correction, NIS, whose it is."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.localization.observation import ObservationModel, expect, scanner_offset
from commission.localization.pose_gaussian import PoseGaussian


class BearingRow(NamedTuple):
    """One row: how far a measured bearing is from the one expected of a landmark."""

    residual: float
    """Measured less expected, wrapped [rad]."""
    x: float
    """Jacobian of the expected bearing with respect to x, y and heading of base."""
    y: float
    theta: float
    variance: float
    """Of bearing and landmark together [rad^2]."""


class BearingCorrection(NamedTuple):
    """A belief after a row, and the row's NIS before it."""

    belief: PoseGaussian
    nis: float


@compiled
def bearing_row(  # noqa: PLR0917 - a bearing and a landmark, number by number
    belief: PoseGaussian, bearing: float, x: float, y: float, surveyed_variance: float, model: ObservationModel
) -> BearingRow:
    """Row of a bearing of one landmark.

    Parameters
    ----------
    belief : before it.
    bearing : measured [rad], scanner frame.
    x, y, surveyed_variance : the landmark [m], map frame, and the variance of its place, each axis [m^2].
    model : mounting of the scanner and variance of its bearings.

    Notes
    -----
    Bearing and its Jacobian of Sobreira et al. 2016, equation 2; a place that is off by s turns it by s / range.
    """
    offset_x, offset_y = scanner_offset(belief.theta, model)
    e = expect(belief.x, belief.y, belief.theta, offset_x, offset_y, x, y, model.mount_theta)
    square = max(e.range * e.range, 1e-6)
    variance = model.bearing_variance + surveyed_variance / square
    return BearingRow(wrap_scalar(bearing - e.bearing), e.bearing_x, e.bearing_y, e.bearing_theta, variance)


@compiled
def row_nis(belief: PoseGaussian, row: BearingRow) -> float:
    """NIS of a row, with one degree of freedom.

    Parameters
    ----------
    belief : before it.
    row : of the bearing.

    Notes
    -----
    v^2 / (H P H^T + R), by definition.
    """
    px, py, pt = _spread(belief, row)
    return row.residual * row.residual / (row.x * px + row.y * py + row.theta * pt + row.variance)


@compiled
def correct_by_bearing(belief: PoseGaussian, row: BearingRow) -> BearingCorrection:
    """Correct a belief by a row.

    Parameters
    ----------
    belief : before it.
    row : of the bearing.

    Notes
    -----
    K = P H^T / S, P' = P - K S K^T in Joseph's form of one row: (I - K H) P (I - K H)^T + K R K^T (Bar-Shalom, Li,
    Kirubarajan 2001, equation 5.2.3-18).
    """
    P = np.array(
        ((belief.xx, belief.xy, belief.xt), (belief.xy, belief.yy, belief.yt), (belief.xt, belief.yt, belief.tt))
    )
    H = np.array((row.x, row.y, row.theta))
    PH = np.zeros(3)
    for i in range(3):
        for j in range(3):
            PH[i] += P[i, j] * H[j]
    S = H[0] * PH[0] + H[1] * PH[1] + H[2] * PH[2] + row.variance
    K = PH / S
    M = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            M[i, j] = P[i, j] - K[i] * PH[j]
    MH = np.zeros(3)
    for i in range(3):
        for j in range(3):
            MH[i] += M[i, j] * H[j]
    for i in range(3):
        for j in range(3):
            P[i, j] = M[i, j] - MH[i] * K[j] + row.variance * K[i] * K[j]
    v = row.residual
    after = PoseGaussian(
        belief.x + K[0] * v,
        belief.y + K[1] * v,
        wrap_scalar(belief.theta + K[2] * v),
        P[0, 0],
        0.5 * (P[0, 1] + P[1, 0]),
        0.5 * (P[0, 2] + P[2, 0]),
        P[1, 1],
        0.5 * (P[1, 2] + P[2, 1]),
        P[2, 2],
    )
    return BearingCorrection(after, v * v / S)


@compiled
def whose(  # noqa: PLR0917 - a bearing and the map
    belief: PoseGaussian, bearing: float, landmarks: FloatArray, gate: float, reach: float, model: ObservationModel
) -> int:
    """Landmark that a bearing without a name is of; -1 where none, or more than one, is inside the gate.

    Parameters
    ----------
    belief : before it.
    bearing : measured [rad], scanner frame.
    landmarks : (N, 3) x, y [m], map frame, and variance of the place [m^2].
    gate : largest NIS.
    reach : of the goniometer [m].
    model : mounting and variance.

    Notes
    -----
    No formula: the only one whose NIS is inside the gate. A bearing alone does not tell near from far, so that of two
    landmarks in one direction neither is taken.
    """
    found = -1
    for i in range(len(landmarks)):
        dx, dy = landmarks[i, 0] - belief.x, landmarks[i, 1] - belief.y
        if dx * dx + dy * dy > reach * reach:
            continue
        row = bearing_row(belief, bearing, landmarks[i, 0], landmarks[i, 1], landmarks[i, 2], model)
        if abs(row.residual) < 0.5 * math.pi and row_nis(belief, row) <= gate:
            if found >= 0:
                return -1
            found = i
    return found


@compiled
def _spread(belief: PoseGaussian, row: BearingRow) -> tuple[float, float, float]:
    """P H^T.

    Notes
    -----
    By definition.
    """
    return (
        belief.xx * row.x + belief.xy * row.y + belief.xt * row.theta,
        belief.xy * row.x + belief.yy * row.y + belief.yt * row.theta,
        belief.xt * row.x + belief.yt * row.y + belief.tt * row.theta,
    )
