"""What the filter believed before each scan of a run: kept while it is driven, else found again by going over it.

The validation areas of one cycle at the cursor are all that wants it: hours of it need no memory.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from commission.geometry.arrays import FloatArray, read_only

KEPT = 6
"""Stretches between checkpoints that are kept: those that the last innovations of a reflector lie in, 0.4 MB each."""


class PriorRows(NamedTuple):
    """Beliefs after *predict* of some cycles that follow each other."""

    means: FloatArray
    """(K, 3) `T_map_base` [m, m, rad]."""
    covariances: FloatArray
    """(K, 3, 3) of x [m], y [m], theta [rad]."""


def prior_rows(cycles: int) -> PriorRows:
    """Return rows for so many cycles, to be written."""
    return PriorRows(np.empty((cycles, 3)), np.empty((cycles, 3, 3)))


class Priors(Protocol):
    """Beliefs after *predict* of all cycles of a run."""

    def at(self, cycle: int) -> tuple[FloatArray, FloatArray]:
        """Return mean (3,) and covariance (3, 3) before the detections of a cycle."""
        ...

    def rows(self) -> PriorRows:
        """Return those of all cycles, in memory."""
        ...

    def blocks(self) -> Iterator[PriorRows]:
        """Return those of all cycles, some cycles at a time."""
        ...


class KeptPriors:
    """Priors that are in memory.

    Parameters
    ----------
    rows : of all cycles, read-only.
    """

    def __init__(self, rows: PriorRows) -> None:
        self._rows = rows

    def at(self, cycle: int) -> tuple[FloatArray, FloatArray]:
        """Return mean (3,) and covariance (3, 3) before the detections of a cycle."""
        return self._rows.means[cycle], self._rows.covariances[cycle]

    def rows(self) -> PriorRows:
        """Return those of all cycles."""
        return self._rows

    def blocks(self) -> Iterator[PriorRows]:
        """Return those of all cycles at once: they are there anyway."""
        yield self._rows


class ReplayedPriors:
    """Priors that are computed again, to the last bit, from the checkpoint before them.

    Parameters
    ----------
    bounds : (C,) cycles of the checkpoints, ascending; cycle 0 first.
    cycles : number of cycles.
    replay : returns the priors of the cycles from a checkpoint to before the next.
    known : those that need no replay, by the checkpoint before them; read-only.
    """

    def __init__(
        self,
        bounds: Sequence[int],
        cycles: int,
        replay: Callable[[int, int], PriorRows],
        known: Mapping[int, PriorRows] | None = None,
    ) -> None:
        self._bounds = np.unique((*bounds, cycles))
        self._known = known or {}
        self._compute = replay
        self._newest: dict[int, PriorRows] = {}
        """Of a few checkpoints, by their cycles: a cursor that moves on needs them again."""

    def at(self, cycle: int) -> tuple[FloatArray, FloatArray]:
        """Return mean (3,) and covariance (3, 3) before the detections of a cycle."""
        index = int(np.searchsorted(self._bounds, cycle, side="right")) - 1
        first, last = self._bounds[index : index + 2].tolist()
        kept = self._newest
        rows = kept.get(first) or self._replay(first, last)
        # The one used longest ago comes first. Exchanged whole, never changed: a study may ask in its own thread.
        others = [pair for pair in kept.items() if pair[0] != first]
        self._newest = dict([*others[1 - KEPT :], (first, rows)])
        return rows.means[cycle - first], rows.covariances[cycle - first]

    def known_before(self, cycle: int) -> dict[int, PriorRows]:
        """Return those that need no replay, as far as before a cycle, by the checkpoint before them."""
        return {
            first: PriorRows(rows.means[: cycle - first], rows.covariances[: cycle - first])
            for first, rows in self._known.items()
            if first < cycle
        }

    def _replay(self, first: int, last: int) -> PriorRows:
        """Priors from a checkpoint to before the next."""
        known = self._known.get(first)
        return self._compute(first, last) if known is None else known

    def rows(self) -> PriorRows:
        """Return those of all cycles."""
        parts = list(self.blocks())
        whole = PriorRows(*map(np.concatenate, zip(*parts, strict=True))) if parts else prior_rows(0)
        return PriorRows(read_only(whole.means), read_only(whole.covariances))

    def blocks(self) -> Iterator[PriorRows]:
        """Return those of all cycles, from each checkpoint to the next."""
        return itertools.starmap(self._replay, itertools.pairwise(self._bounds.tolist()))
