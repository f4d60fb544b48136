"""Time by a device's own clock, from what its telegrams say: counters that wrap, and times that jitter.

It uses no time of arrival but to tell a counter that wrapped from a device that began again.
"""

from __future__ import annotations

from collections import deque

import numpy as np

WRAP = 2**32
"""Where a counter of 32 bits begins again: one of microseconds after 71 minutes, of milliseconds after 49 days."""
PATIENCE_NS = 60_000_000_000
"""What waits on the network for longer is of a device that began again [ns]."""
WINDOW = 256
"""Scans whose times are put in line: ten seconds at 25 Hz."""
FEWEST = 16
"""Scans of which no line is drawn yet."""
APART = 0.75
"""Intervals between scans by which a time is beside the line when its clock was set, or a scan was not counted."""


class Counter32:
    """A counter of time that begins again after 2^32 units, as one that does not.

    Parameters
    ----------
    unit_ns : what it counts [ns].
    """

    def __init__(self, unit_ns: int) -> None:
        self._unit_ns = unit_ns
        self._last: tuple[int, int] | None = None

    def unwrapped(self, count: int, arrived_ns: int) -> int:
        """Return the time by the device's clock; of a device that began again, what it counts since then [ns].

        Parameters
        ----------
        count : what a telegram says.
        arrived_ns : when it arrived [ns].
        """
        period_ns, found_ns = WRAP * self._unit_ns, count * self._unit_ns
        if self._last is not None:
            last_ns, last_arrived_ns = self._last
            waited_ns = arrived_ns - last_arrived_ns
            ahead_ns = (found_ns - last_ns) % period_ns
            if ahead_ns > period_ns - PATIENCE_NS:
                ahead_ns -= period_ns
            ahead_ns += period_ns * max(0, round((waited_ns - ahead_ns) / period_ns))
            if ahead_ns <= waited_ns + PATIENCE_NS:
                found_ns = last_ns + ahead_ns
        self._last = found_ns, arrived_ns
        return found_ns


class EvenTime:
    """Times of scans that turn evenly, from times that jitter and the numbers of the scans: on the line of both.

    The line is the one of least squares through the last scans; their jitter is in it by its mean alone, which is
    constant.
    """

    def __init__(self) -> None:
        self._rows: deque[tuple[int, int]] = deque(maxlen=WINDOW)

    def of(self, number: int, device_ns: int) -> int | None:
        """Return the time of a scan [ns]; before there is a line, the one it says itself; None of a clock that stands.

        Parameters
        ----------
        number : of the scan; scans that are not sent count, too.
        device_ns : time that it says [ns].
        """
        if self._rows and device_ns == self._rows[-1][1]:
            return None
        line = self._line()
        if line is not None and abs(device_ns - self._at(line, number)) > APART * line[1]:
            line = None
            self._rows.clear()
        elif self._rows and device_ns < self._rows[0][1]:
            self._rows.clear()
        if not self._rows or number > self._rows[-1][0]:
            self._rows.append((number, device_ns))
            line = self._line()
        return device_ns if line is None else self._at(line, number)

    def _line(self) -> tuple[float, float] | None:
        """Height at the first row [ns, from its time] and slope [ns] of the line; None where there is none."""
        if len(self._rows) < FEWEST:
            return None
        first_number, first_ns = self._rows[0]
        numbers = np.array([number - first_number for number, _ in self._rows], np.float64)
        times = np.array([at - first_ns for _, at in self._rows], np.float64)
        away = numbers - numbers.mean()
        slope = float(away @ times / (away @ away))
        return (float(times.mean() - slope * numbers.mean()), slope) if slope > 0.0 else None

    def _at(self, line: tuple[float, float], number: int) -> int:
        """Time of a scan by the line [ns]."""
        first_number, first_ns = self._rows[0]
        return first_ns + round(line[0] + line[1] * (number - first_number))
