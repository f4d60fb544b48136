"""No record is lost by this computer: what has arrived and was not read yet is waited for; what is lost is told."""

from __future__ import annotations

import socket
import threading
import typing
from collections.abc import Callable

import numpy as np

from commission.io.live.accounts import RecordAccount
from commission.io.live.clocks import HostClock
from commission.io.live.connection import Arrival
from commission.io.live.registry import SourceAddress
from commission.io.live.session import BEHIND_NS, Session, connection_of
from commission.io.live.sorter import PATIENCE_NS, Sorter
from commission.io.live.status import ODOMETRY, Arrivals, SourceState, SourceStatus
from commission.io.protocols.json_records import encode_message
from commission.io.protocols.message import LiveMessage, Sent
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan, TagSightings
from tests.io.live.virtual import NAMES, Listening, Sending, until

MS = 1_000_000


class Reading:
    """A source of which a test says what it delivers, and whether it has read everything."""

    def __init__(self, name: str) -> None:
        self.address = SourceAddress(name, "127.0.0.1", 0)
        self.is_behind = False
        self.deliver: Callable[[Arrival], bool] = lambda _: False

    def start(self, deliver: Callable[[Arrival], bool]) -> None:
        self.deliver = deliver

    def stop(self) -> None:
        pass

    def status(self) -> SourceStatus:
        return SourceStatus(state=SourceState.RECEIVING)

    def times(self) -> dict[int, Arrivals]:
        return {}


class Hall:
    """A session of a scanner and a vehicle, and the time."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.scanner, self.vehicle = Reading("sick-safety"), Reading("json")
        clock = HostClock(lambda: self.now_ns, lambda: self.now_ns)
        self.session = Session([self.scanner, self.vehicle], clock=clock)
        self.session.start()

    def at(self, ms: float, source: Reading | None = None, record: Sent | None = None) -> list[Record]:
        """Let time pass and a record arrive; return what is due."""
        self.now_ns = round(ms * MS)
        if source is not None and record is not None:
            assert source.deliver(Arrival(record, self.now_ns, 1))
        return [record for record, _ in self.session.records(0.0)]

    def driven(self) -> None:
        for step in range(10):
            self.at(20 * step, self.vehicle, Odometry(20 * step * MS, np.array([0.01, 0.0, 0.0])))


def seen(ms: float) -> Detections:
    return Detections(round(ms * MS), np.array([[2.0, 0.0]]))


def test_a_scan_waits_beyond_its_patience_for_odometry_that_has_arrived_and_was_not_read() -> None:
    hall = Hall()
    hall.driven()
    hall.vehicle.is_behind = True
    assert hall.at(215, hall.scanner, seen(215)) == []
    assert hall.at(215 + 5 * PATIENCE_NS / MS) == []
    hall.at(216 + 5 * PATIENCE_NS / MS, hall.vehicle, Odometry(200 * MS, np.zeros(3)))
    hall.vehicle.is_behind = False
    hall.at(217 + 5 * PATIENCE_NS / MS)
    hall.at(217 + 6 * PATIENCE_NS / MS)
    assert not hall.session.sorter.too_late


def test_a_computer_that_never_catches_up_does_not_stop_the_run() -> None:
    hall = Hall()
    hall.driven()
    hall.vehicle.is_behind = True
    assert hall.at(215, hall.scanner, seen(215)) == []
    limit_ms = 215 + (PATIENCE_NS + BEHIND_NS) / MS
    assert hall.at(limit_ms - 1) == []
    assert [type(record) for record in hall.at(limit_ms)] == [Detections]


def test_what_came_in_one_go_after_a_standstill_of_this_computer_is_sorted_before_patience_is_judged() -> None:
    hall = Hall()
    hall.driven()
    # Both arrived while nobody took them; the scan first.
    assert hall.scanner.deliver(Arrival(seen(215), 215 * MS, 1))
    assert hall.vehicle.deliver(Arrival(Odometry(200 * MS, np.zeros(3)), 216 * MS, 1))
    found = hall.at(900)
    assert [type(record) for record in found] == [Odometry, Detections]
    assert not hall.session.sorter.too_late


def test_a_reference_is_late_by_other_references_only() -> None:
    sorter = Sorter()
    pose = np.zeros(3)
    sorter.push(0, seen(100), 100 * MS)
    assert len(list(sorter.due(100 * MS + PATIENCE_NS))) == 1
    for stamp_ms in (90, 95, 93):
        sorter.push(1, ReferencePose(stamp_ms * MS, pose), 210 * MS)
        list(sorter.due(210 * MS))
    assert sorter.too_late == {(1, ReferencePose): 1}


def test_a_source_says_that_it_is_behind_until_it_has_delivered_what_arrived() -> None:
    goes_on, arrived = threading.Event(), threading.Event()

    def deliver(_: Arrival) -> bool:
        arrived.set()
        return goes_on.wait(5.0)

    connection = connection_of(SourceAddress("json", "127.0.0.1", 0), NAMES, HostClock())
    connection.start(deliver)
    try:
        assert not connection.is_behind
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for group in Sending("json").pieces(range(3)):
                for piece in group:
                    out.sendto(piece, ("127.0.0.1", connection.address.port))
        assert arrived.wait(5.0)
        assert connection.is_behind
        goes_on.set()
        assert until(lambda: not connection.is_behind)
        assert connection.status().records == 3
    finally:
        goes_on.set()
        connection.stop()
    assert not connection.is_behind


def test_what_became_of_the_records_is_said_by_kind_and_cause() -> None:
    statuses = [
        SourceStatus(state=SourceState.RECEIVING, records=90, lost=3),
        SourceStatus(state=SourceState.RECEIVING, records=10, overrun=2, undecodable=1),
    ]
    none = RecordAccount.of([SourceStatus(state=SourceState.RECEIVING, records=90)], 90, {Scan: 0})
    assert (none.lost, none.text) == (0, "90 records received, none lost")
    account = RecordAccount.of(statuses, 92, {Scan: 1, Odometry: 4}, refused=1)
    assert account.lost == 12
    assert account.text == (
        "100 records received, 12 lost: 1 scan came too late, 4 odometry records came too late, 2 dropped, since this "
        "computer was too slow, 1 refused by the localizer, 3 never came, 1 undecodable"
    )


def test_records_of_every_kind_have_words_for_being_lost() -> None:
    for kind in typing.get_args(Record):
        account = RecordAccount.of([SourceStatus(state=SourceState.RECEIVING, records=2)], 0, {kind: 2})
        assert "2 lost: 2 " in account.text


def test_frames_of_a_camera_say_nothing_of_when_odometry_arrives() -> None:
    frame = TagSightings(5, np.array([[1.0, 0.0, 0.1, *3 * [np.nan]]]), ("7",))
    records = frame, Odometry(7, np.zeros(3))
    with Listening("json") as listening, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for number, record in enumerate(records):
            data = encode_message(LiveMessage(record, record.stamp_ns, number), NAMES)
            out.sendto(data, ("127.0.0.1", listening.connection.address.port))
        assert until(lambda: len(listening.arrivals) == len(records))
        assert isinstance(listening.arrivals[0].record, TagSightings)
        times = listening.connection.times()
    assert list(times) == [ODOMETRY]
    assert len(times[ODOMETRY][1]) == 1
