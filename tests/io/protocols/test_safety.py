from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import DecodeError
from commission.io.protocols import safety
from tests.io.protocols.captures import fragments, instance


def joined(datagrams: list[bytes]) -> list[bytes]:
    reassembly = safety.Reassembly()
    found = [reassembly.add(safety.decode_fragment(datagram)) for datagram in datagrams]
    return [each for each in found if each is not None]


def test_instance_of_a_nanoscan_has_the_measured_sizes() -> None:
    whole = instance()
    datagrams = fragments(whole, 1)

    assert len(whole) == 6812
    assert [len(each) for each in datagrams] == [1460, 1460, 1460, 1460, 1092]
    assert joined(datagrams) == [whole]


def test_scan_is_what_the_layout_says() -> None:
    found = safety.decode_instance(instance())
    assert found is not None
    scan = safety.scan_of(found, 9)

    assert (found.sequence, found.scan_number, found.days, found.milliseconds) == (77, 88, 19_000, 3_600_000)
    assert (found.cycle_ms, found.beam_us, found.contamination_warning, found.contamination_error) == (
        30,
        50,
        True,
        False,
    )
    assert len(scan.ranges) == 1651
    assert scan.angle_min == pytest.approx(math.radians(-137.5))
    assert scan.bearings[-1] == pytest.approx(math.radians(137.5), abs=1e-4)
    assert scan.ranges[3] == pytest.approx(1.003)
    assert np.isnan(scan.ranges[7])
    assert scan.reflector is not None
    assert np.flatnonzero(scan.reflector).tolist() == [100, 101, 102, 103]
    assert scan.intensities is not None
    assert scan.intensities[300] == 300 % 256


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_fragments_come_in_any_order_twice_and_among_those_of_others(data: st.DataObject) -> None:
    wholes = [instance(beams) for beams in (1651, 700, 1200)]
    datagrams = [each for number, whole in enumerate(wholes) for each in fragments(whole, number)]
    datagrams += data.draw(st.lists(st.sampled_from(datagrams), max_size=6))

    assert sorted(joined(data.draw(st.permutations(datagrams)))) == sorted(wholes)


def test_instance_with_a_lost_fragment_is_given_up_and_counted() -> None:
    reassembly = safety.Reassembly()
    for number in range(30):
        parts = fragments(instance(700), number)
        for part in parts[:-1] if number == 3 else parts:
            reassembly.add(safety.decode_fragment(part))
    assert reassembly.lost == 0
    for number in range(30, 60):
        reassembly.add(safety.decode_fragment(fragments(instance(700), number)[0]))

    assert reassembly.lost == 1 + 30 - safety.OPEN_LIMIT


@pytest.mark.parametrize(
    ("made", "found"),
    [
        ({"said": 1650}, "has 1651 beams, 1650 by the configuration"),
        ({"block": 6612}, "a measurement block of 6612 bytes has 1651 beams"),
        ({"block": 6604}, "a measurement block of 6604 bytes has 1651 beams"),
        ({"block": 60_000}, "the measurement block has 60000 bytes at 200 of 6812"),
    ],
)
def test_size_of_a_block_against_the_count_is_an_error(made: dict[str, int], found: str) -> None:
    with pytest.raises(DecodeError, match=found):
        safety.decode_instance(instance(**made))


def test_fragment_beyond_its_instance_is_an_error() -> None:
    datagram = bytearray(fragments(instance(), 1)[-1])
    struct.pack_into("<I", datagram, 16, 6000)

    with pytest.raises(DecodeError, match="1068 bytes at 6000 of an instance of 6812"):
        safety.decode_fragment(bytes(datagram))


def test_two_totals_of_one_instance_are_an_error() -> None:
    reassembly = safety.Reassembly()
    reassembly.add(safety.decode_fragment(fragments(instance(1651), 5)[0]))

    with pytest.raises(DecodeError, match="expected 6812, as was said"):
        reassembly.add(safety.decode_fragment(fragments(instance(1200), 5)[1]))


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_changed_instance_is_a_decode_error_or_a_scan_of_its_beams(data: st.DataObject) -> None:
    content = bytearray(instance(50))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, 230))] = data.draw(st.integers(0, 255))
    del content[data.draw(st.sampled_from([len(content), data.draw(st.integers(0, len(content)))])) :]
    try:
        found = safety.decode_instance(bytes(content))
    except DecodeError:
        return
    if found is not None:
        assert len(safety.scan_of(found, 0).ranges) * 4 <= len(content)
