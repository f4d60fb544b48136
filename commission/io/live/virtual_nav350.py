"""A virtual NAV350: it says a scan when it is asked for the next one."""

from __future__ import annotations

from commission.io.live.stream_device import StreamClient, StreamDevice
from commission.io.protocols.cola_encoder import encode_nav, frame_binary
from commission.io.protocols.message import Sent
from commission.site.records import Scan

REQUEST = b"sMN mNPOSGetData "


class VirtualNav350(StreamDevice):
    """Answers each request twice: that it has come, and with the next scan."""

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the answer that a scan is in; such a scanner says nothing else."""
        return [frame_binary(encode_nav(record))] if isinstance(record, Scan) else []

    def answer(self, request: bytes, client: StreamClient) -> bytes:
        """Acknowledge a request."""
        if not request.startswith(REQUEST):
            return b""
        client.owe(1)
        return frame_binary(b"sMA mNPOSGetData")
