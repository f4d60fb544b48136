from __future__ import annotations

import math
from pathlib import Path

import apsw
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.io.recordings.base import load_log, open_recording
from commission.io.recordings.channels import ChannelOptions
from commission.io.recordings.motion import Wheels
from commission.io.recordings.writers import write_records
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, ReferencePose, Scan
from tests.io.recordings import ros_bags as bags
from tests.io.recordings.ros_bags import KINDS, START
from tests.io.recordings.test_mcap_recording import assert_same

TENTH = 100_000_000
"""A tenth of a second [ns]."""
ECHO = [1.0, 2.0, math.inf, 0.05, 31.0]
"""Ranges of which the first two are measurements within 0.1 to 30 m."""


def drive() -> list[bags.Message]:
    """Straight ahead by 0.1 m a step from (1, 2) towards 90 degrees, seen by one scanner and a second system."""
    found: list[bags.Message] = []
    for step in range(4):
        stamp = START + step * TENTH
        pose = (1.0, 2.0 + 0.1 * step, math.pi / 2)
        found.append(bags.odometry(stamp, pose))
        found.append(bags.scan(stamp, ECHO, intensities=[100.0, 4000.0, 0.0, 7.0, 8.0]))
        found.append(bags.pose_stamped(stamp, (5.0, 0.1 * step, 0.5)))
    return found


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def written(folder: Path, kind: str, messages: list[bags.Message]) -> Path:
    return bags.write_bag(folder / f"bag_{kind[1:]}{kind}", messages)


def read(folder: Path, messages: list[bags.Message], *channels: str, kind: str = ".mcap") -> RecordLog:
    return load_log(written(folder, kind, messages), ChannelOptions(channels=channels))


def test_drive_in_a_bag_becomes_its_records(tmp_path: Path, kind: str) -> None:
    log = load_log(written(tmp_path, kind, drive()))

    assert log.odometry_stamps_ns.tolist() == [START + step * TENTH for step in range(4)]
    np.testing.assert_allclose(log.displacements, [[0.0, 0.0, 0.0], *3 * [[0.1, 0.0, 0.0]]], atol=1e-12)
    np.testing.assert_allclose(log.reference_poses, [[5.0, 0.1 * step, 0.5] for step in range(4)], atol=1e-12)
    scan = log.scans[0].scan(3)
    assert scan.stamp_ns == START + 3 * TENTH
    assert (scan.angle_min, scan.angle_increment) == (-0.5, 0.25)
    np.testing.assert_array_equal(scan.ranges, np.array([1.0, 2.0, np.nan, np.nan, np.nan], dtype=np.float32))
    assert scan.intensities is not None
    assert scan.intensities.tolist() == [100.0, 4000.0, 0.0, 7.0, 8.0]
    assert log.notes == (
        "scans are those of /scan",
        "the odometry is /odom (nav_msgs/msg/Odometry)",
        "the reference is /truth (geometry_msgs/msg/PoseStamped)",
    )


def test_records_of_a_bag_come_in_order_of_their_stamps(tmp_path: Path, kind: str) -> None:
    records = list(open_recording(written(tmp_path, kind, drive())).records())

    assert [type(record) for record in records[:3]] == [Odometry, ReferencePose, Scan]
    assert [record.stamp_ns for record in records] == sorted(record.stamp_ns for record in records)


def test_bag_is_known_by_its_content_and_not_by_its_name(tmp_path: Path) -> None:
    folder = written(tmp_path, ".mcap", drive())
    renamed = next(folder.glob("*.mcap")).rename(tmp_path / "recording of tuesday")

    assert len(load_log(renamed).odometry_stamps_ns) == 4


def test_sqlite_file_without_its_folder_is_read_by_the_types_of_a_distribution(tmp_path: Path) -> None:
    folder = written(tmp_path, ".db3", drive())
    alone = next(folder.glob("*.db3")).rename(tmp_path / "alone.db3")

    assert len(load_log(alone).odometry_stamps_ns) == 4


def test_disorder_is_sorted_and_counted(tmp_path: Path, kind: str) -> None:
    messages = drive()
    messages[3:6], messages[6:9] = messages[6:9], messages[3:6]

    log = load_log(written(tmp_path, kind, messages))

    np.testing.assert_allclose(log.displacements[1:], 3 * [[0.1, 0.0, 0.0]], atol=1e-12)
    assert np.all(np.diff(log.scans[0].stamps_ns) == TENTH)


