from __future__ import annotations

import itertools
import multiprocessing
import os
import pickle
import random
import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from commission.errors import FileFormatError, ProjectError
from commission.io.journal import Journal, News, remove_leftovers
from commission.io.journal_replay import Restored, restore
from commission.io.project_file import load_project, save_project
from commission.io.project_parts import apply, change
from commission.site.disturbances import Disturbances, WheelNoise
from commission.site.fields import in_file
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.io.crashing_editor import edit_until_killed, random_edit
from tests.io.projects import projects

HALL = FloorMap(np.full((20, 30), FREE, np.int8), 0.1)


def started(folder: Path) -> tuple[Project, Journal]:
    """A saved project and its journal."""
    project = Project(
        name="edit 0",
        floor_map=HALL,
        reflectors=ReflectorMap((Reflector(id="A", x=1.0, y=1.0), Reflector(id="B", x=2.0, y=1.0))),
    )
    save_project(project, folder)
    return project, Journal(folder, project)


@given(before=projects(), after=projects())
@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow])
def test_a_change_made_again_gives_the_later_project(before, after):
    path = Path("journal")
    assert apply(before, change(before, after), path) == after
    assert apply(Project(), change(None, after), path) == after
    assert change(after, after) == {}


def test_an_older_journal_that_knows_no_wheels_leaves_those_there_are():
    project = Project(disturbances=Disturbances(wheels=WheelNoise(lateral_per_sqrt_m=0.05)))
    assert apply(project, {"disturbances": {"people": 3}}, Path("journal")).disturbances == replace(
        project.disturbances, people=3
    )
    whole = {"disturbances": {"people": 3}, "parameters": {"odometry": {"lateral_per_sqrt_m": 0.07}}}
    assert apply(Project(), whole, Path("journal")).disturbances.wheels == WheelNoise(lateral_per_sqrt_m=0.07)


def test_a_small_edit_is_a_small_change():
    many = Project(
        reflectors=ReflectorMap(tuple(Reflector(id=str(i), x=float(i), y=0.0) for i in range(100))), floor_map=HALL
    )
    moved = replace(many, reflectors=ReflectorMap((*many.reflectors.reflectors[:-1], Reflector(id="99", x=5.0, y=5.0))))
    assert [name for name, _ in change(many, moved)["reflectors"]["set"]] == ["99"]
    cells = np.array(HALL.cells)
    cells[3:5, 7] = OCCUPIED
    drawn = replace(many, floor_map=replace(HALL, cells=cells))
    assert change(many, drawn)["floor_map"]["size"] == [2, 1]
    turned = replace(drawn, floor_map=replace(drawn.floor_map, origin=np.array([5.0, 6.0, 0.7])))
    assert change(drawn, turned)["floor_map"]["size"] == [0, 0]
    assert apply(drawn, change(drawn, turned), Path("journal")) == turned
    both = change(many, turned)
    assert both["floor_map"]["size"] == [2, 1]
    assert apply(many, both, Path("journal")) == turned


def test_edits_are_restored_and_named_after_the_program_was_killed(tmp_path):
    project, journal = started(tmp_path)
    assert not journal.path.exists()
    rng = random.Random(1)
    for number in range(1, 20):
        project = random_edit(project, number, rng)
        journal.append(project, f"Edit {number}")
    restored = restore(tmp_path, load_project(tmp_path))
    assert restored is not None
    assert restored.project == project
    assert restored.summary().startswith("Restored 19 edits up to 20")
    assert restored.summary().endswith(": Edit 19")
    journal.close()


def test_saving_removes_the_journal_and_later_edits_begin_another(tmp_path):
    project, journal = started(tmp_path)
    first = replace(project, name="first")
    journal.append(first, "Rename")
    journal.save(first)
    assert load_project(tmp_path) == first
    assert restore(tmp_path, first) is None
    journal.append(replace(first, name="second"), "Rename")
    restored = restore(tmp_path, load_project(tmp_path))
    assert restored is not None
    assert (restored.project.name, restored.edits, restored.foreign_changes) == ("second", 1, ())
    journal.discard()
    assert not journal.path.exists()
    journal.close()


