"""A live source at work: a thread that receives, decodes and counts, and connects again when the other side is gone.

Sockets are bound to the address that was asked for and no other; what is kept is bounded, whatever arrives.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from commission.errors import DecodeError, SourceError
from commission.io.live.clocks import DevicePlaces, HostClock
from commission.io.live.driver import Driver
from commission.io.live.links import Link, Opened
from commission.io.live.registry import SourceAddress
from commission.io.live.senders import NEW_PORTS, Ports, Sender, Senders
from commission.io.live.sorter import stamped
from commission.io.live.status import ODOMETRY, Arrivals, Numbers, SourceState, SourceStatus, Tally
from commission.io.protocols.message import LiveMessage, Sent
from commission.site.records import Detections, ReferencePose, Reflex, Scan, TagSightings

RETRY_S = (0.1, 0.2, 0.5, 1.0, 2.0)
"""Times before connecting again, the last one for ever [s]."""
SENDER_LIMIT = 8
"""Senders to one address that are remembered at once."""
AGAIN = 3
"""Numbers in a row that ascend, and are less than one that came: the sender counts from the begin again."""
REST_NS = 1_000_000_000
"""Time after the end in which what had arrived is still received [ns]."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """A record and when it came."""

    record: Sent
    """Stamped by the host's clock."""
    arrived_ns: int
    """When the piece that completes it arrived [ns]."""
    conversation: int
    """Number of the sender since the start: another one when it began again."""


class LiveSource(Protocol):
    """What every live source offers; a virtual one in a test, too."""

    @property
    def address(self) -> SourceAddress:
        """Where it is; the port is the one in use."""
        ...

    def start(self, deliver: Callable[[Arrival], bool]) -> None:
        """Begin to receive; raises SourceError where an address cannot be listened at.

        Parameters
        ----------
        deliver : takes a record, from the source's own thread; returns whether there was room for it.
        """
        ...

    def stop(self) -> None:
        """Close the connection and end the thread; it can be started again."""
        ...

    def status(self) -> SourceStatus:
        """Return how it is doing."""
        ...

    @property
    def is_behind(self) -> bool:
        """Whether something has arrived that was not delivered yet."""
        ...

    def times(self) -> dict[int, Arrivals]:
        """Return when records of each kind (index of the scanner, or ODOMETRY) were measured and arrived."""
        ...


