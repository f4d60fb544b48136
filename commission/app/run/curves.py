"""One value per cycle, however many, as a curve of a few hundred points that is cut at the cursor. No viser in here."""

from __future__ import annotations

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray

BINS = 400


def bins_of(times: FloatArray, duration: float) -> IntArray:
    """(N,) which of `BINS` equal stretches of the drive each time lies in."""
    return np.minimum((times * (BINS / max(duration, 1e-9))).astype(np.int64), BINS - 1)


def binned(times: FloatArray, values: FloatArray, duration: float) -> FloatArray:
    """Return the largest value in each of `BINS` equal stretches of the drive.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    values : (K,) array; NaN where unknown.
    duration : length of the drive [s].

    Returns
    -------
    levels : (BINS,) array; NaN where nothing is known. However long the drive, no peak is lost. A stretch without a
        cycle has the value of the one before: a short drive has many, over which uPlot would draw slopes.
    """
    filled, first = np.unique(bins_of(times, duration), return_index=True)
    if not len(filled):
        return np.full(BINS, np.nan)
    latest = np.searchsorted(filled, np.arange(BINS), side="right") - 1
    levels = np.fmax.reduceat(values, first)
    return np.where(latest >= 0, levels[latest], np.nan)


class PlotCurve:
    """One value per cycle of a whole run, ready to be cut at the cursor at no cost.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    values : (K,) array; NaN where unknown.
    duration : length of the drive [s].
    """

    def __init__(self, times: FloatArray, values: FloatArray, duration: float) -> None:
        self._values, self._duration = values, duration
        self._levels = binned(times, values, duration)
        self._firsts = np.searchsorted(bins_of(times, duration), np.arange(BINS))

    @property
    def largest(self) -> float:
        """Largest value of the whole run; NaN when none is known."""
        return float(np.fmax.reduce(self._levels))

    def cut(self, time: float, lived: int) -> tuple[FloatArray, FloatArray]:
        """Return two (BINS,) arrays: what is lived, and what is computed behind the cursor; NaN elsewhere.

        Parameters
        ----------
        time : the cursor [s].
        lived : number of cycles up to it: of the stretch that it is in, only these count as lived.
        """
        here = int(bins_of(np.array([time]), self._duration)[0])
        before, behind = self._levels.copy(), self._levels.copy()
        newest = self._values[self._firsts[here] : lived]
        before[here:] = np.nan
        behind[:here] = np.nan
        if len(newest):
            before[here] = np.fmax.reduce(newest)
        elif here:
            before[here] = before[here - 1]
        return before, behind
