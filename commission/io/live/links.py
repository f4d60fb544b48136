"""What carries bytes: a datagram socket that listens, a stream that is connected to. It knows no protocol."""

from __future__ import annotations

import selectors
import socket
from dataclasses import replace
from types import TracebackType
from typing import NamedTuple, Protocol, Self

from commission.errors import SourceError
from commission.io.live.registry import SourceAddress

LOOK_UP_S = 0.1
"""Time after which a thread that receives looks whether it is to stop [s]."""
CONNECT_S = 2.0
"""Time in which a device has to take a connection [s]."""
LONGEST_SILENCE_S = 10.0
"""Time after which a stream that says nothing is connected to anew [s]."""
PIECE_BYTES = 65_536
RECEIVE_BUFFER = 1 << 20
"""Bytes that the system keeps while a thread is busy: a second of a scanner's data."""


class Piece(NamedTuple):
    """What arrived at once."""

    data: bytes
    sender: tuple[str, int] | None = None
    """Address of who sent it, where there may be several."""


class Opened(Protocol):
    """An open connection; a context manager that closes it."""

    @property
    def unread(self) -> bool:
        """Whether something has arrived that was not received yet; asked by any thread."""
        ...

    def arrives(self) -> bool:
        """Wait for a moment; returns whether something is there. Raises OSError or SourceError at its end."""
        ...

    def receive(self) -> Piece | None:
        """Return what is there; None where nothing is. Raises OSError or SourceError at its end."""
        ...

    def send(self, data: bytes) -> None:
        """Send something; nothing where there is nothing to send, or to who is only listened to."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class Link(Protocol):
    """How a connection is opened."""

    @property
    def listens(self) -> bool:
        """Whether it listens at an address of this computer."""
        ...

    def open(self) -> Opened:
        """Open it; raises SourceError or OSError."""
        ...

    def here(self, address: SourceAddress, opened: Opened) -> SourceAddress:
        """Return an address with the port that is in use."""
        ...


class _Closing:
    """Closes its socket at the end."""

    def __init__(self, opened: socket.socket) -> None:
        self.socket = opened
        self._selector = selectors.DefaultSelector()
        self._selector.register(opened, selectors.EVENT_READ)

    @property
    def unread(self) -> bool:
        """Whether the system has something for it; of one that is being closed, nothing."""
        try:
            return bool(self._selector.select(0.0))
        except (OSError, ValueError, RuntimeError):
            return False

    def arrives(self) -> bool:
        """Wait for a moment, without taking what arrives."""
        return bool(self._selector.select(LOOK_UP_S))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._selector.close()
        self.socket.close()


class _Datagrams(_Closing):
    """A socket that datagrams arrive at."""

    def receive(self) -> Piece | None:
        """Return one datagram."""
        try:
            data, (host, port, *_) = self.socket.recvfrom(PIECE_BYTES)
        except TimeoutError:
            return None
        return Piece(data, (str(host), int(port)))

    def send(self, data: bytes) -> None:
        """Send nothing: who sends datagrams is only listened to."""


class UdpLink:
    """Listens for datagrams at one address of this computer.

    Parameters
    ----------
    host, port : where; port 0 takes a free one.
    """

    listens = True

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port

    def open(self) -> Opened:
        """Bind the socket; raises SourceError that says what is in the way."""
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            opened.bind((self.host, self.port))
        except OSError as error:
            opened.close()
            found = error.strerror or str(error)
            raise SourceError(
                f"UDP {self.host}:{self.port} cannot be listened at ({found}); expected a free port of an address of "
                "this computer"
            ) from error
        opened.settimeout(LOOK_UP_S)
        return _Datagrams(opened)

    def here(self, address: SourceAddress, opened: Opened) -> SourceAddress:
        """Return an address with the port that was taken, which stays the same when it is opened again."""
        if isinstance(opened, _Datagrams):
            self.port = int(opened.socket.getsockname()[1])
        return replace(address, port=self.port)


class _Stream(_Closing):
    """A stream of bytes."""

    def __init__(self, opened: socket.socket) -> None:
        super().__init__(opened)
        self._moments = 0

    def arrives(self) -> bool:
        """Wait for a moment; raises SourceError after a long silence."""
        if super().arrives():
            self._moments = 0
            return True
        self._moments += 1
        if self._moments * LOOK_UP_S > LONGEST_SILENCE_S:
            raise SourceError(f"nothing came for {LONGEST_SILENCE_S:g} s; it is connected to anew")
        return False

    def receive(self) -> Piece | None:
        """Return what has arrived."""
        try:
            data = self.socket.recv(PIECE_BYTES)
        except TimeoutError:
            return None
        if not data:
            raise SourceError("the device has closed the connection")
        return Piece(data)

    def send(self, data: bytes) -> None:
        """Send everything."""
        if data:
            self.socket.sendall(data)


class TcpLink:
    """Connects to a device.

    Parameters
    ----------
    host, port : of the device.
    """

    listens = False

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port

    def open(self) -> Opened:
        """Connect; raises SourceError."""
        try:
            opened = socket.create_connection((self.host, self.port), timeout=CONNECT_S)
        except OSError as error:
            found = error.strerror or str(error)
            raise SourceError(f"TCP {self.host}:{self.port} does not answer ({found})") from error
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        opened.settimeout(LOOK_UP_S)
        return _Stream(opened)

    def here(self, address: SourceAddress, opened: Opened) -> SourceAddress:  # noqa: ARG002 - the link's
        """Return the address as it is: it is the device's."""
        return address