def test_what_came_late_by_its_own_stamp_is_told(tmp_path: Path) -> None:
    order = [0, 2, 1, 3]
    messages = [
        (topic, kind, START + place * TENTH, make)
        for place, step in enumerate(order)
        for topic, kind, _, make in drive()[3 * step : 3 * step + 3]
    ]

    log = read(tmp_path, messages)

    np.testing.assert_allclose(log.displacements[1:], 3 * [[0.1, 0.0, 0.0]], atol=1e-12)
    assert log.scans[0].stamps_ns.tolist() == [START + step * TENTH for step in range(4)]
    assert "1 rows of odometry came after a later one and are sorted" in log.notes
    assert "1 scans came after a later one and are sorted" in log.notes
    assert "1 reference poses came after a later one and are sorted" in log.notes


def test_equal_stamps_are_counted_and_no_motion_is_lost(tmp_path: Path, kind: str) -> None:
    messages = drive()
    messages.append(bags.odometry(START + 3 * TENTH, (1.0, 2.4, math.pi / 2)))
    messages.append(bags.scan(START + 3 * TENTH, ECHO, intensities=[1.0] * 5))

    log = load_log(written(tmp_path, kind, messages))

    np.testing.assert_allclose(log.displacements[:, 0].sum(), 0.4, atol=1e-12)
    assert len(log.scans[0]) == 4
    assert "1 rows of odometry have a stamp that is taken and are left out but for the last of each" in log.notes
    assert "1 scans have a stamp that is taken and are left out" in log.notes


def test_velocities_are_driven_along_arcs(tmp_path: Path) -> None:
    quarter = (math.pi / 2, 0.0, math.pi / 2)
    messages = [bags.twist_stamped(START + step * 10 * TENTH, quarter) for step in range(3)]

    log = read(tmp_path, messages)

    # A quarter of a circle of radius 1 m in each second.
    np.testing.assert_allclose(log.displacements, [[0.0, 0.0, 0.0], *2 * [[1.0, 1.0, math.pi / 2]]], atol=1e-12)


def test_odometry_that_has_velocities_only_is_driven_by_them(tmp_path: Path) -> None:
    messages = [bags.odometry(START + step * 10 * TENTH, (0.0, 0.0, 0.0), (0.5, 0.0, 0.0)) for step in range(3)]

    np.testing.assert_allclose(read(tmp_path, messages).displacements[:, 0], [0.0, 0.5, 0.5], atol=1e-12)


@pytest.mark.parametrize(
    ("positions", "speeds", "ticks"),
    [
        ([[0.0, 0.0], [1.0, 3.0], [2.0, 6.0]], [], None),
        ([], [[1.0, 3.0], [1.0, 3.0], [1.0, 3.0]], None),
        ([[65000.0, 64000.0], [464.0, 1464.0], [1464.0, 4464.0]], [], 1000.0 * 2.0 * math.pi),
    ],
    ids=["angles", "speeds", "ticks of a counter of 16 bit"],
)
def test_turning_wheels_become_motion(
    tmp_path: Path, positions: list[list[float]], speeds: list[list[float]], ticks: float | None
) -> None:
    messages = [
        bags.joint_state(
            START + step * 10 * TENTH,
            ["right", "mast", "left"],
            [positions[step][1], 0.0, positions[step][0]] if positions else [],
            [speeds[step][1], 0.0, speeds[step][0]] if speeds else [],
        )
        for step in range(3)
    ]
    wheels = Wheels(left="left", right="right", radius=0.1, separation=0.4, ticks=ticks)

    log = load_log(written(tmp_path, ".mcap", messages), ChannelOptions(wheels=wheels))

    # 0.1 m on the left and 0.3 m on the right: a circle of 0.4 m by half a radian.
    arc = [0.4 * math.sin(0.5), 0.4 * (1.0 - math.cos(0.5)), 0.5]
    np.testing.assert_allclose(log.displacements, [[0.0, 0.0, 0.0], arc, arc], atol=1e-12)


def test_wheels_of_unknown_size_are_asked_for(tmp_path: Path) -> None:
    bag = written(tmp_path, ".mcap", [bags.joint_state(START, ["left", "right"], [0.0, 0.0], [])])

    with pytest.raises(FileFormatError, match="is the only odometry, of turning wheels; expected --wheels LEFT"):
        load_log(bag)


