from __future__ import annotations

import os
from pathlib import Path

import pytest

from commission.errors import FileFormatError
from commission.io.atomic import atomic_file, write_bytes, write_text


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
