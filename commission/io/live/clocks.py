"""Time of what arrives: this computer's clock that never steps, and the clocks of devices placed in it.

A device's clock is even and starts anywhere; the time of arrival is right and late by whatever the network and a busy
computer make it. The least delay of the last seconds is taken as none, once the drift of the device's clock is taken
out: what all records are late by is not measurable here and stays as a constant offset.
"""

from __future__ import annotations

import time
from collections import OrderedDict, deque
from collections.abc import Callable

import numpy as np

from commission.studies.arrival import LARGEST_DRIFT, line_below

BLOCK_NS = 1_000_000_000
"""Of so much time the record with the least delay is remembered [ns]."""
WINDOW, LONG_WINDOW = 15, 30
"""Blocks over which the least delay is looked for, before the drift is known and after."""
OLDEST_NS = 60_000_000_000
"""Blocks that are older than the newest by more, since nothing came, say nothing any more [ns]."""
SHORTEST_NS, LONGEST = 40_000_000_000, 120
"""Time [ns] from which on the drift is known, and blocks that it is taken from: of delays of up to 200 ms, at 25
records in a second, to 10 us in a second. Before, a clock that is off by 50 us in a second shifts stamps by 0.8 ms."""
RESTART_NS = 1_000_000_000
"""A device's clock that goes back by more is that of a device that began again [ns]."""
AHEAD_NS = 1_000_000_000
"""One that goes ahead of the quickest records by more was set [ns]."""
STALL_NS = 1_000_000_000
"""Delays that are longer than the least by more, for so long, are those of a clock that stood still [ns]; for a shorter
time the network has stalled, and what was delayed is stamped as it was measured."""
STEPPED, STEPPED_NS = 6, 100_000_000
"""Records in a row, and time that they take [ns], each later than the one before and all earlier than one that came:
the clock was set back."""
STILL_NS = 1_500_000_000
"""Time of arrivals with one and the same time of the device, from which on it has no clock [ns]."""
REMEMBERED = 64
"""Moments of the device whose stamps are remembered: records of one moment have one stamp."""


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
        self._blocks: deque[tuple[int, int, int]] = deque(maxlen=LONGEST)
        self._drift, self._knows_drift = 0.0, False
        self._channels: dict[int, _ChannelTime] = {}
        self._given: OrderedDict[int, int] = OrderedDict()
        self._newest: tuple[int, int] | None = None
        self._stalled_since_ns: int | None = None
        self.begun_again = 0
        """How often the device's clock began again."""

    @property
    def drift(self) -> float:
        """How much faster the host's clock goes than the device's [1]; 0 before it is known."""
        return self._drift

    def is_near(self, device_ns: int, arrived_ns: int) -> bool:
        """Whether a device's time [ns] of what arrived [ns] may be by this clock, and not by quite another one."""
        offset_ns = self._offset_at(device_ns)
        return offset_ns is None or abs(arrived_ns - device_ns - offset_ns) < AHEAD_NS

    def stamp(self, device_ns: int | None, arrived_ns: int, channel: int = 0) -> int:
        """Return the stamp of what arrived, by the host's clock [ns].

        Parameters
        ----------
        device_ns : time by the device's clock; None where it says none: the time of arrival stands.
        arrived_ns : time of arrival by the host's clock.
        channel : what kind of record it is: of one kind, records come in order but for few.
        """
        if device_ns is None:
            return arrived_ns
        seen = self._channels.get(channel)
        if seen is not None and seen.stands_still(device_ns, arrived_ns):
            return arrived_ns
        is_back = seen is not None and device_ns < seen.newest_ns - RESTART_NS
        if is_back or self._was_set(device_ns, arrived_ns, seen):
            self._begin_anew(keeps_order=not is_back)
            self.begun_again += is_back
            seen = None
        if seen is None:
            seen = self._channels[channel] = _ChannelTime(device_ns, arrived_ns)
        seen.take(device_ns, arrived_ns)
        if device_ns in self._given:
            return self._given[device_ns]
        if self._stalled_since_ns is None:
            self._learn(device_ns, arrived_ns)
        offset_ns = self._offset_at(device_ns)
        stamp_ns = self._ordered(device_ns, device_ns + (arrived_ns - device_ns if offset_ns is None else offset_ns))
        self._given[device_ns] = stamp_ns
        if len(self._given) > REMEMBERED:
            self._given.popitem(last=False)
        return stamp_ns

    def stands_still(self, channel: int) -> bool:
        """Whether the clock that the records of a channel have stands still."""
        return channel in self._channels and self._channels[channel].is_still

    def _begin_anew(self, *, keeps_order: bool) -> None:
        """Forget where the clock stood; stamps go on ascending, unless the device began again."""
        self._blocks.clear()
        self._channels.clear()
        self._given.clear()
        self._drift, self._knows_drift, self._stalled_since_ns = 0.0, False, None
        # The next one is the newest, whatever the device said before.
        self._newest = (-(2**63), self._newest[1]) if keeps_order and self._newest is not None else None

    def _was_set(self, device_ns: int, arrived_ns: int, seen: _ChannelTime | None) -> bool:
        """Whether the device's clock was set, or stood still for a while: its delays say nothing any more."""
        offset_ns = self._offset_at(device_ns)
        if offset_ns is None:
            return False
        late_ns = arrived_ns - device_ns - offset_ns
        if late_ns < -AHEAD_NS or (seen is not None and seen.stepped_back(arrived_ns)):
            return True
        if late_ns <= STALL_NS or (seen is not None and device_ns == seen.newest_ns):
            self._stalled_since_ns = None
            return False
        if self._stalled_since_ns is None:
            self._stalled_since_ns = arrived_ns
        return arrived_ns - self._stalled_since_ns > STALL_NS

    def _learn(self, device_ns: int, arrived_ns: int) -> None:
        """Remember of each block of time the least delay."""
        if self._blocks and arrived_ns - self._blocks[-1][0] < BLOCK_NS:
            begin_ns, _, least_ns = self._blocks[-1]
            # Within a second, drift is nothing.
            if arrived_ns - device_ns < least_ns:
                self._blocks[-1] = begin_ns, device_ns, arrived_ns - device_ns
            return
        self._follow_drift()
        self._blocks.append((arrived_ns, device_ns, arrived_ns - device_ns))

    def _follow_drift(self) -> None:
        """Take the drift from the line below the least delays of the last minutes."""
        if not self._blocks or self._blocks[-1][0] - self._blocks[0][0] < SHORTEST_NS:
            return
        rows = np.array(self._blocks, np.int64)
        rows = rows[np.argsort(rows[:, 1], kind="stable")]
        drift, _ = line_below((rows[:, 1] - rows[0, 1]) * 1e-9, (rows[:, 2] - rows[:, 2].min()) * 1e-9)
        # Beyond, it is none: a vehicle that is shown faster than it drove, a network that became slower.
        self._drift, self._knows_drift = (drift if abs(drift) <= LARGEST_DRIFT else 0.0), abs(drift) <= LARGEST_DRIFT

    def _offset_at(self, device_ns: int) -> int | None:
        """What is added to a device's time [ns]; None before anything arrived."""
        if not self._blocks:
            return None
        drift, least_ns = self._drift, 0
        window = LONG_WINDOW if self._knows_drift else WINDOW
        for number, (begin_ns, at_ns, delay_ns) in enumerate(reversed(self._blocks)):
            if number >= window or self._blocks[-1][0] - begin_ns > OLDEST_NS:
                break
            found_ns = delay_ns + round(drift * (device_ns - at_ns))
            least_ns = min(least_ns, found_ns) if number else found_ns
        return least_ns

    def _ordered(self, device_ns: int, stamp_ns: int) -> int:
        """Return a stamp [ns] in the order of the device's times: while the least delay is found, it would go back."""
        if self._newest is None or device_ns > self._newest[0]:
            if self._newest is not None:
                stamp_ns = max(stamp_ns, self._newest[1] + 1)
            self._newest = device_ns, stamp_ns
            return stamp_ns
        return min(stamp_ns, self._newest[1] - 1)


