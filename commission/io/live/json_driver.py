"""Plain JSON over UDP, one record in each datagram: the source `json`."""

from __future__ import annotations

from collections.abc import Iterator

from commission.io.live.driver import BaseDriver
from commission.io.protocols.json_records import decode_message
from commission.io.protocols.message import LiveMessage


class JsonDriver(BaseDriver):
    """Whatever sends records as JSON."""

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:  # noqa: ARG002 - the driver's
        """Deliver the record of a datagram; raises DecodeError."""
        yield decode_message(data, self.scanners)
