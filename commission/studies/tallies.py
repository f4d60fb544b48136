"""What became of the detections of each cycle, counted and summed up in one pass: what many figures of a run are of.

The figures themselves are those of `consistency` and `run`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.estimate import Status
from commission.localization.run_columns import RunColumns

INLIER = int(Status.INLIER)
OUTLIER_DETECTOR = int(Status.OUTLIER_DETECTOR)


class Tallies(NamedTuple):
    """Of each of K cycles."""

    counts: NDArray[np.int32]
    """(K, 3) detections of each `Status`."""
    accepted_d2: FloatArray
    """(K,) sum of the squared Mahalanobis distances of the accepted."""
    largest_d2: FloatArray
    """(K,) largest of them; NaN in a cycle without one."""
    known: NDArray[np.int32]
    """(K,) detections that passed the detector and have a reflector whose distance is known."""
    known_d2: FloatArray
    """(K,) sum of their squared Mahalanobis distances."""


def tallies_of(columns: RunColumns, first: int = 0, after: int | None = None) -> Tallies:
    """Tallies of the cycles from `first` to the one before `after`; to the last one when None.

    Parameters
    ----------
    columns : the run.
    first, after : bounds.
    """
    after = len(columns) if after is None else after
    rows = slice(int(columns.offsets[first]), int(columns.offsets[after]))
    tallies = _no_tallies(after - first)
    offsets = read_only(columns.offsets[first : after + 1])
    _tally(offsets, read_only(columns.status[rows]), read_only(columns.d2[rows]), tallies)
    return tallies


def _no_tallies(cycles: int) -> Tallies:
    """Room for the tallies of some cycles."""
    counts, known = np.empty((cycles, len(Status)), np.int32), np.empty(cycles, np.int32)
    return Tallies(counts, np.empty(cycles), np.empty(cycles), known, np.empty(cycles))


@compiled
def _tally(offsets: IntArray, status: NDArray[np.int8], d2: FloatArray, tallies: Tallies) -> None:
    """Write the tallies of cycles whose detections are `offsets` less the first of them."""
    for k in range(len(offsets) - 1):
        accepted_d2, largest, known, known_d2 = 0.0, math.nan, 0, 0.0
        for each in range(3):
            tallies.counts[k, each] = 0
        for row in range(offsets[k] - offsets[0], offsets[k + 1] - offsets[0]):
            tallies.counts[k, status[row]] += 1
            if status[row] == INLIER:
                accepted_d2 += d2[row]
                if not d2[row] <= largest:
                    largest = d2[row]
            if status[row] != OUTLIER_DETECTOR and math.isfinite(d2[row]):
                known += 1
                known_d2 += d2[row]
        tallies.accepted_d2[k], tallies.largest_d2[k] = accepted_d2, largest
        tallies.known[k], tallies.known_d2[k] = known, known_d2


def warm_up() -> None:
    """Compile the pass."""
    offsets, status, d2 = np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int8), np.zeros(0)
    _tally(read_only(offsets), read_only(status), read_only(d2), _no_tallies(0))
