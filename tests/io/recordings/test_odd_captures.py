"""Captures as plants have them: other links, virtual networks, mirrored ports, two clients of one scanner."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from commission.errors import FileFormatError
from commission.io.protocols.cola_encoder import encode_lmd, frame_binary
from commission.io.recordings.base import load_log
from commission.io.recordings.pcap import payloads
from commission.site.records import Scan
from tests.io.recordings import captured_packets as made

START = 1_700_000_000_123_456_000
TENTH = 100_000_000
HELLO = made.ip(17, made.udp(b"hello"))[14:]
_PPP = struct.pack(">BBHHH", 0x11, 0, 1, len(HELLO) + 2, 0x21)


def linked(path: Path, link: int, packet: bytes) -> Path:
    content = bytearray(made.write_pcap(path, [(START, packet)]).read_bytes())
    content[20:24] = struct.pack("<I", link)
    path.write_bytes(content)
    return path


def cooked(kind: bytes) -> bytes:
    return struct.pack(">HHH8s", 0, 1, 6, bytes(8)) + kind


def cooked_2(kind: bytes) -> bytes:
    return kind + struct.pack(">HIHBB8s", 0, 2, 1, 0, 6, bytes(8))


@pytest.mark.parametrize(
    ("link", "before"),
    [
        (1, bytes(12) + b"\x91\x00\x00\x05\x81\x00\x00\x06\x08\x00"),
        (1, bytes(12) + b"\x88\xa8\x00\x05\x81\x00\x00\x06\x08\x00"),
        (1, bytes(12) + b"\x88\x64" + _PPP),
        (12, b""),
        (14, b""),
        (101, b""),
        (228, b""),
        (0, struct.pack("<I", 2)),
        (108, struct.pack(">I", 2)),
        (113, cooked(b"\x08\x00")),
        (113, cooked(b"\x81\x00") + b"\x00\x05\x08\x00"),
        (276, cooked_2(b"\x08\x00")),
        (276, cooked_2(b"\x81\x00") + b"\x00\x05\x08\x00"),
    ],
)
def test_packet_is_found_behind_whatever_stands_before_it(tmp_path: Path, link: int, before: bytes) -> None:
    told = Counter[str]()

    found = list(payloads(linked(tmp_path / "a.pcap", link, before + HELLO), told))

    assert [(each.sender, each.receiver, each.data) for each in found] == [
        ("192.168.0.1:6060", "192.168.0.2:6060", b"hello")
    ]
    assert not +told


@pytest.mark.parametrize("kind", [b"\x08\x06", b"\x88\xcc", b"\x00\x26", b"\x88\x92"])
def test_what_every_network_has_besides_ip_is_passed_over_without_a_word(tmp_path: Path, kind: bytes) -> None:
    told = Counter[str]()
    assert not list(payloads(linked(tmp_path / "a.pcap", 1, bytes(12) + kind + bytes(46)), told))
    assert not +told


def test_kind_of_frame_that_is_not_read_is_told_with_its_number(tmp_path: Path) -> None:
    file = linked(tmp_path / "a.pcap", 1, bytes(12) + b"\x89\x1d" + HELLO)

    with pytest.raises(FileFormatError, match=r"\(1 packets hold what is not read \(EtherType 0x891d; IPv4 is 0x0800"):
        load_log(file)


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcap_of_a_patched_kernel_has_eight_bytes_more_before_each_packet(tmp_path: Path, order: str) -> None:
    packet = made.ip(17, made.udp(b"hello"))
    content = struct.pack(f"{order}IHHIIII", 0xA1B2CD34, 2, 4, 0, 0, 65_535, 1)
    for number in range(3):
        content += struct.pack(f"{order}IIII", 100 + number, 5, len(packet), len(packet)) + bytes(8) + packet
    (tmp_path / "a.pcap").write_bytes(content)

    found = list(payloads(tmp_path / "a.pcap"))

    assert [(each.stamp_ns, each.data) for each in found] == [
        ((100 + number) * 10**9 + 5_000, b"hello") for number in range(3)
    ]


def test_fragments_that_a_mirrored_port_shows_twice_are_not_told_as_lost(tmp_path: Path) -> None:
    whole = made.udp(bytes(range(256)) * 10)
    parts = [made.ip(17, whole[:1480], number=9, more=True), made.ip(17, whole[1480:], number=9, offset=1480)]
    sent = [(START + k, part) for k, part in enumerate([*parts, *parts, parts[1], parts[0]])]
    # Much later the number is another datagram's.
    sent += [(START + 10 * TENTH * 3 + k, part) for k, part in enumerate(parts)]
    told = Counter[str]()

    found = list(payloads(made.write_pcap(tmp_path / "a.pcap", sent), told))

    assert [each.data for each in found] == [bytes(range(256)) * 10] * 2
    assert not +told


def turned(number: int) -> Scan:
    ranges = np.full(60, 2.0 + 0.01 * number, np.float32)
    return Scan(
        stamp_ns=START + number * TENTH, ranges=ranges, angle_min=-0.5, angle_increment=np.radians(1.0), reflector=None
    )


def stream(
    begin: int, client: int, *, first: int = 0, last: int = 30, telegram: Callable[[int], bytes] | None = None
) -> list[made.Packet]:
    """What a scanner sends to one client, each telegram in two segments; stamps of its own clock."""
    sent: list[made.Packet] = []
    for number in range(first, last):
        data = frame_binary(encode_lmd(turned(number), number)) if telegram is None else telegram(number)
        for half in (data[:50], data[50:]):
            segment = made.tcp(begin, half)
            # The client's port.
            segment = segment[:2] + struct.pack(">H", client) + segment[4:]
            sent.append((START + number * TENTH + client + len(sent) % 2, made.ip(6, segment)))
            begin += len(half)
    return sent


def far(log_ranges: np.ndarray) -> list[float]:
    return [round(float(each), 2) for each in log_ranges[:, 0]]


def test_scanner_that_serves_two_clients_at_once_is_read_once(tmp_path: Path) -> None:
    both = sorted([*stream(1_000, 50_000), *stream(2**32 - 500, 50_001)], key=lambda each: each[0])

    log = load_log(made.write_pcap(tmp_path / "a.pcap", both, nanoseconds=True))

    assert far(log.scans[0].block(0, len(log.scans[0])).ranges) == [round(2.0 + 0.01 * n, 2) for n in range(30)]
    assert np.diff(log.scans[0].stamps_ns).tolist() == [TENTH] * 29
    assert "30 telegrams of 192.168.0.1:2112 went to a second receiver, too, and are taken once" in log.notes


def test_client_that_connects_anew_goes_on_where_it_was(tmp_path: Path) -> None:
    sent = [*stream(1_000, 50_000, last=12), *stream(7_777_777, 50_444, first=12)]

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sent, nanoseconds=True))

    assert far(log.scans[0].block(0, len(log.scans[0])).ranges) == [round(2.0 + 0.01 * n, 2) for n in range(30)]
    assert not any("second receiver" in note for note in log.notes)


def test_clock_of_a_scanner_that_stands_gives_way_to_the_times_of_capture(tmp_path: Path) -> None:
    def telegram(number: int) -> bytes:
        content = bytearray(encode_lmd(turned(number), number))
        # Both times of the telegram, in microseconds, at byte 30 of its content.
        content[30:38] = bytes(8)
        return frame_binary(bytes(content))

    sent = stream(1_000, 50_000, telegram=telegram)

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sent, nanoseconds=True))

    assert len(log.scans[0]) == 30
    assert np.abs(np.diff(log.scans[0].stamps_ns) - TENTH).max() <= 1_000_000


def test_capture_of_thousands_of_connections_finds_its_scanner(tmp_path: Path) -> None:
    others: list[made.Packet] = []
    for number in range(500):
        packet = made.ip(6, struct.pack(">HH", 40_000 + number, 443) + made.tcp(1, bytes(900))[4:])
        others.append((START + number, packet))
    mixed = [each for pair in zip(others, stream(1_000, 50_000) * 9, strict=False) for each in pair]

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sorted(mixed, key=lambda each: each[0])))

    assert len(log.scans[0]) == 30
