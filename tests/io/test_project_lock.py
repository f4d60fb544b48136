"""One writer per project."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import socket
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from commission.errors import ProjectError
from commission.io import project_lock
from commission.io.project_lock import FILE_NAME, NOBODY_KNOWN, Hold, ProjectLock


def hold_until_killed(folder: Path, told: Connection) -> None:
    lock = ProjectLock(folder)
    told.send(lock.look())
    told.recv()


def test_the_second_one_is_told_who_holds_it_and_gets_it_when_it_is_free(tmp_path: Path) -> None:
    first, second = ProjectLock(tmp_path), ProjectLock(tmp_path)
    assert first.look() is first.look() is Hold.OURS
    assert second.look() is Hold.THEIRS
    assert second.holder is not None
    assert (second.holder.host, second.holder.process) == (socket.gethostname(), os.getpid())
    assert str(second.holder).startswith(f"process {os.getpid()} on {socket.gethostname()} since 20")
    first.release()
    assert not (tmp_path / FILE_NAME).exists()
    assert second.look() is Hold.OURS
    assert second.holder is None
    second.release()


def test_a_killed_holder_blocks_nobody_though_its_file_stays(tmp_path: Path) -> None:
    context = multiprocessing.get_context("forkserver")
    ours, theirs = context.Pipe()
    child = context.Process(target=hold_until_killed, args=(tmp_path, theirs))
    child.start()
    assert ours.recv() is Hold.OURS
    lock = ProjectLock(tmp_path)
    assert lock.look() is Hold.THEIRS
    assert lock.holder is not None
    assert lock.holder.process == child.pid
    child.kill()
    child.join()
    assert (tmp_path / FILE_NAME).exists()
    assert lock.look() is Hold.OURS
    assert lock.left_by is None
    lock.release()


def test_whoever_takes_over_waits_for_the_last_line_of_the_holder_before(tmp_path: Path) -> None:
    first, second = ProjectLock(tmp_path), ProjectLock(tmp_path)
    first.look()
    second.look()
    second.take_over()
    assert second.look() is Hold.TAKING_OVER
    # The first one looks before it writes, and now knows better.
    assert first.look() is Hold.THEIRS
    assert second.look() is Hold.OURS
    assert first.look() is Hold.THEIRS
    first.take_over()
    assert first.look() is Hold.TAKING_OVER
    assert second.look() is Hold.THEIRS
    assert first.look() is Hold.OURS
    first.release()


def test_a_holder_that_hangs_is_not_waited_for_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(project_lock, "PATIENCE_S", 0.0)
    hanging, second = ProjectLock(tmp_path), ProjectLock(tmp_path)
    hanging.look()
    second.look()
    second.take_over()
    assert second.look() is Hold.OURS
    assert hanging.look() is Hold.THEIRS


def test_of_two_that_take_over_at_once_one_has_it(tmp_path: Path) -> None:
    locks = [ProjectLock(tmp_path) for _ in range(3)]
    for lock in locks:
        lock.look()
    for lock in locks[1:]:
        lock.take_over()
    for _ in range(3):
        held = [lock.look() for lock in locks]
    assert held == [Hold.THEIRS, Hold.THEIRS, Hold.OURS]


def test_a_lock_whose_file_is_deleted_or_replaced_is_taken_again(tmp_path: Path) -> None:
    lock = ProjectLock(tmp_path)
    lock.look()
    (tmp_path / FILE_NAME).unlink()
    assert lock.look() is Hold.OURS
    (tmp_path / "copy").write_text("of a sync client")
    (tmp_path / "copy").replace(tmp_path / FILE_NAME)
    assert lock.look() is Hold.OURS
    assert ProjectLock(tmp_path).look() is Hold.THEIRS
    lock.release()


def test_a_folder_that_does_not_exist_is_nobodys_until_it_does(tmp_path: Path) -> None:
    folder = tmp_path / "hall"
    lock = ProjectLock(folder)
    assert lock.look() is Hold.NOBODYS
    assert not folder.exists()
    folder.mkdir()
    assert lock.look() is Hold.OURS
    shutil.rmtree(folder)
    assert lock.look() is Hold.NOBODYS
    lock.release()


def test_a_file_system_without_locks_keeps_nobody_from_working(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(_file: int) -> bool:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(project_lock, "_try_lock", no_locks)
    assert ProjectLock(tmp_path).look() is Hold.NOBODYS


def test_one_that_another_computer_never_let_go_of_is_taken_and_named(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text(json.dumps({"host": "laptop", "process": 7, "since": "2026-01-05 14:03:00"}))
    lock = ProjectLock(tmp_path)
    assert lock.look() is Hold.OURS
    assert str(lock.left_by) == "process 7 on laptop since 2026-01-05 14:03:00"
    lock.release()


@pytest.mark.parametrize("content", [b"", b"[]", b'{"host": 1}', b"\xff" * 9000])
def test_a_file_that_says_nothing_is_no_obstacle(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE_NAME).write_bytes(content)
    lock = ProjectLock(tmp_path)
    assert lock.look() is Hold.OURS
    assert lock.left_by is None
    (tmp_path / FILE_NAME).write_bytes(content)
    other = ProjectLock(tmp_path)
    assert other.look() is Hold.THEIRS
    assert other.holder == NOBODY_KNOWN
    lock.release()


def test_a_folder_that_cannot_be_written_cannot_be_taken_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = ProjectLock(tmp_path), ProjectLock(tmp_path)
    first.look()

    def refuse(_self: Path, _target: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(ProjectError, match="cannot be taken over: Permission denied"):
        second.take_over()
    assert (first.look(), second.look()) == (Hold.OURS, Hold.THEIRS)
    first.release()
