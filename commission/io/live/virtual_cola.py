"""A virtual TiM or LMS: LMDscandata over TCP, in the dialect in which it is asked."""

from __future__ import annotations

from commission.io.live.stream_device import StreamClient, StreamDevice
from commission.io.protocols.cola_encoder import encode_lmd, encode_lmd_text, frame_binary, frame_text
from commission.io.protocols.message import Sent
from commission.site.records import Scan


class VirtualTim(StreamDevice):
    """Sends each scan to who has subscribed to them."""

    is_text = False
    """Whether it speaks CoLa A, and does not understand B."""
    _count = 0

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the frame of a scan; such a scanner says nothing else."""
        if not isinstance(record, Scan):
            return []
        self._count += 1
        encode = encode_lmd_text if self.is_text else encode_lmd
        return [self._framed(encode(record, self._count))]

    def answer(self, request: bytes, client: StreamClient) -> bytes:
        """Answer the subscription."""
        wanted = b"sEN LMDscandata 1" if self.is_text else b"sEN LMDscandata \x01"
        if request != wanted:
            return b""
        client.owe(-1)
        return self._framed(b"sEA LMDscandata " + (b"1" if self.is_text else b"\x01"))

    def _framed(self, content: bytes) -> bytes:
        return (frame_text if self.is_text else frame_binary)(content)
