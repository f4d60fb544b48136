"""Where a vehicle that is switched on could take its place for another one: its map, its pairs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray
from commission.planning.ambiguity import AmbiguousPair
from commission.planning.coverage import Lattice
from commission.progress import Progress
from commission.site.reflectors import ReflectorMap
from commission.studies.ambiguity import AmbiguityInput, AmbiguityResult, ambiguity, both_ways

NOTHING, UNIQUE, TOO_FEW, SOME, EVERY = range(5)
"""Classes: beside the floor; each heading tells its place; fewer than two visible somewhere, no twin; a twin at some
headings; no heading tells its place."""
CLASSES = EVERY + 1


@dataclass(frozen=True, slots=True, eq=False)
class AmbiguousFloor:
    """The ambiguous floor."""

    reflectors: ReflectorMap
    """The reflectors that were looked at."""
    lattice: Lattice
    """The spots."""
    classes: NDArray[np.uint8]
    """(rows, columns) class of each spot; row 0 is the lowest y."""
    pairs: tuple[AmbiguousPair, ...]
    """Groups of reflectors that are taken for each other, one way or the other; the most frequent first."""

    def shares(self) -> FloatArray:
        """Share of the floor in each class from `UNIQUE` on [0..1]."""
        counts = np.bincount(self.classes.ravel(), minlength=CLASSES)[UNIQUE:]
        return counts / max(1, counts.sum())

    def names(self, group: tuple[int, ...]) -> tuple[str, ...]:
        """Ids of a group of reflectors."""
        return tuple(self.reflectors.reflectors[index].id for index in group)


def look_alike(inputs: AmbiguityInput, progress: Progress) -> AmbiguousFloor:
    """Ask for every free spot of the floor, heading by heading, whether another pose sees the same."""
    found = ambiguity(inputs, progress)
    return AmbiguousFloor(inputs.reflectors, found.lattice, _classes(found), both_ways(found.cold.pairs))


def _classes(found: AmbiguityResult) -> NDArray[np.uint8]:
    """Sort the spots."""
    kinds = np.where(found.ambiguous, TOO_FEW, UNIQUE)
    kinds = np.where(found.has_twin, SOME, kinds)
    kinds = np.where(found.share == 1.0, EVERY, kinds)
    kinds = np.where(found.drivable, kinds, NOTHING).astype(np.uint8)
    return kinds.reshape(found.lattice.rows, found.lattice.columns)
