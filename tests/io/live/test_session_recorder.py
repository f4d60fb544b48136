"""What a live run is recorded to: the same run again, nothing overwritten, readable to the cut."""

from __future__ import annotations

import itertools
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.errors import FileFormatError, UsageError
from commission.io.bundled import bundled_folder
from commission.io.interchange import ConvertOptions, convert_file
from commission.io.live.live_run import LiveRun
from commission.io.live.session_recorder import SessionRecorder, new_recording
from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.io.recordings.recorded_start import recorded_start_of, recorded_start_text
from commission.localization.estimate import Mode
from commission.simulation.scenario import records
from commission.site.project import Project
from commission.site.recorded_start import RecordedStart
from commission.site.records import Record, Scan
from commission.studies.run import RunInput, judged_run
from commission.studies.start import StartOrigin, start_of

SECONDS = 6


@pytest.fixture(scope="module")
def warehouse() -> Project:
    return load_project(bundled_folder("maps") / "warehouse")


@pytest.fixture(scope="module")
def drive(warehouse: Project) -> list[Record]:
    whole = records(warehouse, warehouse.routes[0].name, 1)
    return list(itertools.takewhile(lambda record: record.stamp_ns < SECONDS * 10**9, whole))


def recorded(project: Project, path: Path, drive: list[Record], *, first: int = 0) -> LiveRun:
    """A live run that is recorded from a record on."""
    run, recorder = (
        LiveRun(project, pose=(5.01, 4.02, 0.002), sigmas=(0.03, 0.02, 0.01)),
        SessionRecorder(path, project.scanners),
    )
    count = 0
    for number, record in enumerate(drive):
        belief = run.belief_before(record)
        estimates = run.take(record)
        if recorder.is_begun or (number >= first and belief is not None):
            count += 1
            recorder.append(record, estimates, belief)
    recorder.append_estimates(run.end())
    status = recorder.close()
    assert (status.is_over, status.trouble, status.records) == (True, "", count + (first > 0))
    assert status.size == path.stat().st_size
    assert count > len(drive) - first - 10
    assert status.duration == pytest.approx((drive[-1].stamp_ns - drive[-count].stamp_ns) * 1e-9, abs=0.021)
    return run


