from __future__ import annotations

import struct
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.io.recordings.base import load_log
from commission.io.recordings.device_clock import DeviceClock
from commission.io.recordings.pcap import packets, payloads
from tests.io.protocols.captures import cola_b, fragments, instance, nav_answer, udp_parts
from tests.io.protocols.test_cola import binary
from tests.io.recordings import captured_packets as made

START = 1_700_000_000_123_456_789


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("nanoseconds", [False, True])
def test_pcap_of_every_order_and_unit_is_read(tmp_path: Path, order: str, nanoseconds: bool) -> None:
    file = made.write_pcap(
        tmp_path / "a.pcap", [(START, made.ip(17, made.udp(b"hello")))], order=order, nanoseconds=nanoseconds
    )

    stamp = START if nanoseconds else START // 1000 * 1000
    assert [(p.stamp_ns, p.sender, p.receiver, p.data) for p in payloads(file)] == [
        (stamp, "192.168.0.1:6060", "192.168.0.2:6060", b"hello")
    ]


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("digits", [None, 9, 3])
def test_pcapng_of_every_order_and_resolution_is_read(tmp_path: Path, order: str, digits: int | None) -> None:
    file = made.write_pcapng(tmp_path / "a.pcapng", [(START, made.ip(17, made.udp(b"x")))], order=order, digits=digits)

    unit = 10 ** (9 - (6 if digits is None else digits))
    assert [stamp for stamp, _, _ in packets(file)] == [START // unit * unit]


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_tcp_is_put_in_order_and_each_byte_comes_once(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content = bytes(range(200))
    begin = data.draw(st.sampled_from([0, 2**32 - 90]))
    cuts = sorted(data.draw(st.sets(st.integers(1, 199), max_size=6)))
    parts = [(a, content[a:b]) for a, b in zip([0, *cuts], [*cuts, 200], strict=True)]
    sent = data.draw(st.permutations([*parts, *data.draw(st.lists(st.sampled_from(parts), max_size=3))]))
    segments = [made.tcp(begin - 1, b"", syn=True), *(made.tcp(begin + at, part) for at, part in sent)]
    file = made.write_pcap(
        tmp_path_factory.mktemp("tcp") / "a.pcap", [(START, made.ip(6, segment)) for segment in segments]
    )

    assert b"".join(payload.data for payload in payloads(file)) == content


def test_datagram_in_parts_of_ip_is_joined(tmp_path: Path) -> None:
    whole = made.udp(bytes(range(256)) * 10)
    parts = [
        made.ip(17, whole[1480:], number=9, offset=1480),
        made.ip(17, whole[:1480], number=9, more=True),
    ]
    file = made.write_pcap(tmp_path / "a.pcap", [(START + i, part) for i, part in enumerate(parts)])

    assert [payload.data for payload in payloads(file)] == [bytes(range(256)) * 10]


def safety_capture(folder: Path, datagrams: list[bytes]) -> Path:
    clock = count(START, 1_000_000)
    return made.write_pcap(
        folder / "safety.pcap", [(next(clock), made.ip(17, made.udp(each))) for each in datagrams], nanoseconds=True
    )


def test_safety_scanner_in_a_capture_becomes_scans_with_flags(tmp_path: Path) -> None:
    log = load_log(safety_capture(tmp_path, [part for number in range(4) for part in fragments(instance(), number)]))

    assert (len(log.scans[0]), set(log.scans[0].beams.tolist())) == (4, {1651})
    flags = log.scans[0].scan(2).reflector
    assert flags is not None
    assert np.flatnonzero(flags).tolist() == [100, 101, 102, 103]
    assert "scanner 'scanner' is 192.168.0.1:6060: safety scanner" in log.notes


def test_lost_and_broken_telegrams_are_counted_and_the_others_are_read(tmp_path: Path) -> None:
    parts = [
        part for number in range(30) for part in fragments(instance(300, said=299 if number == 4 else 300), number)
    ]
    del parts[10]

    log = load_log(safety_capture(tmp_path, parts))

    assert len(log.scans[0]) >= 28
    assert any("cannot be decoded and are left out" in note for note in log.notes)


def test_cola_in_a_capture_is_stamped_by_the_scanners_own_clock(tmp_path: Path) -> None:
    def telegram(index: int) -> bytes:
        content = bytearray(binary())
        # Time since the start in microseconds, 15 scans a second, just before its 32 bits end.
        content[16 + 14 : 16 + 18] = ((2**32 - 100_000 + index * 66_667) % 2**32).to_bytes(4, "big")
        return cola_b(bytes(content))

    late = [0, 3_000_000, 1_000_000, 9_000_000, 0]
    sequence, sent = 100, []
    for index, delay in enumerate(late):
        sent.append((START + index * 66_667_000 + delay, made.ip(6, made.tcp(sequence, telegram(index)))))
        sequence += len(telegram(index))

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sent, nanoseconds=True))

    assert log.scans[0].stamps_ns.tolist() == [START + index * 66_667_000 for index in range(5)]


