from __future__ import annotations

import os
from pathlib import Path

import pytest

from commission.errors import FileFormatError
from commission.io.atomic import atomic_file, remove_half_written, staged, write_bytes, write_text


def test_file_is_replaced_and_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b.txt"
    write_text(path, "first")
    write_bytes(path, b"second")
    assert path.read_text() == "second"
    assert [p.name for p in path.parent.iterdir()] == ["b.txt"]


def test_error_while_writing_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "b.txt"
    write_text(path, "old")
    with pytest.raises(RuntimeError, match="stop"), atomic_file(path) as file:
        file.write(b"half of the n")
        raise RuntimeError("stop")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["b.txt"]


def test_place_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileFormatError, match="cannot be written"):
        write_text(tmp_path / "file" / "b.txt", "x")


def test_full_disk_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(FileFormatError, match=r"b\.txt: cannot be written \(No space left on device\)"):
        write_text(tmp_path / "b.txt", "x")
    assert list(tmp_path.iterdir()) == []


def test_text_that_no_file_can_hold_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="text that UTF-8 can hold"):
        write_text(tmp_path / "b.txt", "name: \ud800")


def test_a_name_that_no_file_can_have_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"cannot be written \(embedded null byte\)"):
        write_text(tmp_path / "a\0b" / "c.txt", "x")


def test_files_that_belong_together_come_together_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    with pytest.raises(FileFormatError) as refused, staged(folder) as scratch:
        write_text(scratch / "first.txt", "x")
        write_text(scratch / "first.txt" / "second.txt", "x")
    # The place that the engineer knows, not the scratch folder.
    assert refused.value.path == folder / "first.txt" / "second.txt"
    assert list(tmp_path.iterdir()) == []
    with staged(folder, last="a.txt") as scratch:
        write_text(scratch / "a.txt", "1")
        write_text(scratch / "deep" / "b.txt", "2")
        assert [path.name for path in folder.iterdir()] == [scratch.name]
    assert (folder / "a.txt").read_text() + (folder / "deep" / "b.txt").read_text() == "12"
    assert sorted(path.name for path in folder.iterdir()) == ["a.txt", "deep"]


def test_ctrl_c_leaves_an_older_folder_as_it_was(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "old")
    with pytest.raises(KeyboardInterrupt), staged(tmp_path) as scratch:
        write_text(scratch / "a.txt", "new")
        raise KeyboardInterrupt
    assert (tmp_path / "a.txt").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_what_a_killed_program_left_is_removed_and_nothing_else(tmp_path: Path) -> None:
    stays = [".project.yaml.tmp", ".other.abcdefgh.tmp", "project.yaml", f".commission.writing.{os.getppid()}.abc"]
    goes = [".project.yaml.abc_ef12.tmp", ".commission.writing.999999999.abc", f".commission.writing.{os.getpid()}.x"]
    for name in (*stays, *goes):
        if "writing" in name:
            write_text(tmp_path / name / "half.txt", "x")
        else:
            write_text(tmp_path / name, "x")
    remove_half_written(tmp_path, ["project.yaml", "map.png"])
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(stays)
    remove_half_written(tmp_path / "nowhere", [])