def test_a_project_that_somebody_else_changed_is_not_overwritten_silently(tmp_path):
    project, journal = started(tmp_path)
    mine = replace(project, name="mine")
    journal.append(mine, "Rename")
    save_project(replace(project, reflectors=ReflectorMap()), tmp_path)
    assert journal.foreign_changes() == ("reflectors.csv",)
    restored = restore(tmp_path, load_project(tmp_path))
    assert restored is not None
    assert "meanwhile changed on disk by somebody else: reflectors.csv" in restored.summary()
    with pytest.raises(ProjectError, match=r"changed on disk by somebody else: reflectors\.csv"):
        journal.save(mine)
    assert load_project(tmp_path).name == "edit 0"
    journal.save(mine, overwrite=True)
    assert load_project(tmp_path) == mine
    journal.close()


def test_a_save_that_was_killed_halfway_is_not_taken_for_somebody_else(tmp_path, monkeypatch):
    project, journal = started(tmp_path)
    edited = replace(project, name="edited", reflectors=ReflectorMap((Reflector(id="A", x=7.0, y=7.0),)))

    def killed(project: Project, folder: Path) -> None:
        save_project(replace(project, name="edit 0"), folder)
        raise KeyboardInterrupt

    monkeypatch.setattr("commission.io.journal.save_project", killed)
    journal.append(edited, "Move A")
    with pytest.raises(KeyboardInterrupt):
        journal.save(edited)
    restored = restore(tmp_path, load_project(tmp_path))
    assert restored is not None
    assert restored.project == edited
    assert restored.foreign_changes == ()
    journal.close()


def test_a_save_that_was_killed_when_all_was_written_restores_nothing(tmp_path, monkeypatch):
    project, journal = started(tmp_path)
    # Files round what nobody meant: that is no unsaved edit.
    edited = replace(project, reflectors=ReflectorMap((Reflector(id="A", x=5.640000000000006, y=1.0),)))
    journal.append(edited, "Move A")

    def killed(_file: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("commission.io.journal_file.JournalFile.remove", killed)
    with pytest.raises(KeyboardInterrupt):
        journal.save(edited)
    assert journal.path.exists()
    assert load_project(tmp_path) != edited
    assert restore(tmp_path, load_project(tmp_path)) is None


def full_disk(*_arguments: object) -> int:
    raise OSError(28, "No space left on device")


def test_edits_without_space_are_written_down_as_soon_as_there_is_some(tmp_path, monkeypatch):
    project, journal = started(tmp_path)
    journal.append(replace(project, name="first"), "Rename")
    with monkeypatch.context() as full:
        full.setattr(os, "write", full_disk)
        with pytest.raises(FileFormatError, match=r"No space left on device.*a crash would lose this edit"):
            journal.append(replace(project, name="second"), "Rename again")
        assert not journal.is_protecting
        assert journal.check() == ()
        assert given_back(tmp_path).project.name == "first"
    assert journal.check() == (News(f"all edits are in the journal again: {journal.path}", is_good=True),)
    assert journal.is_protecting
    assert given_back(tmp_path).last_edit == "Rename again"
    assert given_back(tmp_path).project.name == "second"
    assert journal.check() == ()
    journal.close()


def test_a_save_that_has_space_where_the_journal_has_none_succeeds(tmp_path, monkeypatch):
    project, journal = started(tmp_path)
    monkeypatch.setattr("commission.io.journal_file.os.write", full_disk)
    with pytest.raises(FileFormatError):
        journal.append(replace(project, name="first"), "Rename")
    journal.save(replace(project, name="first"))
    assert load_project(tmp_path).name == "first"
    assert journal.is_protecting


def given_back(folder: Path) -> Restored:
    """What the program would find if it was killed now; it has not lost anything by the search."""
    restored = restore(folder, load_project(folder) if (folder / "project.yaml").exists() else Project())
    assert restored is not None
    assert not restored.damage
    return restored


def deleted(path: Path) -> None:
    path.unlink()


def replaced_by_an_older_one(path: Path) -> None:
    older = path.with_name("older")
    older.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:3]))
    older.replace(path)


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def added_to(path: Path) -> None:
    with path.open("ab") as file:
        file.write(b"something")


