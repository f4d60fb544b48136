"""The way of a vehicle by its odometry alone, at any time, and how it changes with the scale of the wheels.

Arrays over a whole drive for a calibration; no belief, no noise and no reflector in here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray

WHEELS = 3
"""Constants of the wheels: scale of the way, scale of turns, turn with the way."""
TWIST_NS = 50_000_000
"""Half the time over which a velocity is averaged: as long as the filter's `TREND_NS` in all."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Poses of base by odometry, from the origin at the first record."""

    stamps_ns: IntArray
    """(M,) [ns], ascending."""
    poses: FloatArray
    """(M, 3) [m, m, rad]; headings are not wrapped."""
    derivatives: FloatArray
    """(M, 3, 3) of each pose (rows) with respect to each constant of the wheels."""
    twists: FloatArray
    """(M, 3) twist of the motion that leads to each record [m, m, rad]."""


def track_of(stamps_ns: IntArray, displacements: FloatArray, wheels: FloatArray) -> Track:
    """Compose the displacements of a drive.

    Parameters
    ----------
    stamps_ns : (M,) of the records [ns].
    displacements : (M, 3) motion since the row before [m, m, rad]; the first one is ignored.
    wheels : (3,) share by which the way is longer and turns are larger than reported, and turn per metre [rad/m].

    Notes
    -----
    p_j = p_(j-1) + R(theta_(j-1)) d_j and its derivative dp_j = dp_(j-1) + R (dd_j + dtheta_(j-1) (-d_y, d_x)): sums.
    """
    scale = np.array([1.0 + wheels[0], 1.0 + wheels[0], 1.0 + wheels[1]])
    reported = se2.log(displacements)
    reported[0] = 0.0
    twists = reported * scale
    twists[:, 2] += wheels[2] * reported[:, 0]
    moves, by_twist = _exp_with_jacobian(twists)
    # Of the twist with respect to each constant: its way, its turn, the turn that goes with the way.
    of_twist = np.zeros((len(twists), 3, WHEELS))
    of_twist[:, 0, 0], of_twist[:, 1, 0] = reported[:, 0], reported[:, 1]
    of_twist[:, 2, 1], of_twist[:, 2, 2] = reported[:, 2], reported[:, 0]
    of_moves = by_twist @ of_twist
    headings = np.cumsum(twists[:, 2])
    before = headings - twists[:, 2]
    turned = np.cumsum(of_twist[:, 2], axis=0)
    c, s = np.cos(before), np.sin(before)
    xy = np.stack((c * moves[:, 0] - s * moves[:, 1], s * moves[:, 0] + c * moves[:, 1]), axis=1)
    derivatives = np.empty((len(twists), 3, WHEELS))
    dx, dy = of_moves[:, 0], of_moves[:, 1]
    lever = (turned - of_twist[:, 2])[:, np.newaxis] * np.stack((-xy[:, 1], xy[:, 0]), axis=1)[:, :, np.newaxis]
    rotated = np.stack((c[:, None] * dx - s[:, None] * dy, s[:, None] * dx + c[:, None] * dy), axis=1)
    derivatives[:, :2] = np.cumsum(rotated + lever, axis=0)
    derivatives[:, 2] = turned
    return Track(stamps_ns, np.column_stack((np.cumsum(xy, axis=0), headings)), derivatives, twists)


def at(track: Track, stamps_ns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Poses at some times, between records at a constant twist, and their derivatives.

    Parameters
    ----------
    track : of the drive.
    stamps_ns : (K,) [ns]; before the first record and after the last one the vehicle stands.

    Returns
    -------
    poses : (K, 3) [m, m, rad].
    derivatives : (K, 3, 3) with respect to the wheels; within an interval in proportion.
    """
    stamps = track.stamps_ns
    row = np.clip(np.searchsorted(stamps, stamps_ns, side="right"), 1, len(stamps) - 1)
    span = (stamps[row] - stamps[row - 1]).astype(np.float64)
    share = np.clip((stamps_ns - stamps[row - 1]) / np.maximum(span, 1.0), 0.0, 1.0)[:, np.newaxis]
    twist = share * track.twists[row]
    moved = se2.exp(twist)
    begin = track.poses[row - 1]
    c, s = np.cos(begin[:, 2]), np.sin(begin[:, 2])
    poses = begin + np.column_stack((c * moved[:, 0] - s * moved[:, 1], s * moved[:, 0] + c * moved[:, 1], twist[:, 2]))
    part = share[:, :, np.newaxis]
    return poses, (1.0 - part) * track.derivatives[row - 1] + part * track.derivatives[row]


def twists_at(track: Track, stamps_ns: FloatArray) -> FloatArray:
    """(K, 3) velocity of base about some times [m/s, m/s, rad/s], averaged over twice `TWIST_NS`."""
    first, last = float(track.stamps_ns[0]), float(track.stamps_ns[-1])
    begin, end = (np.clip(stamps_ns + side, first, last) for side in (-TWIST_NS, TWIST_NS))
    (before, _), (after, _) = at(track, begin), at(track, end)
    seconds = np.maximum(end - begin, 1.0) * 1e-9
    return se2.log(se2.relative(before, after)) / seconds[:, np.newaxis]


def between(poses: FloatArray, derivatives: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Displacement from each pose to the next one, and its derivative.

    Parameters
    ----------
    poses : (K, 3) along a track.
    derivatives : (K, 3, 3) of them.

    Returns
    -------
    displacements : (K - 1, 3) [m, m, rad].
    by_wheels : (K - 1, 3, 3).

    Notes
    -----
    d = R(theta_k)^T (p_(k+1) - p_k), its derivative by the product rule.
    """
    theta = poses[:-1, 2]
    c, s = np.cos(theta), np.sin(theta)
    delta, by = np.diff(poses, axis=0), np.diff(derivatives, axis=0)
    x, y = c * delta[:, 0] + s * delta[:, 1], c * delta[:, 1] - s * delta[:, 0]
    by_wheels = np.empty_like(by)
    c, s = c[:, np.newaxis], s[:, np.newaxis]
    turned = derivatives[:-1, 2]
    by_wheels[:, 0] = c * by[:, 0] + s * by[:, 1] + turned * y[:, np.newaxis]
    by_wheels[:, 1] = c * by[:, 1] - s * by[:, 0] - turned * x[:, np.newaxis]
    by_wheels[:, 2] = by[:, 2]
    return np.column_stack((x, y, wrap(delta[:, 2]))), by_wheels


def _exp_with_jacobian(twists: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(M, 3) `se2.exp` of twists, and its (M, 3, 3) derivative (Solà et al. 2018, equation 158, differentiated)."""
    f, left, w = twists.T
    small = np.abs(w) < 1e-3
    safe = np.where(small, 1.0, w)
    along = np.where(small, 1.0 - w * w / 6.0, np.sin(w) / safe)
    across = np.where(small, 0.5 * w, (1.0 - np.cos(w)) / safe)
    along_w = np.where(small, -w / 3.0, (np.cos(w) - along) / safe)
    across_w = np.where(small, 0.5 - w * w / 8.0, (np.sin(w) - across) / safe)
    jacobian = np.zeros((len(twists), 3, 3))
    jacobian[:, 0, 0], jacobian[:, 0, 1], jacobian[:, 0, 2] = along, -across, along_w * f - across_w * left
    jacobian[:, 1, 0], jacobian[:, 1, 1], jacobian[:, 1, 2] = across, along, across_w * f + along_w * left
    jacobian[:, 2, 2] = 1.0
    return np.column_stack((along * f - across * left, across * f + along * left, w)), jacobian
