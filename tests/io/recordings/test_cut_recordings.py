"""Recordings of which a part is missing: each reader says which part, or refuses in one line; none is silent."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from commission.errors import CommissionError
from commission.io.recordings.base import load_log
from commission.io.recordings.csv_folder import DETECTIONS, ODOMETRY
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.pcap import payloads
from commission.io.recordings.writers import write_records
from commission.site.record_log import RecordLog
from tests.io.protocols.captures import cola_b, fragments, instance
from tests.io.protocols.test_cola import binary
from tests.io.recordings import captured_packets as made
from tests.io.recordings import ros_bags as bags
from tests.io.recordings.test_carmen import flaser, log_of
from tests.io.recordings.test_mcap_recording import NAMES, steps
from tests.io.recordings.test_ros_bag import ECHO, TENTH

START = 1_700_000_000_123_456_789
SECOND = 1_000_000_000


def safety_packets(count: int = 6) -> list[made.Packet]:
    parts = [part for number in range(count) for part in fragments(instance(300), number)]
    return [(START + index * 1_000_000, made.ip(17, made.udp(part))) for index, part in enumerate(parts)]


def ros_messages() -> list[bags.Message]:
    found: list[bags.Message] = []
    for step in range(200):
        stamp = bags.START + step * TENTH
        found.append(bags.odometry(stamp, (0.1 * step, 0.0, 0.0)))
        found.append(bags.scan(stamp, ECHO * 100, intensities=[1.0] * 500))
    return found


def ros_bag(folder: Path, ending: str) -> Path:
    path = bags.write_bag(folder / f"bag_{ending[1:]}{ending}", ros_messages())
    return path if path.is_file() else next(path.glob(f"*{ending}"))


def carmen(folder: Path) -> Path:
    return log_of(folder, *(flaser([1.0, 2.0], (0.1 * i, 0.0, 0.0), 100.0 + i, 1.0 + i) for i in range(30)))


def own(ending: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        write_records(folder / f"own{ending}", steps(), scanners=NAMES)
        return folder / f"own{ending}"

    return write


KINDS: dict[str, Callable[[Path], Path]] = {
    "pcap": lambda folder: made.write_pcap(folder / "a.pcap", safety_packets()),
    "pcapng": lambda folder: made.write_pcapng(folder / "a.pcapng", safety_packets()),
    "pcapng, big-endian": lambda folder: made.write_pcapng(folder / "a.pcapng", safety_packets(), order=">"),
    "CARMEN": carmen,
    "MCAP of others": lambda folder: ros_bag(folder, ".mcap"),
    "sqlite3 of others": lambda folder: ros_bag(folder, ".db3"),
    "ROS 1 of others": lambda folder: ros_bag(folder, ".bag"),
    "own MCAP": own(".mcap"),
    "own sqlite3": own(".db3"),
    "own ROS 1": own(".bag"),
}


def size(log: RecordLog) -> int:
    return len(log.odometry_stamps_ns) + sum(map(len, log.scans)) + len(log.detection_stamps_ns)


@pytest.mark.parametrize("kind", KINDS)
def test_recording_that_is_cut_anywhere_is_told_or_refused(tmp_path: Path, kind: str) -> None:
    whole = KINDS[kind](tmp_path)
    content, records = whole.read_bytes(), size(load_log(whole))
    cut = tmp_path / f"cut{whole.suffix}"
    rng = np.random.default_rng(5)
    told = 0
    for kept in rng.integers(1, len(content), 40):
        cut.write_bytes(content[:kept])
        try:
            log = load_log(cut)
        except CommissionError as error:
            assert "\n" not in str(error)
            told += 1
            continue
        lost = size(log) < records
        told += lost
        words = [note for note in log.notes if " cut " in note or "cut at" in note]
        # Cut between two lines or two packets, what is left is a whole recording, and nobody can know.
        assert words or not lost or is_whole(kind, content, int(kept)), (kept, log.notes)
    assert told > 20


def is_whole(kind: str, content: bytes, kept: int) -> bool:
    """Whether a file ends between two of its lines, or packets."""
    if kind == "CARMEN":
        return content[:kept].endswith(b"\n")
    if not kind.startswith("pcap"):
        return False
    place, order = (24, "<") if kind == "pcap" else (0, ">" if "big" in kind else "<")
    while place < kept:
        length = struct.unpack_from(f"{order}I", content, place + (8 if kind == "pcap" else 4))[0]
        place += 16 + length if kind == "pcap" else length
    return place == kept


@pytest.mark.parametrize("kind", KINDS)
def test_whole_recording_is_not_called_cut(tmp_path: Path, kind: str) -> None:
    notes = " ".join(load_log(KINDS[kind](tmp_path)).notes)

    assert not any(word in notes for word in (" cut", "missing", "not there", "in part", "no end", "gap"))


def test_cut_capture_says_at_which_byte(tmp_path: Path) -> None:
    file = KINDS["pcap"](tmp_path)
    content = file.read_bytes()
    last = len(content) - 16 - len(safety_packets()[-1][1])
    file.write_bytes(content[:-5])

    log = load_log(file)

    assert len(log.scans[0]) == 5
    told = f"1 packet is cut at the end of the capture (byte {last} of {len(content) - 5}); it is read up to there"
    assert told in log.notes


def test_cut_log_of_carmen_names_its_last_line(tmp_path: Path) -> None:
    file = carmen(tmp_path)
    file.write_bytes(file.read_bytes()[:-3])

    log = load_log(file)

    assert len(log.scans[0]) == 29
    assert "line 32, the last one, has no end: the log was cut there, and it is left out" in log.notes


def test_packets_that_were_captured_in_part_are_counted(tmp_path: Path) -> None:
    packets = safety_packets()
    packets[3] = packets[3][0], packets[3][1][:-40]

    log = load_log(made.write_pcap(tmp_path / "a.pcap", packets))

    assert "1 packets of 192.168.0.1 were captured in part only (whole with tcpdump -s 0)" in log.notes


def test_fragment_that_never_came_is_told_and_its_number_serves_again(tmp_path: Path) -> None:
    whole = made.udp(bytes(range(256)) * 10)
    other = made.udp(bytes(reversed(range(256))) * 10)
    begins = [made.ip(17, data[:1480], number=9, more=True) for data in (whole, other)]
    ends = [made.ip(17, data[1480:], number=9, offset=1480) for data in (whole, other)]
    file = made.write_pcap(
        tmp_path / "a.pcap",
        [(START, begins[0]), (START + 60 * SECOND, ends[1]), (START + 60 * SECOND, begins[1])],
    )
    told = Counter[str]()

    found = [payload.data for payload in payloads(file, told)]

    # The end of one datagram never joins the begin of one that was sent a minute before under the same number.
    assert found == [bytes(reversed(range(256))) * 10]
    assert told == {"datagrams of 192.168.0.1 lack a fragment of IP and are left out": 1}


def cola_packets(count: int) -> list[made.Packet]:
    """Scans of a TiM, one in each segment of TCP."""
    found, sequence = [], 100
    for index in range(count):
        content = bytearray(binary())
        content[16 + 14 : 16 + 18] = (1_000_000 + index * 66_667).to_bytes(4, "big")
        frame = cola_b(bytes(content))
        found.append((START + index * 66_667_000, made.ip(6, made.tcp(sequence, frame))))
        sequence += len(frame)
    return found


def test_lost_segment_of_tcp_loses_its_own_scan_only_and_is_told(tmp_path: Path) -> None:
    packets = cola_packets(40)
    del packets[10]

    log = load_log(made.write_pcap(tmp_path / "a.pcap", packets, nanoseconds=True))

    assert len(log.scans[0]) == 39
    assert "1 gaps in what 192.168.0.1:2112 sent: segments of TCP that were not captured" in log.notes


def test_segment_sent_again_in_other_pieces_comes_once(tmp_path: Path) -> None:
    content = bytes(range(200))
    sent = [(0, 50), (60, 90), (40, 75), (90, 100), (85, 200), (70, 120)]
    packets = [(START, made.ip(6, made.tcp(1_000 + begin, content[begin:end]))) for begin, end in sent]

    file = made.write_pcap(tmp_path / "a.pcap", packets)

    assert b"".join(payload.data for payload in payloads(file)) == content


def test_scanner_that_is_switched_on_late_is_a_scanner_all_the_same(tmp_path: Path) -> None:
    late = [(stamp + 900 * SECOND, ip.replace(made.SCANNER, bytes([192, 168, 0, 7]))) for stamp, ip in safety_packets()]
    others = [(START + SECOND + i, made.ip(17, made.udp(b"chatter", 99))) for i in range(6_000)]

    log = load_log(made.write_pcap(tmp_path / "a.pcap", [*safety_packets(), *others, *late]))

    assert log.scanners == ("192-168-0-1_6060", "192-168-0-7_6060")
    assert [len(scans) for scans in log.scans] == [6, 6]


def split_bag(folder: Path, ending: str, *, with_metadata: bool) -> Path:
    """A bag in four parts, numbered from 0 on."""
    bag = folder / "drive"
    bag.mkdir()
    messages = ros_messages()
    for part in range(4):
        written = bags.write_bag(folder / str(part) / f"bag_{ending[1:]}{ending}", messages[part * 100 :][:100])
        next(written.glob(f"*{ending}")).rename(bag / f"drive_{part}{ending}")
        if with_metadata and part == 3:
            text = (written / "metadata.yaml").read_text()
            one = next(line for line in text.splitlines() if line.strip().startswith("- ") and ending in line)
            listed = "\n".join(one.replace(one.strip()[2:], f"drive_{each}{ending}") for each in range(4))
            (bag / "metadata.yaml").write_text(text.replace(one, listed, 1))
    return bag


@pytest.mark.parametrize("ending", [".mcap", ".db3"])
@pytest.mark.parametrize("lost", [0, 2])
@pytest.mark.parametrize("with_metadata", [True, False])
def test_part_of_a_bag_that_is_not_there_is_named(tmp_path: Path, ending: str, lost: int, with_metadata: bool) -> None:
    bag = split_bag(tmp_path, ending, with_metadata=with_metadata)
    assert not any("not there" in note for note in load_log(bag).notes)
    (bag / f"drive_{lost}{ending}").unlink()

    log = load_log(bag)

    assert len(log.scans[0]) == 150
    how = "which metadata.yaml lists" if with_metadata else "by the numbers of the others"
    assert f"drive_{lost}{ending}, {how}, is not there: what was recorded in it is missing" in log.notes


def test_last_part_that_metadata_lists_is_named_too(tmp_path: Path) -> None:
    bag = split_bag(tmp_path, ".mcap", with_metadata=True)
    (bag / "drive_3.mcap").unlink()

    assert any("drive_3.mcap, which metadata.yaml lists, is not there" in note for note in load_log(bag).notes)


@pytest.mark.parametrize("kind", ["sqlite3 of others", "own sqlite3"])
def test_what_a_recorder_had_not_yet_put_into_its_file_is_told(tmp_path: Path, kind: str) -> None:
    file = KINDS[kind](tmp_path)
    file.with_name(f"{file.name}-wal").write_bytes(b"pages")

    assert any(f"{file.name}-wal holds what the recorder had not yet put" in note for note in load_log(file).notes)


@pytest.mark.parametrize("table", [ODOMETRY, DETECTIONS])
def test_table_whose_last_line_has_no_end_is_told(tmp_path: Path, table: str) -> None:
    write_recording(tmp_path / "drive", steps(), scanners=NAMES)
    assert not any("no end" in note for note in load_log(tmp_path / "drive").notes)
    file = tmp_path / "drive" / table
    file.write_bytes(file.read_bytes()[:-1])

    told = f"{table}: the last line has no end; if the file was cut there, its last number may lack digits"
    assert told in load_log(tmp_path / "drive").notes