def test_a_recording_opens_and_localizes_to_the_live_estimate_bit_for_bit(
    warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    live = recorded(warehouse, tmp_path / "live.mcap", drive).so_far().result
    log = load_log(tmp_path / "live.mcap")
    start = start_of(warehouse, log)
    assert start.origin is StartOrigin.RECORDED
    again = judged_run(RunInput.of(warehouse, log, start))
    assert live is not None
    for name in ("stamps_ns", "means", "covariances", "modes", "status", "reflector", "d2"):
        assert getattr(again.columns, name).tobytes() == getattr(live.columns, name).tobytes(), name
    assert again.columns.final == live.columns.final


def test_a_recording_that_began_on_the_way_starts_where_the_vehicle_was(
    warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    live = recorded(warehouse, tmp_path / "late.mcap", drive, first=len(drive) // 2).so_far().result
    log = load_log(tmp_path / "late.mcap")
    again = judged_run(RunInput.of(warehouse, log, start_of(warehouse, log)))
    assert live is not None
    behind = live.columns.means[-len(again.columns) :]
    assert len(again.columns) > 50
    # The supervisor and what was remembered begin anew; the pose does not.
    np.testing.assert_allclose(again.columns.means, behind, atol=2e-3)


@pytest.mark.parametrize("first", [0, 5])
def test_a_recording_that_begins_while_the_vehicle_looks_where_it_is_looks_again(
    first: int, warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    run, recorder = LiveRun(replace(warehouse, routes=())), SessionRecorder(tmp_path / "x.mcap", warehouse.scanners)
    for number, record in enumerate(drive):
        belief, sought = run.belief_before(record), run.is_sought
        estimates = run.take(record)
        if recorder.is_begun or (number >= first and belief is not None):
            recorder.append(record, estimates, belief, sought=sought)
    run.end()
    recorder.close()
    live = run.so_far().result
    log = load_log(tmp_path / "x.mcap")
    # The project has a route, and yet the recording says that nobody knew where it was.
    start = start_of(warehouse, log)
    assert start.origin is StartOrigin.SEARCH
    again = judged_run(RunInput.of(warehouse, log, start))
    assert live is not None
    assert again.columns.modes[0] == Mode.INITIALIZING
    assert again.columns.modes[-1] == Mode.OPERATIONAL
    if first == 0:
        for name in ("stamps_ns", "means", "covariances", "modes", "status", "reflector"):
            assert getattr(again.columns, name).tobytes() == getattr(live.columns, name).tobytes(), name
    else:
        np.testing.assert_allclose(again.columns.means[-1], live.columns.means[-1], atol=2e-3)


def test_what_the_localizer_made_of_it_stands_beside_the_raw_data(
    warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    from tests.io.recordings.test_recorder import messages

    live = recorded(warehouse, tmp_path / "live.mcap", drive).so_far().result
    found = messages(tmp_path / "live.mcap")
    scans = sum(isinstance(record, Scan) for record in drive)
    assert live is not None
    assert len(found["/commission/estimate"]) == len(found["/commission/detections"]) == len(live.columns)
    assert sum(len(found[name]) for name in found if name.endswith("/scan") or name == "/scan") == scans
    assert found["/commission/mode"][0].data in ("operational", "initializing")
    position = found["/commission/estimate"][-1].pose.pose.position
    assert (position.x, position.y) == tuple(live.columns.means[-1, :2])


def test_recorded_live_drive_goes_whole_into_another_file_and_what_tables_do_not_hold_is_told(
    warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    recorded(warehouse, tmp_path / "live.mcap", drive)
    assert convert_file(tmp_path / "live.mcap", tmp_path / "copy.mcap", ConvertOptions()) == ()
    for source in ("live.mcap", "copy.mcap"):
        notes = convert_file(tmp_path / source, tmp_path / f"tables of {source[:4]}", ConvertOptions())
        assert any("estimate, detections, mode" in note for note in notes), notes
        # What it says to type is the start of the recording.
        assert any("--initial-pose 5.0100,4.0200,0.0020,0.0300,0.0200,0.0100" in note for note in notes), notes


def test_nothing_is_overwritten_and_other_endings_are_refused(warehouse: Project, tmp_path: Path) -> None:
    (tmp_path / "there.mcap").write_bytes(b"precious")
    with pytest.raises(UsageError, match="never overwritten"):
        SessionRecorder(tmp_path / "there.mcap", warehouse.scanners)
    assert (tmp_path / "there.mcap").read_bytes() == b"precious"
    with pytest.raises(UsageError, match=r"ends in \.mcap"):
        SessionRecorder(tmp_path / "drive.csv", warehouse.scanners)
    with pytest.raises(FileFormatError):
        SessionRecorder(tmp_path / "there.mcap" / "drive.mcap", warehouse.scanners)
    for name in ("live-a.mcap", "live-a-2.mcap"):
        assert new_recording(tmp_path, "a").name == name
        new_recording(tmp_path, "a").write_bytes(b"")


def test_a_recording_that_no_record_came_for_is_taken_away(warehouse: Project, tmp_path: Path) -> None:
    recorder = SessionRecorder(tmp_path / "folder" / "live.mcap", warehouse.scanners)
    assert (tmp_path / "folder" / "live.mcap").exists()
    assert recorder.close().is_over
    assert recorder.close().is_over
    assert not (tmp_path / "folder" / "live.mcap").exists()


def test_a_full_disk_ends_the_recording_and_not_the_run(
    warehouse: Project, drive: list[Record], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from commission.io.recordings.mcap_writer import McapWriter

    def full(*_: object, **__: object) -> None:
        raise FileFormatError(tmp_path, "", "cannot be written", "room on the disk")

    run, recorder = LiveRun(warehouse), SessionRecorder(tmp_path / "live.mcap", warehouse.scanners)
    for number, record in enumerate(drive[:400]):
        if number == 200:
            monkeypatch.setattr(McapWriter, "add_message", full)
        recorder.append(record, run.take(record), None)
    status = recorder.status()
    assert status.is_over
    assert "room on the disk" in status.trouble
    assert status.records == 200
    assert len(load_log(tmp_path / "live.mcap")) == 200


KILLED = """
import sys
from pathlib import Path
from commission.io.bundled import bundled_folder
from commission.io.live.session_recorder import SessionRecorder
from commission.io.interchange import ConvertOptions, convert_file
from commission.io.project_file import load_project
from commission.simulation.scenario import records
project = load_project(bundled_folder("maps") / "warehouse")
recorder = SessionRecorder(Path(sys.argv[1]), project.scanners)
for record in records(project, project.routes[0].name, 1):
    recorder.append(record, (), None)
    if record.stamp_ns > 4_500_000_000:
        print("here", flush=True)
        sys.stdin.read()
"""


def test_a_recording_of_a_program_that_was_killed_is_read_up_to_the_second_before(
    warehouse: Project, drive: list[Record], tmp_path: Path
) -> None:
    path = tmp_path / "cut.mcap"
    command = [sys.executable, "-c", KILLED, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == b"here\n"
        program.send_signal(signal.SIGKILL)
    log = load_log(path)
    assert any("was cut" in note for note in log.notes)
    assert 3_500_000_000 <= log.last_ns <= 4_500_000_000
    sent = [record for record in drive if isinstance(record, Scan)][: len(log.scan_stamps_ns)]
    assert len(sent) > 80
    assert log.scan_stamps_ns.tolist() == [record.stamp_ns for record in sent]


def test_a_start_is_read_as_it_was_written_and_what_is_none_is_refused() -> None:
    start = RecordedStart(np.array([0.1, 1 / 3, 0.2]), np.diag([1e-3, 1 / 7, 1e-5]))
    again = recorded_start_of(Path("x.mcap"), recorded_start_text(start))
    assert again.pose.tobytes() == start.pose.tobytes()
    assert again.covariance.tobytes() == start.covariance.tobytes()
    for text in ("", "[]", "{}", '{"pose": [1, 2], "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}', '{"schema": 2}'):
        with pytest.raises(FileFormatError):
            recorded_start_of(Path("x.mcap"), text)
    for covariance in (np.zeros((3, 3)), np.diag([1.0, -1.0, 1.0]), np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1.0]])):
        with pytest.raises(ValueError, match="positive definite"):
            RecordedStart(np.zeros(3), covariance)
