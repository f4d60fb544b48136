"""A project kept on disk while it is edited: saved, journaled, restored, and never overwritten silently."""

from dataclasses import replace
from pathlib import Path

import pytest

from commission.app.base import actions
from commission.app.base.actions import ClickFloor, Join
from commission.app.base.state import AppState
from commission.app.editing import actions as editing
from commission.app.editing.editor import Tool
from commission.app.project.actions import ChangedOnDisk, Reload, Restored, Save
from commission.app.project.project_folder import ProjectFolder
from commission.app.project.state import FilesState
from commission.app.runtime import Runtime
from commission.errors import ProjectError
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, save_project
from commission.site.project import Project
from tests.app.asking import FEATURES, ME, by
from tests.app.sites import room


class Kept:
    """A runtime without a page over a project on disk; messages are handled at once."""

    def __init__(self, folder: Path) -> None:
        self.project = load_project(folder)
        state = AppState(project=self.project, saved=self.project, folder=folder)
        self.runtime = Runtime(state, [feature for feature in FEATURES if feature.name != "run"])
        self.files = self.runtime.service(ProjectFolder)
        self.do(Join(), editing.ChooseTool(Tool.PLACE))

    def do(self, *asked: actions.Action) -> None:
        for each in asked:
            self.runtime.handle(by(ME, each))
            for message in self.runtime._drained():
                self.runtime.handle(message)

    def place(self, x: float, y: float) -> None:
        self.do(ClickFloor((x, y), 0.1))

    @property
    def now(self) -> Project:
        return self.runtime.state.project


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_project(room(), tmp_path)
    return tmp_path


def test_every_edit_undo_and_redo_survives_a_crash_and_a_save_ends_the_journal(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    kept.place(5.0, 3.0)
    kept.do(actions.Undo())
    # Nothing is closed: the program is killed here.
    restored = restore(folder, load_project(folder))
    assert restored is not None
    assert restored.project == kept.now
    assert "undo place R6" in restored.summary()
    again = Kept(folder)
    again.do(Restored(restored.project, restored.summary()))
    assert again.now == kept.now
    assert again.runtime.state.is_changed
    assert again.runtime.state.greeting == restored.summary()
    again.do(Save())
    assert load_project(folder) == kept.now
    assert restore(folder, load_project(folder)) is None
    assert not again.runtime.state.is_changed
    assert again.runtime.state.greeting == ""


def test_what_somebody_else_saved_is_noticed_and_overwritten_only_when_asked(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    theirs = replace(kept.project, name="Theirs")
    save_project(theirs, folder)
    files = kept.files.foreign_changes()
    assert files == ("project.yaml",)
    kept.do(ChangedOnDisk(files))
    assert kept.runtime.state.part(FilesState).foreign == files
    with pytest.raises(ProjectError, match="changed on disk by somebody else"):
        kept.do(Save())
    assert load_project(folder).name == "Theirs"
    kept.do(Save(overwrite=True))
    assert load_project(folder) == kept.now
    assert kept.runtime.state.part(FilesState).foreign == ()


def test_reading_again_takes_theirs_and_undo_brings_ones_own_back(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    mine = kept.now
    save_project(replace(kept.project, name="Theirs"), folder)
    kept.do(Reload())
    assert kept.now.name == "Theirs"
    assert not kept.runtime.state.is_changed
    assert restore(folder, load_project(folder)) is None
    kept.do(actions.Undo())
    assert kept.now == mine


def test_a_copy_saved_elsewhere_is_the_project_from_then_on(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("copy")
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    kept.do(Save(elsewhere))
    assert load_project(elsewhere) == kept.now
    assert load_project(folder) == kept.project
    kept.place(5.0, 3.0)
    restored = restore(elsewhere, load_project(elsewhere))
    assert restored is not None
    assert restored.project == kept.now
    assert restore(folder, load_project(folder)) is None
