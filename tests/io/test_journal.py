from __future__ import annotations

import itertools
import multiprocessing
import os
import pickle
import random
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
from commission.io.journal import Journal, restore
from commission.io.project_file import load_project, save_project
from commission.io.project_parts import apply, change
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


@pytest.mark.parametrize("cut", [1, 5, 40])
def test_a_line_that_was_cut_off_ends_what_is_restored(tmp_path, cut):
    project, journal = started(tmp_path)
    for number in (1, 2):
        journal.append(replace(project, name=f"edit {number}"), f"Edit {number}")
    journal.close()
    data = journal.path.read_bytes()
    journal.path.write_bytes(data[:-cut])
    restored = restore(tmp_path, project)
    assert restored is not None
    assert restored.project.name == "edit 1"
    assert "the rest of the journal is lost (line 3 is damaged or cut off)" in restored.summary()


def test_a_journal_of_garbage_restores_what_stands_before_the_garbage(tmp_path):
    project, journal = started(tmp_path)
    journal.append(replace(project, name="edit 1"), "Edit 1")
    journal.close()
    whole = journal.path.read_bytes()
    rng = random.Random(2)
    for _ in range(60):
        data = bytearray(whole)
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        journal.path.write_bytes(data)
        restored = restore(tmp_path, project)
        assert restored is None or restored.project.name == "edit 1"
    journal.path.write_bytes(os.urandom(1000))
    assert restore(tmp_path, project) is None


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
    with pytest.raises(KeyboardInterrupt):
        journal.save(edited)
    restored = restore(tmp_path, load_project(tmp_path))
    # Nothing but the save itself was journaled: it counts as the edit that it completes.
    assert restored is not None
    assert restored.project == edited
    assert restored.foreign_changes == ()
    journal.close()


def test_a_journal_that_cannot_be_written_says_that_a_crash_would_lose_the_edit(tmp_path):
    project, journal = started(tmp_path)
    journal.path.mkdir()
    with pytest.raises(FileFormatError, match="a crash would lose this edit"):
        journal.append(replace(project, name="x"), "Rename")


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
        assert project in (safe, begun)
        if edits >= 200 and seed >= 19:
            break


def killed(child: BaseProcess, receiver: Connection) -> Iterator[Project | None]:
    """Kill an editor; what it had told until then."""
    child.kill()
    child.join()
    yield from heard(receiver, 1.0)
