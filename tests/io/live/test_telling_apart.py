"""Several scanners over one rosbridge, a device that answers nothing sensible, and a source that ends by a fault."""

from __future__ import annotations

import json
import socket
import threading

import numpy as np
import pytest

from commission.io.live.checklist import checklist
from commission.io.live.clocks import HostClock
from commission.io.live.cola_driver import ASK, ColaDriver
from commission.io.live.connection import Connection
from commission.io.live.links import UdpLink
from commission.io.live.registry import SourceAddress, driver_of
from commission.io.live.session import Session
from commission.io.live.status import SourceState
from commission.io.protocols.cola_encoder import frame_binary
from commission.io.protocols.message import OdometryPose
from commission.io.protocols.rosbridge import encode_publication
from commission.site.records import Scan
from tests.io.live.virtual import scan, until

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
