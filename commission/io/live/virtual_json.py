"""A virtual vehicle's computer that sends all its records as JSON over UDP."""

from __future__ import annotations

from commission.io.live.virtual_device import DatagramDevice
from commission.io.protocols.json_records import encode_message
from commission.io.protocols.message import LiveMessage, Sent


class JsonVehicle(DatagramDevice):
    """Sends every record, numbered."""

    sends_all = True
    _sequence = 0

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the one datagram of a record."""
        message = LiveMessage(record, device_ns=record.stamp_ns, sequence=self._sequence)
        self._sequence += 1
        return [encode_message(message, self.scanners)]
