"""Stamps from a device's own clock, which is even, and the times of capture, which are late by whatever the network is.

The least delay of the minutes around a telegram is taken as none, once the drift of the device's clock is taken out: it
is not measurable here, and stays as a constant offset of the scanner's clock.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.studies.arrival import LARGEST_DRIFT, line_below

BLOCK_NS = 1_000_000_000
"""Of so much time the telegram with the least delay is remembered [ns]."""
AROUND_S = 60.0
"""Time before and behind a moment whose telegrams tell the clock there [s]."""
SHORTEST_S = 40.0
"""Time of telegrams below which drift is not told from delays [s]."""
APART_NS = 1_000_000_000
"""A clock that goes back, or ahead of the quickest telegrams, by more was set or began again [ns]."""


class DeviceClock:
    """Places a device's clock in that of the capture; first it learns from all telegrams, then it stamps them."""

    def __init__(self) -> None:
        self._pieces: list[_Piece] = []

    def learn(self, device_ns: int | None, captured_ns: int) -> None:
        """Take the two times of a telegram [ns]; the device's is None where it says none."""
        if device_ns is None:
            return
        if not self._pieces or self._pieces[-1].ends_before(device_ns, captured_ns):
            self._pieces.append(_Piece(captured_ns))
        self._pieces[-1].learn(device_ns, captured_ns)

    def begin(self) -> None:
        """Begin with the first telegram again: all have been learned from."""
        for piece in self._pieces:
            piece.end()

    def stamp(self, device_ns: int | None, captured_ns: int) -> int:
        """Return the stamp of a telegram by the clock of the capture [ns]."""
        if device_ns is None or not self._pieces:
            return captured_ns
        found = bisect_right(self._pieces, captured_ns, key=lambda piece: piece.begin_ns) - 1
        return device_ns + self._pieces[max(found, 0)].offset_at(device_ns)


class _Piece:
    """The time in which a device's clock went on without being set."""

    def __init__(self, captured_ns: int) -> None:
        self.begin_ns = self._block_ns = captured_ns
        self._newest_ns: int | None = None
        self._first_ns = self._least_ns = 0
        self._rows: list[tuple[int, int]] = []
        self._lines: tuple[FloatArray, FloatArray] = np.zeros(0), np.zeros(0)

    def ends_before(self, device_ns: int, captured_ns: int) -> bool:
        """Whether a telegram is of a clock that was set, or began again."""
        if self._newest_ns is None:
            return False
        late_ns = captured_ns - device_ns - self._rows[-1][1]
        return device_ns < self._newest_ns - APART_NS or late_ns < -APART_NS

    def learn(self, device_ns: int, captured_ns: int) -> None:
        """Take the two times of a telegram [ns]."""
        self._newest_ns = device_ns if self._newest_ns is None else max(device_ns, self._newest_ns)
        row = device_ns, captured_ns - device_ns
        if self._rows and captured_ns - self._block_ns < BLOCK_NS:
            self._rows[-1] = min(self._rows[-1], row, key=lambda each: each[1])
            return
        self._block_ns = captured_ns
        self._rows.append(row)

    def end(self) -> None:
        """Draw the lines: all telegrams of this clock are there."""
        rows = np.array(self._rows, np.int64)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        self._first_ns, self._least_ns = int(rows[0, 0]), int(rows[:, 1].min())
        at, late = ((rows - (self._first_ns, self._least_ns)).astype(np.float64) * 1e-9).T
        if at[-1] < SHORTEST_S:
            self._lines = np.zeros(1), np.zeros(1)
            return
        # Only where there are telegrams: a damaged one may be of another century.
        steps = np.floor(at / (AROUND_S / 2))
        knots = np.unique(np.concatenate((steps, steps + 1.0))) * (AROUND_S / 2)
        self._lines = knots, np.array([_least_at(knot, at, late) for knot in knots])

    def offset_at(self, device_ns: int) -> int:
        """What is added to a device's time [ns]."""
        return self._least_ns + round(float(np.interp((device_ns - self._first_ns) * 1e-9, *self._lines)) * 1e9)


def _least_at(knot: float, at: FloatArray, late: FloatArray) -> float:
    """Delay of the quickest telegram at a time, by those around it [s]."""
    first, last = np.searchsorted(at, (knot - AROUND_S, knot + AROUND_S))
    near, values = at[first:last], late[first:last]
    if len(near) < 2 or near[-1] - near[0] < SHORTEST_S:
        # At the ends, and around a pause: the nearest ones.
        count, here = round(2 * AROUND_S), int(np.searchsorted(at, knot))
        around = np.arange(max(here - count, 0), min(here + count, len(at)))
        nearest = np.sort(around[np.argsort(np.abs(at[around] - knot), kind="stable")[:count]])
        near, values = at[nearest], late[nearest]
    slope, height = line_below(near - knot, values)
    if abs(slope) > LARGEST_DRIFT:
        return float(values.min())
    return height