@pytest.mark.parametrize("by_an_edit", [False, True])
@pytest.mark.parametrize(
    ("done", "told"),
    [
        (deleted, "was deleted by somebody else"),
        (replaced_by_an_older_one, "was replaced by somebody else"),
        (emptied, "was changed by somebody else"),
        (added_to, "was changed by somebody else"),
    ],
)
def test_a_journal_that_is_lost_is_begun_anew_with_the_whole_project(tmp_path, done, told, by_an_edit):
    project, journal = started(tmp_path)
    for number in (1, 2):
        project = replace(project, name=f"edit {number}", floor_map=HALL)
        journal.append(project, f"Edit {number}")
    done(journal.path)
    there = journal.path.read_bytes() if journal.path.exists() else None
    if by_an_edit:
        project = replace(project, name="edit 3")
        journal.append(project, "Edit 3")
    news = journal.check()
    assert f"the journal of unsaved edits {told}; it was begun anew with the whole project" in news[0].text
    # Even the floor map, which was never edited: whoever deletes a journal may delete more.
    for path in (tmp_path / "map.yaml", tmp_path / "map.png"):
        path.unlink()
    restored = restore(tmp_path, Project())
    assert restored is not None
    assert restored.project == project
    kept = [path.read_bytes() for path in tmp_path.glob(".commission.journal.found-*")]
    assert kept == ([] if there is None else [there])
    assert len(news) == 1 + len(kept)
    assert journal.check() == ()
    journal.close()