def test_strongest_echo_of_a_beam_counts(tmp_path: Path, kind: str) -> None:
    log = load_log(
        written(tmp_path, kind, [bags.multi_echo(START, [[4.0, 5.0], [], [6.0]], [[10.0, 900.0], [], [3.0]])])
    )

    scan = log.scans[0].scan(0)
    np.testing.assert_array_equal(scan.ranges, np.array([5.0, np.nan, 6.0], dtype=np.float32))
    assert scan.intensities is not None
    assert scan.intensities.tolist() == [900.0, 0.0, 3.0]


def test_scans_without_intensities_are_read_and_that_is_told(tmp_path: Path, kind: str) -> None:
    log = load_log(written(tmp_path, kind, [bags.scan(START + step * TENTH, ECHO) for step in range(3)]))

    assert log.scans[0].scan(0).intensities is None
    assert "3 scans of /scan have no intensities: no reflector can be seen in them" in log.notes
    assert "it holds no odometry: how the vehicle moved is not known" in log.notes


def test_folders_of_topics_are_scanners(tmp_path: Path, kind: str) -> None:
    log = load_log(
        written(tmp_path, kind, [bags.scan(START, ECHO, "/rear/scan"), bags.scan(START, ECHO[:2], "/front/scan")])
    )

    assert log.scanners == ("front", "rear")
    assert [store.beams.tolist() for store in log.scans] == [[2], [5]]


def test_several_candidates_are_listed_with_the_option_that_chooses(tmp_path: Path) -> None:
    bag = written(tmp_path, ".mcap", [*drive(), bags.scan(START, ECHO, "/scan_filtered")])

    listed = (
        r"2 topics of scan: /scan \(sensor_msgs/msg/LaserScan, 4 messages\), "
        r"/scan_filtered \(sensor_msgs/msg/LaserScan, 1 messages\); expected --channel scan=TOPIC"
    )
    with pytest.raises(UsageError, match=listed):
        open_recording(bag)
    log = load_log(bag, ChannelOptions(channels=("scan=/scan_filtered",)))
    assert len(log.scans[0]) == 1


def test_scanners_are_named_by_the_option(tmp_path: Path) -> None:
    messages = [bags.scan(START, ECHO, "/a"), bags.scan(START, ECHO[:3], "/b")]

    log = read(tmp_path, messages, "scan.left=/b", "scan.right=/a")

    assert log.scanners == ("left", "right")
    assert log.scans[0].beams.tolist() == [3]


def test_odometry_can_be_the_reference_of_a_second_system(tmp_path: Path) -> None:
    messages = [*drive(), *(bags.odometry(START, (7.0, 8.0, 0.0), topic="/second") for _ in range(1))]

    log = read(tmp_path, messages, "odometry=/odom", "reference=/second")

    assert log.reference_poses.tolist() == [[7.0, 8.0, 0.0]]


def test_commands_and_goals_are_not_taken_for_what_was_measured(tmp_path: Path) -> None:
    messages = [*drive(), bags.pose_stamped(START, (9.0, 9.0, 0.0), "/move_base/goal")]

    assert len(read(tmp_path, messages).reference_poses) == 4


def test_pose_with_covariance_is_a_reference(tmp_path: Path, kind: str) -> None:
    log = load_log(written(tmp_path, kind, [bags.pose_with_covariance(START, (1.0, 2.0, -0.5))]))

    np.testing.assert_allclose(log.reference_poses, [[1.0, 2.0, -0.5]], atol=1e-12)


def test_topic_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no topic '/odo' of odometry; expected --channel odometry=one of: /odom"):
        read(tmp_path, drive(), "odometry=/odo")


def test_bag_without_anything_to_read_says_what_it_has(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"has no topic that is read \(it has /tf_static"):
        read(tmp_path, [bags.transform(START, "a", "b", (0.0, 0.0, 0.0))])


def test_mounting_is_told_through_all_frames_between(tmp_path: Path, kind: str) -> None:
    messages = [
        bags.transform(START, "base_link", "mast", (1.0, 0.5, math.pi / 2)),
        bags.transform(START, "mast", "laser", (0.25, 0.0, 0.0), upside_down=True),
        *drive(),
    ]

    log = load_log(written(tmp_path, kind, messages))

    told = "scanner 'scanner' is mounted at [1, 0.75, 1.571], upside down (x [m], y [m], heading [rad] in base_link)"
    assert told in log.notes


