"""Files that are replaced whole or not at all: a crash or a full disk never leaves half a file behind."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError


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
    except OSError as error:
        raise _cannot_write(path, error) from error
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes files that only their owner may read; a project is shared like any other file of the user.
        temporary.chmod(0o644)
        temporary.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        temporary.unlink(missing_ok=True)


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


def _cannot_write(path: Path, error: OSError) -> FileFormatError:
    return FileFormatError(
        path, "", f"cannot be written ({error.strerror or error})", "a writable place with free space"
    )


def _sync_folder(folder: Path) -> None:
    """Make the new name itself survive a power cut, where the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
