"""Whatever of the page reads or writes a path that a browser has named stays within the shared folders."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from commission.app.base.actions import PROGRAM, Envelope, Report, Sender
from commission.app.base.effects import Effect
from commission.app.base.reach import Reach
from commission.app.base.service import Service
from commission.app.base.state import AppState
from commission.app.exchange.effects import ReadFile
from commission.app.exchange.pending import ServerFile
from commission.app.exchange.work import ExchangeService
from commission.app.floor_map.actions import MapFailed
from commission.app.floor_map.draft import MapFile
from commission.app.floor_map.effects import ReadMapFile
from commission.app.floor_map.work import MapService
from commission.app.project.effects import WriteProject
from commission.app.project.project_folder import ProjectFolder
from commission.app.run.actions import RecordedDrive
from commission.app.run.effects import LoadSource
from commission.app.run.service import RunService
from commission.errors import UsageError
from commission.io.imports import WHOLE
from commission.site.project import Project
from tests.app.owning import Owner

GUEST = Sender(3)
SECRET = "root:x:0:0"

Ask = Callable[[Path, Project], Effect]
WAYS: dict[str, tuple[type[Service], Ask]] = {
    "import": (ExchangeService, lambda path, project: ReadFile(1, ServerFile(path), WHOLE, project)),
    "floor map": (MapService, lambda path, _project: ReadMapFile(MapFile(path))),
    "recording": (RunService, lambda path, _project: LoadSource(RecordedDrive(path))),
    "copy": (ProjectFolder, lambda path, project: WriteProject(project, path)),
}


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """A shared folder beside secrets, with a link to them."""
    (tmp_path / "hall").mkdir()
    (tmp_path / "secret").mkdir()
    for name in ("passwd.csv", "map.yaml", "odometry.csv"):
        (tmp_path / "secret" / name).write_text(SECRET)
    (tmp_path / "hall" / "link").symlink_to(tmp_path / "secret")
    return tmp_path / "hall"


@pytest.fixture
def owner(hall: Path, project: Project, request: pytest.FixtureRequest) -> Iterator[Owner[Any]]:
    state = AppState(project=project, saved=project, reach=Reach.within([hall]))
    made = Owner(WAYS[request.param][0], state)
    yield made
    made.close()


@pytest.mark.parametrize(("owner", "way"), [(way, way) for way in WAYS], indirect=["owner"])
@pytest.mark.parametrize("where", ["../secret", "link", "link/passwd.csv", "../secret/map.yaml", "../secret/new"])
def test_a_path_out_of_reach_is_refused_before_anything_is_read_or_written(
    owner: Owner[Any], way: str, where: str, hall: Path, project: Project
) -> None:
    before = sorted(hall.parent.rglob("*"))
    state = AppState(project=project, saved=project, reach=Reach.within([hall]))
    with pytest.raises(UsageError, match="out of reach") as refused:
        owner.service.carry_out(WAYS[way][1](hall / where, project), state, GUEST)
    assert SECRET not in str(refused.value)
    assert owner.jobs.unfinished() == ()
    assert sorted(hall.parent.rglob("*")) == before


@pytest.mark.parametrize("owner", ["floor map"], indirect=True)
def test_the_image_of_a_map_may_not_be_a_link_out_of_reach(owner: Owner[Any], hall: Path, project: Project) -> None:
    (hall / "map.yaml").write_text(
        "image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    (hall / "map.png").symlink_to(hall.parent / "secret" / "passwd.csv")
    state = AppState(project=project, saved=project, reach=Reach.within([hall]))
    owner.service.carry_out(ReadMapFile(MapFile(hall / "map.yaml")), state, GUEST)
    owner.settle(state)
    (answer,) = owner.posted
    assert isinstance(answer, Envelope)
    assert isinstance(answer.action, MapFailed)
    assert answer.sender == GUEST
    assert "out of reach" in answer.action.text
    assert SECRET not in answer.action.text


@pytest.mark.parametrize("owner", ["recording"], indirect=True)
@pytest.mark.parametrize("sender", [GUEST, PROGRAM])
def test_why_a_recording_cannot_be_read_is_told_to_who_asked(
    owner: Owner[Any], sender: Sender, hall: Path, project: Project
) -> None:
    (hall / "drive").mkdir()
    (hall / "drive" / "odometry.csv").write_text(SECRET)
    state = AppState(project=project, saved=project, reach=Reach.within([hall]))
    owner.service.carry_out(LoadSource(RecordedDrive(hall / "drive")), state, sender)
    owner.settle(state)
    reports = [each for each in owner.posted if isinstance(each, Envelope) and isinstance(each.action, Report)]
    assert [each.sender for each in reports] == [sender]
    assert isinstance(reports[0].action, Report)
    assert SECRET not in reports[0].action.listed