def test_answers_of_a_nav350_become_scans(tmp_path: Path) -> None:
    log = load_log(
        made.write_pcap(tmp_path / "a.pcap", [(START, made.ip(6, made.tcp(7, cola_b(nav_answer()))))], nanoseconds=True)
    )

    assert len(log.scans[0].scan(0).ranges) == 1440


def test_device_clock_takes_the_least_delay_for_none() -> None:
    clock = DeviceClock()
    clock.learn(1_000, 51_000)
    clock.learn(2_000, 50_500)
    clock.begin()

    assert [clock.stamp(1_000, 51_000), clock.stamp(2_000, 50_500), clock.stamp(None, 77)] == [49_500, 50_500, 77]


def test_device_clock_follows_drift_and_a_clock_that_begins_again() -> None:
    rng, clock = np.random.default_rng(8), DeviceClock()
    true = np.arange(0, 1_200 * 25) * 40_000_000
    late = rng.integers(0, 100_000_000, len(true))
    # It is too fast by 80 us in a second, and switched off and on after ten minutes.
    device = np.round(true * (1.0 + 80e-6)).astype(np.int64) + 10**12
    device[15_000:] -= device[15_000] - 10**9
    pairs = list(zip(device.tolist(), (true + late + START).tolist(), strict=True))
    for at, captured in pairs:
        clock.learn(at, captured)
    clock.begin()
    off = np.array([clock.stamp(at, captured) for at, captured in pairs]) - true - START
    assert np.abs(off).max() < 2_000_000


@pytest.mark.parametrize("ahead_ns", [10**13, 2**62])
def test_device_time_of_another_century_takes_no_longer_and_moves_no_other(ahead_ns: int) -> None:
    """Damaged, or begun again twice: of a clock the time between its telegrams may be any."""
    clock, times = DeviceClock(), list(range(0, 100 * 10**9, 10**9))
    pairs = [(at + ahead_ns * (at == 50 * 10**9), at + START) for at in times]
    for at, captured in pairs:
        clock.learn(at, captured)
    clock.begin()
    stamps = [clock.stamp(at, captured) - START for at, captured in pairs]
    assert stamps[:50] + stamps[51:] == times[:50] + times[51:]


def test_capture_without_telegrams_says_what_is_read(tmp_path: Path) -> None:
    file = made.write_pcap(tmp_path / "a.pcap", [(START, made.ip(17, made.udp(b"hello")))])

    with pytest.raises(FileFormatError, match="holds no telegram that is read; expected telegrams of SICK CoLa"):
        load_log(file)


