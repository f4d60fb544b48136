"""What carries messages of a websocket; like `links`, it knows no protocol."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from commission.errors import SourceError
from commission.io.live.links import CONNECT_S, LONGEST_SILENCE_S, LOOK_UP_S, Opened, Piece
from commission.io.live.registry import SourceAddress

MESSAGE_LIMIT = 4_000_000
"""Bytes of a message; of a longer one the connection is closed before it is in memory."""


class _Messages:
    """An open websocket."""

    def __init__(self, opened: ClientConnection) -> None:
        self._opened = opened
        self._moments = 0
        self._piece: Piece | None = None

    @property
    def unread(self) -> bool:
        """Whether a message waits: not told, since the library takes it from the system by a thread of its own."""
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._opened.close()

    def arrives(self) -> bool:
        """Wait for one message for a moment."""
        try:
            data = self._opened.recv(timeout=LOOK_UP_S)
        except TimeoutError:
            self._moments += 1
            if self._moments * LOOK_UP_S > LONGEST_SILENCE_S:
                raise SourceError(f"nothing came for {LONGEST_SILENCE_S:g} s; it is connected to anew") from None
            return False
        except WebSocketException as error:
            raise SourceError(f"the server has closed the connection ({error})") from error
        self._moments = 0
        self._piece = Piece(data.encode() if isinstance(data, str) else data)
        return True

    def receive(self) -> Piece | None:
        """Return the message that has arrived."""
        piece, self._piece = self._piece, None
        return piece

    def send(self, data: bytes) -> None:
        """Send each line as a text message."""
        try:
            for line in data.splitlines():
                self._opened.send(line.decode())
        except WebSocketException as error:
            raise SourceError(f"the server has closed the connection ({error})") from error


class WebsocketLink:
    """Connects to a server of websockets.

    Parameters
    ----------
    host, port : of the server.
    """

    listens = False

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port

    def open(self) -> Opened:
        """Connect; raises SourceError."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        try:
            opened = connect(
                f"ws://{host}:{self.port}",
                open_timeout=CONNECT_S,
                close_timeout=LOOK_UP_S,
                max_size=MESSAGE_LIMIT,
                proxy=None,
                compression=None,
            )
        except (OSError, WebSocketException) as error:
            raise SourceError(f"{host}:{self.port} is no websocket that answers ({error})") from error
        return _Messages(opened)

    def here(self, address: SourceAddress, opened: Opened) -> SourceAddress:  # noqa: ARG002 - the link's
        """Return the address as it is: it is the server's."""
        return address
