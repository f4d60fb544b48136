from __future__ import annotations

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import DecodeError
from commission.io.protocols import cola
from tests.io.protocols.captures import cola_b, tcp_stream

TEXT = (
    b"sSN LMDscandata 1 1 89A27F 0 0 343 347 27477BA9 2747813B 0 0 7 0 0 1388 168 0 1 DIST1 3F800000 00000000 "
    b"FFF92230 D05 4 3E8 0 7D0 BB8 1 RSSI1 3F800000 00000000 FFF92230 D05 4 1 2 FE FF 0 0 0 0 0"
)
"""Written by hand after the layout of a TiM55x."""


def binary(beams: int = 3, *, channels: int = 1, layer: int = 0) -> bytes:
    content = b"sSN LMDscandata " + struct.pack(
        ">HHIHHHIIHHhIIH", 1, 1, 99, 0, 5, 6, 7_000, 8_000, 0, 0, layer, 1500, 0, 0
    )
    content += struct.pack(">H", channels)
    for index in range(channels):
        content += f"DIST{index + 1}".encode() + struct.pack(">ffiHH", 2.0, 1.0, -450000, 3333, beams)
        content += np.array([0, 1000, 2000], dtype=">u2")[:beams].tobytes()
    return content + struct.pack(">HHHHHH", 0, 0, 0, 0, 0, 0)


def test_every_frame_of_a_real_start_of_an_mrs1104_is_found(shared_data: Path) -> None:
    stream = tcp_stream(shared_data / "sick_captures" / "mrs1xxx_test01_tcp_data.json")

    frames, rest = cola.split_frames(stream)

    assert (len(frames), rest) == (208, b"")


def test_scans_of_an_mrs1104_are_those_that_the_drivers_of_its_maker_publish(shared_data: Path) -> None:
    folder = shared_data / "sick_captures"
    frames, _ = cola.split_frames(tcp_stream(folder / "mrs1xxx_test01_tcp_data.json"))
    decoded = [cola.decode_lmd(frame) for frame in frames if cola.is_scan(frame)]
    published = json.loads((folder / "mrs1xxx_test01_ref_messages.json").read_text())["RefLaserscanMsg"]["/scan"]

    # The driver publishes three echoes of each telegram, in order; its frames name layer and echo.
    assert len(published) == 36
    for index, message in enumerate(published):
        telegram, echo = decoded[index // 3], index % 3 + 1
        scan = cola.scan_of(telegram, 0, echo=echo)
        layer = {"POS": 1, "NEG": -1}[message["frame_id"].split("_")[1]] * int(message["frame_id"].split("_")[2])
        ranges = np.frombuffer(bytes.fromhex(message["ranges"]), "<f4")
        strengths = np.frombuffer(bytes.fromhex(message["intensities"]), "<f4")
        assert telegram.layer == layer
        assert scan.intensities is not None
        measured = np.isfinite(ranges) & (ranges > cola.NOTHING)
        np.testing.assert_array_equal(np.isfinite(scan.ranges), measured)
        np.testing.assert_allclose(scan.ranges[measured], ranges[measured], rtol=0.0, atol=1e-6)
        np.testing.assert_array_equal(scan.intensities, strengths)
        assert scan.angle_min == pytest.approx(message["angle_min"], abs=1e-6)
        assert scan.angle_increment == pytest.approx(message["angle_increment"], abs=1e-9)


def test_text_says_the_same_as_binary() -> None:
    telegram = cola.decode_lmd(TEXT)

    assert (telegram.telegram_count, telegram.scan_count) == (0x343, 0x347)
    assert telegram.begin_us == 0x27477BA9
    assert [(c.name, c.start, c.step, c.raw.tolist()) for c in telegram.channels] == [
        ("DIST1", -450000, 3333, [1000, 0, 2000, 3000]),
        ("RSSI1", -450000, 3333, [1, 2, 254, 255]),
    ]
    scan = cola.scan_of(telegram, 17)
    np.testing.assert_array_equal(scan.ranges, np.array([1.0, np.nan, 2.0, 3.0], dtype=np.float32))
    assert scan.angle_min == pytest.approx(math.radians(-135.0))


def test_distances_are_scaled_and_zero_is_no_measurement() -> None:
    scan = cola.scan_of(cola.decode_lmd(binary()), 17)

    np.testing.assert_allclose(scan.ranges, [np.nan, 2.001, 4.001], rtol=1e-6)
    assert (scan.stamp_ns, scan.intensities) == (17, None)


@pytest.mark.parametrize(
    ("step", "degrees"),
    [(3333, 1 / 3), (1667, 1 / 6), (1666, 1 / 6), (2500, 0.25), (5000, 0.5), (10000, 1.0), (1250, 0.125)],
)
def test_rounded_steps_stand_for_their_fractions(step: int, degrees: float) -> None:
    assert cola.nominal_step_deg(step) == pytest.approx(degrees, abs=1e-12)


def test_frames_are_cut_however_the_stream_is_split_and_garbage_is_passed_over() -> None:
    stream = b"xx" + cola_b(b"sRA a ") + b"\x02sRA b\x03" + b"\x02\x02\x02\x02\xff\xff\xff\xff" + cola_b(binary())
    wanted = [b"sRA a ", b"sRA b", binary()]
    for cut in range(len(stream)):
        first, rest = cola.split_frames(stream[:cut])
        second, _ = cola.split_frames(rest + stream[cut:])
        assert [f for f in first + second if f in wanted] == wanted


def test_frame_with_a_wrong_checksum_is_dropped() -> None:
    broken = bytearray(cola_b(binary()))
    broken[-1] ^= 1

    frames, _ = cola.split_frames(bytes(broken) + cola_b(b"sRA a "))

    assert binary() not in frames
    assert b"sRA a " in frames


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"sSN LMDradardata 1", "is no LMDscandata telegram"),
        (binary()[:-20], "are left; expected|numbers of 2 bytes are said"),
        (binary(channels=17), "17 channels are said; expected 16 at most"),
        (TEXT[:80], "it ends after"),
        (TEXT.replace(b"D05 4 3E8", b"D05 FFFF 3E8"), "65535 beams are said"),
        (TEXT.replace(b"27477BA9", b"27477BXX"), "is no number"),
    ],
)
def test_what_cannot_be_is_a_decode_error(content: bytes, found: str) -> None:
    with pytest.raises(DecodeError, match=found):
        cola.decode_lmd(content)


@settings(max_examples=300, deadline=None)
@given(data=st.data(), whole=st.sampled_from([binary(), TEXT, binary(channels=5)]))
def test_changed_telegram_is_a_decode_error_or_a_scan(data: st.DataObject, whole: bytes) -> None:
    content = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(16, len(content) - 1))] = data.draw(st.integers(0, 255))
    try:
        scan = cola.scan_of(cola.decode_lmd(bytes(content)), 0)
    except DecodeError:
        return
    assert len(scan.ranges) <= 65_535
    assert not (scan.ranges < 0.0).any()
    assert scan.angle_increment != 0.0
