"""What is particular to one protocol of a live source: from bytes that arrive to messages. It opens no socket."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import ClassVar, Protocol

from commission.io.protocols.assembly import Assembly
from commission.io.protocols.message import LiveMessage


class Driver(Protocol):
    """One conversation with one sender, from its first byte; a new one is made when it begins again."""

    is_one_scanner: ClassVar[bool]
    """Whether all that arrives is of one scanner."""
    told: Counter[str]
    """What was left out and why, in fixed words."""

    def greeting(self) -> bytes:
        """Return what is sent first; nothing to who is only listened to."""
        ...

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:
        """Deliver what a piece completes; raises DecodeError where it cannot be, and goes on with the next piece.

        Parameters
        ----------
        data : a datagram, a message of a websocket, or a piece of a stream that begins and ends anywhere.
        arrived_ns : when it arrived [ns].
        """
        ...

    def reply(self, now_ns: int) -> bytes:
        """Return what is to be sent now, mostly nothing; asked after each piece, and some times in a second [ns]."""
        ...


class BaseDriver:
    """A driver that sends nothing.

    Parameters
    ----------
    scanners : names of the vehicle's scanners.
    scanner : which of them this source is, where it is one.
    """

    is_one_scanner: ClassVar[bool] = False

    def __init__(self, scanners: tuple[str, ...], scanner: int) -> None:
        self.scanners = scanners
        self.scanner = scanner
        self.told: Counter[str] = Counter()

    def restrict(self, *, scans_only: bool) -> None:
        """Be the source of one named scanner; what says so itself anyway has nothing to do.

        Parameters
        ----------
        scans_only : whether odometry comes from another source of the same server, and would come twice.
        """

    def greeting(self) -> bytes:
        """Return nothing."""
        return b""

    def reply(self, now_ns: int) -> bytes:  # noqa: ARG002 - the driver's
        """Return nothing."""
        return b""


class ScannerDriver(BaseDriver):
    """A driver of a scanner whose telegrams an assembly puts together, as in a capture.

    Parameters
    ----------
    scanners : names of the vehicle's scanners.
    scanner : which of them this is.
    """

    is_one_scanner = True
    assembly: ClassVar[Callable[[str, Counter[str]], Assembly]]

    def __init__(self, scanners: tuple[str, ...], scanner: int) -> None:
        super().__init__(scanners, scanner)
        self._assembly = type(self).assembly(scanners[scanner], self.told)

    def take(self, data: bytes, arrived_ns: int) -> Iterator[LiveMessage]:
        """Deliver the scans that a piece completes; raises DecodeError."""
        for device_ns, _, make in self._assembly.found(data, arrived_ns):
            scan = make(arrived_ns, self.scanner)
            if scan is not None:
                yield LiveMessage(scan, device_ns=device_ns)