@pytest.fixture
def state_home(tmp_path, monkeypatch) -> Path:
    """The user's own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.mark.parametrize("edits", [0, 2])
def test_edits_of_a_project_whose_folder_was_deleted_are_kept_where_the_news_tell(tmp_path, state_home, edits):
    folder = tmp_path / "hall"
    project, journal = started(folder)
    for number in range(1, edits + 1):
        project = replace(project, name=f"edit {number}")
        journal.append(project, f"Edit {number}")
    shutil.rmtree(folder)
    (news,) = journal.check()
    place = journal.path.parent
    assert news.text == f"the project's folder {folder} was deleted or moved; all edits are kept in {place}"
    assert place.is_relative_to(state_home)
    assert not folder.exists()
    later = replace(project, name="later")
    journal.append(later, "Rename")
    # Killed now: the place that was told gives it back, and so does the place where the project was.
    for found in (place, folder):
        restored = restore(found, Project())
        assert restored is not None
        assert restored.project == later
    following = Journal(folder, Project(), restored)
    following.append(restored.project, "Restore")
    assert not place.exists()
    assert given_back(folder).project == later
    following.close()


def test_a_folder_that_comes_back_has_the_journal_again(tmp_path, state_home):
    folder = tmp_path / "hall"
    project, journal = started(folder)
    journal.append(replace(project, name="first"), "Rename")
    folder.rename(tmp_path / "elsewhere")
    assert "was deleted or moved" in journal.check()[0].text
    journal.append(replace(project, name="second"), "Rename")
    (tmp_path / "elsewhere").rename(folder)
    assert journal.kept_elsewhere is not None
    assert journal.check() == (
        News(f"the project's folder is there again, and edits are kept in it: {folder}", is_good=True),
    )
    assert journal.kept_elsewhere is None
    assert given_back(folder).project.name == "second"
    assert list(state_home.rglob("*.journal")) == []
    assert list(folder.glob("*.found-*")) == []
    journal.save(replace(project, name="second"))
    assert load_project(folder).name == "second"
    journal.close()


def test_a_save_makes_a_deleted_folder_again_when_asked_to(tmp_path, state_home):
    folder = tmp_path / "hall"
    project, journal = started(folder)
    shutil.rmtree(folder)
    with pytest.raises(ProjectError, match=r"changed on disk by somebody else: map\.png, map\.yaml, project\.yaml"):
        journal.save(project)
    journal.check()
    journal.save(project, overwrite=True)
    assert load_project(folder) == project
    assert [path for path in state_home.rglob("*") if path.is_file()] == []
    assert journal.check() == ()
    journal.close()


def test_a_folder_that_is_gone_with_no_other_place_is_told_once_and_tried_again(tmp_path, monkeypatch):
    (tmp_path / "state").write_text("no folder")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    project, journal = started(tmp_path / "hall")
    shutil.rmtree(tmp_path / "hall")
    (news,) = journal.check()
    assert "a crash would lose this edit" in news.text
    assert journal.check() == ()
    assert not journal.is_protecting
    (tmp_path / "state").unlink()
    told, again = journal.check()
    assert "all edits are kept in" in told.text
    assert "all edits are in the journal again" in again.text
    assert again.is_good
    restored = restore(tmp_path / "hall", Project())
    assert restored is not None
    assert restored.project == project
    journal.close()


def test_what_a_killed_save_left_half_written_is_removed(tmp_path):
    project, journal = started(tmp_path)
    for name in (
        ".project.yaml.abcd_123.tmp",
        ".map.png.abcd_123.tmp",
        ".commission.journal.new",
        ".other.abcd_123.tmp",
    ):
        (tmp_path / name).write_text("half")
    (tmp_path / ".commission.writing.999999999.x").mkdir()
    remove_leftovers(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"project.yaml", "map.yaml", "map.png", "reflectors.csv", ".other.abcd_123.tmp"}
    assert load_project(tmp_path) == project
    journal.close()


def heard(receiver: Connection, seconds: float) -> Iterator[Project | None]:
    """What an editor tells until some time has passed or it is gone."""
    end = time.monotonic() + seconds
    try:
        while receiver.poll(max(0.0, end - time.monotonic())):
            yield receiver.recv()
    except (EOFError, OSError, pickle.UnpicklingError):
        # Killed in the middle of a word.
        return


def test_nothing_promised_is_lost_when_the_editor_is_killed_at_any_moment(tmp_path):
    """At least 200 edits of every part of the project, saves in between, and 20 kills -9."""
    project, journal = started(tmp_path)
    journal.close()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.io.crashing_editor"])
    rng = random.Random(3)
    edits = 0
    for seed in itertools.count():
        receiver, sender = context.Pipe(duplex=False)
        child = context.Process(target=edit_until_killed, args=(tmp_path, seed, sender))
        child.start()
        sender.close()
        assert receiver.poll(60.0)
        # The project that was promised to be safe, and the one that an edit under way would make of it.
        safe, begun = project, project
        until_killed = heard(receiver, rng.uniform(0.0, 0.2))
        for told in itertools.chain(until_killed, killed(child, receiver)):
            safe, begun, edits = (begun, begun, edits + 1) if told is None else (safe, told, edits)
        found = load_project(tmp_path)
        restored = restore(tmp_path, found)
        project = restored.project if restored else found
        # What was promised is there, to the last value; an edit whose promise was not heard any more may be there, too.
        # What was saved is rounded as files are.
        assert project in (safe, begun, in_file(safe), in_file(begun))
        if edits >= 200 and seed >= 19:
            break


def killed(child: BaseProcess, receiver: Connection) -> Iterator[Project | None]:
    """Kill an editor; what it had told until then."""
    child.kill()
    child.join()
    yield from heard(receiver, 1.0)
