"""Files of kernels are shared, survive damage, and do not pile up."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from commission.compiled import kernel_files
from commission.compiled.kernel_files import FOLDER, KernelFiles, sweep, usual_folders

DAY = 86400.0


def file_of(folder: Path, name: str, size: int = 100, days: float = 0.0) -> Path:
    """Write a file that was last used some days ago."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"x" * size)
    then = time.time() - days * DAY
    os.utime(path, (then, then))
    return path


def test_content_is_read_as_it_was_written(tmp_path: Path) -> None:
    kept = KernelFiles([tmp_path / "first", tmp_path / "last"])
    assert kept.read("a") is None
    kept.write("a", b"code")
    kept.write("a", b"code")
    assert kept.read("a") == b"code"
    assert [path.name for path in (tmp_path / "first" / FOLDER).iterdir()] == ["a"]
    assert not (tmp_path / "last").exists()


@pytest.mark.parametrize("damage", [lambda c: b"", lambda c: c[:-1], lambda c: c[:2], lambda c: c[:-1] + b"?"])
def test_damaged_content_is_as_good_as_none(tmp_path: Path, damage) -> None:
    kept = KernelFiles([tmp_path, tmp_path / "last"])
    kept.write("a", b"code")
    path = tmp_path / FOLDER / "a"
    path.write_bytes(damage(path.read_bytes()))
    assert kept.read("a") is None


def test_second_folder_serves_where_the_first_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "first").write_text("a file stands where the folder should")
    kept = KernelFiles([tmp_path / "first", tmp_path / "last"])
    kept.write("a", b"code")
    assert kept.read("a") == b"code"
    assert (tmp_path / "last").stat().st_mode & 0o777 == 0o700


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows gives each user a temporary folder")
def test_folder_that_others_can_write_to_is_neither_read_nor_written(tmp_path: Path) -> None:
    (tmp_path / "first").write_text("a file stands where the folder should")
    kept = KernelFiles([tmp_path / "first", tmp_path / "last"])
    kept.write("a", b"code")
    (tmp_path / "last").chmod(0o777)
    assert kept.read("a") is None
    kept.write("b", b"code")
    assert [path.name for path in (tmp_path / "last" / FOLDER).iterdir()] == ["a"]


def test_nowhere_to_write_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    kept = KernelFiles([tmp_path / "file" / "first", tmp_path / "file" / "last"])
    kept.write("a", b"code")
    assert kept.read("a") is None


def test_files_go_when_they_were_not_used_for_thirty_days(tmp_path: Path) -> None:
    young = file_of(tmp_path, f"{FOLDER}/young.kernel", days=29.9)
    old = file_of(tmp_path, f"{FOLDER}/old.kernel", days=30.1)
    sweep(tmp_path)
    assert young.exists()
    assert not old.exists()


def test_reading_a_file_keeps_it(tmp_path: Path) -> None:
    kept = KernelFiles([tmp_path, tmp_path / "last"])
    kept.write("a", b"code")
    path = tmp_path / FOLDER / "a"
    for days, refreshed in ((0.9, False), (29.0, True)):
        then = time.time() - days * DAY
        os.utime(path, (then, then))
        assert kept.read("a") == b"code"
        assert (time.time() - path.stat().st_mtime < 60.0) == refreshed


def test_beyond_the_size_limit_the_longest_unused_go(tmp_path: Path) -> None:
    files = [file_of(tmp_path, f"{FOLDER}/{days}.kernel", size=100, days=days) for days in range(5)]
    sweep(tmp_path, max_total=300)
    assert [path.exists() for path in files] == [True, True, True, False, False]
    sweep(tmp_path, max_total=299)
    assert [path.exists() for path in files] == [True, True, False, False, False]


def test_unfinished_files_go_after_a_day(tmp_path: Path) -> None:
    being_written = file_of(tmp_path, f"{FOLDER}/0123.tmp", days=0.9)
    left_behind = file_of(tmp_path, f"{FOLDER}/4567.tmp", days=1.1)
    sweep(tmp_path)
    assert being_written.exists()
    assert not left_behind.exists()


def test_folders_of_earlier_versions_go_with_their_last_file(tmp_path: Path) -> None:
    file_of(tmp_path, "e16bf9bebdfa8d7b/localization_0f3a/kalman.predict-12.py311.nbi", days=31)
    file_of(tmp_path, "0000f9bebdfa8d7b/localization_0f3a/kalman.predict-12.py311.nbi", days=31)
    used = file_of(tmp_path, "0000f9bebdfa8d7b/localization_0f3a/kalman.predict-12.py311.1.nbc", days=1)
    file_of(tmp_path, "commission-kernels-1/a.kernel", days=31)
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == [used.parents[1]]
    assert list(used.parent.iterdir()) == [used]


def test_files_of_other_programs_are_left_alone(tmp_path: Path) -> None:
    foreign = [
        file_of(tmp_path, "theirs_0f3a/kernel.py311.nbi", days=400),
        file_of(tmp_path, "notes.txt", days=400),
        file_of(tmp_path, "commission-kernels-2-mine/notes.txt", days=400),
    ]
    (tmp_path / "empty").mkdir()
    sweep(tmp_path, max_total=0)
    assert all(path.exists() for path in foreign)
    assert (tmp_path / "empty").exists()


def test_writing_sweeps_at_once_and_then_now_and_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    swept: list[Path] = []
    monkeypatch.setattr(kernel_files, "sweep", swept.append)
    kept = KernelFiles([tmp_path, tmp_path / "last"])
    for i in range(200):
        kept.write(str(i), b"")
    assert swept == [tmp_path]
    kept.write("200", b"")
    assert swept == [tmp_path] * 2


def test_chosen_folder_comes_before_the_user_s(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/some/cache")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    assert usual_folders()[0] == Path("/some/cache/commission/kernels")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/chosen")
    assert usual_folders()[0] == Path("/chosen")


def test_user_without_a_home_has_the_temporary_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    (only,) = usual_folders()
    assert only.name.startswith("commission-kernels-")
