"""What every live source has to stand: truncated, reordered, oversized, mutated, silent, restarted."""

from __future__ import annotations

import contextlib
import random
import socket
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import DecodeError, SourceError, UsageError
from commission.io.live.driver import Driver
from commission.io.live.registry import KINDS, SourceAddress
from commission.io.live.status import SourceState
from commission.io.protocols.message import LiveMessage
from tests.io.live.virtual import ALL, Listening, Sending, numbers_of, scan, until

DATAGRAMS = tuple(name for name in ALL if KINDS[name].transport == "udp")


def fed(driver: Driver, pieces: list[bytes]) -> list[LiveMessage]:
    """What a driver makes of pieces; those that cannot be decoded are passed over, as a connection does."""
    found: list[LiveMessage] = []
    for piece in pieces:
        try:
            found.extend(driver.take(piece, 10**18))
        except DecodeError:
            continue
    return found


def flat(pieces: list[list[bytes]]) -> list[bytes]:
    return [piece for group in pieces for piece in group]


def numbers(found: list[LiveMessage]) -> list[int]:
    return numbers_of([message.record for message in found])  # type: ignore[misc]


@pytest.mark.parametrize("name", ALL)
def test_scans_arrive_as_they_were_measured(name: str) -> None:
    sending = Sending(name)
    found = fed(sending.driver(), flat(sending.pieces(range(6))))
    assert numbers(found)[:5] == list(range(5))
    sent = scan(2)
    record = next(message.record for message in found if numbers([message]) == [2])
    # Devices measure in millimetres and thousandths of a degree.
    np.testing.assert_allclose(record.ranges, sent.ranges, atol=0.001)
    np.testing.assert_allclose(record.bearings, sent.bearings, atol=4e-3)
    if record.reflector is not None:
        np.testing.assert_array_equal(record.reflector, sent.reflector)
    else:
        np.testing.assert_array_equal(record.intensities > np.median(record.intensities), sent.reflector)


@pytest.mark.parametrize("name", ALL)
def test_truncated_pieces_make_no_record_and_harm_no_later_one(name: str) -> None:
    sending = Sending(name)
    before, cut, after = (flat(sending.pieces(range(first, first + 4))) for first in (0, 4, 8))
    rng = random.Random(3)
    broken = [piece[: rng.randrange(len(piece))] for piece in cut]
    found = numbers(fed(sending.driver(), [*before, *broken, *after]))
    assert set(found) <= set(range(12))
    assert found == sorted(set(found))
    assert {0, 1, 2, 9, 10} <= set(found)


@pytest.mark.parametrize("name", DATAGRAMS)
def test_datagrams_that_overtake_each_other_make_the_same_scans(name: str) -> None:
    sending = Sending(name)
    groups = sending.pieces(range(6))
    shuffled = [random.Random(number).sample(group, len(group)) for number, group in enumerate(groups)]
    if name != "compact":
        # Its segments have no fragments of their own: they are turned about within a turn, not beyond.
        shuffled[1:3] = [[*shuffled[1][:-1], shuffled[2][0], shuffled[1][-1], *shuffled[2][1:]]]
    found = fed(sending.driver(), flat(shuffled))
    assert sorted(numbers(found))[:5] == list(range(5))


@pytest.mark.parametrize("name", ALL)
def test_what_is_oversized_takes_no_memory(name: str) -> None:
    sending = Sending(name)
    driver = sending.driver()
    whole = flat(sending.pieces(range(2)))
    rng = random.Random(9)
    fed(driver, whole)
    tracemalloc.start()
    for _ in range(150):
        fed(driver, [rng.choice(whole)[:60] + rng.randbytes(40_000), rng.randbytes(60_000), b"[" * 60_000])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8_000_000
    again = flat(sending.pieces(range(2, 8)))
    # The first scan behind may have been begun by what was none.
    assert {5, 6} <= set(numbers(fed(driver, again)))


