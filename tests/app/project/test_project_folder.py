"""A project kept on disk while it is edited: saved, journaled, restored, and never overwritten silently."""

from dataclasses import replace
from pathlib import Path

import pytest

from commission.app.base import actions
from commission.app.base.state import AppState
from commission.app.editing import actions as editing
from commission.app.editing.editor import Tool
from commission.app.project.project_folder import Keeping
from commission.app.runtime import Runtime, Work
from commission.errors import ProjectError
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, save_project
from commission.site.project import Project
from tests.app.sites import room

ME = 1


class Kept:
    """A runtime without a page over a project on disk; messages are handled at once."""

    def __init__(self, folder: Path) -> None:
        self.project = load_project(folder)
        self.keeping = Keeping(folder, self.project)
        work = Work(
            prepare=lambda *_: pytest.fail("nothing drives"),
            predict=lambda *_: (),
            save=self.keeping.save,
            compile=lambda _progress: None,
            note=self.keeping.note,
            foreign_changes=self.keeping.foreign_changes,
            close=self.keeping.close,
            load=self.keeping.load,
        )
        self.runtime = Runtime(AppState(self.project, self.project, folder=folder), work)
        self.do(editing.Join(ME), editing.ChooseTool(ME, Tool.PLACE))

    def do(self, *wishes: actions.Action) -> None:
        for wish in wishes:
            self.runtime.handle(wish)
            for message in self.runtime._drained():
                self.runtime.handle(message)

    def place(self, x: float, y: float) -> None:
        self.do(editing.ClickFloor(ME, (x, y), 0.1))

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
    kept.do(actions.Undo(ME))
    # Nothing is closed: the program is killed here.
    restored = restore(folder, load_project(folder))
    assert restored is not None
    assert restored.project == kept.now
    assert "undo place R6" in restored.summary()
    again = Kept(folder)
    again.do(editing.Restored(restored.project, restored.summary()))
    assert again.now == kept.now
    assert again.runtime.state.is_changed
    assert again.runtime.state.greeting == restored.summary()
    again.do(actions.Save())
    assert load_project(folder) == kept.now
    assert restore(folder, load_project(folder)) is None
    assert not again.runtime.state.is_changed
    assert again.runtime.state.greeting == ""


def test_what_somebody_else_saved_is_noticed_and_overwritten_only_when_asked(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    theirs = replace(kept.project, name="Theirs")
    save_project(theirs, folder)
    files = kept.keeping.foreign_changes()
    assert files == ("project.yaml",)
    kept.do(actions.ChangedOnDisk(files))
    assert kept.runtime.state.foreign == files
    with pytest.raises(ProjectError, match="changed on disk by somebody else"):
        kept.do(actions.Save())
    assert load_project(folder).name == "Theirs"
    kept.do(actions.Save(overwrite=True))
    assert load_project(folder) == kept.now
    assert kept.runtime.state.foreign == ()


def test_reading_again_takes_theirs_and_undo_brings_ones_own_back(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    mine = kept.now
    save_project(replace(kept.project, name="Theirs"), folder)
    kept.do(actions.Reload())
    assert kept.now.name == "Theirs"
    assert not kept.runtime.state.is_changed
    assert restore(folder, load_project(folder)) is None
    kept.do(actions.Undo(ME))
    assert kept.now == mine


def test_a_copy_saved_elsewhere_is_the_project_from_then_on(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("copy")
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    kept.do(actions.Save(elsewhere))
    assert load_project(elsewhere) == kept.now
    assert load_project(folder) == kept.project
    kept.place(5.0, 3.0)
    restored = restore(elsewhere, load_project(elsewhere))
    assert restored is not None
    assert restored.project == kept.now
    assert restore(folder, load_project(folder)) is None
