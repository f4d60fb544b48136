"""Several scanners over one rosbridge, a device that answers nothing sensible, and a source that ends by a fault."""

from __future__ import annotations

import json
import socket
import threading
from collections import Counter
from contextlib import ExitStack

import numpy as np
import pytest

from commission.io.live.checklist import checklist
from commission.io.live.clocks import HostClock
from commission.io.live.cola_driver import ASK, ColaDriver
from commission.io.live.connection import Connection
from commission.io.live.links import UdpLink
from commission.io.live.registry import SourceAddress, driver_of
from commission.io.live.senders import Senders
from commission.io.live.session import Session
from commission.io.live.status import SourceState
from commission.io.protocols.cola_encoder import frame_binary
from commission.io.protocols.json_records import encode_message
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.io.protocols.rosbridge import encode_publication
from commission.site.records import Scan
from tests.io.live.virtual import Listening, Sending, scan, until

NAMES = ("front", "rear")
SECOND = 1_000_000_000


def rosbridge(text: str, *, scans_only: bool = False):
    return driver_of(SourceAddress.parse(text), NAMES, scans_only=scans_only)()


def topics(driver) -> set[str]:
    return {json.loads(line)["topic"] for line in driver.greeting().decode().splitlines()}


def test_scanners_of_one_rosbridge_are_told_apart_by_their_topics() -> None:
    driver = rosbridge("rosbridge:127.0.0.1:9090")
    assert topics(driver) == {"/reference", "/odom", "/front/scan", "/rear/scan"}
    for topic, index in (("/rear/scan", 1), ("/front/scan", 0)):
        (message,) = driver.take(encode_publication(topic, scan(5 + index), is_cbor=False), SECOND)
        assert isinstance(message.record, Scan)
        assert message.record.scanner == index


def test_a_source_of_one_named_scanner_takes_no_other_and_odometry_comes_once() -> None:
    rear = rosbridge("rosbridge@rear:127.0.0.1:9090", scans_only=True)
    assert topics(rear) == {"/rear/scan", "/scan"}
    assert not list(rear.take(encode_publication("/front/scan", scan(1), is_cbor=False), SECOND))
    (message,) = rear.take(encode_publication("/scan", scan(2), is_cbor=False), SECOND)
    assert isinstance(message.record, Scan)
    assert message.record.scanner == 1
    pose = encode_publication("/odom", OdometryPose(SECOND, np.zeros(3)), is_cbor=False)
    assert not list(rear.take(pose, SECOND))
    front = rosbridge("rosbridge@front:127.0.0.1:9090")
    assert len(list(front.take(pose, SECOND))) == 1


def test_of_two_sources_of_one_server_the_first_brings_odometry() -> None:
    texts = ("rosbridge@front:127.0.0.1:9090", "rosbridge@rear:127.0.0.1:9090", "rosbridge@rear:127.0.0.1:9091")
    session = Session.of([SourceAddress.parse(text) for text in texts], NAMES)
    asked = [topics(source._make()) for source in session.sources]  # type: ignore[attr-defined]
    assert ["/odom" in each for each in asked] == [True, False, True]


@pytest.mark.parametrize(
    ("heard", "asks_again"),
    [
        (b"", True),
        (b"hello, I am a printer\r\n", True),
        (frame_binary(b"sFA\x00\x01"), True),
        (frame_binary(b"sEA LMDscandata \x01"), False),
    ],
)
def test_only_an_answer_of_a_device_keeps_from_asking_in_the_other_dialect(heard: bytes, asks_again: bool) -> None:
    driver = ColaDriver(("scanner",), 0)
    assert driver.reply(0) == b""
    assert not list(driver.take(heard, 0))
    assert driver.reply(2 * SECOND) == (ASK[1] if asks_again else b"")


def test_a_source_that_ends_by_a_fault_of_the_program_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken(ColaDriver):
        def take(self, data, arrived_ns):
            raise RuntimeError("nobody thought of this")

    told: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", told.append)
    address = SourceAddress("json", "127.0.0.1", 0)
    connection = Connection(address, lambda: Broken(("scanner",), 0), UdpLink("127.0.0.1", 0), HostClock())
    connection.start(lambda _arrival: True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"x", ("127.0.0.1", connection.address.port))
        assert until(lambda: connection.status().state is SourceState.FAILED)
    status = connection.status()
    assert "nobody thought of this" in status.trouble
    assert "nobody thought of this" in checklist(connection.address, status, ())[0]
    assert len(told) == 1, "and the log has it"
    connection.stop()


@pytest.mark.parametrize("name", ["json", "sick-safety", "compact"])
def test_of_two_that_send_the_same_to_one_port_one_is_taken_and_the_other_told(name: str) -> None:
    with Listening(name) as listening, ExitStack() as stack:
        to = "127.0.0.1", listening.connection.address.port
        # The second one sends what the first one never does: numbers from 50.
        senders = []
        for first in (0, 50):
            out = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            senders.append((out, Sending(name).pieces(range(first, first + 40))))
        for turn in range(40):
            for out, pieces in senders:
                for piece in pieces[turn]:
                    out.sendto(piece, to)
            assert until(lambda turn=turn: not turn or 50 + turn - 1 in listening.numbers)
        assert until(lambda: 88 in listening.numbers)
        ports = [out.getsockname()[1] for out, _ in senders]
        told = listening.connection.status().told or {}
    # What the first one sent before the second one was heard is there; then it is one vehicle, not two in turns.
    assert [number for number in listening.numbers if number < 50] in ([], [0])
    words = f"messages of 127.0.0.1:{ports[0]} are left out, since 127.0.0.1:{ports[1]} sends the same to this port"
    # Of turn 38 the first one is left out before the second one arrives.
    assert told[words] >= 38, told


def test_programs_that_send_different_records_to_one_port_are_heard_both() -> None:
    def message(record) -> bytes:
        return encode_message(LiveMessage(record, device_ns=record.stamp_ns), ("scanner",))

    with Listening("json") as listening, ExitStack() as stack:
        to = "127.0.0.1", listening.connection.address.port
        scans, poses = (stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2))
        for turn in range(20):
            scans.sendto(message(scan(turn)), to)
            poses.sendto(message(OdometryPose(SECOND + turn * 40_000_000, np.array([0.1 * turn, 0.0, 0.0]))), to)
        assert until(lambda: len(listening.arrivals) == 40)
        assert not listening.connection.status().told


def test_another_computer_is_heard_when_the_first_one_is_silent() -> None:
    told = Counter[str]()
    senders = Senders(told)
    assert senders.takes(0, ("10.0.0.1", 6060), 0)
    assert not senders.takes(0, ("10.0.0.2", 6060), SECOND // 2)
    assert told == {"messages of 10.0.0.2:6060 are left out, since 10.0.0.1:6060 sends the same to this port": 1}
    assert senders.takes(1, ("10.0.0.2", 6060), SECOND // 2)
    assert senders.takes(0, ("10.0.0.2", 6060), SECOND + 1)
    assert not senders.takes(0, ("10.0.0.1", 6060), SECOND + 2)
    for port in range(20):
        senders.takes(0, ("10.0.0.3", port), SECOND + 3)
    # However many there are, few words.
    assert len(told) <= 9
