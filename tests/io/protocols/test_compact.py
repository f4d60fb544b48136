from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import DecodeError
from commission.io.protocols import compact
from tests.io.protocols.captures import udp_parts


def telegrams(parts: list[bytes]) -> Iterator[bytes]:
    """Whole telegrams, by the size that their begin says."""
    data = b""
    for part in parts:
        data += part
        size = compact.whole_size(data)
        if size is not None and len(data) >= size:
            yield data[:size]
            data = data[size:]
    assert data == b""


@pytest.fixture(scope="module")
def captured(shared_data: Path) -> dict[str, list[bytes]]:
    folder = shared_data / "sick_captures"
    names = {
        "picoscan": "picoscan_compact_test01_udp_scandata.json",
        "multiscan": "multiscan_compact_test01_udp_scandata.json",
    }
    return {name: list(telegrams(udp_parts(folder / file))) for name, file in names.items()}


@pytest.mark.parametrize(("name", "count", "scans"), [("picoscan", 96, 96), ("multiscan", 94, 66)])
def test_every_captured_telegram_is_whole(captured: dict[str, list[bytes]], name: str, count: int, scans: int) -> None:
    whole = captured[name]

    assert len(whole) == count
    assert all(zlib.crc32(each[:-4]) == int.from_bytes(each[-4:], "little") for each in whole)
    # Between its scans a multiScan tells of its inertial unit.
    assert sum(map(compact.is_scan, whole)) == scans
    for each in whole:
        if compact.is_scan(each):
            compact.decode_telegram(each)


def test_beams_with_reflector_bit_are_those_of_the_capture(captured: dict[str, list[bytes]]) -> None:
    flags = [
        module.reflector
        for each in captured["multiscan"]
        if compact.is_scan(each)
        for module in compact.decode_telegram(each).modules
        if module.reflector is not None
    ]

    assert sum(int(each.sum()) for each in flags) == 129
    assert sum(each.size for each in flags) == 59_400


def test_segments_of_a_picoscan_are_one_even_turn(captured: dict[str, list[bytes]]) -> None:
    modules = [module for each in captured["picoscan"] for module in compact.decode_telegram(each).modules]
    turn = [module for module in modules if module.frame == modules[10].frame]

    scan = compact.scan_of(turn, 0, 5)

    assert [module.segment for module in turn] == [0, 1, 2, 3, 4]
    assert len(scan.ranges) == 5 * 240
    # 276 degrees in steps of 0.25 by its data sheet, read from beams whose azimuth has steps of 0.011 degrees.
    assert math.degrees(scan.angle_increment) == pytest.approx(0.25, abs=0.002)
    assert scan.reflector is not None
    assert scan.intensities is not None
    assert not scan.reflector.any()
    assert 0.0 < np.nanmin(scan.ranges) < np.nanmax(scan.ranges) < 120.0


def test_turn_without_a_segment_is_no_scan(captured: dict[str, list[bytes]]) -> None:
    modules = [module for each in captured["picoscan"] for module in compact.decode_telegram(each).modules]
    turn = [module for module in modules if module.frame == modules[10].frame]

    with pytest.raises(DecodeError, match="not evenly apart"):
        compact.scan_of([turn[0], turn[2], turn[3]], 0, 5)


def test_wrong_checksum_is_told(captured: dict[str, list[bytes]]) -> None:
    broken = bytearray(captured["picoscan"][0])
    broken[100] ^= 1

    with pytest.raises(DecodeError, match="the checksum is 0x"):
        compact.decode_telegram(bytes(broken))


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_changed_telegram_is_a_decode_error_or_whole(captured: dict[str, list[bytes]], data: st.DataObject) -> None:
    content = bytearray(data.draw(st.sampled_from(captured["picoscan"][:3] + captured["multiscan"][:3])))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, min(len(content) - 5, 400)))] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    # With a right checksum, so that what is behind it is reached.
    content[-4:] = zlib.crc32(content[:-4]).to_bytes(4, "little")
    try:
        compact.whole_size(bytes(content))
        found = compact.decode_telegram(bytes(content))
        for module in found.modules:
            compact.scan_of([module], 0, 0)
    except DecodeError:
        return
    assert sum(module.ranges.size for module in found.modules) * 2 <= len(content)
