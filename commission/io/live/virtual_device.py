"""What every virtual device offers: it sends records through the real protocol. The vehicle that it is on is beside."""

from __future__ import annotations

import socket
from types import TracebackType
from typing import ClassVar, Protocol, Self

from commission.io.live.registry import SourceAddress
from commission.io.protocols.message import Sent


class VirtualDevice(Protocol):
    """Sends records as a real device does; a context manager that opens and closes it."""

    sends_all: ClassVar[bool]
    """Whether its protocol says odometry, too; else it is a scanner, and says scans only."""

    def pieces(self, record: Sent) -> list[bytes]:
        """Return what is sent of a record; nothing where the protocol does not say such."""
        ...

    def send(self, record: Sent) -> None:
        """Send a record; raises OSError where the network refuses."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class DatagramDevice:
    """A device that sends datagrams to one address.

    Parameters
    ----------
    address : of who listens.
    scanners : names of the vehicle's scanners.
    """

    sends_all: ClassVar[bool] = False

    def __init__(self, address: SourceAddress, scanners: tuple[str, ...]) -> None:
        self.scanners = scanners
        self._to = address.host, address.port
        self._socket: socket.socket | None = None

    def __enter__(self) -> Self:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._socket is not None:
            self._socket.close()

    def pieces(self, record: Sent) -> list[bytes]:
        """Return the datagrams of a record."""
        raise NotImplementedError

    def send(self, record: Sent) -> None:
        """Send the datagrams of a record."""
        if self._socket is None:
            raise ValueError("a device is not open; expected `with device`")
        for piece in self.pieces(record):
            self._socket.sendto(piece, self._to)
