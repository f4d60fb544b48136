"""A browser without a browser: a connection that says what a page says, and hears what it hears."""

from __future__ import annotations

from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol


class RawClient:
    """A connection to a server; it counts as a browser from its first camera on."""

    def __init__(self, server: viser.ViserServer) -> None:
        address = f"ws://127.0.0.1:{server.get_port()}"
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self._connection: ClientConnection = connect(address, subprotocols=[protocol], max_size=None)
        self.send(
            type="ViewerCameraMessage",
            **{name: (0.0, 0.0, 1.0) for name in ("position", "look_at", "up_direction")},
            wxyz=(1.0, 0.0, 0.0, 0.0),
            **dict.fromkeys(("fov", "near", "far"), 1.0),
            **dict.fromkeys(("image_height", "image_width"), 100),
        )

    def send(self, **message: Any) -> None:
        """Send one message."""
        self._connection.send(msgspec.msgpack.encode(message))

    def hear(self) -> bytes:
        """Wait for the next bundle of messages and return their msgpack, without the arrays that follow it."""
        bundle = self._connection.recv()
        assert isinstance(bundle, bytes)
        whole, packed = (int.from_bytes(bundle[start : start + 8], "little") for start in (0, 8))
        return zstandard.ZstdDecompressor().decompress(bundle[16 : 16 + packed], max_output_size=whole)

    def close(self) -> None:
        """End the connection."""
        self._connection.close()
