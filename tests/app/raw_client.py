"""A browser without a browser: a connection that says what a page says, and hears what it hears."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

CAMERA = {
    "position": (0.0, 0.0, 1.0),
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 1.0, 0.0),
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    **dict.fromkeys(("fov", "near", "far"), 1.0),
    **dict.fromkeys(("image_height", "image_width"), 100),
}
"""What a browser says of its camera, without the type of the message."""


class RawClient:
    """A connection to a server; it counts as a browser from its first camera on.

    Parameters
    ----------
    server : a started one.
    is_silent : whether to send no camera, and so to stay what is not a browser yet.
    headers : of its request, besides those that each has.
    """

    def __init__(
        self, server: viser.ViserServer, *, is_silent: bool = False, headers: dict[str, str] | None = None
    ) -> None:
        address = f"ws://127.0.0.1:{server.get_port()}"
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self.server = server
        self._connection: ClientConnection = connect(
            address, subprotocols=[protocol], max_size=None, additional_headers=headers
        )
        self.heard: list[dict[str, Any]] = []
        """Every message so far, except for the arrays in them."""
        if not is_silent:
            self.send(type="ViewerCameraMessage", **CAMERA)

    def send(self, **message: Any) -> None:
        """Send one message."""
        self.send_raw(msgspec.msgpack.encode(message))

    def send_raw(self, message: bytes | str) -> None:
        """Send anything."""
        self._connection.send(message)

    def update(self, widget: Any, value: object, name: str = "value") -> None:
        """Say that a person has changed a widget."""
        self.send(type="GuiUpdateMessage", uuid=widget._impl.uuid, updates={name: value})

    def hear(self, timeout: float | None = None) -> bytes:
        """Wait for the next bundle of messages and return their msgpack, without the arrays that follow it."""
        bundle = self._connection.recv(timeout)
        assert isinstance(bundle, bytes)
        whole, packed = (int.from_bytes(bundle[start : start + 8], "little") for start in (0, 8))
        content = zstandard.ZstdDecompressor().decompress(bundle[16 : 16 + packed], max_output_size=whole)
        self.heard += msgspec.msgpack.decode(content)["messages"]
        return content

    def hear_until(self, reached: Callable[[dict[str, Any]], bool], seconds: float = 10.0) -> dict[str, Any]:
        """Return the first message, of those to come, for which something holds."""
        end = time.monotonic() + seconds
        while True:
            before = len(self.heard)
            self.hear(max(end - time.monotonic(), 0.0))
            for message in self.heard[before:]:
                if reached(message):
                    return message

    def hear_all(self, seconds: float) -> None:
        """Hear whatever comes in this time."""
        end = time.monotonic() + seconds
        try:
            while True:
                self.hear(max(end - time.monotonic(), 0.0))
        except (TimeoutError, ConnectionClosed):
            pass

    @property
    def refusals(self) -> list[str]:
        """What this browser has been told of what it said."""
        return [note["body"] for note in self.notes if note["title"] == "Not taken"]

    @property
    def refused(self) -> int:
        """How many refusals it has been told of; a flood of them is one note with their number."""
        return sum(1 + _more(text) for text in self.refusals)

    @property
    def notes(self) -> list[dict[str, Any]]:
        """Every note that was shown to this browser."""
        return [message["props"] for message in self.heard if message["type"] == "NotificationShowMessage"]

    @property
    def close_reason(self) -> str:
        """Why the server has ended the connection; empty while it has not."""
        return self._connection.close_reason or ""

    def close(self) -> None:
        """End the connection."""
        self._connection.close()


def _more(text: str) -> int:
    """Number in "(and 3 more)" at the end of a note."""
    return int(text.rpartition("(and ")[2].split()[0]) if text.endswith(" more)") else 0
