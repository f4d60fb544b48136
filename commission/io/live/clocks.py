"""Time of what arrives: this computer's clock that never steps, and the clocks of devices placed in it.

A device's clock is even and starts anywhere; the time of arrival is right and late by whatever the network is. The
least delay of the last seconds is taken as none: it is not measurable here and stays as a constant offset.
"""

from __future__ import annotations

import time
from collections.abc import Callable

WINDOW_NS = 10_000_000_000
"""Time over which the least delay is looked for, twice at most: with a drift of 50 us in a second it is off by 1 ms."""
RESTART_NS = 1_000_000_000
"""A device's clock that goes back by more is that of a device that began again [ns]."""
STALL_NS = 1_000_000_000
"""Delays that are longer than the least by more, for so long, are those of a clock that stood still [ns]; for a shorter
time the network has stalled, and what was delayed is stamped as it was measured."""


class HostClock:
    """Nanoseconds since 1970 that go on evenly: a step of the computer's clock by NTP is not in them."""

    def __init__(
        self, monotonic: Callable[[], int] = time.monotonic_ns, wall: Callable[[], int] = time.time_ns
    ) -> None:
        self._monotonic = monotonic
        self._offset = wall() - monotonic()

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return self._monotonic() + self._offset


class DevicePlace:
    """Where a device's clock stands in the host's, learned from what arrives. Stamps keep the order of the device's."""

    def __init__(self) -> None:
        self._newest_ns: int | None = None
        self._stamp_ns = 0
        self._least: tuple[int, int] | None = None
        self._window_begin_ns = 0
        self._stalled_since_ns: int | None = None
        self.begun_again = 0
        """How often the device's clock began again."""

    @property
    def offset_ns(self) -> int | None:
        """What is added to the device's time [ns]; None before anything arrived."""
        return None if self._least is None else min(self._least)

    def stamp(self, device_ns: int | None, arrived_ns: int) -> int:
        """Return the stamp of what arrived, by the host's clock [ns].

        Parameters
        ----------
        device_ns : time by the device's clock; None where it says none: the time of arrival stands.
        arrived_ns : time of arrival by the host's clock.
        """
        if device_ns is None:
            return arrived_ns
        delay = arrived_ns - device_ns
        went_back = self._newest_ns is not None and device_ns < self._newest_ns - RESTART_NS
        self.begun_again += went_back
        if self._least is None or went_back or self._stood_still(delay, arrived_ns):
            self._least = delay, delay
            self._window_begin_ns, self._stalled_since_ns = arrived_ns, None
            self._newest_ns = None if went_back else self._newest_ns
        if arrived_ns - self._window_begin_ns > WINDOW_NS and self._stalled_since_ns is None:
            self._least = self._least[1], delay
            self._window_begin_ns = arrived_ns
        self._least = self._least[0], min(self._least[1], delay)
        stamp = device_ns + min(self._least)
        if self._newest_ns is None:
            self._newest_ns, self._stamp_ns = device_ns, stamp
        elif device_ns > self._newest_ns:
            # While the least delay is still being found, time would go back by what is found.
            self._newest_ns, self._stamp_ns = device_ns, max(stamp, self._stamp_ns + 1)
        elif device_ns == self._newest_ns:
            return self._stamp_ns
        else:
            return min(stamp, self._stamp_ns - 1)
        return self._stamp_ns

    def _stood_still(self, delay: int, arrived_ns: int) -> bool:
        """Whether delays have been too long for so long that the device's clock must have stood still."""
        if self._least is None or delay <= min(self._least) + STALL_NS:
            self._stalled_since_ns = None
            return False
        if self._stalled_since_ns is None:
            self._stalled_since_ns = arrived_ns
        return arrived_ns - self._stalled_since_ns > STALL_NS
