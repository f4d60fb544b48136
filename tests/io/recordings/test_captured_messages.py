"""JSON over UDP and rosbridge in captures; frames of WebSocket are made by the library `websockets`."""

from __future__ import annotations

import math
import struct
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from websockets.frames import Frame, Opcode

from commission.errors import CommissionError
from commission.io.protocols.json_records import encode_message
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.io.protocols.rosbridge import encode_publication
from commission.io.protocols.safety_encoder import encode_fragments, encode_instance
from commission.io.recordings.base import load_log
from commission.io.recordings.channels import ChannelOptions
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan, TagSightings
from tests.io.recordings import captured_packets as made

START = 1_700_000_000_123_456_000
TENTH = 100_000_000
BOOT = 5_000_000_000
"""The sender's clock begins elsewhere."""


def shot(number: int, scanner: int = 0) -> Scan:
    ranges = np.full(9, 2.0 + 0.01 * number + scanner, np.float32)
    flags = np.arange(9) == number % 9
    return Scan(
        stamp_ns=BOOT + number * TENTH,
        ranges=ranges,
        angle_min=-0.5,
        angle_increment=0.125,
        reflector=flags,
        scanner=scanner,
    )


def pose(number: int, x: float = 0.1) -> OdometryPose:
    return OdometryPose(BOOT + number * TENTH, np.array([x * number, 0.0, 0.0]))


def datagrams(names: tuple[str, ...], records: list[Record | OdometryPose]) -> list[made.Packet]:
    """Each from a new port, a few milliseconds late."""
    late, port = count(0), count(40_000)
    sent: list[made.Packet] = []
    for record in records:
        data = encode_message(LiveMessage(record, device_ns=record.stamp_ns), names)
        content = struct.pack(">HHHH", next(port), 6061, 8 + len(data), 0) + data
        arrived = START + record.stamp_ns - BOOT + next(late) % 5 * 1_000_000
        sent.append((arrived, made.ip(17, content)))
    return sent


def first_ranges(scans) -> list[float]:
    return [round(float(each), 2) for each in scans.block(0, len(scans)).ranges[:, 0]]


def test_json_in_a_capture_becomes_the_records_that_were_sent(tmp_path: Path) -> None:
    records: list[Record | OdometryPose] = []
    for number in range(20):
        stamp = BOOT + number * TENTH
        records += [pose(number), shot(number), ReferencePose(stamp, np.array([5.0, 0.2 * number, math.nan]))]
        records += [Detections(stamp + 1_000_000, np.array([[3.0, 0.1 * number]]))]
    sent = datagrams(("scanner",), records)

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sent, nanoseconds=True))

    np.testing.assert_allclose(log.displacements[1:], np.tile([0.1, 0.0, 0.0], (19, 1)), atol=1e-12)
    # By the sender's clock: evenly, whatever the network did, and the quickest message was 0 ms late.
    assert log.odometry_stamps_ns.tolist() == [START + number * TENTH for number in range(20)]
    assert log.scans[0].stamps_ns.tolist() == log.odometry_stamps_ns.tolist()
    assert first_ranges(log.scans[0]) == [round(2.0 + 0.01 * number, 2) for number in range(20)]
    flags = log.scans[0].block(0, 20).reflector
    assert flags is not None
    assert flags.argmax(axis=1).tolist() == [number % 9 for number in range(20)]
    assert log.range_bearing[:, 1].tolist() == pytest.approx([0.1 * number for number in range(20)])
    np.testing.assert_allclose(log.reference_poses[:, :2], [[5.0, 0.2 * number] for number in range(20)], atol=1e-12)
    assert np.isnan(log.reference_poses[:, 2]).all()
    assert "JSON is spoken at 192.168.0.2:6061" in log.notes


def test_scanners_that_messages_name_are_called_so(tmp_path: Path) -> None:
    records: list[Record | OdometryPose] = [shot(number, scanner) for number in range(5) for scanner in range(2)]
    path = made.write_pcap(tmp_path / "a.pcap", datagrams(("front", "rear"), records))

    log = load_log(path)
    chosen = load_log(path, ChannelOptions(channels=("scan=192.168.0.2:6061 rear/scan",)))

    assert log.scanners == ("front", "rear")
    assert [first_ranges(each)[0] for each in log.scans] == [2.0, 3.0]
    assert [first_ranges(each)[0] for each in chosen.scans] == [3.0]


def test_odometry_as_json_beside_a_scanner_s_telegrams_is_one_recording(tmp_path: Path) -> None:
    sent = datagrams(
        ("scanner",),
        [Odometry(BOOT + number * TENTH, np.array([0.1, 0.0, 0.01]) * (number > 0)) for number in range(20)],
    )
    for number in range(20):
        instance = encode_instance(shot(number), number)
        for place, part in enumerate(encode_fragments(instance, number)):
            sent.append((START + number * TENTH + place, made.ip(17, made.udp(part))))

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sorted(sent, key=lambda each: each[0]), nanoseconds=True))

    np.testing.assert_allclose(log.displacements[1:], np.tile([0.1, 0.0, 0.01], (19, 1)), atol=1e-12)
    assert (log.scanners, len(log.scans[0])) == (("scanner",), 20)


