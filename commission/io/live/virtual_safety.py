"""A virtual SICK safety scanner: data output over UDP."""

from __future__ import annotations

from commission.io.live.virtual_device import DatagramDevice
from commission.io.protocols import safety_encoder
from commission.io.protocols.message import Sent
from commission.site.records import Scan


class VirtualSafetyScanner(DatagramDevice):
    """Sends scans in fragments."""

    _sequence = 0

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the datagrams of a scan; such a scanner says nothing else."""
        if not isinstance(record, Scan):
            return []
        instance = safety_encoder.encode_instance(record, self._sequence)
        self._sequence += 1
        return safety_encoder.encode_fragments(instance, self._sequence)
