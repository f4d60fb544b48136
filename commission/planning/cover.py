"""Fewest columns so that every row is covered often enough: greedy, then exchange, and a bound. Knows no reflectors.

The number of rows' needs that a set of columns meets is submodular in the set: each further column gains less. So
greedy is within a factor H(largest gain) of the fewest (Wolsey 1982); a linear program tells how near it came.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog  # pyright: ignore[reportUnknownVariableType]
from scipy.sparse import csr_array, vstack  # pyright: ignore[reportUnknownVariableType]

from commission.geometry.arrays import BoolArray, FloatArray, IntArray

ROUNDING = 1e-6
"""What the solver of the linear program may be off, before its bound is rounded up."""
NEGLIGIBLE = 1e-7
"""Part of a row's need below which a column's gain is handed to all sets at once: the solver drops what is smaller."""
SOLVER_SECONDS = 20.0
"""What the solver may take. It cannot be interrupted, and a bound that is not found in time is not waited for."""


@dataclass(frozen=True, slots=True, eq=False)
class CoverProblem:
    """R rows to be covered by C columns."""

    covers: NDArray[np.float32]
    """(R, C) 1 where a column covers a row; as numbers, so that sums over columns are matrix products."""
    needs: IntArray
    """(R,) columns that each row needs."""
    fixed: BoolArray
    """(C,) columns that are taken anyway and cost nothing."""
    conflicts: tuple[IntArray, ...]
    """For each column those that must not be taken beside it."""

    def attainable(self) -> IntArray:
        """(R,) the needs, as far as all columns together meet them (conflicts not considered)."""
        return np.minimum(self.needs, self.covers.sum(axis=1).astype(np.int64))

    def counts(self, taken: BoolArray) -> IntArray:
        """(R,) columns of a set that cover each row."""
        # A set is a small part of the columns: they are gathered, rather than all multiplied by mostly zeros.
        return self.covers[:, np.flatnonzero(taken)].sum(axis=1).astype(np.int64)

    def allowed(self, taken: BoolArray) -> BoolArray:
        """(C,) columns that may still be added to a set."""
        free = ~taken
        for column in np.flatnonzero(taken):
            free[self.conflicts[column]] = False
        return free


def merged(covers: BoolArray, needs: IntArray) -> tuple[BoolArray, IntArray]:
    """Merge rows that the same columns cover into one with the greatest need."""
    rows, inverse = np.unique(np.packbits(covers, axis=1), axis=0, return_inverse=True)
    greatest = np.zeros(len(rows), dtype=np.int64)
    np.maximum.at(greatest, inverse.reshape(-1), needs)
    return np.unpackbits(rows, axis=1, count=covers.shape[1]).astype(np.bool_), greatest


def cover(
    problem: CoverProblem, rng: np.random.Generator, rounds: int = 200, step: Callable[[float], None] | None = None
) -> BoolArray:
    """Cover the rows by few columns: greedy, then exchange.

    Parameters
    ----------
    problem : rows that cannot be covered are covered as far as columns go.
    rng : decides what is taken out in each exchange.
    rounds : exchanges: a part of the columns is taken out and filled up again, and kept when that needs no more.
    step : called with the fraction done [0..1]; may raise to cancel.

    Returns
    -------
    taken : (C,) the columns, the fixed ones included.
    """
    goal = problem.attainable()
    best = _reduced(problem, goal, _filled(problem, goal, problem.fixed))
    shortfall = _shortfall(problem, goal, best)
    for done in range(rounds):
        if step is not None:
            step(done / rounds)
        movable = np.flatnonzero(best & ~problem.fixed)
        if len(movable) == 0:
            break
        # One in three, and at least two: two for one is the smallest exchange that gains.
        out = rng.choice(movable, size=min(len(movable), max(2, len(movable) // 3)), replace=False)
        tried = best.copy()
        tried[out] = False
        # Those taken out are dear for once, or greedy would take them all again.
        tried = _reduced(problem, goal, _filled(problem, goal, tried, dear=out, rng=rng))
        missing = _shortfall(problem, goal, tried)
        if (missing, tried.sum()) <= (shortfall, best.sum()):
            best, shortfall = tried, missing
    if step is not None:
        step(1.0)
    return _two_for_one(problem, goal, best)


def lower_bound(problem: CoverProblem, gains: FloatArray | None = None, needs: FloatArray | None = None) -> int:
    """Fewest columns, besides the fixed ones, that any cover needs: the linear program's optimum, rounded up.

    Parameters
    ----------
    problem : rows to be covered.
    gains, needs : (K, C) and (K,) further rows: what each column adds, and how much of it is needed.
    """
    goal = problem.attainable() - problem.counts(problem.fixed)
    rows, columns = np.flatnonzero(goal > 0), np.flatnonzero(~problem.fixed)
    matrix, goal = problem.covers[np.ix_(rows, columns)].astype(np.float64), goal[rows].astype(np.float64)
    if gains is not None and needs is not None and len(gains):
        further = needs - gains[:, problem.fixed].sum(axis=1)
        # What no set reaches, or every set has, says nothing about how many there must be.
        asks = (further > 0.0) & (further <= gains[:, columns].sum(axis=1))
        matrix = np.concatenate((matrix, gains[np.ix_(asks, columns)]))
        goal = np.concatenate((goal, further[asks]))
    if len(goal) == 0:
        return 0
    matrix, goal = _conditioned(matrix, goal)
    matrix = csr_array(matrix)
    pairs = [(a, b) for a, b in _conflicting_pairs(problem) if not problem.fixed[a] and not problem.fixed[b]]
    sides, bounds = -matrix, -goal
    if pairs:
        place = np.full(len(problem.fixed), -1)
        place[columns] = np.arange(len(columns))
        entries = place[np.array(pairs)].reshape(-1)
        apart = csr_array(
            (np.ones(len(entries)), (np.repeat(np.arange(len(pairs)), 2), entries)), shape=(len(pairs), len(columns))
        )
        sides, bounds = vstack((sides, apart)), np.concatenate((bounds, np.ones(len(pairs))))
    solved = linprog(
        np.ones(len(columns)),
        A_ub=sides,
        b_ub=bounds,
        bounds=(0.0, 1.0),
        method="highs",
        options={"time_limit": SOLVER_SECONDS},
    )
    if solved.status == 0:
        return math.ceil(float(solved.fun) - ROUNDING)
    # Conflicts may forbid what columns without them could do, and a hard program may take too long. Fewer rows bound
    # less, but hold as well; without any there is no bound to give but none.
    return 0 if gains is None else lower_bound(problem)


def _conditioned(gains: FloatArray, needs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rows of a linear program that say the same of every set of whole columns, in parts of what each row needs.

    Gains of information span fourteen decades, at which a simplex does not come to an end. A column that gains more
    than a row needs meets it alone, whatever it gains beyond (the tightening of a knapsack's cover), and what no row
    would notice is taken off the needs for all sets at once. Both leave what any set of whole columns meets.
    """
    parts = gains / needs[:, None]
    # What a column takes away must stay, and with it what others gain beyond.
    only_adds = (parts >= 0.0).all(axis=1, keepdims=True)
    parts = np.where(only_adds, np.minimum(parts, 1.0), parts)
    negligible = np.abs(parts) < NEGLIGIBLE
    left = 1.0 - np.where(negligible, np.maximum(parts, 0.0), 0.0).sum(axis=1)
    return np.where(negligible & (parts >= 0.0), 0.0, parts), left