def test_what_a_capture_has_no_place_for_and_what_is_broken_is_told(tmp_path: Path) -> None:
    tags = TagSightings(BOOT, np.array([[1.0, 2.0, 0.5, 0.1, 0.1, 0.1]]), ("a",))
    sent = datagrams(("scanner",), [shot(0), tags, shot(1)])
    broken = b'{"type": "odometry", "pose": [1, 2]}'
    sent.append((START + 9, made.ip(17, made.udp(broken))))
    sent.append((START + 10, made.ip(17, made.udp(b'{"hello": "world"}'))))

    notes = load_log(made.write_pcap(tmp_path / "a.pcap", sent)).notes

    assert any("messages (TagSightings at 192.168.0.2:6061) are left out" in note for note in notes)
    assert any("messages to 192.168.0.2:6060 cannot be decoded and are left out" in note for note in notes)
    assert not any("world" in note for note in notes)


def server(data: bytes, begin: int) -> bytes:
    return struct.pack(">HHIIBBHHH", 9090, 50_000, begin % 2**32, 0, 5 << 4, 16, 0, 0, 0) + data


def frames(message: bytes, *, in_parts: bool) -> bytes:
    opcode = Opcode.TEXT if message[:1] == b"{" else Opcode.BINARY
    if not in_parts:
        return Frame(opcode, message).serialize(mask=False)
    parts = [Frame(opcode, message[:40], fin=False), Frame(Opcode.PING, b"x"), Frame(Opcode.CONT, message[40:])]
    return b"".join(part.serialize(mask=False) for part in parts)


def bridge(
    *, is_cbor: bool, in_parts: bool = False, greeted: bool = True, lost: int | None = None
) -> list[made.Packet]:
    sent: list[made.Packet] = []
    begin = 77
    pieces = (
        [b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n"] if greeted else []
    )
    for number in range(20):
        publications = [
            encode_publication("/odom", pose(number), is_cbor=False),
            encode_publication("/front/scan", shot(number), is_cbor=is_cbor),
            encode_publication("/move_base/goal", ReferencePose(BOOT, np.array([9.0, 9.0, 0.0])), is_cbor=False),
            encode_publication("/amcl", ReferencePose(BOOT + number * TENTH, np.array([1.0, 2.0, 0.0])), is_cbor=False),
        ]
        pieces.append(b"".join(frames(each, in_parts=in_parts) for each in publications))
    for number, piece in enumerate(pieces):
        for at in range(0, len(piece), 900):
            if number != lost:
                sent.append((START + number * TENTH + at, made.ip(6, server(piece[at : at + 900], begin + at))))
        begin += len(piece)
    return sent


@pytest.mark.parametrize("is_cbor", [False, True])
@pytest.mark.parametrize("in_parts", [False, True])
def test_rosbridge_in_a_capture_becomes_the_records_that_were_published(
    tmp_path: Path, *, is_cbor: bool, in_parts: bool
) -> None:
    log = load_log(made.write_pcap(tmp_path / "a.pcap", bridge(is_cbor=is_cbor, in_parts=in_parts), nanoseconds=True))

    np.testing.assert_allclose(log.displacements[1:], np.tile([0.1, 0.0, 0.0], (19, 1)), atol=1e-12)
    assert first_ranges(log.scans[0]) == [round(2.0 + 0.01 * number, 2) for number in range(20)]
    assert np.diff(log.scans[0].stamps_ns).tolist() == [TENTH] * 19
    # A goal is not where the vehicle is.
    assert set(log.reference_poses[:, 0].tolist()) == {1.0}
    assert log.scanners == ("front",)
    assert "rosbridge is spoken at 192.168.0.1:9090" in log.notes
    assert any("20 messages (/move_base/goal at 192.168.0.1:9090) are left out" in note for note in log.notes)


@pytest.mark.parametrize("is_cbor", [False, True])
def test_connection_that_began_before_the_capture_and_lost_a_piece_comes_into_step(
    tmp_path: Path, *, is_cbor: bool
) -> None:
    sent = bridge(is_cbor=is_cbor, greeted=False, lost=7)

    log = load_log(made.write_pcap(tmp_path / "a.pcap", sent, nanoseconds=True))

    found = first_ranges(log.scans[0])
    assert 18 <= len(found) <= 19
    assert set(found) <= {round(2.0 + 0.01 * number, 2) for number in range(20)}
    np.testing.assert_allclose(log.displacements[:, 0].sum(), 1.9, atol=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_mutated_messages_are_an_error_in_one_line_or_records(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    sent = bridge(is_cbor=bool(seed % 2)) + datagrams(("scanner",), [pose(n) for n in range(5)])
    sent = [(at, bytearray(packet)) for at, packet in sent]
    for _ in range(6):
        packet = sent[rng.integers(len(sent))][1]
        packet[rng.integers(34, len(packet))] = rng.integers(256)
    path = made.write_pcap(tmp_path / "a.pcap", [(at, bytes(packet)) for at, packet in sent])

    try:
        log = load_log(path)
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(log.displacements).all()
