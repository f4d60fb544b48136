"""Autosave: every edit is appended to a journal beside the project at once, and made again after a crash.

Guarantee: an edit is in the hands of the system when `append` returns, so that a killed program loses nothing; it is on
the disk at most a second later, so that a power cut loses at most the last second. A journal needs nothing from the
project's files but a floor map that was never edited; where it is itself lost (deleted, replaced, its folder gone), it
is begun anew with everything. What it gives back is the business of `journal_replay`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from commission.errors import FileFormatError, ProjectError
from commission.io.atomic import remove_half_written
from commission.io.fingerprint import Fingerprint
from commission.io.journal_file import CHANGED, JournalFile
from commission.io.journal_lines import FORMAT
from commission.io.journal_place import FILE_NAME, FileId, rescue_folder
from commission.io.journal_replay import Restored, set_aside
from commission.io.project_file import save_project
from commission.io.project_lock import FILE_NAME as LOCK_NAME
from commission.io.project_parts import change
from commission.site.project import Project

SYNC_INTERVAL_S = 1.0
"""Longest time that an edit is only in the system's memory [s]."""


@dataclass(frozen=True, slots=True)
class News:
    """Something about the journal that the engineer has to know."""

    text: str
    """One line."""
    is_good: bool = False
    """Whether all is well again."""


