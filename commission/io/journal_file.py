"""An open journal: numbered lines that are appended, and whether it still is the file that has its name."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from commission.errors import FileFormatError
from commission.io.atomic import cannot_write, sync_folder
from commission.io.journal_lines import line
from commission.io.journal_place import FileId

CHANGED = "was changed by somebody else"


class JournalFile:
    """A journal that is being written."""

    def __init__(self, path: Path, entries: Sequence[dict[str, Any]]) -> None:
        """Begin a file with its first lines; it gets its name, and replaces what has it, when it is complete.

        Parameters
        ----------
        path : the journal; its folder is made when missing.
        entries : the first lines.

        Raises
        ------
        FileFormatError
            it cannot be written; what was there stays.
        """
        self._path = path
        self._number = self._size = 0
        beginning = path.with_name(f"{path.name}.new")
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | getattr(os, "O_BINARY", 0)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self.descriptor = os.open(beginning, flags, 0o644)
        except OSError as error:
            raise not_protected(path, error) from error
        try:
            self.append(*entries)
            if os.path.lexists(path):
                # What is replaced may be all there is of a crashed session; else the first edit need not wait for it.
                os.fsync(self.descriptor)
            beginning.replace(path)
        except (OSError, FileFormatError) as error:
            self.close()
            with suppress(OSError):
                beginning.unlink()
            raise not_protected(path, error) from error
        self._is_new = True

    def append(self, *entries: dict[str, Any]) -> None:
        """Write lines in one call of the system, all of them or (on a full disk) none; raises FileFormatError."""
        data = b"".join(line(number, entry) for number, entry in enumerate(entries, start=self._number + 1))
        try:
            written = os.write(self.descriptor, data)
            if written < len(data):
                raise OSError(f"only {written} of {len(data)} bytes were written")
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self.descriptor, self._size)
            raise not_protected(self._path, error) from error
        self._number += len(entries)
        self._size += len(data)

    def problem(self) -> str:
        """Say what others have done to the file that has the name; empty: nothing."""
        try:
            found = FileId.of(self._path)
        except OSError:
            return "was deleted by somebody else"
        if found != FileId.of(self.descriptor):
            return "was replaced by somebody else"
        return "" if os.fstat(self.descriptor).st_size == self._size else CHANGED

    def syncing(self) -> Callable[[], None]:
        """Return what brings all that is written until now to the disk; it may take long, and outlive the file."""
        try:
            descriptor, is_new = os.dup(self.descriptor), self._is_new
        except OSError:
            return lambda: None
        self._is_new = False

        def bring_to_disk() -> None:
            with suppress(OSError):
                os.fsync(descriptor)
            os.close(descriptor)
            if is_new:
                sync_folder(self._path.parent)

        return bring_to_disk

    def close(self) -> None:
        """Let go of it."""
        os.close(self.descriptor)

    def remove(self) -> None:
        """Let go of it and remove it, unless its name has come to stand for another file."""
        is_ours = "replaced" not in self.problem()
        self.close()
        if is_ours:
            self._path.unlink(missing_ok=True)


def not_protected(path: Path, error: OSError | FileFormatError) -> FileFormatError:
    """Error that says why edits are not in the journal."""
    problem = error.problem if isinstance(error, FileFormatError) else cannot_write(path, error).problem
    remedy = "a writable place with free space: a crash would lose this edit"
    return FileFormatError(path, "", problem, remedy)