def _filled(
    problem: CoverProblem,
    goal: IntArray,
    start: BoolArray,
    dear: IntArray | None = None,
    rng: np.random.Generator | None = None,
) -> BoolArray:
    """Add the column that meets most open needs, again and again; of equals the first, or any when there is chance."""
    taken = start.copy()
    counts, allowed = problem.counts(taken), problem.allowed(taken)
    weights = np.ones(len(taken)) if rng is None else 1.0 + 1e-3 * rng.random(len(taken))
    if dear is not None:
        weights[dear] *= 0.5
    is_open = counts < goal
    gains = is_open.astype(np.float32) @ problem.covers
    while True:
        worth = gains * allowed * weights
        column = int(np.argmax(worth)) if len(worth) else 0
        if len(worth) == 0 or worth[column] <= 0.0:
            return taken
        taken[column] = True
        allowed[column] = False
        allowed[problem.conflicts[column]] = False
        counts += problem.covers[:, column].astype(np.int64)
        # Each row closes once, so that keeping the gains costs as much as summing them up once. They are whole numbers.
        closed = is_open & (counts >= goal)
        gains -= problem.covers[closed].sum(axis=0)
        is_open &= ~closed


def _reduced(problem: CoverProblem, goal: IntArray, taken: BoolArray) -> BoolArray:
    """Drop columns without which the rows are covered as well, those that cover least first."""
    taken, counts = taken.copy(), problem.counts(taken)
    movable = np.flatnonzero(taken & ~problem.fixed)
    for column in movable[np.argsort(problem.covers[:, movable].sum(axis=0), kind="stable")]:
        rows = problem.covers[:, column] > 0.0
        if np.all((counts > goal)[rows] | (goal[rows] == 0)):
            taken[column] = False
            counts -= rows
    return taken


def _two_for_one(problem: CoverProblem, goal: IntArray, taken: BoolArray) -> BoolArray:
    """Replace two columns by one wherever that covers as well."""
    while True:
        found = next(_exchanged(problem, goal, taken), None)
        if found is None:
            return taken
        taken = found


def _exchanged(problem: CoverProblem, goal: IntArray, taken: BoolArray) -> Iterator[BoolArray]:
    """Sets with one column in place of two."""
    counts = problem.counts(taken)
    open_now = np.maximum(goal - counts, 0)
    movable = np.flatnonzero(taken & ~problem.fixed)
    for i, first in enumerate(movable):
        for second in movable[i + 1 :]:
            left = counts - problem.covers[:, first] - problem.covers[:, second]
            lost = np.maximum(goal - left, 0.0) - open_now
            if lost.max(initial=0.0) > 1.0:
                continue
            without = taken.copy()
            without[[first, second]] = False
            allowed = problem.allowed(without)
            allowed[[first, second]] = False
            for column in _covering_all(problem, np.flatnonzero(lost > 0.0), np.flatnonzero(allowed)):
                tried = without.copy()
                tried[column] = True
                yield tried


def _covering_all(problem: CoverProblem, rows: IntArray, columns: IntArray) -> IntArray:
    """Those of some columns that cover all of some rows; a few rows leave few columns to look at closely."""
    for some in (rows[:: max(1, len(rows) // 16)], rows):
        columns = columns[(problem.covers[np.ix_(some, columns)] > 0.0).all(axis=0)]
    return columns


def _shortfall(problem: CoverProblem, goal: IntArray, taken: BoolArray) -> int:
    """Needs that a set leaves open, because of conflicts."""
    return int(np.maximum(goal - problem.counts(taken), 0).sum())


def _conflicting_pairs(problem: CoverProblem) -> list[tuple[int, int]]:
    return [(a, int(b)) for a, others in enumerate(problem.conflicts) for b in others if a < b]