class Connection:
    """A live source.

    Parameters
    ----------
    address : which one, and where.
    make : makes its driver, anew for each conversation.
    link : what opens the connection.
    clock : the host's.
    """

    def __init__(self, address: SourceAddress, make: Callable[[], Driver], link: Link, clock: HostClock) -> None:
        self.address = address
        self._make, self._link, self._clock = make, link, clock
        self._tally = Tally()
        self._told: Counter[str] = Counter()
        self._stopped = threading.Event()
        self._thread: threading.Thread | None = None
        self._conversations = 0
        self._is_one_scanner = False
        self._senders = Senders(self._told)
        self._ports = Ports()
        self._opened: Opened | None = None
        self._is_busy = False
        self._end_ns = 0

    def start(self, deliver: Callable[[Arrival], bool]) -> None:
        """Begin to receive; see `LiveSource`."""
        if self._thread is not None:
            return
        self._stopped.clear()
        self._tally.state = SourceState.CONNECTING
        opened = None
        if self._link.listens:
            # Whoever asks for an address that cannot be had is told at once.
            opened = self._link.open()
            self.address = self._link.here(self.address, opened)
        name = f"source {self.address.name}"
        self._thread = threading.Thread(target=self._run, args=(deliver, opened), name=name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Close the connection; see `LiveSource`."""
        self._stopped.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)
        self._thread = None
        self._tally.state = SourceState.STOPPED

    def status(self) -> SourceStatus:
        """Return how it is doing; from any thread."""
        return self._tally.status(self._clock.now_ns(), self._told)

    @property
    def is_behind(self) -> bool:
        """Whether something has arrived that was not delivered yet; from any thread."""
        opened = self._opened
        # In this order: what has been taken from the system makes it busy before it is taken.
        return (opened is not None and opened.unread) or self._is_busy

    def times(self) -> dict[int, Arrivals]:
        """Return when the last records of each kind were measured and arrived; from any thread."""
        return self._tally.times()

    def _run(self, deliver: Callable[[Arrival], bool], opened: Opened | None) -> None:
        """Receive until it is stopped; where a fault of this program ends that, the source has failed and says so."""
        try:
            self._receive(deliver, opened)
        finally:
            if not self._stopped.is_set():
                self._tally.trouble = f"receiving ended by a fault of this program: {sys.exception()!r}"
                self._tally.state = SourceState.FAILED

    def _receive(self, deliver: Callable[[Arrival], bool], opened: Opened | None) -> None:
        """Receive until it is stopped; connect again when the connection ends."""
        tries = 0
        while not self._stopped.is_set():
            try:
                opened = opened or self._link.open()
                with opened:
                    tries = 0
                    self._opened = opened
                    self._converse(opened, deliver)
            except (OSError, SourceError) as error:
                self._tally.trouble = str(error) or type(error).__name__
            finally:
                self._opened, self._is_busy = None, False
            opened = None
            if not self._stopped.is_set():
                self._tally.state = SourceState.CONNECTING
                self._stopped.wait(RETRY_S[min(tries, len(RETRY_S) - 1)])
                tries += 1

    def _converse(self, opened: Opened, deliver: Callable[[Arrival], bool]) -> None:
        """Receive from one connection until it ends."""
        conversations: OrderedDict[object, _Conversation] = OrderedDict()
        self._tally.state = SourceState.WAITING
        if not self._link.listens:
            conversations[None] = self._begun()
            opened.send(conversations[None].driver.greeting())
        while self._goes_on(opened):
            self._is_busy = False
            self._is_busy = opened.arrives()
            piece = opened.receive() if self._is_busy else None
            arrived_ns = self._clock.now_ns()
            if piece is None:
                for talk in conversations.values():
                    opened.send(talk.driver.reply(arrived_ns))
                continue
            self._tally.bytes_received += len(piece.data)
            sender = piece.sender if self._is_one_scanner else self._ports.program(piece.sender)
            # Fragments of two scanners would be taken for those of one.
            if self._is_one_scanner and not self._senders.takes(0, sender, arrived_ns):
                continue
            if sender not in conversations:
                conversations[sender] = self._begun(sender)
            conversations.move_to_end(sender)
            if len(conversations) > SENDER_LIMIT:
                conversations.popitem(last=False)
            talk = conversations[sender]
            try:
                for message in talk.driver.take(piece.data, arrived_ns):
                    self._deliver(message, arrived_ns, talk, deliver)
            except DecodeError as error:
                self._tally.undecodable += 1
                self._tally.trouble = str(error)
            opened.send(talk.driver.reply(arrived_ns))

    def _goes_on(self, opened: Opened) -> bool:
        """Whether there is something to receive: until it is stopped, and then what had arrived by then."""
        if not self._stopped.is_set():
            self._end_ns = self._clock.now_ns() + REST_NS
            return True
        return opened.unread and self._clock.now_ns() < self._end_ns

    def _begun(self, sender: Sender | None = None) -> _Conversation:
        """Return a conversation with a sender that begins."""
        driver = self._make()
        # Of all conversations, one count.
        driver.told = self._told
        self._is_one_scanner = driver.is_one_scanner
        self._conversations += 1
        self._tally.connects += 1
        self._tally.forget_times()
        return _Conversation(driver, self._conversations, sender)

    def _deliver(
        self, message: LiveMessage, arrived_ns: int, talk: _Conversation, deliver: Callable[[Arrival], bool]
    ) -> None:
        """Stamp a record and hand it on, unless it came before."""
        channel = _channel(message.record)
        if not self._is_one_scanner and not self._senders.takes(channel, talk.sender, arrived_ns):
            return
        if talk.counts_again(message.sequence, channel):
            talk.places = DevicePlaces()
            self._anew(talk)
        before = talk.places.begun_again
        stamp_ns = talk.places.stamp(message.device_ns, arrived_ns, channel)
        device_ns = self._device_ns(message.device_ns, talk, channel)
        if talk.places.begun_again != before:
            self._anew(talk)
        lost = talk.taken(message.sequence, channel)
        if lost is None:
            self._tally.duplicates += 1
            return
        self._tally.lost = max(self._tally.lost + lost, 0)
        self._tally.arrived(arrived_ns, None if device_ns is None else arrived_ns - stamp_ns)
        if channel >= ODOMETRY:
            self._tally.timed(channel, device_ns, arrived_ns)
        if not deliver(Arrival(stamped(message.record, stamp_ns), arrived_ns, talk.number)):
            self._tally.overrun += 1

    def _anew(self, talk: _Conversation) -> None:
        """Take a sender for another one from here on: it began again."""
        self._conversations += 1
        talk.number = self._conversations
        talk.numbers.clear()
        self._tally.forget_times()

    def _device_ns(self, device_ns: int | None, talk: _Conversation, channel: int) -> int | None:
        """Time by the sender's clock [ns]; None where it has none, and told where it says that it has."""
        if device_ns is not None and talk.places.stands_still(channel):
            self._told["records have a clock that stands still and are stamped as they arrive"] += 1
            return None
        if device_ns is not None and talk.places.several and not talk.is_told:
            talk.is_told = True
            self._told["times a sender's records had clocks more than 1 s apart, each placed by when they arrive"] += 1
        return device_ns


def _channel(record: Sent) -> int:
    """Index of the scanner that a record is of, ODOMETRY, or less of what says nothing of clocks."""
    if isinstance(record, Scan | Detections):
        return record.scanner
    others = ReferencePose, TagSightings, Reflex
    return next((ODOMETRY - 1 - number for number, kind in enumerate(others) if isinstance(record, kind)), ODOMETRY)


class _Conversation:
    """One sender, from when it began."""

    def __init__(self, driver: Driver, number: int, sender: Sender | None) -> None:
        self.driver, self.number, self.sender = driver, number, sender
        self.numbers: dict[int, Numbers] = {}
        self.places = DevicePlaces()
        self.is_told = False
        self._has_several = sender is not None and sender[1] == NEW_PORTS
        self._behind: dict[int, tuple[int, int]] = {}
        """Of each kind the number of the last message, and how many in a row were less than one that came."""

    def counts_again(self, sequence: int | None, channel: int) -> bool:
        """Whether a program whose ports tell nothing counts from the begin again: some numbers that came go on.

        Parameters
        ----------
        sequence : number of a message; None where it has none.
        channel : what kind of record it is of.
        """
        if not self._has_several or sequence is None:
            return False
        before, row = self._behind.get(channel, (sequence, 0))
        is_behind = channel in self.numbers and self.numbers[channel].is_behind(sequence)
        row = (row + 1 if row and sequence > before else 1) if is_behind else 0
        self._behind[channel] = sequence, row
        return row >= AGAIN

    def taken(self, sequence: int | None, channel: int) -> int | None:
        """Take the number of a message; see `Numbers.taken`.

        Parameters
        ----------
        sequence : the number; None where it has none.
        channel : what kind of record it is of.
        """
        # Several programs whose ports tell nothing count each for itself, or one counts all: both are not told apart.
        numbers = self.numbers.setdefault(channel if self._has_several else 0, Numbers())
        lost = numbers.taken(sequence)
        return 0 if lost is not None and len(self.numbers) > 1 else lost
