"""A project kept on disk while it is edited: saved, journaled, restored, and never overwritten silently."""

import os
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from commission.app.base import actions
from commission.app.base.actions import ClickFloor, Join, Sender
from commission.app.base.effects import Effect, Tell
from commission.app.base.panel import escaped
from commission.app.base.server import start_server
from commission.app.base.state import NOTHING_SAVED, AppState
from commission.app.base.view import view_of
from commission.app.editing import actions as editing
from commission.app.editing.site_tools import PlaceTool
from commission.app.launch import bundled, open_page
from commission.app.problems.problems_panel import ProblemsPanel
from commission.app.project.actions import (
    AskToReplace,
    ChangedOnDisk,
    EditsRestored,
    KeepOther,
    Reload,
    RenameProject,
    Save,
    TakeOver,
)
from commission.app.project.project_folder import ProjectFolder
from commission.app.project.state import CopyQuestion, FilesState
from commission.app.project.top_bar import standing
from commission.app.runtime import Runtime
from commission.errors import ProjectError, UsageError
from commission.io.journal import Journal
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, open_project, save_project
from commission.io.project_lock import Hold, ProjectLock
from commission.site.project import Project
from tests.app.asking import FEATURES, ME, by, taking
from tests.app.owning import Owner
from tests.app.project.killed_page import NoPage
from tests.app.sites import room


class Told(NoPage):
    """A page that keeps what it is to tell."""

    def __init__(self) -> None:
        self.told: list[tuple[Tell, Sender]] = []

    def carry_out(self, effect: Effect, sender: Sender) -> None:
        if isinstance(effect, Tell):
            self.told.append((effect, sender))


class Kept:
    """A runtime without a page over a project on disk; messages are handled at once."""

    def __init__(self, folder: Path) -> None:
        self.project = load_project(folder)
        state = AppState(project=self.project, saved=self.project, folder=folder)
        self.runtime = Runtime(state, [feature for feature in FEATURES if feature.name != "run"])
        self.files = self.runtime.service(ProjectFolder)
        self.do(Join(), editing.ChooseTool(PlaceTool()))

    def start(self) -> None:
        """Begin as the page does."""
        self.files.start()
        self.look()

    def do(self, *asked: actions.Action) -> None:
        for each in asked:
            self.runtime.handle(by(ME, each))
            self.settle()

    def settle(self) -> None:
        """Let what is written be written, and handle what follows."""
        self.files.wait(60.0)
        while not self.runtime._queue.empty():
            self.runtime.handle(self.runtime._queue.get())
            self.files.wait(60.0)

    def refused(self, asked: actions.Action) -> str:
        """Ask for something that fails in the background; what the browser that asked is told."""
        page = Told()
        self.runtime._page = page
        self.do(asked)
        self.runtime._page = None
        ((tell, sender),) = page.told
        assert (tell.failed, sender.browser) == (True, ME)
        return tell.text

    def place(self, x: float, y: float) -> None:
        self.do(ClickFloor((x, y), 0.1))

    def look(self) -> None:
        """Let the service look at the folder, as it does every second."""
        self.files._look(self.runtime.state)
        self.settle()

    def kill(self) -> None:
        """End it as the system would: nothing is written any more, and the lock is free."""
        assert self.files._lock is not None
        os.close(self.files._lock._file)
        self.files._lock._file = None

    @property
    def kept(self) -> FilesState:
        return self.runtime.state.part(FilesState)

    @property
    def question(self) -> AskToReplace | None:
        """What the browser is asked about a copy."""
        return self.runtime.state.of_browser(ME, CopyQuestion).asked

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
    kept.kill()
    restored = restore(folder, load_project(folder))
    assert restored is not None
    assert restored.project == kept.now
    assert "undo place R6" in restored.summary()
    again = Kept(folder)
    again.start()
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
    assert kept.refused(Save()).startswith("changed on disk by somebody else: project.yaml")
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


def doubtful(folder: Path) -> str:
    """Let the map name its image by a path on another computer; what is said about it."""
    (described,) = (path for path in folder.glob("*.yaml") if path.name != "project.yaml")
    (image,) = folder.glob("*.png")
    described.write_text(described.read_text().replace(image.name, f"/home/robot/maps/{image.name}"))
    return f"the image '/home/robot/maps/{image.name}' is not read; {image.name} beside {described.name} is taken"


