"""Records of several sources in one order: each waits until nothing earlier is due, for a stated patience at most.

It reads no clock: who feeds it says what time it is.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.io.protocols.message import OdometryPose, Sent
from commission.site.records import ORDER_WITHIN_A_STAMP, Detections, Odometry, Record, ReferencePose, Scan

PATIENCE_NS = 100_000_000
"""Time that a record waits for one with an earlier stamp, where none is said [ns]."""
WAITING_LIMIT = 4_096
"""Records that wait at once; of more, the earliest goes on."""
SILENT_NS = 1_000_000_000
"""A channel from which nothing came for so long is not waited for [ns]."""
USUAL = 0.5
"""Share of a channel's usual interval after a record of it during which the next one is not yet due."""

FASTEST, JUMP = 20.0, 0.5
"""A vehicle is not faster [m/s]; odometry that moves by more in no time [m] began anew."""


class _Waiting(NamedTuple):
    key: tuple[int, int, int]
    number: int
    source: int
    arrived_ns: int
    record: Sent
    conversation: int


class _Channel:
    """What is known of when one kind of record comes."""

    def __init__(self) -> None:
        self.newest_ns = self.arrived_ns = 0
        self.interval_ns = 0

    def take(self, stamp_ns: int, arrived_ns: int) -> None:
        if self.newest_ns and stamp_ns > self.newest_ns:
            passed = stamp_ns - self.newest_ns
            # The shorter of two counts at once, a longer one (a lost record) hardly.
            self.interval_ns = min(passed, round(self.interval_ns + 0.1 * (passed - self.interval_ns)) or passed)
        self.newest_ns = max(self.newest_ns, stamp_ns)
        self.arrived_ns = arrived_ns

    @property
    def none_due_until_ns(self) -> int:
        """Time up to which no other record of this channel is due [ns]."""
        return self.newest_ns + round(USUAL * self.interval_ns)


class Sorter:
    """Puts records into the order in which a recording of them is read; references keep an order of their own.

    Parameters
    ----------
    patience_ns : how long a record waits for an earlier one at most [ns].
    """

    def __init__(self, patience_ns: int = PATIENCE_NS) -> None:
        self.patience_ns = patience_ns
        self.told: Counter[str] = Counter()
        """What was mended, in fixed words."""
        self.too_late: Counter[tuple[int, type[Record]]] = Counter()
        """Records that were left out, by number of their source and kind."""
        self._waiting: list[_Waiting] = []
        self._number = 0
        self._channels: dict[tuple[int, int, int], _Channel] = {}
        self._newest: tuple[int, int, int] = (-1, 0, 0)
        self._last: tuple[int, int, int] = (-1, 0, 0)
        self._last_reference_ns = -1
        self._pose: tuple[int, OdometryPose] | None = None
        self._carried: FloatArray | None = None

    def push(self, source: int, record: Sent, arrived_ns: int, conversation: int = 0) -> None:
        """Take a record with its stamp.

        Parameters
        ----------
        source : number of the source that it comes from.
        record : stamped by the host's clock.
        arrived_ns : when it arrived [ns].
        conversation : another number means that the sender, and where its odometry began, is another one.
        """
        key = _key(record)
        self.told["records came after a later one and are sorted"] += key < self._newest
        self._newest = max(self._newest, key)
        if not isinstance(record, ReferencePose):
            # The localizer reads no reference: nothing waits for one.
            channel = self._channels.setdefault((source, *key[1:]), _Channel())
            channel.take(record.stamp_ns, arrived_ns)
        heapq.heappush(self._waiting, _Waiting(key, self._number, source, arrived_ns, record, conversation))
        self._number += 1

    def due(self, now_ns: int) -> Iterator[Record]:
        """Deliver what needs not wait any longer, in ascending order.

        Parameters
        ----------
        now_ns : time by the host's clock [ns].
        """
        active = [channel for channel in self._channels.values() if now_ns - channel.arrived_ns < SILENT_NS]
        until_ns = min((channel.none_due_until_ns for channel in active), default=now_ns)
        while self._waiting:
            first = self._waiting[0]
            is_patient = now_ns - first.arrived_ns < self.patience_ns and len(self._waiting) <= WAITING_LIMIT
            if is_patient and first.key[0] > until_ns:
                return
            yield from self._released(heapq.heappop(self._waiting))

    def next_due_ns(self) -> int | None:
        """Return when the first record has waited for long enough [ns]; None when none waits."""
        return self._waiting[0].arrived_ns + self.patience_ns if self._waiting else None

    def rest(self) -> Iterator[Record]:
        """Deliver everything that waits, since no more comes."""
        while self._waiting:
            yield from self._released(heapq.heappop(self._waiting))

    def _released(self, waiting: _Waiting) -> Iterator[Record]:
        """Return a record whose turn it is, unless a later one has gone before."""
        record = waiting.record
        if isinstance(record, ReferencePose):
            # It waits for nothing and nothing for it: only another reference makes one late.
            if record.stamp_ns > self._last_reference_ns:
                self._last_reference_ns = record.stamp_ns
                yield record
            else:
                self.too_late[waiting.source, ReferencePose] += 1
            return
        is_late = waiting.key <= self._last
        if is_late:
            self.too_late[waiting.source, _kind(record)] += 1
        if isinstance(record, OdometryPose):
            if is_late:
                return
            record = self._moved(record, waiting.conversation)
        elif is_late:
            if isinstance(record, Odometry):
                # What the vehicle moved is not forgotten: it belongs to the next record.
                carried = np.zeros(3) if self._carried is None else self._carried
                self._carried = se2.compose(carried, record.displacement)
            return
        elif isinstance(record, Odometry) and self._carried is not None:
            record = Odometry(record.stamp_ns, se2.compose(self._carried, record.displacement))
            self._carried = None
        self._last = waiting.key
        yield record

    def _moved(self, record: OdometryPose, conversation: int) -> Odometry:
        """Return the motion since the pose before; none since the first, or where poses begin anew."""
        before, self._pose = self._pose, (conversation, record)
        moved = np.zeros(3)
        if before is not None and before[0] == conversation:
            way = se2.relative(before[1].pose, record.pose)
            seconds = (record.stamp_ns - before[1].stamp_ns) * 1e-9
            if float(np.hypot(way[0], way[1])) <= JUMP + FASTEST * seconds:
                moved = way
            else:
                self.told["poses of odometry jumped and are taken as beginning anew"] += 1
        return Odometry(record.stamp_ns, moved)


def _key(record: Sent) -> tuple[int, int, int]:
    """Order of delivery: stamp, kind, scanner."""
    scanner = record.scanner if isinstance(record, Scan | Detections) else 0
    return record.stamp_ns, ORDER_WITHIN_A_STAMP[_kind(record)], scanner


def _kind(record: Sent) -> type[Record]:
    """Return the kind of record that comes of it."""
    return Odometry if isinstance(record, OdometryPose) else type(record)


def stamped(record: Sent, stamp_ns: int) -> Sent:
    """Return a record with another stamp [ns]."""
    return replace(record, stamp_ns=stamp_ns)
