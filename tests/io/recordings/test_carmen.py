from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.carmen import CarmenLog
from commission.site.records import Odometry

HOST = "robot1"


def flaser(ranges: list[float], odometry: tuple[float, float, float], sent: float, written: float) -> str:
    numbers = " ".join(f"{each:.2f}" for each in ranges)
    x, y, theta = odometry
    return f"FLASER {len(ranges)} {numbers} 9.0 9.0 9.0 {x} {y} {theta} {sent} {HOST} {written}"


def odometry(x: float, sent: float, written: float) -> str:
    return f"ODOM {x} 0.0 0.0 0.5 0.0 0.0 {sent} {HOST} {written}"


def robot_laser(ranges: list[float], remissions: list[float] | None, x: float, sent: float) -> str:
    numbers = " ".join(map(str, ranges))
    strengths = "" if remissions is None else " ".join(map(str, [len(remissions), *remissions]))
    begin = f"ROBOTLASER1 0 -1.570796 3.141593 1.570796 30.0 0.01 0 {len(ranges)} {numbers} {strengths}"
    return f"{begin} 8.0 8.0 8.0 {x} 0.5 0.25 0.0 0.0 0.6 0.4 10.0 {sent} {HOST} {sent}"


def log_of(folder: Path, *lines: str, name: str = "drive.log") -> Path:
    path = folder / name
    path.write_text("\n".join(["# CARMEN Logfile", "PARAM robot_width 0.5 nohost 0", *lines, ""]), encoding="utf-8")
    return path


def test_flaser_is_a_scan_and_the_pose_of_its_odometry(tmp_path: Path) -> None:
    lines = [flaser([1.0, 2.0, 81.91, 3.0], (0.1 * i, 0.0, 0.0), 100.0 + 0.2 * i, 0.2 * i) for i in range(4)]
    log = load_log(log_of(tmp_path, *lines))

    assert log.odometry_stamps_ns.tolist() == [100_000_000_000 + 200_000_000 * step for step in range(4)]
    np.testing.assert_allclose(log.displacements, [[0.0, 0.0, 0.0], *[[0.1, 0.0, 0.0]] * 3], atol=1e-12)
    scan = log.scans[0].scan(1)
    assert scan.ranges.tolist()[:2] == [1.0, 2.0]
    assert math.isnan(scan.ranges[2])
    # Four beams of a half turn, the last of which would be the fifth.
    assert (scan.angle_min, scan.angle_increment) == pytest.approx((-math.pi / 2, math.pi / 4))
    assert scan.intensities is None


@pytest.mark.parametrize(("beams", "step_deg"), [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5)])
def test_beams_of_old_scanners_stand_whole_or_half_degrees_apart(tmp_path: Path, beams: int, step_deg: float) -> None:
    log = load_log(log_of(tmp_path, *(flaser([2.0] * beams, (0.0, 0.0, 0.0), i + 1.0, i + 1.0) for i in range(2))))

    assert math.degrees(log.scans[0].scan(0).angle_increment) == pytest.approx(step_deg)


def test_odom_comes_before_the_poses_of_scans(tmp_path: Path) -> None:
    lines = [odometry(0.2 * i, 5.0 + i, 5.0 + i) for i in range(3)]
    log = load_log(log_of(tmp_path, *lines, flaser([1.0, 1.0], (7.0, 7.0, 7.0), 6.5, 6.5)))

    assert log.odometry_stamps_ns.tolist() == [5 * 10**9, 6 * 10**9, 7 * 10**9]
    np.testing.assert_allclose(log.displacements[1:, 0], [0.2, 0.2])


@pytest.mark.parametrize("remissions", [None, [], [10.0, 250.0, 30.0]])
def test_robotlaser_of_older_and_newer_logs_is_read(tmp_path: Path, remissions: list[float] | None) -> None:
    lines = [robot_laser([1.5, 30.0, 2.5], remissions, 0.1 * i, 3.0 + i) for i in range(3)]
    log = load_log(log_of(tmp_path, *lines))

    scan = log.scans[0].scan(2)
    assert (scan.angle_min, scan.angle_increment) == (-1.570796, 1.570796)
    assert np.isnan(scan.ranges).tolist() == [False, True, False]
    assert (None if scan.intensities is None else scan.intensities.tolist()) == (remissions or None)
    np.testing.assert_allclose(np.hypot(*log.displacements[1:, :2].T), [0.1, 0.1])


