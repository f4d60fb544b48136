"""Drives on the page, virtual or replayed, are recorded and open as the same run; nothing is overwritten."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from commission.app.base.drive_now import DriveNow
from commission.app.live.actions import RecordDrive
from commission.app.run.actions import ChooseSource, Play, RecordedDrive, VirtualDrive
from commission.app.run.service import RunService
from commission.errors import UsageError
from commission.io.recordings.base import load_log
from commission.io.recordings.run_recording import write_run
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of
from tests.app.sites import room
from tests.browser.serving import Served


@pytest.fixture
def served() -> Iterator[Served]:
    project = room()
    opened = Served(project, source=VirtualDrive(project.routes[0].name))
    opened.until(lambda: opened.view is not None)
    opened.runtime.post(Play(playing=False))
    yield opened
    opened.close()


def test_a_drive_on_the_page_is_recorded_with_what_the_localizer_made_of_it(served: Served, tmp_path: Path) -> None:
    parts = served.runtime.service(RunService).parts(slowly=False)
    drive = next(part for part in parts if isinstance(part, DriveNow))
    path = tmp_path / "drive.mcap"
    served.runtime.post(RecordDrive(drive, path))
    served.until(path.exists)
    log = load_log(path)
    project = room()
    again = judged_run(RunInput.of(project, log, start_of(project, log)))
    assert again.columns.means.tobytes() == drive.columns.means.tobytes()
    assert again.columns.covariances.tobytes() == drive.columns.covariances.tobytes()
    with AnyReader([path]) as reader:
        counts = {each.topic: each.msgcount for each in reader.connections}
    assert counts["/commission/estimate"] == counts["/commission/detections"] == len(drive.columns)
    assert counts["/commission/mode"] >= 1
    assert counts["/scan"] == len(drive.inputs.log.scans[0])
    # A replay of it is recorded as well, to the last bit of what its sensors and the localizer said.
    served.runtime.post(ChooseSource(RecordedDrive(path)))
    served.until(lambda: served.view is not None and served.view.result.inputs.log is not drive.inputs.log)
    parts = served.runtime.service(RunService).parts(slowly=False)
    replay = next(part for part in parts if isinstance(part, DriveNow))
    served.runtime.post(RecordDrive(replay, tmp_path / "replay.mcap"))
    served.until((tmp_path / "replay.mcap").exists)
    second = load_log(tmp_path / "replay.mcap")
    for name in ("odometry_stamps_ns", "displacements", "reference_stamps_ns", "reference_poses"):
        assert getattr(second, name).tobytes() == getattr(drive.inputs.log, name).tobytes(), name
    for number in (0, len(second.scans[0]) - 1):
        ours, theirs = second.scans[0].scan(number), drive.inputs.log.scans[0].scan(number)
        assert ours.ranges.tobytes() == theirs.ranges.tobytes()
    once_more = judged_run(RunInput.of(project, second, start_of(project, second)))
    assert once_more.columns.means.tobytes() == drive.columns.means.tobytes()
    assert once_more.columns.final == drive.columns.final
    before = path.read_bytes()
    with pytest.raises(UsageError, match="exists"):
        write_run(path, drive.inputs, drive.columns, project.scanners)
    with pytest.raises(UsageError, match=r"ends in \.mcap"):
        write_run(tmp_path / "drive.bag", drive.inputs, drive.columns, project.scanners)
    assert path.read_bytes() == before
    assert {each.name for each in tmp_path.iterdir()} == {"drive.mcap", "replay.mcap"}
