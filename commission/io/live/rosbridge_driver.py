"""A ROS 1 or ROS 2 vehicle behind rosbridge: the source `rosbridge`. It subscribes and publishes nothing."""

from __future__ import annotations

from collections.abc import Iterator

from commission.io.live.driver import BaseDriver
from commission.io.protocols.message import LiveMessage
from commission.io.protocols.rosbridge import decode_publication, decode_record, subscription
from commission.io.recordings.recorder import scanner_topics

SCAN, ODOMETRY, REFERENCE = "/scan", "/odom", "/reference"
ASK_AGAIN_NS = 2_000_000_000
"""Time without a message after which topics are subscribed to again: they may be there only now [ns]."""


class RosbridgeDriver(BaseDriver):
    """Scans of /scan, of several scanners of /NAME/scan; odometry of /odom; a second system's pose of /reference.

    Parameters
    ----------
    scanners : names of the vehicle's scanners.
    scanner : which of them this source is, once `restrict` says that it is one; else the topics say it.
    """

    def __init__(self, scanners: tuple[str, ...], scanner: int) -> None:
        super().__init__(scanners, scanner)
        self._scans = {topic: index for index, topic in enumerate(scanner_topics(scanners))}
        self._others = REFERENCE, ODOMETRY
        self._stamps: dict[str, int | None] = {}
        self._heard_ns: int | None = None

    def restrict(self, *, scans_only: bool) -> None:
        """Take the scans of one scanner alone: of its own topic, or of /scan where the server has no other."""
        self._scans = {topic: index for topic, index in self._scans.items() if index == self.scanner}
        self._scans[SCAN] = self.scanner
        self._others = () if scans_only else self._others

    def greeting(self) -> bytes:
        """Subscribe; one request in each line."""
        return "\n".join(map(subscription, (*self._others, *self._scans))).encode()

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:
        """Deliver the record of a publication; raises DecodeError."""
        found = decode_publication(data)
        if found is None or found[0] not in (*self._scans, *self._others):
            return
        self._heard_ns = arrived_ns
        message = decode_record(*found, self._scans)
        if message is None:
            return
        if message.device_ns is not None and self._stamps.get(found[0]) == message.device_ns:
            self.told["messages came twice and are taken once"] += 1
            return
        self._stamps[found[0]] = message.device_ns
        yield message

    def reply(self, now_ns: int) -> bytes:
        """Subscribe again while nothing is published."""
        if self._heard_ns is None:
            self._heard_ns = now_ns
        if now_ns - self._heard_ns < ASK_AGAIN_NS:
            return b""
        self._heard_ns = now_ns
        return self.greeting()