def test_what_is_doubted_when_a_project_is_opened_stands_in_the_problems_of_its_page(folder: Path) -> None:
    note = doubtful(folder)
    opened = open_project(folder)
    assert opened.notes == (note,)
    assert bundled(folder).notes == (note,)
    server = start_server("127.0.0.1", 0)
    runtime = open_page(server, opened.project, folder=folder, notes=opened.notes)
    try:
        assert runtime.state.faults == (note,)
        panel = ProblemsPanel(server.gui, taking([]), server.gui.add_tab_group().add_tab("Problems"))
        panel.draw_slowly(view_of(runtime.state))
        assert escaped(note) in panel._html.content
    finally:
        runtime.stop()
        server.stop()


def test_what_is_doubted_when_a_project_is_read_again_is_listed_once_and_told(folder: Path) -> None:
    kept = Kept(folder)
    note = doubtful(folder)
    page = Told()
    kept.runtime._page = page
    kept.do(Reload(), Reload())
    kept.runtime._page = None
    assert kept.runtime.state.faults == (note,)
    assert [tell.text for tell, _ in page.told] == [note, note]
    assert not page.told[0][0].failed


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


def test_a_second_server_shows_the_project_read_only_and_follows_what_the_first_one_saves(folder: Path) -> None:
    first, second = Kept(folder), Kept(folder)
    second.start()
    assert second.kept.holder.startswith(f"process {os.getpid()} on ")
    assert "opened read-only: it is edited by process" in second.runtime.state.greeting
    first.place(4.0, 3.0)
    for ask in (lambda: second.place(5.0, 3.0), lambda: second.do(Save()), lambda: second.do(RenameProject("Mine"))):
        with pytest.raises(UsageError, match=r"read-only: it is edited by process \d+ on .*; Take over lets you edit"):
            ask()
    assert second.now == second.project
    first.do(Save())
    second.look()
    assert second.now == first.now
    assert not second.runtime.state.is_changed
    # What it shows may be kept elsewhere, and is edited there.
    second.do(Save(folder / "copy"))
    assert second.runtime.state.read_only == second.kept.holder == ""
    second.place(5.0, 3.0)
    assert len(second.now.reflectors) == len(first.now.reflectors) + 1


def test_whoever_takes_over_has_every_edit_and_the_first_one_becomes_read_only(folder: Path) -> None:
    first, second = Kept(folder), Kept(folder)
    second.start()
    first.place(4.0, 3.0)
    first.place(5.0, 3.0)
    edited = first.now
    second.do(TakeOver())
    second.look()
    # The first one has not looked yet: nothing is read before it has let go.
    assert second.runtime.state.read_only
    first.look()
    assert first.kept.holder
    assert "taken over by process" in first.runtime.state.greeting
    with pytest.raises(UsageError, match="read-only"):
        first.place(6.0, 3.0)
    second.look()
    assert second.now == edited
    assert second.runtime.state.read_only == ""
    assert "Restored 2 edits" in second.runtime.state.greeting
    second.place(6.0, 3.0)
    assert len(second.now.reflectors) == len(edited.reflectors) + 1
    first.do(TakeOver())
    second.look()
    first.look()
    assert first.now == second.now
    first.do(Save())
    assert load_project(folder) == first.now
    first.files.close()
    second.files.close()


def test_an_edit_before_the_next_look_after_a_take_over_is_told_to_be_on_its_page_alone(folder: Path) -> None:
    first, second = Kept(folder), Kept(folder)
    second.start()
    first.place(4.0, 3.0)
    shared = first.now
    second.do(TakeOver())
    first.place(5.0, 3.0)
    assert any("is shown on this page alone: process" in fault for fault in first.runtime.state.faults)
    assert first.runtime.state.read_only
    second.look()
    assert second.now == shared


