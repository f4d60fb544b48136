"""What the localizer said while a drive was recorded goes along into each format that has a place for it."""

from __future__ import annotations

import tracemalloc
from collections import defaultdict
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from commission.errors import CommissionError
from commission.io.bundled import bundled_folder
from commission.io.interchange import ConvertOptions, convert_file
from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.io.recordings.mcap_recording import McapRecording
from commission.io.recordings.recorder import BESIDE, Recorder
from commission.localization.localizer import Localizer
from commission.simulation.scenario import virtual_drive
from commission.site.recorded_start import RecordedStart
from commission.studies.run import RunInput
from commission.studies.start import start_of
from tests.io.recordings.test_mcap_recording import assert_same

ENDINGS = (".mcap", ".db3", ".bag")
COUNT = 150_000
"""Messages of a long recording, of 400 bytes each."""
COVARIANCE = np.diag([0.01, 0.02, 0.03]) + 0.001


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first seconds of a virtual drive with two scanners, recorded beside what the localizer says about it."""
    project = load_project(bundled_folder("maps") / "loading_bay")
    drive = virtual_drive(project, project.routes[0].name, 1)
    inputs = RunInput.of(project, drive, start_of(project, drive))
    localizer = Localizer(inputs.segments[0].setup, inputs.start.belief)
    path = tmp_path_factory.mktemp("recorded") / "live.mcap"
    start = RecordedStart(inputs.start.belief.mean, COVARIANCE)
    with Recorder(
        path, drive.scanners, truth=drive.truth, mounted=project.scanners, start=start, chunk_s=0.2
    ) as recorder:
        for record in islice(drive.records(), 300):
            recorder.append(record)
            for estimate in localizer.feed(record):
                recorder.append_estimate(estimate)
    return path


def beside(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Times and bytes of what stands beside the records, as `rosbags` reads them; of ROS 1 the bytes that ROS 2 has."""
    found: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, time, data in reader.messages():
            if connection.topic in BESIDE:
                message = reader.deserialize(data, connection.msgtype)
                found[connection.topic].append((time, _plain(message)))
    return dict(found)


def _plain(message: Any) -> Any:
    """The fields of a message in order; the number that ROS 1 gives to each header is none of ROS 2."""
    if hasattr(message, "__dataclass_fields__"):
        names = [name for name in message.__dataclass_fields__ if name not in ("seq", "__msgtype__")]
        return [(name, _plain(getattr(message, name))) for name in names]
    if isinstance(message, list):
        return [_plain(each) for each in message]
    return message.tobytes() if isinstance(message, np.ndarray) else message


@pytest.mark.parametrize("ending", ENDINGS)
def test_all_that_was_recorded_beside_the_records_is_equal_in_what_they_are_converted_to(
    live: Path, tmp_path: Path, ending: str
) -> None:
    notes = convert_file(live, tmp_path / f"copy{ending}", ConvertOptions())

    expected, found = beside(live), beside(tmp_path / f"copy{ending}")
    assert expected.keys() == BESIDE.keys()
    assert len(expected["/commission/estimate"]) > 40
    assert found == expected
    before, after = load_log(live), load_log(tmp_path / f"copy{ending}")
    assert_same(after.records(), before.records())
    assert before.start is not None
    assert after.start is not None
    assert after.start.pose.tolist() == before.start.pose.tolist()
    assert after.start.covariance.tolist() == COVARIANCE.tolist()
    assert notes == ()


def test_bytes_are_the_same_after_a_way_through_every_format(live: Path, tmp_path: Path) -> None:
    place = live
    for ending in (".bag", ".db3", ".mcap"):
        convert_file(place, tmp_path / f"next{ending}", ConvertOptions())
        place = tmp_path / f"next{ending}"

    def carried(path: Path) -> set[tuple[str, int, bytes]]:
        return {(each.channel.topic, each.log_time_ns, each.data) for each in McapRecording(path).beside()}

    first, last = carried(live), carried(place)

    assert len(first) == sum(map(len, beside(live).values()))
    assert first == last


def test_estimates_stand_among_the_records_of_their_time(live: Path, tmp_path: Path) -> None:
    convert_file(live, tmp_path / "copy.db3", ConvertOptions())

    with AnyReader([tmp_path / "copy.db3"]) as reader:
        order = [(connection.topic, time) for connection, time, _ in reader.messages()]
    latest = 0
    for topic, time in order:
        if topic == "/odom":
            latest = time
        elif topic == "/commission/estimate":
            assert abs(time - latest) <= 100_000_000


def test_tables_have_no_place_for_it_and_that_is_told(live: Path, tmp_path: Path) -> None:
    notes = convert_file(live, tmp_path / "tables", ConvertOptions())

    assert [any(word in note for note in notes) for word in ("(estimate, detections, mode)", "--initial-pose")] == [
        True
    ] * 2


@pytest.mark.parametrize("kept", [0.4, 0.8])
def test_of_a_file_that_is_cut_what_is_there_goes_along(live: Path, tmp_path: Path, kept: float) -> None:
    content = live.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: int(kept * len(content))])

    convert_file(tmp_path / "cut.mcap", tmp_path / "copy.mcap", ConvertOptions())

    whole, found = beside(live)["/commission/estimate"], beside(tmp_path / "copy.mcap")["/commission/estimate"]
    assert (kept - 0.3) * len(whole) < len(found) < len(whole)
    assert found == whole[: len(found)]


@pytest.mark.parametrize("seed", range(20))
def test_damaged_file_is_converted_or_refused_in_one_line(live: Path, tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    content = bytearray(live.read_bytes())
    for place in rng.integers(len(content) // 2, len(content), 3):
        content[place] = rng.integers(256)
    (tmp_path / "odd.mcap").write_bytes(content)

    for ending in (".mcap", ".bag"):
        try:
            convert_file(tmp_path / "odd.mcap", tmp_path / f"copy{ending}", ConvertOptions())
        except CommissionError as error:
            assert "\n" not in str(error)
            assert not (tmp_path / f"copy{ending}").exists()


def test_what_goes_along_is_not_kept_in_memory(live: Path, tmp_path: Path) -> None:
    one = next(each for each in McapRecording(live).beside() if each.channel.topic == "/commission/estimate")
    path = tmp_path / "long.mcap"
    with Recorder(path) as recorder:
        for _ in range(COUNT):
            recorder.append_beside(one)
    recording = McapRecording(path)

    tracemalloc.start()
    try:
        count = sum(len(each.data) == len(one.data) for each in recording.beside())
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

    assert count == COUNT
    # Three chunks of 4 MB stay unpacked while the next one is; the place of a message has 8 bytes, and all are sorted.
    assert peak < 20_000_000 + 60 * COUNT < 0.6 * COUNT * len(one.data)
