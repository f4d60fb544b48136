"""A virtual drive is recorded from the page, opens as the same run, and nothing is overwritten."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from commission.app.base.drive_now import DriveNow
from commission.app.live.actions import RecordDrive
from commission.app.run.actions import Play, VirtualDrive
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
    before = path.read_bytes()
    with pytest.raises(UsageError, match="exists"):
        write_run(path, drive.inputs, drive.columns, project.scanners)
    with pytest.raises(UsageError, match=r"ends in \.mcap"):
        write_run(tmp_path / "drive.bag", drive.inputs, drive.columns, project.scanners)
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["drive.mcap"]
