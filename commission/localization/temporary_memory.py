"""What is remembered of temporary landmarks: their places, and the joint covariance of pose and places. Bounded.

As a value between records, and as arrays with room for as many as there may be that the steps of `temporary` write in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, read_only

POSE = 3
"""x, y and heading of base: first entries of the joint state."""
PER_LANDMARK = 2
"""x and y of a landmark, map frame."""
KIND, SEEN_NS, BORN_NS, MATCHES, MISSES, NUMBER = range(6)
"""Columns of `marks`: a `LandmarkKind`, stamps [ns], scans that saw it, scans in a row that should have and did not,
and its number in the order of birth."""
SHAPE, DRIFT_X, DRIFT_Y = range(3)
"""Columns of `shapes`: radius of a reel [m] or heading of a corner [rad, map frame], mean of its innovations."""
W_KIND, W_X, W_Y, W_SHAPE, W_COUNT = range(5)
"""Columns of `waiting`."""
MOST_WAITING = 64
"""Things that wait to be seen again at most; beyond, the one seen longest ago goes."""
LANDMARKS, WAITING, NEXT_NUMBER = range(3)
"""Entries of `counts`."""


class TemporaryMemory(NamedTuple):
    """Room for C landmarks, for kernels, written in place."""

    mean: FloatArray
    """(3 + 2 C,) pose after the last cycle, then place of each [m, m, rad, m, m, ...], map frame."""
    covariance: FloatArray
    """(3 + 2 C, 3 + 2 C) of the same; only its lower triangle, and of the pose only the rows below it."""
    marks: IntArray
    """(C, 6) see `KIND` and so on."""
    shapes: FloatArray
    """(C, 3) see `SHAPE` and so on."""
    waiting: FloatArray
    """(MOST_WAITING, 5) what was seen and is no landmark yet: kind, place [m], shape, scans that saw it."""
    waiting_ns: IntArray
    """(MOST_WAITING,) when each was seen last [ns]."""
    counts: IntArray
    """(3,) landmarks, waiting ones, number of the next landmark."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TemporaryLandmarks:
    """Temporary landmarks after a cycle: n of them. All arrays are read-only."""

    mean: FloatArray
    """(3 + 2 n,) pose of base and place of each [m, m, rad, m, m, ...], map frame."""
    covariance: FloatArray
    """(3 + 2 n, 3 + 2 n) lower triangle, see `TemporaryMemory`."""
    marks: IntArray
    """(n, 6) kind, stamps of last sight and birth [ns], scans that saw it, misses, number."""
    shapes: FloatArray
    """(n, 3) radius [m] or heading [rad], then running mean of its innovations."""
    waiting: FloatArray
    """(w, 5) what was seen and is no landmark yet."""
    waiting_ns: IntArray
    """(w,) when [ns]."""
    born: int
    """How many there have ever been."""

    def __len__(self) -> int:
        """Return the number of landmarks."""
        return len(self.marks)

    def __eq__(self, other: object) -> bool:
        """Whether both say the same, to the last bit."""
        if not isinstance(other, TemporaryLandmarks):
            return NotImplemented
        return self._bytes() == other._bytes()

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash(self._bytes())

    @property
    def places_map(self) -> FloatArray:
        """(n, 2) place of each [m], map frame."""
        return self.mean[POSE:].reshape(-1, PER_LANDMARK)

    @property
    def place_covariances(self) -> FloatArray:
        """(n, 2, 2) covariance of each place [m^2], map frame."""
        found = np.empty((len(self), PER_LANDMARK, PER_LANDMARK))
        for index in range(len(self)):
            at = POSE + PER_LANDMARK * index
            block = np.tril(self.covariance[at : at + PER_LANDMARK, at : at + PER_LANDMARK])
            found[index] = block + np.tril(block, -1).T
        return found

    def _bytes(self) -> tuple[bytes | int, ...]:
        arrays = (self.mean, self.covariance, self.marks, self.shapes, self.waiting, self.waiting_ns)
        return *(each.tobytes() for each in arrays), self.born


def memory_of(known: TemporaryLandmarks | None, most: int) -> TemporaryMemory:
    """Return arrays for the steps to write in, with room for as many landmarks.

    Parameters
    ----------
    known : what is remembered; None: nothing.
    most : landmarks that there may be. Of more than that, those seen last stay.
    """
    size = POSE + PER_LANDMARK * most
    memory = TemporaryMemory(
        np.zeros(size),
        np.zeros((size, size)),
        np.zeros((most, 6), np.int64),
        np.zeros((most, 3)),
        np.zeros((MOST_WAITING, 5)),
        np.zeros(MOST_WAITING, np.int64),
        np.zeros(3, np.int64),
    )
    if known is None:
        return memory
    kept = np.arange(len(known))
    if len(known) > most:
        kept = np.sort(np.argsort(-known.marks[:, SEEN_NS], kind="stable")[:most])
    rows = np.concatenate((np.arange(POSE), *(POSE + PER_LANDMARK * k + np.arange(PER_LANDMARK) for k in kept)))
    used, n, w = len(rows), len(kept), len(known.waiting)
    memory.mean[:used] = known.mean[rows]
    memory.covariance[:used, :used] = known.covariance[np.ix_(rows, rows)]
    memory.marks[:n], memory.shapes[:n] = known.marks[kept], known.shapes[kept]
    memory.waiting[:w], memory.waiting_ns[:w] = known.waiting, known.waiting_ns
    memory.counts[:] = n, w, known.born
    return memory


def landmarks_in(memory: TemporaryMemory) -> TemporaryLandmarks | None:
    """Return what steps have left, as a value; None where nothing is remembered and never was.

    Parameters
    ----------
    memory : written by them.
    """
    n, w, born = memory.counts.tolist()
    if n == w == born == 0:
        return None
    used = POSE + PER_LANDMARK * n
    return TemporaryLandmarks(
        mean=read_only(memory.mean[:used].copy()),
        covariance=read_only(np.tril(memory.covariance[:used, :used])),
        marks=read_only(memory.marks[:n].copy()),
        shapes=read_only(memory.shapes[:n].copy()),
        waiting=read_only(memory.waiting[:w].copy()),
        waiting_ns=read_only(memory.waiting_ns[:w].copy()),
        born=born,
    )
