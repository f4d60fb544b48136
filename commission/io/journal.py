"""Autosave: every edit is appended to a journal beside the project at once, and made again after a crash.

Guarantee: an edit is in the hands of the system when `append` returns, so that a killed program loses nothing; it is on
the disk at most a second later, so that a power cut loses at most the last second. A journal needs nothing from the
project's files but a floor map that was never edited; a line that was cut off or damaged ends what is restored.
"""

from __future__ import annotations

import json
import os
import threading
import time
import zlib
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from commission.errors import CommissionError, FileFormatError, ProjectError
from commission.io.fingerprint import Fingerprint
from commission.io.project_file import save_project
from commission.io.project_parts import apply, change
from commission.io.reading import cannot_read, check_size
from commission.site.project import Project

FILE_NAME = ".commission.journal"
SYNC_INTERVAL_S = 1.0
"""Longest time that an edit is only in the system's memory [s]."""
SIZE_LIMIT = 2_000_000_000
"""Bytes of a journal: a floor map that was changed all over ten thousand times."""
FORMAT = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Restored:
    """What a journal gave back after a crash."""

    project: Project
    """The project as last edited."""
    edits: int
    """Number of edits made again."""
    last_edit: str
    """Name of the newest of them."""
    last_at: datetime
    """When it was made."""
    foreign_changes: tuple[str, ...] = ()
    """Files that somebody else has changed since the journal began: ask before they are overwritten."""
    damage: str = ""
    """Why the journal could not be read to its end; empty: it could."""

    def summary(self) -> str:
        """Return what was restored as one line."""
        edits = f"{self.edits} edit{'' if self.edits == 1 else 's'}"
        text = f"Restored {edits} up to {self.last_at:%Y-%m-%d %H:%M:%S}: {self.last_edit}"
        if self.damage:
            text += f"; the rest of the journal is lost ({self.damage})"
        if self.foreign_changes:
            text += f"; meanwhile changed on disk by somebody else: {', '.join(self.foreign_changes)}"
        return text


class Journal:
    """The journal of one project that is being edited; the file appears with the first edit.

    Parameters
    ----------
    folder : the project's folder.
    project : the project as its files are.
    on_disk : those files; read now when None.
    """

    def __init__(self, folder: Path, project: Project, on_disk: Fingerprint | None = None) -> None:
        self.path = folder / FILE_NAME
        self._folder = folder
        self._saved = self._journaled = project
        self._on_disk = on_disk or Fingerprint.of(folder)
        self._has_map = False
        self._descriptor: int | None = None
        self._lock = threading.Lock()
        self._unsynced = threading.Event()
        self._closed = threading.Event()
        self._syncer: threading.Thread | None = None

    def append(self, project: Project, what: str) -> None:
        """Write down an edit (an undo and a redo are edits too).

        Parameters
        ----------
        project : the project after it.
        what : its name as the engineer reads it, like `Move 3 reflectors`.

        Raises
        ------
        FileFormatError
            the journal cannot be written (disk full): the edit stands, but a crash would lose it.
        """
        with self._lock:
            has_map = self._descriptor is not None and self._has_map
            values = change(self._journaled, project, with_map=has_map)
            if not has_map and project.floor_map is not self._journaled.floor_map:
                # The first edit of the map writes all of it: from here on the files may be of any state.
                values |= {"floor_map": change(None, project)["floor_map"]}
                has_map = True
            line = _line({"at": time.time(), "what": what, "change": values})
            if self._descriptor is None:
                self._begin(line)
            else:
                self._write(self._descriptor, line)
            self._journaled, self._has_map = project, has_map
            self._unsynced.set()

    def save(self, project: Project, *, overwrite: bool = False) -> None:
        """Save the project and remove the journal.

        Parameters
        ----------
        project : what to save.
        overwrite : whether files that somebody else has changed since they were read or saved are replaced.

        Raises
        ------
        ProjectError
            somebody else has changed the files, and `overwrite` is False: nothing is written.
        FileFormatError
            a file cannot be written; the journal stays.
        """
        foreign = () if overwrite else self._on_disk.changed_files()
        if foreign:
            raise ProjectError(
                f"changed on disk by somebody else: {', '.join(foreign)}; expected as read or last saved"
            )
        self.append(project, "Save")
        with self._lock:
            if self._descriptor is not None:
                # A save that is killed halfway leaves files of two states; the mark says that they are our own.
                self._write(self._descriptor, _line({"saving": True}))
                os.fsync(self._descriptor)
            save_project(project, self._folder)
            self._on_disk = Fingerprint.of(self._folder)
            self._saved = self._journaled = project
            self._remove()

    def foreign_changes(self) -> tuple[str, ...]:
        """Files that somebody else has changed since they were read or last saved."""
        return self._on_disk.changed_files()

    def discard(self) -> None:
        """Remove the journal: its edits are not wanted."""
        with self._lock:
            self._journaled = self._saved
            self._remove()

    def close(self) -> None:
        """Bring what is written to the disk and stop; the journal stays for the next start."""
        self._closed.set()
        self._unsynced.set()
        if self._syncer is not None:
            self._syncer.join()
        with self._lock:
            self._close_file()

    def _begin(self, first: bytes) -> None:
        """Start a file with the project (without its map) as it was, and the line of the first edit.

        It takes the place of a crashed session's journal only when it is complete, since it may hold what was restored.
        """
        whole = change(None, self._journaled, with_map=False)
        header = _line({"journal": FORMAT, "on_disk": list(self._on_disk.digests), "change": whole})
        beginning = self.path.with_name(f"{FILE_NAME}.new")
        descriptor = None
        try:
            # A new project's folder appears with its first edit.
            self._folder.mkdir(parents=True, exist_ok=True)
            flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | getattr(os, "O_BINARY", 0)
            descriptor = os.open(beginning, flags, 0o644)
            self._write(descriptor, header + first)
            os.fsync(descriptor)
            beginning.replace(self.path)
        except (OSError, FileFormatError) as error:
            if descriptor is not None:
                os.close(descriptor)
            if isinstance(error, FileFormatError):
                raise
            raise _cannot_write(self.path, error) from error
        self._descriptor = descriptor
        if self._syncer is None:
            self._syncer = threading.Thread(target=self._sync_forever, name="journal", daemon=True)
            self._syncer.start()

    def _write(self, descriptor: int, data: bytes) -> None:
        """Append in one call of the system, whole or (after a full disk) taken back."""
        size = os.fstat(descriptor).st_size
        try:
            written = os.write(descriptor, data)
            if written < len(data):
                raise OSError(f"only {written} of {len(data)} bytes were written")
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(descriptor, size)
            raise _cannot_write(self.path, error) from error

    def _sync_forever(self) -> None:
        """Bring lines to the disk, at most once a second; a slow disk delays nobody who edits."""
        while not self._closed.is_set():
            self._unsynced.wait()
            self._unsynced.clear()
            with self._lock:
                descriptor = None if self._descriptor is None else os.dup(self._descriptor)
            if descriptor is not None:
                with suppress(OSError):
                    os.fsync(descriptor)
                os.close(descriptor)
            self._closed.wait(0.5 * SYNC_INTERVAL_S)

    def _remove(self) -> None:
        self._close_file()
        self.path.unlink(missing_ok=True)

    def _close_file(self) -> None:
        if self._descriptor is not None:
            with suppress(OSError):
                os.fsync(self._descriptor)
            os.close(self._descriptor)
            self._descriptor = None