class DevicePlaces:
    """Clocks of one sender: mostly one; some hand on what others have stamped."""

    def __init__(self) -> None:
        self._places: list[DevicePlace] = []
        self._of: dict[int, DevicePlace] = {}

    @property
    def begun_again(self) -> int:
        """How often one of them began again."""
        return sum(place.begun_again for place in self._places)

    @property
    def several(self) -> bool:
        """Whether its records have clocks that differ by a second and more."""
        return len(self._places) > 1

    def stands_still(self, channel: int) -> bool:
        """Whether the clock that the records of a channel have stands still."""
        return channel in self._of and self._of[channel].stands_still(channel)

    def stamp(self, device_ns: int | None, arrived_ns: int, channel: int = 0) -> int:
        """Return the stamp of what arrived, by the host's clock [ns].

        Parameters
        ----------
        device_ns : time by the sender's clock; None where it says none: the time of arrival stands.
        arrived_ns : time of arrival by the host's clock.
        channel : what kind of record it is.
        """
        if device_ns is None:
            return arrived_ns
        place = self._of.get(channel)
        if place is None:
            place = next((each for each in self._places if each.is_near(device_ns, arrived_ns)), None)
            if place is None:
                place = DevicePlace()
                self._places.append(place)
            self._of[channel] = place
        return place.stamp(device_ns, arrived_ns, channel)


class _ChannelTime:
    """Times of the device that one kind of record says."""

    def __init__(self, device_ns: int, arrived_ns: int) -> None:
        self.newest_ns = self._last_ns = device_ns
        self._since_ns = self._newest_came_ns = arrived_ns
        self._older = 0
        self.is_still = False

    def take(self, device_ns: int, arrived_ns: int) -> None:
        """Take the time that a record says [ns], and when it arrived [ns]."""
        if device_ns != self._last_ns:
            self._since_ns = arrived_ns
        if device_ns >= self.newest_ns:
            self._older, self.newest_ns, self._newest_came_ns = 0, device_ns, arrived_ns
        else:
            self._older = self._older + 1 if device_ns > self._last_ns else 1
        self._last_ns = device_ns

    def stepped_back(self, arrived_ns: int) -> bool:
        """Whether all that arrives is older than something that came long before [ns]."""
        return self._older >= STEPPED and arrived_ns - self._newest_came_ns > STEPPED_NS

    def stands_still(self, device_ns: int, arrived_ns: int) -> bool:
        """Whether a record says the same time [ns] as all others of a long time [ns]."""
        self.is_still = device_ns == self._last_ns and arrived_ns - self._since_ns > STILL_NS
        return self.is_still
