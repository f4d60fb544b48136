"""A virtual picoScan: Compact telegrams over UDP."""

from __future__ import annotations

from commission.io.live.virtual_device import DatagramDevice
from commission.io.protocols.compact_encoder import encode_turn
from commission.io.protocols.message import Sent
from commission.site.records import Scan


class VirtualPicoScan(DatagramDevice):
    """Sends scans in segments."""

    _turn = 0

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the datagrams of a scan; such a scanner says nothing else."""
        if not isinstance(record, Scan):
            return []
        self._turn += 1
        return encode_turn(record, self._turn)
