"""Stretches of a row in which something holds without a gap. What holds, the caller knows."""

from __future__ import annotations

import numpy as np

from commission.geometry.arrays import BoolArray, IntArray


def stretches_of(mask: BoolArray) -> IntArray:
    """Return the (S, 2) first index, and the one after the last, of each run of True in (K,) flags, in order."""
    bounds = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return bounds.reshape(-1, 2)