@pytest.mark.parametrize("name", ALL)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_mutated_bytes_are_a_decode_error_or_valid_records(name: str, data: st.DataObject) -> None:
    sending = Sending(name)
    pieces = flat(sending.pieces(range(3)))
    index = data.draw(st.integers(0, len(pieces) - 1))
    piece = bytearray(pieces[index])
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.one_of(st.integers(0, min(119, len(piece) - 1)), st.integers(0, len(piece) - 1)))
        piece[place] = data.draw(st.integers(0, 255))
    pieces[index] = bytes(piece)
    for message in fed(sending.driver(), pieces):
        record = message.record
        if numbers([message]):
            assert np.isfinite([record.angle_min, record.angle_increment]).all()
            assert record.angle_increment != 0.0
            assert 0 < len(record.ranges) <= 20_000


@pytest.mark.parametrize("name", DATAGRAMS)
def test_a_silent_source_is_told_within_a_second(name: str) -> None:
    sending = Sending(name)
    with Listening(name) as listening, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        to = "127.0.0.1", listening.connection.address.port
        assert listening.connection.status().state is SourceState.WAITING or until(
            lambda: listening.connection.status().state is SourceState.WAITING
        )
        for piece in flat(sending.pieces(range(4))):
            out.sendto(piece, to)
        assert until(lambda: len(listening.numbers) >= 3)
        assert listening.connection.status().state is SourceState.RECEIVING
        heard = time.monotonic()
        assert until(lambda: listening.connection.status().state is SourceState.SILENT)
        assert 0.8 < time.monotonic() - heard < 1.3


@pytest.mark.parametrize("name", DATAGRAMS)
def test_a_sender_that_begins_again_is_heard_again_without_duplicates(name: str) -> None:
    # All stay open: else the system now and then gives a sender the port of one before, and it is taken for that one.
    with Listening(name) as listening, contextlib.ExitStack() as senders:
        to = "127.0.0.1", listening.connection.address.port
        for life in range(20):
            sending = Sending(name)
            out = senders.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            for piece in flat(sending.pieces(range(4))):
                out.sendto(piece, to)
            assert until(lambda life=life: listening.numbers.count(2) == life + 1)
        found = listening.numbers
    assert [number for number in found if number == 0] == [0] * 20
    stamps = [arrival.record.stamp_ns for arrival in listening.arrivals]
    assert stamps == sorted(stamps)
    assert listening.connection.status().connects == 20


@pytest.mark.parametrize("name", DATAGRAMS)
def test_nothing_is_ever_sent_to_who_is_only_listened_to(name: str) -> None:
    sending = Sending(name)
    with Listening(name) as listening, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.bind(("127.0.0.1", 0))
        out.settimeout(0.3)
        for piece in flat(sending.pieces(range(4))):
            out.sendto(piece, ("127.0.0.1", listening.connection.address.port))
        assert until(lambda: len(listening.numbers) >= 3)
        with pytest.raises(TimeoutError):
            out.recvfrom(100)
    driver = sending.driver()
    assert driver.greeting() == driver.reply(10**18) == b""


def test_an_address_that_is_taken_is_refused_at_once() -> None:
    with Listening("json") as first:
        second = Listening("json", first.connection.address.port)
        with pytest.raises(SourceError, match="cannot be listened at"):
            second.connection.start(lambda _: True)


def test_sources_listen_at_this_computers_own_address_unless_told_otherwise() -> None:
    assert SourceAddress.parse("json:6061").host == "127.0.0.1"
    assert SourceAddress.parse("json").port == 6061
    assert str(SourceAddress.parse("sick-safety@front left:192.168.0.5:6060")) == (
        "sick-safety@front left:192.168.0.5:6060"
    )


@pytest.mark.parametrize("text", ["", "json:", "lidar:1", "json:127.0.0.1:", "json:x:70000", "json:1.2.3.4:-1"])
def test_a_source_that_is_none_is_refused_with_what_is_expected(text: str) -> None:
    if text == "json:":
        assert SourceAddress.parse(text).port == 6061
        return
    with pytest.raises(UsageError, match="expected"):
        SourceAddress.parse(text)