def test_mounting_is_that_in_the_frame_that_the_odometry_moves(tmp_path: Path) -> None:
    # The odometry moves `base_link`, here above `base_footprint`.
    messages = [
        bags.transform(START, "base_link", "base_footprint", (0.5, 0.0, 0.0)),
        bags.transform(START, "base_footprint", "laser", (0.25, 0.0, 0.0)),
    ]
    (found,) = read(tmp_path, [*messages, *drive()]).mountings
    assert (found.base, found.x) == ("base_link", 0.75)


def test_time_of_recording_stands_where_a_message_has_none(tmp_path: Path) -> None:
    topic, kind, _, make = bags.scan(0, ECHO)

    log = read(tmp_path, [(topic, kind, START + 5, make)])

    assert log.scans[0].stamps_ns.tolist() == [START + 5]
    assert "1 messages of /scan have no stamp; the time of recording stands for it" in log.notes


@pytest.mark.parametrize("kept", [0.4, 0.7, 0.95])
def test_mcap_is_read_to_where_it_was_cut(tmp_path: Path, kept: float) -> None:
    messages = [bags.scan(START + step * TENTH, 2000 * [1.5], intensities=2000 * [1.0]) for step in range(300)]
    file = next(written(tmp_path, ".mcap", messages).glob("*.mcap"))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(file.read_bytes()[: int(kept * file.stat().st_size)])

    log = load_log(cut)

    assert 0.3 * kept < len(log.scans[0]) / 300 <= kept
    assert "cut.mcap was cut while it was recorded; it is read up to there" in log.notes


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("bags")
    found: dict[str, Path] = {}
    for kind in KINDS:
        path = written(folder, kind, drive())
        found[kind] = path if path.is_file() else next(path.glob(f"*{kind}"))
    return found


@settings(max_examples=60, deadline=None)
@given(
    changes=st.lists(st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4),
    kept=st.sampled_from([1.0, 1.0, 0.9, 0.5, 0.2, 0.01]),
)
@pytest.mark.parametrize("damaged", [".mcap", ".bag", ".db3"])
def test_damaged_bag_is_an_error_in_one_line_or_valid_records(
    tmp_path_factory: pytest.TempPathFactory,
    whole: dict[str, Path],
    damaged: str,
    changes: list[tuple[float, int]],
    kept: float,
) -> None:
    content = bytearray(whole[damaged].read_bytes())
    for place, value in changes:
        content[int(place * len(content))] = value
    file = tmp_path_factory.mktemp("damaged") / f"file{damaged}"
    file.write_bytes(content[: int(kept * len(content))])

    try:
        log = load_log(file)
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        assert all(np.isfinite(record.displacement).all() for record in log.records() if isinstance(record, Odometry))


def test_real_bag_of_ros_1_is_read(shared_data: Path) -> None:
    log = load_log(shared_data / "sick_captures" / "rms_1xxx_lms_1xx_movement_off.bag")

    assert len(log.scans[0]) == 89
    assert set(log.scans[0].beams.tolist()) == {541}
    assert np.median(np.diff(log.scans[0].stamps_ns)) * 1e-9 == pytest.approx(0.02, abs=1e-3)


def test_intensities_that_are_all_nan_are_none(tmp_path: Path) -> None:
    messages = [bags.scan(START, ECHO, intensities=[math.nan] * 5), bags.odometry(START, (0.0, 0.0, 0.0))]

    log = read(tmp_path, messages)

    assert log.scans[0].scan(0).intensities is None
    assert "1 scans of /scan have no intensities: no reflector can be seen in them" in log.notes


@pytest.mark.parametrize("kind", [".mcap", ".db3"])
@pytest.mark.parametrize("name", ["MESSAGE", "FILE"])
def test_packed_bag_of_ros_2_is_read_as_if_it_were_not(tmp_path: Path, kind: str, name: str) -> None:
    path = bags.write_bag(tmp_path / f"bag_{kind[1:]}{kind}", drive(), packed=name)
    assert len(load_log(path).scans[0]) == 4
    alone = next(file for file in path.iterdir() if file.suffix != ".yaml")
    whole = list(load_log(path).records())
    assert_same(load_log(alone).records(), whole)
    (path / "metadata.yaml").unlink()
    assert_same(load_log(path).records(), whole)