def test_constant_stamps_of_sending_are_replaced_by_those_of_writing_and_told(tmp_path: Path) -> None:
    log = load_log(log_of(tmp_path, *(odometry(0.1 * i, 976052857.0, 40.0 + 0.1 * i) for i in range(5))))

    np.testing.assert_allclose(np.diff(log.odometry_stamps_ns), 1e8)
    assert "stamps are those of when it was written" in log.notes


def test_log_whose_stamps_are_all_constant_is_refused(tmp_path: Path) -> None:
    path = log_of(tmp_path, *(odometry(0.1 * i, 5.0, 7.0) for i in range(5)))

    with pytest.raises(FileFormatError, match="has one stamp in all its lines; expected times at the end of each line"):
        open_recording(path)


@pytest.mark.parametrize("period", [10_000.0, 2.0**32 * 1e-6, 2.0**32 * 1e-3])
def test_stamps_that_start_again_are_continued_and_told(tmp_path: Path, period: float) -> None:
    times = [(period - 0.45 + 0.1 * i) % period for i in range(10)]
    log = load_log(log_of(tmp_path, *(odometry(0.1 * i, time, time) for i, time in enumerate(times))))

    np.testing.assert_allclose(np.diff(log.odometry_stamps_ns) * 1e-9, 0.1, atol=1e-6)
    np.testing.assert_allclose(log.displacements[1:, 0], 0.1)
    assert "1 times the stamps start again; they are continued" in log.notes


def test_log_is_known_by_its_content_and_other_text_is_none(tmp_path: Path) -> None:
    lines = [odometry(0.1 * i, 5.0 + i, 5.0 + i) for i in range(3)]
    assert isinstance(open_recording(log_of(tmp_path, *lines, name="drive.clf")), CarmenLog)
    (tmp_path / "odd.log").write_text("ODOM and other words\nINFO all is well\n", encoding="utf-8")
    assert not CarmenLog.recognizes(tmp_path / "odd.log")


def test_message_that_ends_early_is_told_with_its_line(tmp_path: Path) -> None:
    good = odometry(0.0, 5.0, 5.0)
    path = log_of(tmp_path, good, f"FLASER 180 1.0 2.0 6.0 {HOST} 6.0", odometry(1.0, 7.0, 7.0))

    with pytest.raises(FileFormatError, match="line 4: is no FLASER"):
        load_log(path)


def test_message_that_ends_before_its_stamp_is_told_with_its_line(tmp_path: Path) -> None:
    path = log_of(tmp_path, odometry(0.0, 5.0, 5.0), "FLASER 180 1.0 2.0", odometry(1.0, 7.0, 7.0))

    with pytest.raises(FileFormatError, match="line 4: has no stamp; expected times at the end of each line"):
        load_log(path)


WORDS = st.sampled_from(
    [
        "FLASER",
        "ODOM",
        "ROBOTLASER1",
        "RAWLASER1",
        "TRUEPOS",
        "180",
        "2",
        "-1",
        "1e400",
        "nan",
        "0.5",
        "x",
        "99999999999",
    ]
)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.lists(WORDS, max_size=14).map(" ".join), max_size=6), st.integers(0, 2000))
def test_any_log_is_an_error_in_one_line_or_valid_records(
    tmp_path_factory: pytest.TempPathFactory, lines: list[str], kept: int
) -> None:
    sound = [odometry(0.1 * i, 5.0 + i, 5.0 + i) for i in range(3)]
    path = log_of(tmp_path_factory.mktemp("log"), sound[0], *lines, *sound[1:])
    path.write_bytes(path.read_bytes()[: 100 + kept])

    try:
        log = load_log(path)
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        assert all(np.isfinite(record.displacement).all() for record in log.records() if isinstance(record, Odometry))
