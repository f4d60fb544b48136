"""Distances between reflectors that a vehicle sees at once: two pairs of nearly the same one are taken for each other.

A start search tells reflectors apart by these distances. What it makes of a whole constellation is in `ambiguity`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning.route_prediction import PlannedRoute
from commission.planning.unmet import Unmet


class AlikePairs(NamedTuple):
    """N times two pairs of reflectors whose distances differ too little, the most alike first."""

    reflectors: IntArray
    """(N, 4) of the one pair, then of the other; they may have one in common."""
    distances: FloatArray
    """(N, 2) between the reflectors of each pair [m]."""


def alike_pairs(sees: BoolArray, centers: FloatArray, least: float) -> AlikePairs:
    """Find pairs that are in sight at once and whose distances differ by no more than a least difference.

    Parameters
    ----------
    sees : (K, M) whether each of M reflectors is seen at each scan.
    centers : (M, 2) of the reflectors [m], map frame.
    least : difference from which pairs are told apart [m]; 0: all are.
    """
    first, second = np.triu_indices(sees.shape[1], k=1)
    rows = np.unique(np.packbits(sees, axis=1), axis=0)
    seen = np.unpackbits(rows, axis=1, count=sees.shape[1]).astype(np.bool_)
    together = seen[:, first] & seen[:, second]
    ever = np.flatnonzero(together.any(axis=0))
    first, second, together = first[ever], second[ever], together[:, ever]
    distances = np.hypot(*(centers[first] - centers[second]).T)
    order = np.argsort(distances, kind="stable")
    first, second, together, distances = first[order], second[order], together[:, order], distances[order]
    # In their order, only those that follow within the difference can be alike.
    ends = np.searchsorted(distances, distances + least, side="right")
    counts = np.maximum(ends - np.arange(len(distances)) - 1, 0) if least > 0.0 else np.zeros(len(distances), np.int64)
    one = np.repeat(np.arange(len(distances)), counts)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
    at_once = np.zeros(len(one), np.bool_)
    for row in together:
        at_once |= row[one] & row[other]
    one, other = one[at_once], other[at_once]
    nearest = np.argsort(distances[other] - distances[one], kind="stable")
    one, other = one[nearest], other[nearest]
    reflectors = np.column_stack((first[one], second[one], first[other], second[other]))
    return AlikePairs(reflectors.reshape(-1, 4), np.column_stack((distances[one], distances[other])).reshape(-1, 2))


def seen_at_once(alike: AlikePairs, sees: BoolArray) -> BoolArray:
    """(K,) whether two alike pairs are in sight at each scan.

    Parameters
    ----------
    alike : pairs.
    sees : (K, M) whether each reflector is seen at each scan.
    """
    result = np.zeros(len(sees), np.bool_)
    for four in alike.reflectors:
        result |= sees[:, four].all(axis=1)
    return result


class PairDistances:
    """The demand that distances between reflectors differ, asked for one layout after the other.

    Parameters
    ----------
    planned : the routes, with all M reflectors that could be taken.
    covers : of each route, (K, M) whether each reflector is seen at each scan.
    centers : (M, 2) of the reflectors [m], map frame.
    least : difference from which pairs are told apart [m]; 0: all are.
    """

    def __init__(
        self, planned: Sequence[PlannedRoute], covers: Sequence[BoolArray], centers: FloatArray, least: float
    ) -> None:
        self._planned, self._covers, self._centers, self._least = planned, covers, centers, least
        every = np.concatenate([np.zeros((0, len(centers)), np.bool_), *covers])
        packed = np.unique(np.packbits(every, axis=1), axis=0)
        self._sees = np.unpackbits(packed, axis=1, count=len(centers)).astype(np.bool_)

    def alike(self, taken: BoolArray) -> AlikePairs:
        """Return pairs of a layout (M,) that are taken for each other; reflectors are counted among those taken."""
        return alike_pairs(self._sees[:, taken], self._centers[taken], self._least)

    def unmet(self, taken: BoolArray) -> Iterator[Unmet]:
        """Metres of the routes on which two pairs of a layout (M,) that are taken for each other are in sight."""
        alike = self.alike(taken)
        for route, covers in zip(self._planned, self._covers, strict=True):
            metres = np.unique(route.drive.metres[seen_at_once(alike, covers[:, taken])].astype(np.int64))
            if len(metres):
                yield Unmet(route=route.name, metres=tuple(metres.tolist()), reason="pairs")
