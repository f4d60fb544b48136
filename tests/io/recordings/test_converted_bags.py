"""Recordings become bags of ROS 1 and ROS 2 that read back to the last bit, and that other programs understand."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from rosbags.highlevel import AnyReader

from commission.errors import CommissionError, FileFormatError
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.channels import ChannelOptions
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.writers import write_records
from commission.site.disturbances import ScannerError
from commission.site.records import Detections, Odometry, Record, Reflex, Scan, TagSightings
from commission.site.reference_mount import ReferenceMount
from commission.site.truth import Truth
from tests.io.recordings.test_mcap_recording import NAMES, assert_same, drives, run, steps

BAGS = (".bag", ".db3")
ALL = ("", ".mcap", *BAGS)
"""How what can be written ends; a CSV folder has no ending."""


def shifted(records: list[Record]) -> list[Record]:
    """The same records, none of them before 1970."""
    later = max(0, -min(record.stamp_ns for record in records))
    return [replace(record, stamp_ns=record.stamp_ns + later) for record in records]


@settings(max_examples=20, deadline=None)
@given(drives())
@pytest.mark.parametrize("ending", BAGS)
def test_every_record_comes_back_from_a_bag_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, ending: str, records: list[Record]
) -> None:
    path = tmp_path_factory.mktemp("drive") / f"drive{ending}"
    records = shifted(records)
    write_records(path, records, scanners=NAMES)

    log = load_log(path)

    assert (log.scanners, log.notes) == (NAMES, ())
    assert_same(log.records(), records)


@pytest.mark.parametrize(("source", "target"), [pair for pair in itertools.product(ALL, ALL) if pair[0] != pair[1]])
def test_each_kind_of_recording_becomes_each_other_kind(tmp_path: Path, source: str, target: str) -> None:
    truth = Truth(seed=7, route="Ä loop", scanners=(ScannerError(scanner="rear", clock_offset=0.0123),))
    mount = ReferenceMount(antenna=(0.1, -0.2, 1.0), clock_offset=0.05)
    one, two = tmp_path / f"one{source}", tmp_path / f"two{target}"
    write_records(one, steps(), truth, scanners=NAMES, reference_mount=mount)

    assert run("convert", str(one), str(two)) == 0

    log = load_log(two)
    assert_same(log.records(), steps())
    assert (log.scanners, log.truth, log.reference_mount) == (NAMES, truth, mount)


@pytest.mark.parametrize("ending", BAGS)
def test_tags_and_bearings_come_back_from_a_bag(tmp_path: Path, ending: str) -> None:
    pose = np.array([[1.0, 0.2, 0.3, 0.01, 0.01, 0.02]])
    records: list[Record] = [
        Odometry(1_000, np.zeros(3)),
        TagSightings(2_000, pose, ("A 1",)),
        Reflex(3_000, 0.5, "R1"),
        Reflex(4_000, math.nan, ""),
    ]
    write_records(tmp_path / f"drive{ending}", records)

    assert_same(load_log(tmp_path / f"drive{ending}").records(), records)


@pytest.mark.parametrize("ending", BAGS)
def test_other_programs_find_messages_of_ros_in_a_bag_that_is_written(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"drive{ending}"
    write_records(path, steps(), scanners=NAMES)
    scans = [record for record in steps() if isinstance(record, Scan) and record.scanner == 1]
    moved = [record.displacement for record in steps() if isinstance(record, Odometry)]

    # Not our reader: the library's, and the types that the bag itself defines.
    with AnyReader([path]) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
        read: dict[str, list[Any]] = {"/rear/scan": [], "/odom": []}
        for connection, stamp, data in reader.messages():
            if connection.topic in read:
                read[connection.topic].append((stamp, reader.deserialize(data, connection.msgtype)))

    assert kinds["/rear/scan"] == "sensor_msgs/msg/LaserScan"
    assert kinds["/odom"] == "nav_msgs/msg/Odometry"
    assert [stamp for stamp, _ in read["/rear/scan"]] == [scan.stamp_ns for scan in scans]
    for (_, message), scan in zip(read["/rear/scan"], scans, strict=True):
        np.testing.assert_array_equal(message.ranges, scan.ranges)
        assert message.angle_min == pytest.approx(scan.angle_min, abs=1e-6)
    assert len(read["/odom"]) == len(moved)


@pytest.mark.parametrize("ending", BAGS)
def test_topics_of_a_bag_that_is_written_can_be_named(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"drive{ending}"
    write_records(path, steps(), scanners=NAMES)

    log = load_log(path, ChannelOptions(channels=("scan=/rear/scan",)))

    assert len(log.scans) == 1
    assert len(log.scans[0]) == sum(isinstance(record, Scan) and record.scanner == 1 for record in steps())


def test_loading_twice_reads_the_same(tmp_path: Path) -> None:
    write_records(tmp_path / "drive.db3", steps(), scanners=NAMES)
    recording = open_recording(tmp_path / "drive.db3")

    assert_same(recording.load().records(), recording.load().records())


@pytest.mark.parametrize(
    ("ending", "kept"), [(".bag", 0.02), (".bag", 0.3), (".db3", 0.02), (".db3", 0.3), (".db3", 0.7), (".db3", 0.99)]
)
def test_bag_that_is_cut_is_an_error_in_one_line(tmp_path: Path, ending: str, kept: float) -> None:
    path = tmp_path / f"drive{ending}"
    write_records(path, steps(), scanners=NAMES)
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])

    with pytest.raises(CommissionError) as told:
        load_log(path)

    assert str(told.value).startswith(str(path))
    assert "\n" not in str(told.value)


def test_bag_of_ros_1_that_is_cut_gives_what_was_complete_to_the_last_bit(tmp_path: Path) -> None:
    records = steps(2_000)
    path = tmp_path / "drive.bag"
    write_records(path, records, scanners=NAMES)
    path.write_bytes(path.read_bytes()[: int(0.7 * path.stat().st_size)])

    log = load_log(path)

    found = list(log.records())
    assert log.notes == ("drive.bag was cut while it was recorded; it is read up to there",)
    assert 0.3 * len(records) < len(found) < len(records)
    assert_same(found, records[: len(found)])


def test_time_before_1970_is_refused_where_ros_1_has_none_and_nothing_is_left(tmp_path: Path) -> None:
    records = [Odometry(-5, np.zeros(3)), Detections(0, np.empty((0, 2)))]

    with pytest.raises(FileFormatError, match=r"its stamp is -5 ns; expected 1970 or later"):
        write_records(tmp_path / "drive.bag", records)

    assert not list(tmp_path.iterdir())
    write_records(tmp_path / "drive.db3", records)
    assert_same(load_log(tmp_path / "drive.db3").records(), records)


def test_bag_that_is_there_stays_until_it_may_be_replaced(tmp_path: Path, capsys: Any) -> None:
    write_recording(tmp_path / "one", steps(), scanners=NAMES)
    (tmp_path / "drive.bag").write_bytes(b"mine")

    assert run("convert", str(tmp_path / "one"), str(tmp_path / "drive.bag")) == 2
    assert "drive.bag exists" in capsys.readouterr().err
    assert (tmp_path / "drive.bag").read_bytes() == b"mine"
    assert run("convert", str(tmp_path / "one"), str(tmp_path / "drive.bag"), "--force") == 0
    assert_same(load_log(tmp_path / "drive.bag").records(), steps())


@pytest.mark.parametrize("ending", [".pcap", ".pcapng", ".log", ".clf"])
def test_formats_that_are_only_read_are_refused_as_targets(tmp_path: Path, capsys: Any, ending: str) -> None:
    write_recording(tmp_path / "one", steps(), scanners=NAMES)

    assert run("convert", str(tmp_path / "one"), str(tmp_path / f"drive{ending}")) == 2

    told = capsys.readouterr().err
    assert f"ends in {ending}, which is read only; expected a folder for tables" in told
    assert ".mcap or .db3 (ROS 2) or .bag (ROS 1)" in told


def test_range_below_zero_is_told(tmp_path: Path) -> None:
    scan = next(record for record in steps() if isinstance(record, Scan))
    odd = np.float32(7.654321)
    records = [Odometry(scan.stamp_ns, np.zeros(3)), replace(scan, ranges=np.full(len(scan.ranges), odd), scanner=0)]
    file = tmp_path / "drive.db3"
    write_records(file, records)
    # What one bit makes of a file without checksums.
    file.write_bytes(file.read_bytes().replace(odd.tobytes(), (-odd).tobytes(), 1))

    with pytest.raises(FileFormatError, match=r"scans: has a range of -7.65432 m; expected 0 m or more"):
        load_log(file)
