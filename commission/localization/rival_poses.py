"""Rival poses as a value, between two cycles: where the vehicle may stand as well. Steps: `several_scans`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, read_only

MOST_POSES = 6
"""Poses at most, the run's own among them: the likeliest."""


class RivalPoses(NamedTuple):
    """Rivals of the run's own pose, for kernels; in and out."""

    beliefs: FloatArray
    """(MOST_POSES - 1, 9) x, y, theta, xx, xy, xt, yy, yt, tt."""
    weights: FloatArray
    """(MOST_POSES - 1,) ln of the weight of each, relative to the run's own; -inf: not used."""
    newest: FloatArray
    """(9,) the run's own pose after its newest cycle."""
    begun: NDArray[np.bool_]
    """(1,) whether there was such a cycle."""


@dataclass(frozen=True, slots=True, eq=False)
class KeptPoses:
    """Rivals that have begun; read-only."""

    beliefs: FloatArray
    weights: FloatArray
    newest: FloatArray

    def __eq__(self, other: object) -> bool:
        """Whether both say the same, to the last bit."""
        if not isinstance(other, KeptPoses):
            return NotImplemented
        return self._bits() == other._bits()

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash(self._bits())

    def _bits(self) -> tuple[bytes, ...]:
        return self.beliefs.tobytes(), self.weights.tobytes(), self.newest.tobytes()


def poses_of(kept: KeptPoses | None, *, wanted: bool) -> RivalPoses | None:
    """Rivals for the steps to write in: a copy; None where scans are decided on one by one.

    Parameters
    ----------
    kept : after the cycle before; None: none has begun.
    wanted : whether several scans are decided on together.
    """
    if not wanted:
        return None
    rows = MOST_POSES - 1
    poses = RivalPoses(np.zeros((rows, 9)), np.full(rows, -np.inf), np.zeros(9), np.zeros(1, dtype=np.bool_))
    if kept is not None:
        poses.beliefs[:], poses.weights[:], poses.newest[:] = kept.beliefs, kept.weights, kept.newest
        poses.begun[0] = True
    return poses


def kept_poses(poses: RivalPoses | None) -> KeptPoses | None:
    """Return what steps have left, as a value; None where nothing has begun.

    Parameters
    ----------
    poses : after the steps.
    """
    if poses is None or not poses.begun[0]:
        return None
    beliefs = np.where((poses.weights > -np.inf)[:, np.newaxis], poses.beliefs, 0.0)
    return KeptPoses(read_only(beliefs), read_only(poses.weights.copy()), read_only(poses.newest.copy()))
