"""Bags as plants have them: motion in transforms only, prefixes of robots, files that are packed, cut, never closed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from commission.errors import CommissionError, FileFormatError
from commission.io.interchange import ConvertOptions, convert_file
from commission.io.recordings.base import load_log
from commission.io.recordings.channels import ChannelOptions
from commission.io.recordings.mcap_writer import McapWriter
from commission.io.recordings.motion import Wheels
from commission.site.record_log import RecordLog
from commission.site.recorded_sweep import RecordedSweep
from tests.io.recordings import ros_bags as bags
from tests.io.recordings.ros_bags import KINDS, START
from tests.io.recordings.test_mcap_recording import assert_same

TENTH = 100_000_000
ECHO = [1.5, 2.5, math.inf, 0.0, 3.5]
STRONG = [1.0, 2.0, 3.0, 4.0, 5.0]
# Ahead 1 m, a quarter of a turn to the left where it stands, and ahead 1 m: the third pose is that of the corner.
POSES = [(4.0, 7.0, 0.0), (5.0, 7.0, 0.0), (5.0, 7.0, math.pi / 2), (5.0, 8.0, math.pi / 2)]
STEPS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2], [1.0, 0.0, 0.0]]


def scans(frame: str = "laser", topic: str = "/scan", count: int = 4) -> list[bags.Message]:
    return [bags.scan(START + k * TENTH, ECHO, topic, intensities=STRONG, frame=frame) for k in range(count)]


def moved(parent: str = "odom", child: str = "base_link", topic: str = "/tf") -> list[bags.Message]:
    """Transforms of a vehicle that moves."""
    return [
        bags.transform(START + k * TENTH, parent, child, pose, topic=topic)
        for k, pose in enumerate(POSES)
    ]  # fmt: skip


def read(folder: Path, messages: list[bags.Message], *channels: str, kind: str = ".mcap") -> RecordLog:
    path = bags.write_bag(folder / f"bag_{kind[1:]}{kind}", sorted(messages, key=lambda each: each[2]))
    return load_log(path, ChannelOptions(channels=channels))


@pytest.mark.parametrize("kind", KINDS)
def test_vehicle_whose_odometry_is_in_transforms_only_is_moved_by_them(tmp_path: Path, kind: str) -> None:
    mast = bags.transform(START + TENTH, "base_link", "laser", (0.3, 0.0, 0.0))
    drift = [bags.transform(START + k * TENTH, "map", "odom", (0.01 * k, 0.0, 0.0), topic="/tf") for k in range(4)]

    log = read(tmp_path, [*drift, *moved(), mast, *scans()], kind=kind)

    np.testing.assert_allclose(log.displacements, STEPS, atol=1e-12)
    assert log.odometry_stamps_ns.tolist() == [START + k * TENTH for k in range(4)]
    assert "the odometry is /tf (tf2_msgs/msg/TFMessage)" in log.notes
    assert [(each.base, each.x) for each in log.mountings] == [("base_link", 0.3)]
    assert not any("no stamp" in note for note in log.notes)


def test_transforms_give_way_to_odometry_unless_they_are_named(tmp_path: Path) -> None:
    other = [bags.odometry(START + k * TENTH, (0.5 * k, 0.0, 0.0)) for k in range(4)]

    plain = read(tmp_path / "plain", [*moved(), *other, *scans()])
    named = read(tmp_path / "named", [*moved(), *other, *scans()], "odometry=/tf")
    without = read(tmp_path / "none", [*moved(), *scans()], "odometry=none")

    assert plain.displacements[:, 0].tolist() == [0.0, 0.5, 0.5, 0.5]
    np.testing.assert_allclose(named.displacements, STEPS, atol=1e-12)
    assert "it holds no odometry: how the vehicle moved is not known" in without.notes


def test_frames_of_one_robot_have_its_name_before_them_and_another_robot_is_told(tmp_path: Path) -> None:
    mounted = bags.transform(START, "agv7/base_footprint", "agv7/laser", (0.3, 0.1, 0.0))
    other = moved("agv8/odom", "agv8/base_footprint")[2:]

    log = read(tmp_path, [*moved("agv7/odom", "agv7/base_footprint"), *other, mounted, *scans("agv7/laser")])

    np.testing.assert_allclose(log.displacements, STEPS, atol=1e-12)
    assert [(each.base, each.x, each.y) for each in log.mountings] == [("agv7/base_footprint", 0.3, 0.1)]
    assert "2 transforms of agv8/base_footprint in agv8/odom are of another vehicle" in log.notes


@pytest.mark.parametrize("odometry", ["twist", "none"])
def test_mounting_is_found_behind_the_name_of_a_robot_and_of_transforms_that_come_last(
    tmp_path: Path, odometry: str
) -> None:
    last = START + 3 * TENTH
    chain = [
        bags.transform(last, "agv7/base_link", "agv7/mast", (0.5, 0.0, math.pi / 2)),
        bags.transform(last, "agv7/mast", "agv7/laser", (0.25, 0.0, 0.0), upside_down=True),
    ]
    speeds = [bags.twist_stamped(START + k * TENTH, (1.0, 0.0, 0.0)) for k in range(4)] * (odometry == "twist")

    (found,) = read(tmp_path, [*speeds, *scans("agv7/laser"), *chain]).mountings

    np.testing.assert_allclose([found.x, found.y, found.heading], [0.5, 0.25, math.pi / 2], atol=1e-9)
    assert (found.base, found.upside_down) == ("agv7/base_link", True)


@pytest.mark.parametrize("kind", KINDS)
def test_twist_without_a_stamp_is_read_when_it_is_named_and_offered_when_nothing_else_is_there(
    tmp_path: Path, kind: str
) -> None:
    turning = [bags.twist(START + step * 10 * TENTH, (math.pi / 2, 0.0, math.pi / 2)) for step in range(3)]

    offered = read(tmp_path / "offered", [*turning, *scans()], kind=kind)
    named = read(tmp_path / "named", [*turning, *scans()], "odometry=/cmd_vel", kind=kind)

    told = "only where they are named, --channel odometry=TOPIC: /cmd_vel (geometry_msgs/msg/Twist, 3 messages)"
    assert any(note.endswith(told) for note in offered.notes)
    # A quarter of a circle of radius 1 m in each second.
    np.testing.assert_allclose(named.displacements, [[0.0, 0.0, 0.0], *2 * [[1.0, 1.0, math.pi / 2]]], atol=1e-12)
    assert "3 messages of /cmd_vel have no stamp; the time of recording stands for it" in named.notes


def test_wheels_that_are_called_otherwise_are_told_with_the_names_that_are_there(tmp_path: Path) -> None:
    joints = [bags.joint_state(START + k, ["castor", "wl", "wr"], [0.0, 1.0, 1.0], []) for k in range(3)]
    path = bags.write_bag(tmp_path / "bag_mcap.mcap", [*joints, *scans()])
    wheels = Wheels(left="left", right="right", radius=0.1, separation=0.5)

    notes = load_log(path, ChannelOptions(wheels=wheels)).notes

    assert any("3 messages of /joint_states without both of the wheels" in note for note in notes)
    assert any("(its joints: castor, wl, wr)" in note for note in notes)


@pytest.mark.parametrize(
    ("step", "passed", "direction"), [(0.25, 0.01, 1), (0.25, -0.01, -1), (-0.25, 0.01, -1), (-0.25, -0.01, 1)]
)
def test_sweep_that_scans_tell_is_kept(tmp_path: Path, step: float, passed: float, direction: int) -> None:
    messages = [bags.scan(START + k, ECHO, angles=(0.5, step), time_increment=passed) for k in range(3)]

    log = read(tmp_path, messages)

    (found,) = log.sweeps
    # Five beams have four steps between them, each in a float32.
    assert found == RecordedSweep(scanner="scanner", duration=pytest.approx(0.04, abs=1e-8), direction=direction)
    shot = log.scans[0].scan(0)
    assert (shot.angle_min, shot.angle_increment) == (0.5, step)
    np.testing.assert_array_equal(shot.ranges, np.array([1.5, 2.5, np.nan, np.nan, 3.5], np.float32))


@pytest.mark.parametrize("passed", [0.0, math.inf, math.nan])
def test_time_from_beam_to_beam_that_says_nothing_is_no_sweep(tmp_path: Path, passed: float) -> None:
    assert read(tmp_path, [bags.scan(START, ECHO, time_increment=passed)]).sweeps == ()


def long_drive(kind: str, folder: Path, packed: str = "") -> Path:
    messages: list[bags.Message] = []
    for k in range(300):
        stamp = START + k * TENTH
        messages += [bags.odometry(stamp, (0.1 * k, 0.0, 0.0)), bags.scan(stamp, ECHO * 400, intensities=STRONG * 400)]
    return bags.write_bag(folder / f"bag_{kind[1:]}{kind}", messages, packed=packed)


@pytest.mark.parametrize("packed", ["", "BZ2", "LZ4"])
def test_bag_of_ros_1_whose_recorder_was_stopped_is_read_to_there(tmp_path: Path, packed: str) -> None:
    whole = long_drive(".bag", tmp_path, packed)
    content, records = whole.read_bytes(), list(load_log(whole).records())
    active = tmp_path / "drive.bag.active"
    active.write_bytes(content[: int(0.8 * len(content))])

    log = load_log(active)

    found = list(log.records())
    assert len(records) // 4 < len(found) < len(records)
    assert_same(found, records[: len(found)])
    assert "drive.bag.active was cut while it was recorded; it is read up to there" in log.notes


def test_chunk_whose_length_the_recorder_had_not_yet_written_ends_a_bag_of_ros_1(tmp_path: Path) -> None:
    content = bytearray(long_drive(".bag", tmp_path).read_bytes())
    places = [at for at in range(len(content)) if content.startswith(b"compression=none", at)]
    assert len(places) > 2
    # Behind the header of the last chunk stands how long it is.
    header = content.rfind(b"size=", 0, places[-1] + 40)
    length = header + 9 if header > places[-1] else places[-1] + 16
    content[length : length + 4] = bytes(4)
    active = tmp_path / "drive.bag.active"
    active.write_bytes(content[: length + 4])

    log = load_log(active)

    assert 0 < len(log.scans[0]) < 300
    assert any("was cut while it was recorded" in note for note in log.notes)


@pytest.mark.parametrize("seed", range(30))
def test_damaged_bag_of_ros_1_without_its_index_is_one_line_or_records(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    content = bytearray(bags.write_bag(tmp_path / "bag_bag.bag", scans(count=20)).read_bytes())
    content = content[: int(0.9 * len(content))]
    for place in rng.integers(20, len(content), 5):
        content[place] = rng.integers(256)
    (tmp_path / "drive.bag.active").write_bytes(content)

    try:
        log = load_log(tmp_path / "drive.bag.active")
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        assert len(log.scans[0]) <= 20


def test_packed_bag_that_is_cut_is_read_to_there_and_an_error_names_the_bag(tmp_path: Path) -> None:
    whole = next(long_drive(".mcap", tmp_path, "FILE").glob("*.zstd"))
    records = list(load_log(whole).records())
    cut = tmp_path / "drive_0.mcap.zstd"
    rng = np.random.default_rng(3)
    content = whole.read_bytes()
    cut.write_bytes(content[: int(0.6 * len(content))])

    log = load_log(cut)

    found = list(log.records())
    assert 0 < len(found) < len(records)
    assert_same(found, records[: len(found)])
    assert "drive_0.mcap.zstd is cut; it is read up to there" in log.notes
    noise = whole.with_name("noise.db3.zstd")
    noise.write_bytes(content[:4] + rng.bytes(500))
    with pytest.raises(FileFormatError, match=r"noise\.db3\.zstd: is packed as a whole"):
        load_log(noise)


def simulated(zeros: int, count: int = 20) -> list[bags.Message]:
    """A simulation that tells its time from 0 on, recorded by another clock; at first it stands."""
    found: list[bags.Message] = []
    for k in range(zeros + count):
        stamp = max(k - zeros + 1, 0) * TENTH
        for topic, kind, _, make in (bags.odometry(stamp, (0.1 * k, 0.0, 0.0)), bags.scan(stamp, ECHO)):
            found.append((topic, kind, START + k * TENTH, make))
    return found


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("zeros", [1, 5])
def test_time_of_a_simulation_that_begins_at_zero_is_no_missing_stamp(tmp_path: Path, kind: str, zeros: int) -> None:
    log = read(tmp_path, simulated(zeros), kind=kind)

    assert log.odometry_stamps_ns.tolist() == [k * TENTH for k in range(21)]
    assert log.scans[0].stamps_ns.tolist() == [k * TENTH for k in range(21)]
    assert not any("no stamp" in note for note in log.notes)
    # What it drove while its time stood is not lost.
    np.testing.assert_allclose(log.displacements[:, 0].sum(), 2.0, atol=1e-12)


@pytest.mark.parametrize("count", [1, 63, 200])
def test_scans_that_all_have_no_stamp_are_stamped_by_their_recording(tmp_path: Path, count: int) -> None:
    messages = [(*bags.scan(0, ECHO)[:2], START + k * TENTH, bags.scan(0, ECHO)[3]) for k in range(count)]

    log = read(tmp_path, messages)

    assert log.scans[0].stamps_ns.tolist() == [START + k * TENTH for k in range(count)]
    assert f"{count} messages of /scan have no stamp; the time of recording stands for it" in log.notes


def test_a_stamp_that_is_missing_among_others_of_today_is_that_of_the_recording(tmp_path: Path) -> None:
    messages = [bags.scan(START + k * TENTH, ECHO) for k in range(4)]
    messages[0] = (*messages[0][:3], bags.scan(0, ECHO)[3])

    log = read(tmp_path, messages)

    assert log.scans[0].stamps_ns.tolist() == [START + k * TENTH for k in range(4)]
    assert "1 messages of /scan have no stamp; the time of recording stands for it" in log.notes


@pytest.mark.parametrize("also", ["other joints", "positions that are none", "speeds of the same wheels"])
def test_wheels_are_told_by_those_messages_that_have_them(tmp_path: Path, also: str) -> None:
    messages: list[bags.Message] = []
    for k in range(5):
        stamp = START + k * TENTH
        # The wheels of 0.1 m turn by 2 rad between two messages: 0.2 m.
        wheels = bags.joint_state(stamp, ["wl", "wr"], [2.0 * k, 2.0 * k], [20.0, 20.0])
        if also == "other joints":
            messages.append(bags.joint_state(stamp - 5, ["arm", "wl"], [], [0.3, 0.4]))
        elif also == "positions that are none":
            wheels = bags.joint_state(stamp, ["wl", "wr"], [math.nan, math.nan], [20.0, 20.0])
        else:
            messages.append(bags.joint_state(stamp + 5, ["wl", "wr"], [], [99.0, 99.0]))
        messages.append(wheels)
    path = bags.write_bag(tmp_path / "bag_mcap.mcap", sorted(messages, key=lambda each: each[2]))

    log = load_log(path, ChannelOptions(wheels=Wheels(left="wl", right="wr", radius=0.1, separation=0.5)))

    np.testing.assert_allclose(log.displacements, [[0.0, 0.0, 0.0], *4 * [[0.2, 0.0, 0.0]]], atol=1e-9)


def test_topics_of_another_encoding_and_topics_without_a_message_are_named_as_such(tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    with other.open("wb") as file:
        writer = McapWriter(other, file)
        writer.add_message(writer.add_channel("/scan", "foxglove.LaserScan", ""), START, b"{}")
        writer.finish()
    # Both have three letters, so that nothing moves.
    other.write_bytes(other.read_bytes().replace(b"\x03\x00\x00\x00cdr", b"\x03\x00\x00\x00pb3"))
    empty = tmp_path / "empty.mcap"
    with empty.open("wb") as file:
        writer = McapWriter(empty, file)
        writer.add_channel("/scan", "sensor_msgs/msg/LaserScan", "")
        writer.finish()

    with pytest.raises(FileFormatError, match=r"is read \(it has /scan \(foxglove.LaserScan, encoded as pb3\)\)"):
        load_log(other)
    with pytest.raises(FileFormatError, match=r"is read \(it has /scan \(sensor_msgs/msg/LaserScan, no message\)\)"):
        load_log(empty)


@pytest.mark.parametrize("kind", [".mcap", ".db3"])
def test_metadata_of_a_bag_stand_for_its_folder(tmp_path: Path, kind: str) -> None:
    folder = bags.write_bag(tmp_path / f"bag_{kind[1:]}{kind}", scans())

    assert_same(load_log(folder / "metadata.yaml").records(), load_log(folder).records())
    convert_file(folder / "metadata.yaml", tmp_path / "tables", ConvertOptions())

    assert len(load_log(tmp_path / "tables").scans[0]) == 4


@pytest.mark.parametrize("name", ["/odom", "/odometry/filtered"])
def test_odometry_that_is_named_is_not_its_own_reference(tmp_path: Path, name: str) -> None:
    topics = "/odom", "/odometry/filtered"
    both = [bags.odometry(START + k, (0.1 * k, 0.0, 0.0), topic=topic) for k in range(4) for topic in topics]

    log = read(tmp_path, [*both, *scans()], f"odometry={name}")

    assert len(log.odometry_stamps_ns) == 4
    assert len(log.reference_stamps_ns) == 0
    other = {"/odom": "/odometry/filtered", "/odometry/filtered": "/odom"}[name]
    held = load_log(tmp_path / "bag_mcap", ChannelOptions(channels=(f"odometry={name}", f"reference={other}")))
    assert held.reference_poses[:, 0].tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])


@pytest.mark.parametrize("first_without", [1, 30])
def test_intensities_are_kept_where_the_first_scans_have_none(tmp_path: Path, first_without: int) -> None:
    messages = [
        bags.scan(START + k * TENTH, ECHO, intensities=STRONG if k >= first_without else None) for k in range(100)
    ]

    log = read(tmp_path, messages)

    strengths = log.scans[0].block(0, 100).intensities
    assert strengths is not None
    assert strengths[first_without:].tolist() == [STRONG] * (100 - first_without)
    assert not strengths[:first_without].any()
    assert f"{first_without} scans have no intensities, where others do (taken as 0)" in log.notes
