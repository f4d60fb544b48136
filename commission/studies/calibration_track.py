"""The way of a vehicle by its odometry alone, at any time, and how motion changes with the scale of the wheels.

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
    p_j = p_(j-1) + R(theta_(j-1)) d_j: sums.
    """
    scale = np.array([1.0 + wheels[0], 1.0 + wheels[0], 1.0 + wheels[1]])
    reported = se2.log(displacements)
    reported[0] = 0.0
    twists = reported * scale
    twists[:, 2] += wheels[2] * reported[:, 0]
    moves = se2.exp(twists)
    headings = np.cumsum(twists[:, 2])
    before = headings - twists[:, 2]
    c, s = np.cos(before), np.sin(before)
    xy = np.stack((c * moves[:, 0] - s * moves[:, 1], s * moves[:, 0] + c * moves[:, 1]), axis=1)
    return Track(stamps_ns, np.column_stack((np.cumsum(xy, axis=0), headings)), twists)


def at(track: Track, stamps_ns: FloatArray) -> FloatArray:
    """Poses at some times, between records at a constant twist.

    Parameters
    ----------
    track : of the drive.
    stamps_ns : (K,) [ns]; before the first record and after the last one the vehicle stands.

    Returns
    -------
    poses : (K, 3) [m, m, rad].
    """
    stamps = track.stamps_ns
    row = np.clip(np.searchsorted(stamps, stamps_ns, side="right"), 1, len(stamps) - 1)
    span = (stamps[row] - stamps[row - 1]).astype(np.float64)
    share = np.clip((stamps_ns - stamps[row - 1]) / np.maximum(span, 1.0), 0.0, 1.0)[:, np.newaxis]
    twist = share * track.twists[row]
    moved = se2.exp(twist)
    begin = track.poses[row - 1]
    c, s = np.cos(begin[:, 2]), np.sin(begin[:, 2])
    return begin + np.column_stack((c * moved[:, 0] - s * moved[:, 1], s * moved[:, 0] + c * moved[:, 1], twist[:, 2]))


def twists_at(track: Track, stamps_ns: FloatArray) -> FloatArray:
    """(K, 3) velocity of base about some times [m/s, m/s, rad/s], averaged over twice `TWIST_NS`."""
    first, last = float(track.stamps_ns[0]), float(track.stamps_ns[-1])
    begin, end = (np.clip(stamps_ns + side, first, last) for side in (-TWIST_NS, TWIST_NS))
    before, after = at(track, begin), at(track, end)
    seconds = np.maximum(end - begin, 1.0) * 1e-9
    return se2.log(se2.relative(before, after)) / seconds[:, np.newaxis]


def between(poses: FloatArray) -> FloatArray:
    """Displacement from each pose to the next one: (K - 1, 3) [m, m, rad].

    Parameters
    ----------
    poses : (K, 3) along a track.
    """
    moved = se2.relative(poses[:-1], poses[1:])
    moved[:, 2] = wrap(np.diff(poses[:, 2]))
    return moved


def moved_by_wheels(displacements: FloatArray, wheels: FloatArray) -> FloatArray:
    """(K, 3, 3) derivative of true displacements with respect to the wheels' constants, given what they report.

    Parameters
    ----------
    displacements : (K, 3) true ones [m, m, rad], each at a constant twist.
    wheels : (3,) as in `track_of`.
    """
    twists = se2.log(displacements)
    forward, left = twists[:, 0] / (1.0 + wheels[0]), twists[:, 1] / (1.0 + wheels[0])
    turn = (twists[:, 2] - wheels[2] * forward) / (1.0 + wheels[1])
    of_twist = np.zeros((len(twists), 3, WHEELS))
    of_twist[:, 0, 0], of_twist[:, 1, 0], of_twist[:, 2, 1], of_twist[:, 2, 2] = forward, left, turn, forward
    return _exp_jacobian(twists) @ of_twist


def _exp_jacobian(twists: FloatArray) -> FloatArray:
    """(M, 3, 3) derivative of `se2.exp` (Solà et al. 2018, equation 158, differentiated)."""
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
    return jacobian
