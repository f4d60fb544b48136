"""What a journal gives back: every intact edit, whatever happened to the rest of it, and the file itself."""

from __future__ import annotations

import json
import random
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.errors import FileFormatError
from commission.io import journal_replay
from commission.io.journal import Journal
from commission.io.journal_place import FILE_NAME
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, save_project
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.io.damaged_journals import DAMAGES, Written, check_restored, damaged, written

EDITS = 12


@pytest.fixture
def journal(tmp_path: Path) -> Written:
    return written(tmp_path, EDITS)


def signed(entry: dict[str, object]) -> bytes:
    """A line with the checksum that belongs to it."""
    text = json.dumps(entry, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def test_every_intact_edit_of_a_damaged_journal_comes_back_and_the_journal_is_kept(
    tmp_path: Path, journal: Written
) -> None:
    rng = random.Random(1)
    assert check_restored(tmp_path, journal, journal.content).damage == ""
    for damage in DAMAGES:
        for _ in range(10):
            check_restored(tmp_path, journal, damage(journal.content, rng) or b"x")
    for _ in range(60):
        check_restored(tmp_path, journal, damaged(journal.content, rng))


def test_lines_behind_a_damaged_one_are_kept_and_the_lost_ones_are_counted(tmp_path: Path, journal: Written) -> None:
    third, fourth = (journal.content.index(line) for line in journal.lines[2:4])
    data = bytearray(journal.content)
    data[third + 30] ^= 1
    data[fourth + 30] ^= 1
    restored = check_restored(tmp_path, journal, bytes(data))
    assert restored is not None
    # The first two lines are the header and the project as it was.
    assert "Restored 10 edits up to 20" in restored.summary()
    assert "Edit 12; lines 5 to 6 are damaged or missing; the journal as it was found is kept as" in restored.summary()


def test_a_changed_byte_in_the_first_line_costs_no_edit(tmp_path: Path, journal: Written) -> None:
    restored = check_restored(tmp_path, journal, b"X" + journal.content[1:])
    assert restored is not None
    assert restored.edits == EDITS
    assert "line 1 is damaged or missing" in restored.damage


def test_a_journal_with_other_line_ends_costs_no_edit(tmp_path: Path, journal: Written) -> None:
    restored = check_restored(tmp_path, journal, journal.content.replace(b"\n", b"\r\n"))
    assert restored is not None
    assert restored.edits == EDITS
    assert "something was changed in it" in restored.damage


def test_what_a_lost_line_makes_impossible_is_told_and_the_rest_of_the_edit_is_made(tmp_path: Path) -> None:
    project = Project(name="edit 0")
    save_project(project, tmp_path)
    journal = Journal(tmp_path, project)
    hall = FloorMap(np.full((20, 30), FREE, np.int8), 0.1)
    cells = np.array(hall.cells)
    cells[3, 4] = OCCUPIED
    journal.append(replace(project, floor_map=hall), "Load a map")
    journal.append(replace(project, floor_map=replace(hall, cells=cells), name="drawn"), "Draw and rename")
    journal.close()
    lines = journal.path.read_bytes().splitlines(keepends=True)
    journal.path.write_bytes(b"".join(lines[:2] + lines[3:]))
    restored = restore(tmp_path, project)
    assert restored is not None
    assert restored.project == replace(project, name="drawn")
    assert "line 3 is damaged or missing; line 4 is intact, but not possible without what is lost" in restored.damage


@pytest.mark.parametrize("change", [None, 5, True, "5", [5]])
def test_a_line_whose_change_is_none_is_told_and_the_others_are_made(
    tmp_path: Path, journal: Written, change: object
) -> None:
    lines = journal.content.splitlines(keepends=True)
    odd = signed({"line": len(lines), "change": change, "what": "odd", "at": 0.0})
    (tmp_path / FILE_NAME).write_bytes(b"".join(lines[:-1]) + odd)
    restored = restore(tmp_path, journal.project)
    assert restored is not None
    assert restored.project.name == f"edit {EDITS - 1}"
    assert f"line {len(lines)} is intact, but not possible" in restored.damage
    assert restored.kept is not None


@pytest.mark.parametrize("content", [b"", b"\n", b"no journal at all", bytes(5000)])
def test_a_file_that_is_no_journal_is_put_aside_and_told_once(tmp_path: Path, journal: Written, content: bytes) -> None:
    restored = check_restored(tmp_path, journal, content)
    assert restored is not None
    assert restored.summary().startswith("Nothing could be restored of the journal of unsaved edits; ")
    (tmp_path / FILE_NAME).unlink()
    assert restore(tmp_path, journal.project) is None


def test_a_journal_of_another_version_is_put_aside_unread(tmp_path: Path, journal: Written) -> None:
    later = signed({"line": 1, "journal": 3, "on_disk": []}) + journal.content[journal.content.index(b"\n") + 1 :]
    (tmp_path / FILE_NAME).write_bytes(later)
    restored = restore(tmp_path, journal.project)
    assert restored is not None
    assert (restored.project, restored.edits) == (journal.project, 0)
    assert "it was written by another version of this program (its format is 3, ours 2)" in restored.summary()
    assert restored.kept is not None
    assert restored.kept.read_bytes() == later
    assert not (tmp_path / FILE_NAME).exists()


def test_a_journal_of_the_first_format_is_still_read(tmp_path: Path) -> None:
    project = Project(name="edit 0", reflectors=ReflectorMap((Reflector(id="A", x=1.0, y=1.0),)))
    save_project(project, tmp_path)
    digests = [["project.yaml", "of a file that has changed since"]]
    lines = (
        {"journal": 1, "on_disk": digests, "change": {"name": "as it was"}},
        {"at": 1.7e9, "what": "Rename", "change": {"name": "edited"}},
        {"at": 1.7e9, "what": "Delete A", "change": {"reflectors": {"set": [], "removed": ["A"]}}},
    )
    (tmp_path / FILE_NAME).write_bytes(b"".join(signed(line) for line in lines))
    restored = restore(tmp_path, project)
    assert restored is not None
    assert restored.project == replace(project, name="edited", reflectors=ReflectorMap())
    assert (restored.edits, restored.last_edit, restored.damage) == (2, "Delete A", "")
    assert "project.yaml" in restored.foreign_changes


def test_a_journal_that_is_too_large_or_unreadable_is_put_aside(
    tmp_path: Path, journal: Written, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_replay, "SIZE_LIMIT", len(journal.content) - 1)
    restored = restore(tmp_path, journal.project)
    assert restored is not None
    assert f"it has {len(journal.content)} bytes" in restored.summary()
    assert restored.kept is not None
    assert restored.kept.read_bytes() == journal.content
    (tmp_path / FILE_NAME).mkdir()
    restored = restore(tmp_path, journal.project)
    assert restored is not None
    assert "it is a folder" in restored.summary()


def test_a_damaged_journal_is_kept_once_however_often_the_program_crashes(tmp_path: Path, journal: Written) -> None:
    (tmp_path / FILE_NAME).write_bytes(journal.content[:-20])
    kept = {restore(tmp_path, journal.project).kept for _ in range(3)}
    assert len(kept) == 1
    assert [path.name for path in tmp_path.glob(f"{FILE_NAME}.*")] == [path.name for path in kept]


def test_two_damaged_journals_of_one_second_get_two_names(tmp_path: Path, journal: Written) -> None:
    kept = set()
    for content in (b"first", b"second", b"third"):
        (tmp_path / FILE_NAME).write_bytes(content)
        kept.add(restore(tmp_path, journal.project).kept)
    assert len(kept) == 3
    assert {path.read_bytes() for path in kept} == {b"first", b"second", b"third"}


def test_a_journal_that_can_neither_be_read_nor_put_aside_is_an_error(
    tmp_path: Path, journal: Written, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_self: Path, _target: Path) -> None:
        raise PermissionError(13, "Permission denied")

    (tmp_path / FILE_NAME).write_bytes(b"no journal")
    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(FileFormatError, match=r"journal: cannot be read \(Permission denied\)"):
        restore(tmp_path, journal.project)
    assert (tmp_path / FILE_NAME).read_bytes() == b"no journal"


def test_changes_by_others_that_were_noticed_before_a_crash_are_asked_about_after_it(
    tmp_path: Path, journal: Written
) -> None:
    save_project(replace(journal.project, name="Theirs"), tmp_path)
    for _ in range(2):  # a second crash changes nothing
        restored = restore(tmp_path, load_project(tmp_path))
        assert restored is not None
        assert restored.foreign_changes == ("project.yaml",)
        following = Journal(tmp_path, load_project(tmp_path), restored)
        following.append(restored.project, "Restore")
        assert following.foreign_changes() == ("project.yaml",)
        following.close()
    with pytest.raises(Exception, match=r"changed on disk by somebody else: project\.yaml"):
        Journal(tmp_path, load_project(tmp_path), restored).save(restored.project)
    assert load_project(tmp_path).name == "Theirs"