def restore(folder: Path, project: Project) -> Restored | None:
    """Make the edits of a crashed session again.

    Parameters
    ----------
    folder : the project's folder.
    project : the project as its files are now; its floor map is used where the journal holds none.

    Returns
    -------
    restored : None when there is no journal, or none of its edits can be read. The journal stays until the next edit or
        save: pass the restored project to a new `Journal` by `append` before anything else.

    Raises
    ------
    FileFormatError
        the journal cannot be read at all (no permission, larger than SIZE_LIMIT).
    """
    path = folder / FILE_NAME
    if not path.is_file():
        return None
    check_size(path, SIZE_LIMIT)
    replay = _Replay(path, project)
    try:
        with path.open("rb") as file:
            for number, line in enumerate(file, start=1):
                replay.read(number, line)
                if replay.damage:
                    break
    except OSError as error:
        raise cannot_read(path, error) from error
    return replay.result(folder)


class _Replay:
    """The edits of a journal, line by line."""

    def __init__(self, path: Path, project: Project) -> None:
        self._path = path
        self._project = self._loaded = project
        self._edits = 0
        self._what = ""
        self._at = 0.0
        self._digests: tuple[tuple[str, str], ...] = ()
        self._saving = False
        self.damage = ""

    def read(self, number: int, line: bytes) -> None:
        """Make the edit of a line; a line that is damaged is noted."""
        entry = _entry(line)
        if entry is None:
            self.damage = f"line {number} is damaged or cut off"
            return
        try:
            if (number == 1) != (entry.get("journal") == FORMAT):
                raise ValueError(f"line {number} is out of place")
            if number == 1:
                self._digests = tuple((str(name), str(digest)) for name, digest in entry["on_disk"])
            self._saving = "saving" in entry
            if self._saving:
                return
            self._project = apply(self._project, entry["change"], self._path)
            if number > 1:
                what, at = str(entry["what"]), float(entry["at"])
                self._edits, self._what, self._at = self._edits + bool(entry["change"]), what, at
        except (CommissionError, LookupError, TypeError, ValueError) as error:
            self.damage = f"line {number}: {error}"

    def result(self, folder: Path) -> Restored | None:
        """Return what was restored."""
        was_saved = self._saving and self._project == self._loaded
        if self._edits == 0 or was_saved:
            return None
        foreign = () if self._saving else Fingerprint(folder, self._digests).changed_files()
        when = datetime.fromtimestamp(self._at)
        return Restored(
            project=self._project,
            edits=self._edits,
            last_edit=self._what,
            last_at=when,
            foreign_changes=foreign,
            damage=self.damage,
        )


def _line(entry: dict[str, Any]) -> bytes:
    """Line with a checksum in front: half a line, or one that a disk has mangled, is not mistaken for a whole one."""
    text = json.dumps(entry, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode("ascii")
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _entry(line: bytes) -> dict[str, Any] | None:
    """Entry of a line; None when it is damaged."""
    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        entry = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return entry if isinstance(entry, dict) else None


def _cannot_write(path: Path, error: OSError) -> FileFormatError:
    found = f"cannot be written ({error.strerror or error})"
    return FileFormatError(path, "", found, "a writable place with free space: a crash would lose this edit")
