"""Sources of one vehicle together: what they deliver, in one order. It neither localizes nor writes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from queue import Empty, Full, Queue

from commission.errors import UsageError
from commission.io.live.clocks import HostClock
from commission.io.live.connection import Arrival, Connection, LiveSource
from commission.io.live.links import Link, TcpLink, UdpLink
from commission.io.live.registry import SourceAddress, driver_of
from commission.io.live.sorter import PATIENCE_NS, Sorter
from commission.io.live.status import ODOMETRY, Arrivals
from commission.site.records import Record
from commission.studies.arrival import ArrivalOffset, arrival_offset

BEHIND_NS = 2_000_000_000
"""Time for which this computer may be behind with what has arrived before it is waited for no longer [ns]."""
LOOK_AGAIN_S = 0.002
"""Time after which it is looked again whether it still is [s]."""
QUEUE_LIMIT = 4_096
"""Records that wait to be taken; of more, the newest are dropped and counted."""


def connection_of(
    address: SourceAddress, scanners: tuple[str, ...], clock: HostClock, *, scans_only: bool = False
) -> Connection:
    """Return the connection of a source, not started.

    Parameters
    ----------
    address : which one, and where.
    scanners : names of the vehicle's scanners.
    clock : the host's.
    scans_only : whether odometry comes from another source of the same server.

    Raises
    ------
    UsageError
        the vehicle has no such scanner.
    """
    return Connection(address, driver_of(address, scanners, scans_only=scans_only), link_of(address), clock)


def link_of(address: SourceAddress) -> Link:
    """Return what opens the connection of a source."""
    if address.kind.transport == "udp":
        return UdpLink(address.host, address.port)
    if address.kind.transport == "websocket":
        # Others do not wait for what reads it.
        from commission.io.live.websocket_link import WebsocketLink

        return WebsocketLink(address.host, address.port)
    return TcpLink(address.host, address.port)


class Session:
    """All sources of a vehicle.

    Parameters
    ----------
    sources : one at least, not started.
    patience_ns : how long a record waits for one with an earlier stamp [ns].
    clock : the host's, the same as that of the sources.
    """

    def __init__(
        self, sources: Sequence[LiveSource], patience_ns: int = PATIENCE_NS, clock: HostClock | None = None
    ) -> None:
        if not sources:
            raise UsageError("no source was named; expected one at least")
        self.sources = tuple(sources)
        self.clock = clock or HostClock()
        self.sorter = Sorter(patience_ns)
        self._queue: Queue[tuple[int, Arrival]] = Queue(QUEUE_LIMIT)
        self._read_until_ns = self._newest_ns = 0

    @staticmethod
    def of(addresses: Sequence[SourceAddress], scanners: tuple[str, ...], patience_ns: int = PATIENCE_NS) -> Session:
        """Return the session of some addresses; raises UsageError where one cannot be.

        Parameters
        ----------
        addresses : one at least.
        scanners : names of the vehicle's scanners.
        patience_ns : how long a record waits for one with an earlier stamp [ns].
        """
        clock = HostClock()
        servers = [(address.name, address.host, address.port) for address in addresses]
        # Two scanners of one server: the first source brings its odometry.
        return Session(
            [
                connection_of(address, scanners, clock, scans_only=servers.index(server) < number)
                for number, (address, server) in enumerate(zip(addresses, servers, strict=True))
            ],
            patience_ns,
            clock,
        )

    def start(self) -> None:
        """Start all sources; where one cannot be, none is, and its SourceError passes through."""
        try:
            for number, source in enumerate(self.sources):
                source.start(self._into(number))
        except Exception:
            self.stop()
            raise

    def stop(self) -> None:
        """Stop all sources; what has arrived is still delivered."""
        for source in self.sources:
            source.stop()

    def _into(self, number: int) -> Callable[[Arrival], bool]:
        def deliver(arrival: Arrival) -> bool:
            try:
                self._queue.put_nowait((number, arrival))
            except Full:
                return False
            return True

        return deliver

    def records(self, wait_s: float) -> Iterator[tuple[Record, int]]:
        """Deliver what is due, after waiting for the next arrival.

        Parameters
        ----------
        wait_s : time to wait at most [s].

        Yields
        ------
        record, arrived_ns : in ascending order; the time [ns] is that of the newest arrival so far.
        """
        due_ns = self.sorter.next_due_ns()
        if due_ns is not None:
            left_s = (due_ns - self.clock.now_ns()) * 1e-9
            wait_s = min(wait_s, left_s if left_s > 0.0 else LOOK_AGAIN_S)
        now_ns = self._read_until(self.clock.now_ns())
        self._push(wait_s)
        for record in self.sorter.due(now_ns):
            yield record, self._newest_ns

    def _read_until(self, now_ns: int) -> int:
        """Return the time up to which everything that arrived is in the queue, or should be by now [ns].

        Patience is for what the network has not brought yet. What has arrived and waits for a busy computer to read it
        is no reason to go on without it.
        """
        if any(source.is_behind for source in self.sources):
            now_ns = max(self._read_until_ns, now_ns - BEHIND_NS)
        self._read_until_ns = now_ns
        return now_ns

    def _push(self, wait_s: float) -> None:
        """Wait for an arrival, and sort all there are."""
        try:
            number, arrival = self._queue.get(timeout=wait_s)
            # What floods it is sorted in portions: `due` bounds what waits.
            for _ in range(QUEUE_LIMIT):
                self._sort(number, arrival)
                number, arrival = self._queue.get_nowait()
            self._sort(number, arrival)
        except Empty:
            pass

    def _sort(self, number: int, arrival: Arrival) -> None:
        """Push one arrival of a source."""
        self._newest_ns = arrival.arrived_ns
        self.sorter.push(number, arrival.record, arrival.arrived_ns, arrival.conversation)

    def clocks(self, names: Sequence[str]) -> tuple[ArrivalOffset, ...]:
        """Return what arrival says of the scanners' clocks; nothing of one that too little came of, or no odometry.

        Parameters
        ----------
        names : of the vehicle's scanners.
        """
        kinds: dict[int, Arrivals] = {}
        for source in self.sources:
            for kind, times in source.times().items():
                kinds.setdefault(kind, times)
        driven = kinds.pop(ODOMETRY, None)
        if driven is None:
            return ()
        found = (arrival_offset(names[kind], kinds[kind], driven) for kind in sorted(kinds) if kind < len(names))
        return tuple(each for each in found if each is not None)

    def rest(self) -> Iterator[Record]:
        """Deliver everything that is there, since no more comes."""
        while True:
            try:
                number, arrival = self._queue.get_nowait()
            except Empty:
                break
            self._sort(number, arrival)
        yield from self.sorter.rest()