class Journal:
    """The journal of one project that is being edited; the file appears with the first edit.

    Parameters
    ----------
    folder : the project's folder.
    project : the project as its files are.
    restored : what a crashed session's journal gave back: what somebody else had changed by then stays known, and its
        journal is replaced when the first edit has been written. Any other journal that is found is put aside.
    """

    def __init__(self, folder: Path, project: Project, restored: Restored | None = None) -> None:
        self.path = folder / FILE_NAME
        self._folder = folder
        self._saved = self._journaled = project
        self._on_disk = (restored and restored.on_disk) or Fingerprint.of(folder)
        # Files that hold nothing but what the next journal will hold, too.
        self._replaceable = {restored.source} if restored else set[FileId | None]()
        self._superseded = restored and restored.journal
        self._folder_was_there = folder.is_dir()
        self._file: JournalFile | None = None
        self._has_map = self._needs_all = False
        self._unprotected: tuple[Project, str] | None = None
        self._news: list[News] = []
        self._news_once_written: list[News] = []
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
            the journal cannot be written (disk full): the edit stands, but a crash would lose it; `check` tries again.
        """
        with self._lock:
            self._unprotected = (project, what)
            self._see_to_file()
            self._write_down(project, what)

    def check(self) -> tuple[News, ...]:
        """Look after the journal; call it every second or so. Return what the engineer has to know.

        A journal that is not there any more is begun anew, and edits for which there was no space are written down.
        """
        with self._lock:
            was_unprotected = self._unprotected is not None
            self._see_to_file()
            if self._unprotected is not None:
                try:
                    self._write_down(*self._unprotected)
                except FileFormatError as error:
                    if not was_unprotected:
                        self._news.append(News(str(error)))
                else:
                    if was_unprotected:
                        self._news.append(News(f"all edits are in the journal again: {self.path}", is_good=True))
            news, self._news = tuple(self._news), []
            return news

    @property
    def kept_elsewhere(self) -> Path | None:
        """Folder in which edits are kept while the project's own is gone; None: they are kept beside the project."""
        return None if self.path.parent == self._folder else self.path.parent

    @property
    def is_protecting(self) -> bool:
        """Whether every edit is written down."""
        return self._unprotected is None

    def save(self, project: Project, *, overwrite: bool = False) -> None:
        """Save the project and remove the journal, but for edits that come meanwhile: call it from any thread.

        Parameters
        ----------
        project : what to save: the project of the last `append`, or an earlier one.
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
        with self._lock:
            self._mark_saving()
            bring_to_disk = self._syncing()
        bring_to_disk()
        try:
            save_project(project, self._folder)
        except FileFormatError:
            with self._lock, suppress(FileFormatError):
                if self._file is not None:
                    self._file.append({"saving": False})
            raise
        on_disk = Fingerprint.of(self._folder)
        with self._lock:
            self._on_disk, self._saved = on_disk, project
            self._folder_was_there = True
            self._begin_after_save(project)

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

    def _mark_saving(self) -> None:
        """Write down that a save begins: where it is killed halfway, files of two states are our own.

        What is to be saved must be in the journal then. Where that has no space there may be some for the project.
        """
        with suppress(FileFormatError):
            self._see_to_file()
            if self._file is None:
                self._needs_all = True
                self._write_down(*(self._unprotected or (self._journaled, "Save")))
            if self._file is not None:
                self._file.append({"saving": True})

    def _begin_after_save(self, project: Project) -> None:
        """Remove the journal of what is saved; edits that came meanwhile begin the next one."""
        if self._unprotected is None and self._journaled == project:
            self._remove()
            return
        later = self._unprotected or (self._journaled, "edits while it was saved")
        self._close_file()
        self.path = self._folder / FILE_NAME
        self._journaled, self._has_map, self._needs_all = project, False, False
        self._unprotected = later
        with suppress(FileFormatError):
            self._write_down(*later)

    def _write_down(self, project: Project, what: str) -> None:
        """Append an edit, or begin a file with it; the lock is held."""
        has_map = self._needs_all or (self._file is not None and self._has_map)
        values = change(None if self._needs_all else self._journaled, project, with_map=has_map)
        if not has_map and project.floor_map is not self._journaled.floor_map:
            # The first edit of the map writes all of it: from here on the files may be of any state.
            values |= {"floor_map": change(None, project)["floor_map"]}
            has_map = True
        if not values and self._file is None and not self._needs_all:
            # Nothing differs from the files: a project that was read again, or an edit that was taken back.
            self._journaled, self._unprotected = project, None
            return
        entry = {"at": time.time(), "what": what, "change": values}
        if self._file is None:
            self._begin(entry)
        else:
            self._file.append(entry)
        self._journaled, self._has_map, self._unprotected, self._needs_all = project, has_map, None, False
        self._news += self._news_once_written
        self._news_once_written.clear()
        self._unsynced.set()

    def _see_to_file(self) -> None:
        """Let go of a journal that is lost, or whose folder is, and have the next one begin with everything."""
        is_folder_lost = self._folder_was_there and not self._folder.is_dir()
        is_elsewhere = self.path.parent != self._folder
        if is_folder_lost and not is_elsewhere:
            self.path = rescue_folder(self._folder) / FILE_NAME
            lost = f"the project's folder {self._folder} was deleted or moved; all edits are kept in {self.path.parent}"
        elif is_elsewhere and not is_folder_lost:
            self._superseded = self.path
            self.path = self._folder / FILE_NAME
            lost = f"the project's folder is there again, and edits are kept in it: {self._folder}"
        elif self._file is not None and (problem := self._file.problem()):
            lost = f"the journal of unsaved edits {problem}; it was begun anew with the whole project: {self.path}"
        else:
            return
        self._close_file()
        self._needs_all = True
        self._unprotected = self._unprotected or (self._journaled, "everything until then")
        self._news_once_written.append(News(lost, is_good=is_elsewhere))

    def _begin(self, entry: dict[str, Any]) -> None:
        """Start a file with the project as it was, unless the first edit holds all of it; the lock is held."""
        first = [{"journal": FORMAT, "on_disk": list(self._on_disk.digests)}, entry]
        if not self._needs_all:
            first.insert(1, {"change": change(None, self._journaled, with_map=False)})
        self._put_aside_what_is_there()
        # A new project's folder appears with its first edit.
        self._file = JournalFile(self.path, first)
        self._folder_was_there = self._folder_was_there or self.path.parent == self._folder
        if self._superseded is not None and self._superseded != self.path:
            _remove_with_folder(self._superseded)
        self._superseded = None
        if self._syncer is None:
            self._syncer = threading.Thread(target=self._sync_forever, name="journal", daemon=True)
            self._syncer.start()

    def _put_aside_what_is_there(self) -> None:
        """Keep a journal that is neither ours nor the one that was restored: nobody has read it."""
        with suppress(OSError):
            if FileId.of(self.path) not in self._replaceable:
                kept = set_aside(self.path, "found")
                self._news_once_written.append(
                    News(f"another journal of unsaved edits lay there; it is kept as {kept}")
                )

    def _sync_forever(self) -> None:
        """Bring lines to the disk, at most once a second; a slow disk delays nobody who edits."""
        while not self._closed.is_set():
            self._unsynced.wait()
            self._unsynced.clear()
            with self._lock:
                bring_to_disk = self._syncing()
            bring_to_disk()
            self._closed.wait(0.5 * SYNC_INTERVAL_S)

    def _syncing(self) -> Callable[[], None]:
        """Return what brings the file to the disk, to be called without the lock."""
        return (lambda: None) if self._file is None else self._file.syncing()

    def _remove(self) -> None:
        """Remove the file, as its edits are saved or not wanted; the lock is held."""
        if self._file is not None:
            self._file.remove()
            self._file = None
            if self.path.parent != self._folder:
                _remove_with_folder(self.path)
        self._unprotected, self._needs_all = None, False
        self.path = self._folder / FILE_NAME

    def _close_file(self) -> None:
        if self._file is not None:
            if self._file.problem() != CHANGED:
                self._replaceable.add(FileId.of(self._file.descriptor))
            self._file.syncing()()
            self._file.close()
            self._file = None


def remove_leftovers(folder: Path) -> None:
    """Remove what a killed program has left half-written; nobody else may be saving the project now."""
    names = [name for name, _ in Fingerprint.of(folder).digests]
    for place in {folder, *((folder / name).parent for name in names)}:
        remove_half_written(place, [Path(name).name for name in names])
    with suppress(OSError):
        for path in (folder / f"{FILE_NAME}.new", *folder.glob(f"{LOCK_NAME}.*.new")):
            path.unlink(missing_ok=True)


def _remove_with_folder(path: Path) -> None:
    """Remove a journal, and its folder where nothing else lies in it."""
    path.unlink(missing_ok=True)
    with suppress(OSError):
        path.parent.rmdir()
