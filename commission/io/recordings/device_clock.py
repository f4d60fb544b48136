"""Stamps from a device's own clock, which is even, and the times of capture, which are late by whatever the network is.

The least delay is taken as none: it is not measurable here, and stays as a constant offset of the scanner's clock.
"""

from __future__ import annotations


class DeviceClock:
    """Places a device's clock in that of the capture; first it learns from all telegrams, then it stamps them."""

    PERIOD = 2**32 * 1_000
    """Where a counter of microseconds in 32 bits starts again [ns]: after 71 minutes."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._turns = 0
        self._offset: int | None = None

    def learn(self, device_ns: int | None, captured_ns: int) -> None:
        """Take the two times of a telegram [ns]; the device's is None where it says none."""
        if device_ns is None:
            return
        offset = captured_ns - self._unwrapped(device_ns)
        self._offset = offset if self._offset is None else min(self._offset, offset)

    def begin(self) -> None:
        """Begin with the first telegram again."""
        self._last, self._turns = None, 0

    def stamp(self, device_ns: int | None, captured_ns: int) -> int:
        """Return the stamp of a telegram by the clock of the capture [ns]."""
        if device_ns is None or self._offset is None:
            return captured_ns
        return self._unwrapped(device_ns) + self._offset

    def _unwrapped(self, device_ns: int) -> int:
        if self._last is not None and device_ns < self._last - self.PERIOD // 2:
            self._turns += 1
        self._last = device_ns
        return device_ns + self._turns * self.PERIOD
