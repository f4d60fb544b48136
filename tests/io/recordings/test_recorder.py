"""The recorder's file, read by `rosbags`, which shares no code with it."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from commission.errors import FileFormatError
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.io.recordings.mcap_reader import McapFile
from commission.io.recordings.recorder import Recorder, write_mcap
from commission.localization.localizer import Localizer
from commission.simulation.scenario import virtual_drive
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan
from commission.studies.run import RunInput
from commission.studies.start import start_of

START = 1_700_000_000_000_000_000
"""Stamp of the first record [ns]."""
TENTH = 100_000_000
"""A tenth of a second [ns]."""


def drive(steps: int = 4) -> list[Record]:
    """Ahead by 0.1 m a step, turning by 0.01 rad, seen by a laser, a sensor that detects, and a second system."""
    found: list[Record] = []
    for step in range(steps):
        stamp = START + step * TENTH
        moved = [0.0, 0.0, 0.0] if step == 0 else [0.1, 0.001, 0.01]
        found.append(Odometry(stamp, np.array(moved)))
        found.append(ReferencePose(stamp, np.array([5.0, 0.1 * step, math.nan if step == 2 else 0.5])))
        found.append(Detections(stamp, np.array([[3.0 + step, 0.1], [4.0, -0.2]]) if step else np.empty((0, 2))))
        found.append(
            Scan(
                stamp_ns=stamp,
                ranges=np.array([1.0, 2.5 + step, np.nan, 0.0], dtype=np.float32),
                angle_min=-math.pi / 3,
                angle_increment=math.pi / 7,
                intensities=np.array([1.0, 2.0, 3.0, np.nan], dtype=np.float32),
                reflector=np.array([True, False, False, True]),
            )
        )
    return found


def messages(path: Path) -> dict[str, list[Any]]:
    """Messages of each topic as `rosbags` decodes them."""
    found: dict[str, list[Any]] = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            found[connection.topic].append(reader.deserialize(data, connection.msgtype))
    return dict(found)


def stamp_of(message: Any) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_rosbags_reads_what_was_recorded(tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())

    found = messages(tmp_path / "drive.mcap")

    assert [stamp_of(scan) for scan in found["/scan"]] == [START + step * TENTH for step in range(4)]
    scan = found["/scan"][1]
    np.testing.assert_array_equal(scan.ranges, np.array([1.0, 3.5, np.nan, 0.0], dtype=np.float32))
    np.testing.assert_array_equal(scan.intensities, np.array([1.0, 2.0, 3.0, np.nan], dtype=np.float32))
    assert (scan.angle_min, scan.angle_increment) == (np.float32(-math.pi / 3), np.float32(math.pi / 7))
    assert scan.angle_max == np.float32(-math.pi / 3 + 3 * math.pi / 7)
    assert scan.header.frame_id == "laser"
    beams = found["/commission/beams"][1]
    assert (beams.angle_min, beams.angle_increment) == (-math.pi / 3, math.pi / 7)
    assert beams.reflector.tolist() == [True, False, False, True]
    moved = found["/commission/displacement"][1]
    assert (moved.dx, moved.dy, moved.dtheta) == (0.1, 0.001, 0.01)
    odometry = found["/odom"][1]
    assert (odometry.child_frame_id, odometry.header.frame_id) == ("base_link", "odom")
    assert odometry.pose.pose.position.x == pytest.approx(0.1)
    assert odometry.pose.pose.orientation.z == pytest.approx(math.sin(0.005))
    assert odometry.twist.twist.linear.x == pytest.approx(1.0)
    assert odometry.twist.twist.angular.z == pytest.approx(0.1)
    seen = found["/commission/detected"]
    assert (seen[0].range.tolist(), seen[1].range.tolist()) == ([], [4.0, 4.0])
    assert seen[1].bearing.tolist() == [0.1, -0.2]
    assert found["/reference"][1].pose.orientation.z == pytest.approx(math.sin(0.25))
    assert found["/reference"][2].pose.orientation.w == 0.0
    assert math.isnan(found["/commission/reference"][2].theta)


def test_odometry_is_the_composed_way(tmp_path: Path) -> None:
    quarter = Odometry(START + TENTH, np.array([1.0, 0.0, math.pi / 2]))
    records = [Odometry(START, np.zeros(3)), quarter, Odometry(START + 2 * TENTH, quarter.displacement)]
    write_mcap(tmp_path / "drive.mcap", records)

    last = messages(tmp_path / "drive.mcap")["/odom"][-1].pose.pose

    assert (last.position.x, last.position.y) == pytest.approx((1.0, 1.0))
    assert (abs(last.orientation.z), last.orientation.w) == pytest.approx((1.0, 0.0))


@pytest.fixture(scope="module")
def localized(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Any]]:
    """A virtual drive with two scanners, recorded beside what the localizer says about it."""
    project = load_project(bundled_folder("maps") / "loading_bay")
    drive = virtual_drive(project, project.routes[0].name, 1)
    inputs = RunInput.of(project, drive, start_of(project, drive))
    localizer = Localizer(inputs.segments[0].setup, inputs.start.belief)
    path = tmp_path_factory.mktemp("recorded") / "drive.mcap"
    estimates: list[Any] = []
    with Recorder(path, drive.scanners, truth=drive.truth, mounted=project.scanners) as recorder:
        for count, record in enumerate(drive.records()):
            if count == 400:
                break
            recorder.append(record)
            for estimate in localizer.feed(record):
                recorder.append_estimate(estimate)
                estimates.append(estimate)
    return path, estimates


def test_estimate_detections_and_mode_stand_beside_the_raw_data(localized: tuple[Path, list[Any]]) -> None:
    path, estimates = localized

    found = messages(path)

    poses = found["/commission/estimate"]
    assert len(poses) == len(estimates) > 50
    for pose, estimate in zip(poses, estimates, strict=True):
        assert stamp_of(pose) == estimate.stamp_ns
        mean, covariance = estimate.posterior.mean, pose.pose.covariance.reshape(6, 6)
        assert (pose.pose.pose.position.x, pose.pose.pose.position.y) == (mean[0], mean[1])
        assert 2.0 * math.atan2(pose.pose.pose.orientation.z, pose.pose.pose.orientation.w) == pytest.approx(mean[2])
        np.testing.assert_array_equal(covariance[:2, :2], estimate.posterior.covariance[:2, :2])
        np.testing.assert_array_equal(covariance[5, [0, 1, 5]], estimate.posterior.covariance[2])
    cloud, estimate = found["/commission/detections"][-1], estimates[-1]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "d2", "status"]
    points = np.frombuffer(
        cloud.data.tobytes(), np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("d2", "<f4"), ("status", "u1")])
    )
    np.testing.assert_array_equal(points["x"], estimate.points_map[:, 0].astype(np.float32))
    np.testing.assert_array_equal(points["status"], estimate.status)
    assert [message.data for message in found["/commission/mode"]][-1] == estimates[-1].mode.name.lower()
    assert found["/tf"][0].transforms[0].child_frame_id == "base_link"
    mountings = [message.transforms[0] for message in found["/tf_static"]]
    frames = [message.header.frame_id for message in (found["/front_left/scan"][0], found["/rear_right/scan"][0])]
    assert [each.child_frame_id for each in mountings] == frames


@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9, 0.999])
def test_file_that_is_cut_is_read_up_to_there(localized: tuple[Path, list[Any]], tmp_path: Path, kept: float) -> None:
    whole = McapFile(localized[0])
    everything = [(message.channel.topic, message.data) for message in whole.messages()]
    content = localized[0].read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: int(kept * len(content))])

    mcap = McapFile(cut)
    found = [(message.channel.topic, message.data) for message in mcap.messages()]

    assert mcap.is_cut or kept == 0.999
    assert found == everything[: len(found)]
    assert len(found) > (kept - 0.15) * len(everything)


def test_program_that_is_killed_leaves_all_but_the_last_second(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "live.mcap")
    for record in drive(100):
        recorder.append(record)

    found = list(McapFile(tmp_path / "live.mcap").messages())

    times = [message.log_time_ns for message in found]
    assert max(times) >= START + 99 * TENTH - 10**9
    assert (recorder.records, recorder.duration) == (400, pytest.approx(9.9))
    assert recorder.size == (tmp_path / "live.mcap").stat().st_size
    recorder.close()
    recorder.close()
    assert len(list(McapFile(tmp_path / "live.mcap").messages())) > len(found)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: folder / "missing" / "\0.mcap", "cannot be written"),
        (lambda folder: folder, "cannot be written"),
    ],
)
def test_place_that_cannot_be_written_is_told(tmp_path: Path, spoil: Callable[[Path], Path], message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        Recorder(spoil(tmp_path))


def test_stamp_that_ros_cannot_hold_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="within 68 years of 1970"):
        write_mcap(tmp_path / "drive.mcap", [Odometry(2**31 * 10**9, np.zeros(3))])

    assert list(tmp_path.iterdir()) == []


def test_scanners_whose_names_ros_does_not_allow_have_topics_of_their_own(tmp_path: Path) -> None:
    names = ("front left", "front-left", "2nd")
    records = [
        Scan(stamp_ns=START, ranges=np.full(3, i + 1, np.float32), angle_min=0.0, angle_increment=0.1, scanner=i)
        for i in range(3)
    ]
    write_mcap(tmp_path / "drive.mcap", records, scanners=names)

    found = messages(tmp_path / "drive.mcap")

    topics = [topic for topic in found if topic.endswith("/scan")]
    assert topics == ["/front_left_0/scan", "/front_left_1/scan", "/_2nd/scan"]
    assert [found[topic][0].ranges[0] for topic in topics] == [1.0, 2.0, 3.0]