def test_files_of_a_recorder_that_was_stopped_before_it_wrote_metadata_are_read_in_turn(tmp_path: Path) -> None:
    folder = tmp_path / "stopped"
    folder.mkdir()
    for part, messages in enumerate((drive()[:6], drive()[6:])):
        file = next(written(tmp_path / str(part), ".db3", messages).glob("*.db3"))
        file.rename(folder / f"drive_{part}.db3")
    assert len(load_log(folder).scans[0]) == 4


def test_farthest_range_itself_is_no_return_and_a_scan_that_is_all_beyond_it_is_told(tmp_path: Path) -> None:
    log = read(tmp_path / "a", [bags.scan(START, [30.0, 2.0, 29.9])])
    np.testing.assert_array_equal(log.scans[0].scan(0).ranges, np.array([np.nan, 2.0, 29.9], np.float32))
    log = read(tmp_path / "b", [bags.scan(START, [3000.0, 2000.0, math.inf])])
    assert any("range_max 30 m, typical range 2500): nothing is left of them" in note for note in log.notes)


def test_a_frame_whose_plane_does_not_lie_level_is_told(tmp_path: Path) -> None:
    leaning = bags.transform(START, "base_link", "laser", (1.0, 0.5, 0.0), pitch=math.pi / 2)
    assert any("its plane leaning by 90 deg" in note for note in read(tmp_path, [leaning, *drive()]).notes)


def test_topic_of_sqlite_without_a_name_is_told(tmp_path: Path) -> None:
    file = next(written(tmp_path, ".db3", drive()).glob("*.db3"))
    connection = apsw.Connection(str(file))
    connection.execute("ALTER TABLE topics RENAME COLUMN name TO old")
    connection.execute("ALTER TABLE topics ADD COLUMN name")
    connection.close()

    with pytest.raises(FileFormatError, match="a topic is named None"):
        load_log(file)


@pytest.mark.parametrize("make", ["others", "own"])
@pytest.mark.parametrize("column", ["timestamp", "data"])
def test_cell_of_sqlite_that_holds_nothing_is_told(tmp_path: Path, make: str, column: str) -> None:
    if make == "own":
        write_records(tmp_path / "drive.db3", [Odometry(START, np.zeros(3))])
        file = tmp_path / "drive.db3"
    else:
        file = next(written(tmp_path, ".db3", drive()).glob("*.db3"))
    connection = apsw.Connection(str(file))
    connection.execute(f"ALTER TABLE messages RENAME COLUMN {column} TO old")
    connection.execute(f"ALTER TABLE messages ADD COLUMN {column}")
    connection.close()

    with pytest.raises(FileFormatError, match="has no time or no content"):
        load_log(file)


@pytest.mark.parametrize("kind", [".bag", ".db3"])
def test_bag_of_another_name_is_known_by_its_content(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, kind, drive())
    file = path if path.is_file() else next(path.glob("*.db3"))
    other = file.rename(tmp_path / ("drive.db3" if kind == ".bag" else "drive of tuesday"))

    assert len(load_log(other).scans[0]) == 4
    with pytest.raises(FileFormatError, match=r"folder with bags of ROS 1, a\.bag, b\.bag; expected one of them"):
        (tmp_path / "two").mkdir()
        (tmp_path / "two" / "a.bag").write_bytes(other.read_bytes())
        (tmp_path / "two" / "b.bag").write_bytes(other.read_bytes())
        load_log(tmp_path / "two")


@pytest.mark.parametrize(("back_s", "is_told"), [(4.0, False), (6.0, True), (3600.0, True)])
def test_clock_that_was_set_back_while_a_bag_was_recorded_is_told(tmp_path: Path, back_s: float, is_told: bool) -> None:
    stamps = [START + step * TENTH - (round(back_s * 1e9) if step >= 30 else 0) for step in range(60)]
    messages: list[bags.Message] = []
    for step, stamp in enumerate(stamps):
        for topic, kind, _, make in (bags.odometry(stamp, (0.1 * step, 0.0, 0.0)), bags.scan(stamp, ECHO)):
            messages.append((topic, kind, START + step * TENTH, make))

    told = [note for note in read(tmp_path, messages).notes if "go back by" in note]

    # From the stamp before to the next one a tenth of a second would have passed.
    way = f"go back by {back_s - 0.1:.1f} s: a clock was set, or began anew"
    assert [note.partition(" go back")[0] for note in told] == (
        ["stamps of the odometry", "stamps of the scans of scanner"] if is_told else []
    )
    assert all(way in note for note in told)
