"""Which columns fulfil rows of a linear system of needs: a local search by exchanges. Knows no reflectors.

Covering with gains that are any numbers: a set of columns fulfils a row when their gains reach its need. Rows that stay
unfulfilled weigh more with every step, so that the search leaves where it is stuck (Gao et al. 2015, weighting-based
local search for set covering).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning.cover import CoverProblem

Gains: TypeAlias = NDArray[np.float32]

CLOSE = 1e-5
"""What a need may lack, by rounding."""
OUT_TRIED, IN_TRIED = 6, 64
"""Columns that are tried to be taken out in each step, those that are missed least; and in: that bring most."""


class Needs:
    """Rows that come one after the other: gains of C columns, and how much of them is needed.

    Parameters
    ----------
    problem : the first rows; needed as far as all columns together meet them.
    """

    def __init__(self, problem: CoverProblem) -> None:
        self.problem = problem
        """Which columns are fixed, and which exclude each other."""
        # What one column adds lies together: sets are a small part of the columns.
        self._gains, self._needs = np.ascontiguousarray(problem.covers.T), problem.attainable().astype(np.float32)
        self._count = len(self._needs)

    @property
    def gains(self) -> Gains:
        """(C, R) not negative."""
        return self._gains[:, : self._count]

    @property
    def needs(self) -> Gains:
        """(R,) of each row."""
        return self._needs[: self._count]

    def add(self, gains: FloatArray, needs: FloatArray) -> None:
        """Append rows (K, C) and (K,); what all columns together do not reach is needed as far as they do.

        Raises ValueError for gains that are not finite, or a need that is no number: no set would ever fulfil them.
        """
        if not np.isfinite(gains).all() or np.isnan(needs).any():
            raise ValueError("rows hold gains or needs that are not numbers; expected finite gains")
        needs = np.minimum(needs, gains.sum(axis=1) * (1.0 - 1e-3))
        last = self._count + len(needs)
        if last > len(self._needs):
            # Twice as many, so that a row is copied a few times only.
            room = 2 * last - self._count
            self._gains = np.concatenate((self.gains, np.empty((len(self._gains), room), np.float32)), axis=1)
            self._needs = np.concatenate((self.needs, np.empty(room, np.float32)))
        # More than is needed helps nothing: so no single column looks better than it is.
        self._gains[:, self._count : last] = np.minimum(gains, np.maximum(needs, 0.0)[:, np.newaxis]).T
        self._needs[self._count : last] = needs
        self._count = last

    def missing(self, taken: BoolArray) -> Gains:
        """(R,) need minus what a set adds: negative where it adds more."""
        return self.needs - self.gains[np.flatnonzero(taken)].sum(axis=0) - CLOSE

    def lacking(self, taken: BoolArray) -> Gains:
        """(R,) what a set lacks of each row."""
        return np.maximum(self.missing(taken), 0.0)


def grown(system: Needs, taken: BoolArray) -> BoolArray:
    """Add the column that brings most of what is lacking, again and again, until nothing is or none brings any.

    Parameters
    ----------
    system : the rows, and which columns are fixed or exclude each other.
    taken : (C,) the set at the start.
    """
    taken = taken.copy()
    while True:
        lacking = system.lacking(taken)
        rows = np.flatnonzero(lacking)
        worth = np.minimum(system.gains[:, rows], lacking[rows]).sum(axis=1) * system.problem.allowed(taken)
        best = int(worth.argmax()) if len(worth) else 0
        if len(rows) == 0 or len(worth) == 0 or worth[best] <= 0.0:
            return taken
        taken[best] = True


def pruned(system: Needs, taken: BoolArray) -> BoolArray:
    """Take out columns without which no row lacks more, those that are missed least first.

    Parameters
    ----------
    system : the rows, and which columns are fixed or exclude each other.
    taken : (C,) the set at the start.
    """
    taken, missing = taken.copy(), system.missing(taken)
    movable = np.flatnonzero(taken & ~system.problem.fixed)
    for column in movable[np.argsort(_missed(system, missing, movable, np.ones_like(missing)), kind="stable")]:
        left = missing + system.gains[column]
        if np.all((left <= 0.0) | (system.gains[column] == 0.0)):
            taken[column], missing = False, left
    return taken


def with_one(system: Needs, taken: BoolArray, lacked: BoolArray) -> BoolArray:
    """Add the column that brings most of what another set lacks.

    Parameters
    ----------
    system : the rows, and which columns are fixed or exclude each other.
    taken : (C,) the set that gets one more, where one may be added.
    lacked : (C,) the other set.
    """
    lacking = system.lacking(lacked)
    worth = np.minimum(system.gains, lacking).sum(axis=1) * system.problem.allowed(taken)
    taken = taken.copy()
    if worth.max(initial=0.0) > 0.0:
        taken[worth.argmax()] = True
    return taken


def without_one(system: Needs, taken: BoolArray) -> BoolArray:
    """Take out the column that is missed least.

    Parameters
    ----------
    system : the rows, and which columns are fixed or exclude each other.
    taken : (C,) the set at the start.
    """
    movable = np.flatnonzero(taken & ~system.problem.fixed)
    if len(movable) == 0:
        return taken
    missing = system.missing(taken)
    taken = taken.copy()
    taken[movable[_missed(system, missing, movable, np.ones_like(missing)).argmin()]] = False
    return taken


def exchanged(
    system: Needs,
    taken: BoolArray,
    steps: int,
    step: Callable[[], None] | None = None,
) -> BoolArray:
    """Exchange columns one for one until a set fulfils all rows, or the steps are used up; the best set on the way.

    Parameters
    ----------
    system : the rows, and which columns are fixed or exclude each other.
    taken : (C,) the set at the start; the result has as many columns.
    steps : exchanges at most.
    step : called with each; may raise to cancel.
    """
    taken, weights = taken.copy(), np.ones(len(system.needs), np.float32)
    barred = np.zeros(len(taken), np.int64)
    """Step until which a column stays where it is: in or out."""
    tenure = 2 + int(np.count_nonzero(taken & ~system.problem.fixed)) // 4
    lacking = system.lacking(taken)
    best, least = taken.copy(), float(lacking.sum())
    for number in range(1, steps + 1):
        if not lacking.any():
            return taken
        if step is not None:
            step()
        swap = _best_swap(system, taken, weights, barred >= number)
        if swap is None:
            break
        out, into = swap
        taken[out], taken[into] = False, True
        barred[out], barred[into] = number + tenure, number + tenure
        lacking = system.lacking(taken)
        weights[lacking > 0.0] += 1.0
        if lacking.sum() < least:
            best, least = taken.copy(), float(lacking.sum())
    return best


def _best_swap(system: Needs, taken: BoolArray, weights: Gains, is_barred: BoolArray) -> tuple[int, int] | None:
    """The column out and the column in after which the weighted lack is least; None when none may be exchanged."""
    movable = np.flatnonzero(taken & ~system.problem.fixed & ~is_barred)
    if len(movable) == 0:
        return None
    missing = system.missing(taken)
    outs = movable[np.argsort(_missed(system, missing, movable, weights), kind="stable")[:OUT_TRIED]]
    rows = np.flatnonzero(missing > 0.0)
    worth = _weighted(np.minimum(system.gains[:, rows], missing[rows]), weights[rows])
    worth[taken | is_barred] = 0.0
    ins = np.argsort(-worth, kind="stable")[:IN_TRIED]
    ins = ins[worth[ins] > 0.0]
    best, least = None, np.inf
    for out in outs.tolist():
        left = taken.copy()
        left[out] = False
        without = missing + system.gains[out]
        rows = np.flatnonzero(without > 0.0)
        columns = ins[system.problem.allowed(left)[ins]]
        if len(columns) == 0:
            continue
        still = np.maximum(without[rows] - system.gains[np.ix_(columns, rows)], 0.0)
        lack = _weighted(still, weights[rows])
        index = int(lack.argmin())
        if lack[index] < least:
            best, least = (out, int(columns[index])), float(lack[index])
    return best


def _missed(system: Needs, missing: Gains, movable: IntArray, weights: Gains) -> Gains:
    """(n,) weighted lack that comes without each of the movable columns, where a set misses so much."""
    lost = np.maximum(np.minimum(system.gains[movable] + missing, system.gains[movable]), 0.0)
    return _weighted(lost, weights)


def _weighted(lacks: Gains, weights: Gains) -> Gains:
    """(n,) sums of (n, R) lacks by the weights of their rows; both are finite (`Needs.add`).

    The library behind the product computes in lanes of which some hold what is left from before, and so may raise the
    processor's flag of an invalid operation for finite numbers (numpy issue 24067, OpenBLAS issue 1924).
    """
    with np.errstate(invalid="ignore"):
        return lacks @ weights
