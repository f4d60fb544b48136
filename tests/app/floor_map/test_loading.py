"""A floor map loaded through the owner thread's own handling, with real files and jobs and without a page."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from commission.app.base import actions as page
from commission.app.base.actions import Action, Join
from commission.app.base.feature import Feature
from commission.app.base.service import Context, Service
from commission.app.base.state import AppState
from commission.app.base.uploads import Upload
from commission.app.floor_map import actions
from commission.app.floor_map.draft import MapFile, MapLoading, MapTrouble
from commission.app.project.project_folder import name_of_edit
from commission.app.runtime import Runtime
from commission.io.map_server import write_floor_map
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from tests.app.asking import FEATURES, ME, by
from tests.app.sites import room
from tests.io.large_files import write_drawing


class Noting(Service):
    """Collects what the journal calls each edit."""

    def __init__(self, edits: list[str], context: Context) -> None:
        super().__init__(context)
        self._edits = edits

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:
        self._edits.append(name_of_edit(action, before, after))


class Loading:
    """A runtime whose messages are handled here."""

    def __init__(self) -> None:
        self.edits: list[str] = []
        note = partial(Noting, self.edits)
        features = (
            *(feature for feature in FEATURES if feature.name != "run"),
            Feature(name="noting", services=(note,)),
        )
        self.runtime = Runtime(AppState(project=Project(name="New"), saved=Project(name="New")), features)
        self.runtime.handle(by(ME, Join()))

    @property
    def state(self) -> AppState:
        return self.runtime.state

    def until(self, reached: Callable[[], bool]) -> None:
        """Handle messages until something has happened, at most a minute."""
        end = time.monotonic() + 60.0
        while not reached():
            assert time.monotonic() < end, (self.state.part(MapLoading), self.state.faults)
            for message in self.runtime._drained():
                self.runtime.handle(message)

    def open(self, source: Path | Upload) -> None:
        self.runtime.handle(by(ME, actions.OpenMap(MapFile(source))))


@pytest.fixture
def loading() -> Iterator[Loading]:
    started = Loading()
    yield started
    started.runtime._jobs.close()


@pytest.fixture
def hall() -> FloorMap:
    floor_map = room().floor_map
    assert floor_map is not None
    return floor_map


def test_a_map_is_read_in_the_background_and_journaled_by_its_name(
    loading: Loading, hall: FloorMap, tmp_path: Path
) -> None:
    write_floor_map(hall, tmp_path / "hall.yaml")
    loading.open(tmp_path / "hall.yaml")
    assert loading.state.project.floor_map is None
    loading.until(lambda: loading.state.project.floor_map is not None)
    assert loading.state.project.floor_map == hall
    loading.runtime.handle(page.Undo())
    assert loading.edits == ["load floor map hall.yaml", "undo load floor map hall.yaml"]


def test_a_broken_file_is_told_and_the_map_stays(loading: Loading, hall: FloorMap, tmp_path: Path) -> None:
    write_floor_map(hall, tmp_path / "hall.yaml")
    loading.open(tmp_path / "hall.yaml")
    loading.until(lambda: loading.state.project.floor_map is not None)
    before = loading.state.project
    nowhere = tmp_path / "nowhere.dxf"
    for source, name in (
        (Upload("hall.stl", b"no"), "hall.stl"),
        (Upload("x.png", b"no"), "x.png"),
        (nowhere, nowhere),
    ):
        loading.open(source)
        loading.until(lambda: bool(loading.state.of_browser(ME, MapTrouble).text))
        assert loading.state.of_browser(ME, MapTrouble).text.startswith(f"{name}: ")
    assert loading.state.project is before


def test_a_stopped_job_shows_nothing_and_the_next_file_loads(loading: Loading, hall: FloorMap, tmp_path: Path) -> None:
    write_drawing(tmp_path / "large.dxf", 20_000)
    write_floor_map(hall, tmp_path / "hall.yaml")
    loading.open(tmp_path / "large.dxf")
    under_way = ("Reading large.dxf", "reading the drawing")
    loading.until(lambda: any((job.name, job.message) == under_way for job in loading.runtime.view().jobs))
    loading.runtime.handle(actions.StopMapJob())
    loading.until(lambda: not loading.runtime.view().jobs)
    assert loading.state.part(MapLoading).draft is None
    loading.open(tmp_path / "hall.yaml")
    loading.until(lambda: loading.state.project.floor_map is not None)
