"""Detections of one scan for kernels: rows of the arrays of the whole run, so that nothing is copied per scan."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray


class ScanRows(NamedTuple):
    """What was measured, and what becomes of it."""

    first: int
    """Row of the scan's first detection."""
    last: int
    """The one behind its last."""
    measured: FloatArray
    """(n, 2) range [m] and bearing [rad], scanner frame."""
    aims: FloatArray
    """(m, 3) room for the largest scan, from its first detection on: the bearing as a direction of base, and where in
    the working array the constants of its reflector are, see `scan_association.prepare`."""
    status: NDArray[np.int8]
    """(n,) a `Status` each: that of the detector, then that of the association."""
    entries: IntArray
    """(n,) out: row of `ReflectorIndex.places` that each belongs to, or NOBODY."""
    d2: FloatArray
    """(n,) out: squared Mahalanobis distance at the prior, NaN for nobody."""
