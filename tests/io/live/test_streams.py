"""Sources that are connected to: silent, killed and restarted twenty times, in another dialect, in the wrong mode."""

from __future__ import annotations

import struct
import time
from typing import Any

import numpy as np
import pytest

from commission.errors import DecodeError
from commission.io.live.cola_driver import ColaDriver
from commission.io.live.nav350_driver import ASK_LANDMARKS, ASK_POSE, NavDriver
from commission.io.live.registry import KINDS, SourceAddress, device_of
from commission.io.live.status import SourceState
from commission.io.live.virtual_cola import VirtualTim
from commission.io.protocols import cola, nav350
from commission.io.protocols.cola_encoder import encode_lmd, encode_lmd_text, encode_nav, frame_binary
from commission.site.records import Detections, Scan
from tests.io.live.virtual import ALL, NAMES, Listening, scan, until
from tests.io.protocols.captures import nav_answer

STREAMS = tuple(name for name in ALL if KINDS[name].transport != "udp")
PORTS = {name: 21_000 + index for index, name in enumerate(STREAMS)}


def device(name: str) -> Any:
    return device_of(SourceAddress(name, "127.0.0.1", PORTS[name]), NAMES)


@pytest.mark.parametrize("name", STREAMS)
def test_a_device_that_is_killed_and_restarted_is_connected_to_again_without_duplicates(name: str) -> None:
    with Listening(name, PORTS[name]) as listening:
        for life in range(20):
            with device(name) as opened:
                for number in range(4):
                    opened.send(scan(number))
                assert until(lambda life=life: listening.numbers.count(3) == life + 1)
        assert listening.numbers == [0, 1, 2, 3] * 20
        stamps = [arrival.record.stamp_ns for arrival in listening.arrivals]
        assert stamps == sorted(stamps)
        assert listening.connection.status().connects == 20


@pytest.mark.parametrize("name", STREAMS)
def test_a_device_that_falls_silent_is_told_within_a_second(name: str) -> None:
    with Listening(name, PORTS[name]) as listening, device(name) as opened:
        opened.send(scan(0))
        assert until(lambda: listening.numbers == [0])
        heard = time.monotonic()
        assert until(lambda: listening.connection.status().state is SourceState.SILENT)
        assert 0.8 < time.monotonic() - heard < 1.4


def test_cola_in_text_says_the_same_as_in_binary() -> None:
    one, other = (cola.decode_lmd(encode(scan(3), 7)) for encode in (encode_lmd, encode_lmd_text))
    for name in ("telegram_count", "scan_count", "begin_us", "layer"):
        assert getattr(one, name) == getattr(other, name)
    a, b = cola.scan_of(one, 5), cola.scan_of(other, 5)
    np.testing.assert_array_equal(a.ranges, b.ranges)
    np.testing.assert_array_equal(a.intensities, b.intensities)
    assert (a.angle_min, a.angle_increment) == (b.angle_min, b.angle_increment)


def test_a_device_that_is_set_to_text_is_asked_in_text_after_a_second() -> None:
    class TextTim(VirtualTim):
        is_text = True

    with Listening("cola", PORTS["cola"]) as listening:
        with TextTim(SourceAddress("cola", "127.0.0.1", PORTS["cola"]), NAMES) as opened:
            for number in range(3):
                opened.send(scan(number))
        assert until(lambda: listening.numbers == [0, 1, 2])


def test_a_device_that_answers_is_not_asked_again() -> None:
    driver = ColaDriver(NAMES, 0)
    assert driver.reply(0) == driver.reply(999_999_999) == b""
    assert driver.reply(1_000_000_000).startswith(b"\x02sEN")
    assert driver.reply(2_000_000_000) == driver.greeting()
    list(driver.take(frame_binary(b"sEA LMDscandata \x01"), 0))
    assert driver.reply(9_000_000_000) == b""


def test_a_nav350_is_asked_for_the_next_result_when_one_has_come() -> None:
    driver = NavDriver(NAMES, 0)
    assert driver.greeting() == ASK_POSE
    assert driver.reply(0) == b""
    assert list(driver.take(frame_binary(b"sMA mNPOSGetData"), 0)) == []
    assert driver.reply(1) == b""
    found = list(driver.take(frame_binary(encode_nav(scan(2))), 0))
    assert isinstance(found[0].record, Scan)
    assert found[0].device_ns == scan(2).stamp_ns // 10**6 * 10**6
    assert driver.reply(2) == ASK_POSE
    assert driver.reply(1_000_000_001) == b""
    assert driver.reply(1_000_000_002) == ASK_POSE


def test_a_nav350_that_does_not_navigate_is_asked_for_its_reflectors() -> None:
    driver = NavDriver(NAMES, 0)
    wrong = frame_binary(b"sAN mNPOSGetData " + struct.pack(">HBBBHHHH", 1, 1, 1, 2, 0, 0, 0, 0))
    with pytest.raises(DecodeError, match="wrong mode of operation"):
        list(driver.take(wrong, 0))
    # An answer in no time must not become a question in no time.
    driver.reply(1)
    assert driver.reply(2) == b""
    assert driver.reply(1_000_000_001) == ASK_LANDMARKS
    whole = nav_answer(4)
    begin = b"sAN mNLMDGetData " + whole[17:22]
    # The same answer without pose and scan: reflectors alone.
    pose = struct.calcsize(">HiiIH") + struct.calcsize(">BIiBIB")
    landmarks = whole[22 + pose : whole.index(b"DIST1") - 2]
    (message,) = driver.take(frame_binary(begin + landmarks + struct.pack(">HH", 0, 0)), 0)
    assert isinstance(message.record, Detections)
    # At 180 degrees by the device, away from its cable, is ahead.
    np.testing.assert_allclose(message.record.range_bearing, [[5.0, 0.0], [2.5, np.pi / 2]], atol=1e-9)


def test_a_nav350_says_ranges_and_strengths_of_a_whole_turn() -> None:
    found = nav350.scan_of(nav350.decode_nav(encode_nav(scan(3))), 9)
    assert found is not None
    np.testing.assert_allclose(found.ranges, scan(3).ranges, atol=6e-4)
    assert found.angle_min == pytest.approx(scan(3).angle_min, abs=1e-5)
