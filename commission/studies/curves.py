"""A column of a run as a curve that can be drawn: of each stretch of time the smallest and the largest value.

However long the drive and however few the stretches, neither extreme of anything is lost. Nothing is drawn here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only

BINS = 1200
"""Stretches of time that a curve is cut into: more than a lane has pixels, unless it is as wide as the page."""
GAP = 3.0
"""A time without a scan is a gap when it is so many times as long as nine in ten times between two scans."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Bins:
    """Stretches of a drive that follow each other, each with one cycle at least: B of them."""

    firsts: IntArray
    """(B,) first cycle of each."""
    afters: IntArray
    """(B,) cycle after the last one of each."""
    times: FloatArray
    """(B,) time of the first cycle of each [s]."""
    follows_gap: BoolArray
    """(B,) whether no scan came for long before it: a curve must not go across."""

    def __len__(self) -> int:
        """Return the number of stretches."""
        return len(self.firsts)


def longest_regular(times: FloatArray) -> float:
    """Longest time between two scans that is no gap [s]; infinite where there are fewer than two.

    Nine in ten, and not the half of them: two scanners that follow each other closely make every second time short.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    """
    between = np.diff(times)
    between = between[between > 0.0]
    return GAP * float(np.quantile(between, 0.9)) if len(between) else math.inf


def bins_of(times: FloatArray, span: tuple[float, float], longest: float, count: int = BINS) -> Bins:
    """Cut a span of time into stretches.

    Where it holds fewer cycles than stretches, each cycle has its own. The cycle before the span and the one behind it
    are there, too, so that a curve reaches both edges.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    span : begin and end [s].
    longest : time between two scans that is no gap [s].
    count : number of stretches.
    """
    first = max(int(np.searchsorted(times, span[0], side="left")) - 1, 0)
    after = min(int(np.searchsorted(times, span[1], side="right")) + 1, len(times))
    if after - first <= count:
        firsts = np.arange(first, after, dtype=np.int64)
    else:
        edges = np.linspace(span[0], span[1], count + 1)[1:-1]
        inside = np.searchsorted(times, span[0], side="left"), np.searchsorted(times, span[1], side="right")
        bounds = np.concatenate(([first], inside, np.searchsorted(times, edges, side="left")))
        firsts = np.unique(np.clip(bounds, first, after - 1)).astype(np.int64)
    afters = np.append(firsts[1:], after).astype(np.int64)
    gap = np.zeros(len(firsts), dtype=np.bool_)
    gap[1:] = times[firsts[1:]] - times[firsts[1:] - 1] > longest
    return Bins(firsts=firsts, afters=afters, times=times[firsts], follows_gap=gap)


def extremes(values: ArrayLike, firsts: IntArray, afters: IntArray) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest known value of each stretch of rows.

    Parameters
    ----------
    values : (n,) numbers; NaN where unknown.
    firsts, afters : (B,) first row of each stretch, and the one after its last; a stretch may be empty.

    Returns
    -------
    lows, highs : (B,) arrays; NaN where nothing is known.
    """
    lows, highs = np.empty(len(firsts)), np.empty(len(firsts))
    known = read_only(np.asarray(values, dtype=np.float64))
    _extremes(known, read_only(np.asarray(firsts)), read_only(np.asarray(afters)), lows, highs)
    return lows, highs


@compiled
def _extremes(values: FloatArray, firsts: IntArray, afters: IntArray, lows: FloatArray, highs: FloatArray) -> None:
    """`extremes` into `lows` and `highs`."""
    for b in range(len(firsts)):
        low, high = math.inf, -math.inf
        for row in range(firsts[b], afters[b]):
            value = values[row]
            # Not `min` and `max`: NaN is neither smaller nor larger than anything, and must not remain.
            if value < low:  # noqa: PLR1730
                low = value
            if value > high:  # noqa: PLR1730
                high = value
        lows[b] = low if low <= high else math.nan
        highs[b] = high if low <= high else math.nan


def warm_up() -> None:
    """Compile what a curve needs."""
    rows = np.zeros(1, dtype=np.int64)
    extremes(np.zeros(1), rows, rows)
