"""Files that are replaced whole or not at all: a crash or a full disk never leaves half a file behind."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError

STAGING_PREFIX = ".commission.writing."
"""Begins the name of a folder in which files are complete before the first of them is put in its place."""
_HALF_WRITTEN = re.compile(r"\.(?P<name>.+)\.[a-z0-9_]{8}\.tmp")
_STAGING = re.compile(rf"{re.escape(STAGING_PREFIX)}(?P<process>\d+)\.\w+")


@contextmanager
def atomic_file(path: Path) -> Generator[IO[bytes]]:
    """Open a temporary file beside `path`; after the block it takes the place of `path`, after an error it is gone.

    Parameters
    ----------
    path : file to write; its folder is made when missing.

    Raises
    ------
    FileFormatError
        the file cannot be written (no permission, disk full).
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
    except (OSError, ValueError) as error:
        raise cannot_write(path, error) from error
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes files that only their owner may read; a project is shared like any other file of the user.
        temporary.chmod(0o644)
        temporary.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def staged(folder: Path, *, last: str = "") -> Generator[Path]:
    """Write several files that belong together: in the block into a folder of their own, after it to their place.

    A full disk, an error or Ctrl-C in the block leaves `folder` as it was, and leaves none where there was none.

    Parameters
    ----------
    folder : where the files belong; made when missing.
    last : name of the file that is put in its place after all others, since it refers to them.

    Raises
    ------
    FileFormatError
        a file cannot be written; it is named by its place in `folder`.
    """
    made = _missing(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f"{STAGING_PREFIX}{os.getpid()}.", dir=folder))
    except (OSError, ValueError) as error:
        _remove_empty(made)
        raise cannot_write(folder, error) from error
    try:
        yield scratch
        _put_in_place(scratch, folder, last)
    except FileFormatError as error:
        if not error.path.is_relative_to(scratch):
            raise
        place = folder / error.path.relative_to(scratch)
        raise FileFormatError(place, error.where, error.problem, error.remedy) from error
    except OSError as error:
        raise cannot_write(folder, error) from error
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        _remove_empty(made)


def remove_half_written(folder: Path, names: Iterable[str]) -> None:
    """Remove what a killed program has left of files that it was about to write.

    Parameters
    ----------
    folder : where to look.
    names : files of which a half-written one is removed; those of other programs are not ours to judge.
    """
    wanted = set(names)
    with suppress(OSError):
        for path in folder.iterdir():
            half, staging = _HALF_WRITTEN.fullmatch(path.name), _STAGING.fullmatch(path.name)
            if staging is not None and not _is_running(int(staging["process"])):
                shutil.rmtree(path, ignore_errors=True)
            elif half is not None and half["name"] in wanted:
                path.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    """Whether a process of this computer is there, ourselves apart."""
    try:
        os.kill(process, 0)
    except OSError as error:
        return isinstance(error, PermissionError)
    return process != os.getpid()


def _put_in_place(scratch: Path, folder: Path, last: str) -> None:
    """Move the files of a scratch folder, which are on the disk already."""
    files = sorted((path for path in scratch.rglob("*") if path.is_file()), key=lambda path: path.name == last)
    for path in files:
        place = folder / path.relative_to(scratch)
        place.parent.mkdir(parents=True, exist_ok=True)
        path.replace(place)
    for parent in {folder, *((folder / path.relative_to(scratch)).parent for path in files)}:
        sync_folder(parent)


def _missing(folder: Path) -> list[Path]:
    """Folders that have to be made for this one, itself first."""
    with suppress(OSError, ValueError):
        return [path for path in (folder, *folder.parents) if not path.exists()]
    return []


def _remove_empty(folders: list[Path]) -> None:
    """Remove those that hold nothing, the innermost first."""
    with suppress(OSError, ValueError):
        for folder in folders:
            folder.rmdir()


def write_bytes(path: Path, data: bytes) -> None:
    """Replace the file by `data`, or leave it as it was."""
    with atomic_file(path) as file:
        file.write(data)


def write_text(path: Path, text: str) -> None:
    """Replace the file by `text` in UTF-8, or leave it as it was."""
    try:
        data = text.encode("utf-8")
    except UnicodeEncodeError as error:
        found = f"the text holds {text[error.start]!r}, which is no character"
        raise FileFormatError(path, f"character {error.start}", found, "text that UTF-8 can hold") from error
    write_bytes(path, data)


def cannot_write(path: Path, error: Exception) -> FileFormatError:
    """Error that says why the system does not take a file."""
    reason = getattr(error, "strerror", None) or error
    return FileFormatError(path, "", f"cannot be written ({reason})", "a writable place with free space")


def sync_folder(folder: Path) -> None:
    """Make new names in a folder survive a power cut, where the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
