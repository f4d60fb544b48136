"""A person connects to a vehicle that drives now, sees it, and sees that it has fallen silent."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from commission.app.live.service import LiveService
from commission.app.run.service import RunService
from commission.app.run.state import RunState
from commission.io.live.virtual_vehicle import send_drive
from commission.io.recordings.base import load_log
from commission.simulation.scenario import records
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served


@pytest.fixture
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


def test_a_person_connects_sees_the_vehicle_drive_and_fall_silent(
    served: Served, window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    page = window(served.server)
    page.open()
    page.open_tab("Run")
    page.fill("Sources", "sick-safety:127.0.0.1:0, json:127.0.0.1:0")
    page.press("Connect")
    page.wait_for_text("nothing that is SICK microScan3")
    page.wait_for_text("this computer has 127.0.0.1")
    live = served.runtime.service(LiveService).parts(slowly=True)[0]
    addresses = [source.address for source in live.sources]  # type: ignore[attr-defined]
    project = room()
    drive = list(records(project, project.routes[0].name, 1))
    sender = threading.Thread(target=send_drive, args=(drive, addresses, ("scanner",)), kwargs={"speed": 2.0})
    page.fill("Record to", str(tmp_path / "drive.mcap"))
    page.press("Record")
    page.wait_for_text("● Recording 0.0 s")
    sender.start()
    page.wait_for_text("receiving")
    page.wait_for_text("OPERATIONAL")
    page.wait_for_text("Live vehicle")
    assert served.state.part(RunState).live
    sender.join()
    page.wait_for_text("drive.mcap")
    page.wait_for_text("silent for")
    page.press("Disconnect")
    page.wait_for_text("Recorded")
    # The last cycles come with the end of the connection: the view of before has fewer.
    served.until(lambda: served.runtime.service(RunService)._live is None)
    assert served.view is not None
    assert served.view.result.cycles > 50
    log = load_log(tmp_path / "drive.mcap")
    again = judged_run(RunInput.of(project, log, start_of(project, log)))
    assert again.columns.means.tobytes() == served.view.result.columns.means.tobytes()