def test_one_who_reads_a_project_stays_read_only_while_its_folder_is_gone(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one goes on editing elsewhere: were the second one to edit as well, there would be two projects."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
    first, second = Kept(folder), Kept(folder)
    second.start()
    first.place(4.0, 3.0)
    shutil.rmtree(folder)
    for _ in range(2):
        second.look()
        first.look()
        assert second.runtime.state.read_only
        assert not first.runtime.state.read_only
    first.place(5.0, 3.0)
    first.do(Save(overwrite=True))
    first.look()
    second.look()
    assert second.runtime.state.read_only
    assert load_project(folder) == first.now == second.now
    first.files.close()
    second.files.close()


@pytest.mark.parametrize("how", ["killed", "closed"])
def test_a_project_whose_holder_is_gone_is_edited_by_the_one_who_waited(folder: Path, how: str) -> None:
    first, second = Kept(folder), Kept(folder)
    second.start()
    first.place(4.0, 3.0)
    if how == "killed":
        first.kill()
    else:
        first.files.close()
    second.look()
    assert second.now == first.now
    second.place(5.0, 3.0)
    assert second.runtime.state.read_only == ""


def test_an_edit_that_cannot_be_journaled_stands_and_its_effects_are_carried_out(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Kept(folder)

    def full(*_arguments: object) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr("commission.io.journal_file.os.write", full)
        kept.place(4.0, 3.0)
        kept.look()
        assert len(kept.now.reflectors) == len(kept.project.reflectors) + 1
        assert "a crash would lose this edit" in kept.runtime.state.faults[-1]
        assert not kept.kept.is_protected
        assert standing(kept.runtime.state) == "unsaved, and a crash would lose it: the journal cannot be written"
    kept.look()
    assert kept.kept.is_protected
    assert standing(kept.runtime.state) == "unsaved"
    kept.kill()
    restored = restore(folder, load_project(folder))
    assert restored is not None
    assert restored.project == kept.now


def test_the_journal_is_written_before_the_effects_of_an_edit(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    seen: list[Project] = []

    def look_at_journal(self: Runtime, effect: Effect, sender: Sender) -> None:
        restored = restore(folder, kept.project)
        assert restored is not None
        seen.append(restored.project)

    monkeypatch.setattr(Runtime, "_carry_out", look_at_journal)
    theirs = replace(kept.now, name="Restored")
    kept.do(EditsRestored(theirs, "told to each browser: an effect"))
    assert seen == [theirs]


def test_a_deleted_folder_is_told_as_such_and_its_edits_are_kept_where_the_page_says(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    shutil.rmtree(folder)
    kept.look()
    place = kept.kept.kept_in
    assert place is not None
    assert f"the project's folder {folder} was deleted or moved; all edits are kept in {place}" in (
        kept.runtime.state.faults
    )
    assert standing(kept.runtime.state) == f"its folder is gone; edits are kept in {place}"
    restored = restore(place, Project())
    assert restored is not None
    assert restored.project == kept.now
    kept.do(Save(overwrite=True))
    assert load_project(folder) == kept.now
    kept.look()
    assert kept.kept.kept_in is None
    assert standing(kept.runtime.state).startswith("saved ")
    kept.files.close()


def test_a_deleted_journal_is_begun_anew_without_waiting_for_an_edit(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    (folder / ".commission.journal").unlink()
    kept.look()
    assert "the journal of unsaved edits was deleted by somebody else" in kept.runtime.state.faults[-1]
    kept.kill()
    restored = restore(folder, load_project(folder))
    assert restored is not None
    assert restored.project == kept.now


def test_a_copy_onto_another_project_is_asked_about_first(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = tmp_path_factory.mktemp("other")
    theirs = replace(room(), name="Theirs")
    save_project(theirs, other)
    unsaved = Journal(other, theirs)
    unsaved.append(replace(theirs, name="Unsaved"), "Rename")
    unsaved.close()
    content = unsaved.path.read_bytes()
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    kept.do(Save(other))
    question = kept.question
    assert question is not None
    # The other browsers do not learn what lies there.
    assert kept.runtime.state.joined(ME + 1).of_browser(ME + 1, CopyQuestion).asked is None
    assert question.holds.startswith("the project 'Theirs' and unsaved edits of a session that crashed or still runs")
    kept.do(KeepOther())
    assert kept.question is None
    assert load_project(other) == theirs
    kept.do(Save(other))
    kept.do(Save(other, overwrite=True))
    assert kept.question is None
    assert load_project(other) == kept.now
    (aside,) = other.glob(".commission.journal.replaced-*")
    assert aside.read_bytes() == content
    assert kept.runtime.state.folder == other
    kept.files.close()


def test_a_copy_onto_a_project_that_somebody_edits_or_onto_no_folder_is_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = tmp_path_factory.mktemp("other")
    save_project(replace(room(), name="Theirs"), other)
    lock = ProjectLock(other)
    lock.look()
    kept = Kept(folder)
    assert "holds the project 'Theirs', edited by process" in kept.refused(Save(other, overwrite=True))
    (folder / "file").write_text("")
    for place, said in (
        (folder / "file", "is a file; expected a folder"),
        (Path("a\0b"), "is no path (embedded null byte); expected the path of a folder"),
    ):
        assert said in kept.refused(Save(place))
    assert kept.runtime.state.folder == folder
    kept.place(4.0, 3.0)
    assert restore(folder, kept.project) is not None


def test_a_copy_that_cannot_be_written_to_its_end_does_not_stay_and_the_project_stays_where_it_is(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)

    def full(*_arguments: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("commission.io.project_file.project_text", full)
    assert "No space left on device" in kept.refused(Save(folder / "new" / "copy"))
    assert not (folder / "new").exists()
    assert kept.runtime.state.folder == folder
    kept.kill()
    restored = restore(folder, kept.project)
    assert restored is not None
    assert restored.project == kept.now


def test_changes_by_others_before_a_crash_are_asked_about_after_it(folder: Path) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    save_project(replace(kept.project, name="Theirs"), folder)
    kept.look()
    assert kept.kept.foreign == ("project.yaml",)
    kept.kill()
    again = Kept(folder)
    again.start()
    assert again.kept.foreign == ("project.yaml",)
    assert again.now == kept.now
    assert again.refused(Save()).startswith("changed on disk by somebody else: project.yaml")
    assert load_project(folder).name == "Theirs"


def test_a_damaged_journal_is_told_when_the_page_opens(folder: Path) -> None:
    (folder / ".commission.journal").write_text("no journal")
    kept = Kept(folder)
    kept.start()
    (aside,) = folder.glob(".commission.journal.damaged-*")
    assert f"kept as {aside}" in kept.runtime.state.faults[-1]


def test_a_new_project_is_locked_as_soon_as_its_folder_is_there(tmp_path: Path) -> None:
    state = AppState(project=Project(), saved=NOTHING_SAVED, folder=tmp_path / "new")
    first, second = (Owner(ProjectFolder, state).service for _ in range(2))
    assert not (tmp_path / "new").exists()
    first.note(Project(name="first"), "Rename")
    with pytest.raises(ProjectError, match="Rename is shown on this page alone: process"):
        second.note(Project(name="second"), "Rename")
    restored = restore(tmp_path / "new", Project())
    assert restored is not None
    assert restored.project.name == "first"
    first.close()
    second.close()


def test_edits_while_a_save_is_under_way_are_journaled_at_once_and_are_unsaved_after_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Kept(folder)
    kept.place(4.0, 3.0)
    saved = kept.now
    begun, go_on = threading.Event(), threading.Event()

    def slow(project: Project, place: Path) -> None:
        begun.set()
        assert go_on.wait(60.0)
        save_project(project, place)

    monkeypatch.setattr("commission.io.journal.save_project", slow)
    kept.runtime.handle(by(ME, Save()))
    assert begun.wait(60.0)
    kept.runtime.handle(by(ME, ClickFloor((5.0, 3.0), 0.1)))
    kept.runtime.handle(by(ME, actions.Undo()))
    kept.runtime.handle(by(ME, ClickFloor((5.0, 4.0), 0.1)))
    # Killed now: our own save is not taken for somebody else's, and nothing waits for it.
    restored = restore(folder, kept.project)
    assert restored is not None
    assert restored.project == kept.now != saved
    assert restored.foreign_changes == ()
    # Whoever takes over waits for it, too.
    taking = ProjectLock(folder)
    taking.take_over()
    kept.files._look(kept.runtime.state)
    assert taking.look() is Hold.TAKING_OVER
    taking.release()
    go_on.set()
    kept.settle()
    assert load_project(folder) == saved
    assert kept.runtime.state.is_changed
    kept.look()
    assert kept.kept.foreign == ()
    kept.kill()
    restored = restore(folder, load_project(folder))
    assert restored is not None
    assert restored.project == kept.now
    assert restored.foreign_changes == ()


def test_an_edit_while_a_copy_is_written_is_unsaved_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Kept(folder)
    begun, go_on = threading.Event(), threading.Event()

    def slow(project: Project, place: Path) -> None:
        begun.set()
        assert go_on.wait(60.0)
        save_project(project, place)

    monkeypatch.setattr("commission.io.project_copy.save_project", slow)
    kept.runtime.handle(by(ME, Save(folder / "copy")))
    assert begun.wait(60.0)
    kept.runtime.handle(by(ME, ClickFloor((5.0, 3.0), 0.1)))
    assert restore(folder, kept.project) is not None
    go_on.set()
    kept.settle()
    assert kept.runtime.state.folder == folder / "copy"
    assert kept.runtime.state.is_changed
    restored = restore(folder / "copy", load_project(folder / "copy"))
    assert restored is not None
    assert restored.project == kept.now
    assert restore(folder, kept.project) is None


def test_two_saves_in_a_row_write_the_later_project(folder: Path) -> None:
    kept = Kept(folder)
    for x in (4.0, 5.0):
        kept.runtime.handle(by(ME, ClickFloor((x, 3.0), 0.1)))
        kept.runtime.handle(by(ME, Save()))
    kept.settle()
    assert load_project(folder) == kept.now
    assert not kept.runtime.state.is_changed
    assert restore(folder, kept.now) is None