@settings(max_examples=80, deadline=None)
@given(data=st.data())
def test_damaged_capture_is_an_error_in_one_line_or_scans(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    content = bytearray(safety_capture(folder, [p for n in range(3) for p in fragments(instance(60), n)]).read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file = folder / "changed.pcap"
    file.write_bytes(content[: data.draw(st.integers(len(content) // 2, len(content)))])

    try:
        log = load_log(file)
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        assert sum(map(len, log.scans)) <= 3


def test_real_capture_of_a_tim781s_has_all_its_telegrams(shared_data: Path) -> None:
    log = load_log(shared_data / "sick_captures" / "example_tim781s.pcapng")

    scans = log.scans[0]
    assert len(scans) == 766
    assert set(scans.beams.tolist()) == {811}
    assert np.diff(scans.stamps_ns).mean() * 1e-9 == pytest.approx(1 / 15, rel=0.01)
    assert np.rad2deg(scans.scan(0).bearings[[0, -1]]) == pytest.approx([-135.0, 135.0], abs=1e-9)
    assert scans.scan(0).intensities is not None


def test_real_turns_of_a_picoscan_are_put_together(tmp_path: Path, shared_data: Path) -> None:
    parts = udp_parts(shared_data / "sick_captures" / "picoscan_compact_test01_udp_scandata.json")
    packed: list[made.Packet] = []
    number, offset = 0, 0
    # The capture has the fragments of IP without their headers: 1472 bytes behind that of UDP, 1480, the rest.
    for index, part in enumerate(parts):
        is_begin, is_end = index % 3 == 0, index % 3 == 2
        total = sum(map(len, parts[index : index + 3]))
        content = struct.pack(">HHHH", 2115, 2115, 8 + total, 0) + part if is_begin else part
        number, offset = (number + 1, 0) if is_begin else (number, offset)
        packed.append((START + index * 100_000, made.ip(17, content, number=number, offset=offset, more=not is_end)))
        offset += len(content)

    log = load_log(made.write_pcap(tmp_path / "a.pcap", packed, nanoseconds=True))

    # 96 segments; the turns at both ends are cut.
    assert len(log.scans[0]) == 18
    assert set(log.scans[0].beams.tolist()) == {1200}


def test_capture_of_what_is_not_read_says_what_it_holds(tmp_path: Path) -> None:
    content = bytearray(safety_capture(tmp_path, fragments(instance(60), 1)).read_bytes())
    content[20:24] = struct.pack("<I", 105)
    (tmp_path / "wifi.pcap").write_bytes(content)
    head = struct.pack(">IHBB16s16s", 0x60000000, 9, 17, 64, bytes(16), bytes(16))
    six = made.write_pcap(tmp_path / "six.pcap", [(START, bytes(12) + b"\x86\xdd" + head + made.udp(b"x"))])

    with pytest.raises(FileFormatError, match=r"\(1 packets are of link type 105, which is not read"):
        load_log(tmp_path / "wifi.pcap")
    with pytest.raises(FileFormatError, match=r"\(1 packets are of IPv6, which is not read\)"):
        load_log(six)


def test_capture_whose_packets_are_all_cut_short_says_so(tmp_path: Path) -> None:
    packets = [(START, made.ip(17, made.udp(part))[:96]) for part in fragments(instance(), 1)]

    with pytest.raises(FileFormatError, match=r"holds no scan, .*packets of 192.168.0.1 were captured in part only"):
        load_log(made.write_pcap(tmp_path / "a.pcap", packets))


def test_packets_of_several_interfaces_have_each_their_link_and_their_unit_of_time(tmp_path: Path) -> None:
    def block(kind: int, body: bytes) -> bytes:
        body += bytes(-len(body) % 4)
        return struct.pack("<II", kind, 12 + len(body)) + body + struct.pack("<I", 12 + len(body))

    def packet(interface: int, ticks: int, data: bytes) -> bytes:
        return block(6, struct.pack("<5I", interface, ticks >> 32, ticks & 0xFFFFFFFF, len(data), len(data)) + data)

    whole = made.ip(17, made.udp(b"hello"))
    content = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    content += block(1, struct.pack("<HHI", 1, 0, 0))
    # Raw IP in nanoseconds, 1,000 s of which are left out of each stamp.
    options = struct.pack("<HHB3xHHqHH", 9, 1, 9, 14, 8, 1_000, 0, 0)
    content += block(1, struct.pack("<HHI", 101, 0, 0) + options)
    content += packet(0, START // 1_000, whole) + packet(1, START - 1_000 * 10**9 + 5, whole[14:])
    (tmp_path / "a.pcapng").write_bytes(content)

    found = [(payload.stamp_ns, payload.data) for payload in payloads(tmp_path / "a.pcapng")]

    assert found == [(START // 1_000 * 1_000, b"hello"), (START + 5, b"hello")]


@pytest.mark.parametrize("tags", [1, 2])
def test_packets_of_virtual_networks_are_read(tmp_path: Path, tags: int) -> None:
    whole = made.ip(17, made.udp(b"hello"))
    tagged = whole[:12] + b"\x81\x00\x00\x05" * tags + whole[12:]

    found = list(payloads(made.write_pcap(tmp_path / "a.pcap", [(START, tagged)])))

    assert [payload.data for payload in found] == [b"hello"]


def test_packet_whose_time_cannot_be_is_left_out_and_told(tmp_path: Path) -> None:
    packets = [(START + i, made.ip(17, made.udp(part))) for i, part in enumerate(fragments(instance(60), 1))]
    content = made.write_pcapng(tmp_path / "a.pcapng", packets, digits=9).read_bytes()
    # Its unit is a second, by one byte that is another one: the stamps are 1.7e27 ns.
    unit = struct.pack("<HHB", 9, 1, 9)
    assert content.count(unit) == 1
    (tmp_path / "a.pcapng").write_bytes(content.replace(unit, struct.pack("<HHB", 9, 1, 0)))

    with pytest.raises(FileFormatError, match="packets of the capture have a time that cannot be, and are left out"):
        load_log(tmp_path / "a.pcapng")
