"""The folder of the project: its files and journal, who edits it, and an eye on what others change there."""

from __future__ import annotations

import logging
import os
import time
from contextlib import suppress
from pathlib import Path

from commission.app.base import actions
from commission.app.base.actions import Action, Envelope, Report, Sender
from commission.app.base.effects import Effect
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.project.actions import (
    AskToReplace,
    ChangedOnDisk,
    EditsRestored,
    HeldByOther,
    HeldByUs,
    ProjectSaved,
    Protected,
    Reloaded,
)
from commission.app.project.effects import KeepProjectIn, ReadProject, TakeProjectOver, WriteProject
from commission.app.project.state import FilesState
from commission.app.project.writer import Writer
from commission.errors import CommissionError, FileFormatError, ProjectError, UsageError
from commission.io.findings import Findings
from commission.io.journal import Journal, remove_leftovers
from commission.io.journal_replay import Restored, restore
from commission.io.overwriting import project_in
from commission.io.project_copy import save_copy
from commission.io.project_file import load_project, open_project
from commission.io.project_lock import Hold, ProjectLock
from commission.site.project import Project

log = logging.getLogger(__name__)

OWN_PREFIX = ".commission."
LOOK_AT_DISK_S = 1.0
"""Time between two looks at the project's folder [s]."""
WRITTEN_WITHIN_S = 5.0
"""Longest time that is left to a save which is under way, when the program ends or the files are read again [s]."""


class ProjectFolder(Service):
    """The files of the project that is being edited, or only shown while somebody else edits it."""

    effects = (WriteProject, ReadProject, TakeProjectOver, KeepProjectIn)

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._folder = context.state.folder
        self._lock: ProjectLock | None = None
        self._journal: Journal | None = None
        self._restored: Restored | None = None
        if self._folder is not None:
            self._lock = ProjectLock(self._folder)
            if self._lock.look() is not Hold.THEIRS:
                self._restored = self._edit(self._folder, context.state.project)
        self._listing = _listing(self._folder)
        self._looked_at = context.clock()
        self._writer = Writer(context)

    def start(self) -> None:
        """Say who edits the project; make the edits again that a killed program left in the journal."""
        if self._lock is None:
            return
        if self._journal is None:
            self._tell_holder(was_ours=False)
        elif self._lock.left_by is not None:
            text = f"not let go of by {self._lock.left_by}: it may still be edited there, out of reach of this lock"
            self.context.post(Report(text))
        self._tell_restored()

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:
        """Journal an edit."""
        if not after.read_only:
            self.note(after.project, name_of_edit(action, before, after))

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Write or read the project, or take it over."""
        match effect:
            case WriteProject(project, folder, overwrite):
                is_own = state.folder is not None and os.path.abspath(folder) == os.path.abspath(state.folder)
                folder = folder if is_own else state.reach.checked(folder, sender)
                self.save(project, folder, overwrite=overwrite, sender=sender)
            case KeepProjectIn(project, folder):
                self._keep_in(folder, project, state.project)
            case ReadProject(folder):
                self.context.post(Envelope(self.load(folder), sender))
            case TakeProjectOver() if self._lock is not None:
                self._lock.take_over()
                self._look(state)
            case _:
                pass

    def follow(self, state: AppState) -> Due:
        """Look now and then at what others do in the folder."""
        now = self.context.clock()
        if now - self._looked_at >= LOOK_AT_DISK_S:
            self._looked_at = now
            self._look(state)
        return Due.NEVER

    def note(self, project: Project, what: str) -> None:
        """Journal an edit; see `Journal.append`.

        Raises
        ------
        ProjectError
            somebody else has taken the project over: this edit is on this page alone.
        """
        if self._lock is None:
            return
        # Whoever takes over waits until what is being written is complete: the lock is let go of by looking at it.
        hold = Hold.OURS if self._writer.is_busy else self._lock.look()
        if hold is Hold.THEIRS:
            self._lose()
        if self._journal is None:
            raise ProjectError(f"{what} is shown on this page alone: {self._lock.holder} has taken the project over")
        try:
            self._journal.append(project, what)
        finally:
            if hold is Hold.NOBODYS:
                # A new project's folder has appeared with the edit.
                self._lock.look()

    def save(self, project: Project, folder: Path, *, overwrite: bool, sender: Sender) -> None:
        """Write a project in the background: edits are journaled meanwhile. What came of it is posted.

        Parameters
        ----------
        project : what is written.
        folder : of this project, or another one for a copy.
        overwrite : whether files that have changed meanwhile, or another project, are replaced.
        sender : who is told what came of it.

        Raises
        ------
        ProjectError
            somebody else has taken the project over.
        UsageError
            the project is edited elsewhere.
        """
        journal = self._journal
        if self._folder is None or os.path.abspath(folder) != os.path.abspath(self._folder):
            self._writer.put(lambda: _copied(project, folder, overwrite=overwrite), sender)
            return
        if journal is None or self._lock is None:
            raise UsageError("the project is edited elsewhere; expected another folder to save a copy in")
        if not self._writer.is_busy and self._lock.look() is Hold.THEIRS:
            self._lose()
            raise ProjectError(f"not saved: {self._lock.holder} has taken the project over")
        place = self._folder

        def write() -> list[Action]:
            journal.save(project, overwrite=overwrite)
            return [ProjectSaved(project, place, time.strftime("%H:%M"))]

        self._writer.put(write, sender)

    def wait(self, seconds: float = WRITTEN_WITHIN_S) -> None:
        """Wait until all is written that was asked for, at most so long [s]."""
        self._writer.wait(seconds)

    def load(self, folder: Path) -> Reloaded:
        """Read the project from its files again; the journal of what was edited until now ends.

        Returns
        -------
        reloaded : the project, and what was doubted while it was read.

        Raises
        ------
        FileFormatError
            a file cannot be read.
        """
        self.wait()
        found = Findings()
        project = load_project(folder, found)
        if self._journal is not None:
            self._journal.discard()
            self._journal.close()
            self._journal = Journal(folder, project)
        self._listing = _listing(folder)
        return Reloaded(project, found.lines())

    def foreign_changes(self) -> tuple[str, ...] | None:
        """Return the files that somebody else has changed; none when nothing has happened since the last call."""
        listing = _listing(self._folder)
        if self._journal is None or listing == self._listing:
            return None
        self._listing = listing
        return self._journal.foreign_changes()

    def close(self) -> None:
        """Bring the journal to the disk; it stays for the next start when something is unsaved."""
        self.wait()
        if self._journal is not None:
            self._journal.close()
        if self._lock is not None:
            self._lock.release()

    def _look(self, state: AppState) -> None:
        """Find out who edits the project, look after the journal, and see what others have changed.

        While files are written, they are neither ours nor those of somebody else, and the lock is not let go of.
        """
        if self._lock is None or self._folder is None or self._writer.is_busy:
            return
        hold = self._lock.look()
        if self._journal is not None:
            if hold is Hold.THEIRS:
                self._lose()
            else:
                self._look_after_journal(state)
        elif hold is Hold.THEIRS:
            self._follow_holder(state)
        elif hold is Hold.OURS or (hold is Hold.NOBODYS and self._folder.is_dir()):
            # Where the folder is gone, whoever edited it goes on elsewhere, and here it stays read-only.
            self._begin_to_edit()

    def _look_after_journal(self, state: AppState) -> None:
        if self._journal is None:
            return
        for news in self._journal.check():
            self.context.post(Report(news.text, failed=not news.is_good))
        kept, files = self._journal.kept_elsewhere, state.part(FilesState)
        if (self._journal.is_protecting, kept) != (files.is_protected, files.kept_in):
            self.context.post(Protected(self._journal.is_protecting, kept))
        foreign = self.foreign_changes()
        if foreign is not None and foreign != files.foreign:
            self.context.post(ChangedOnDisk(foreign))

    def _follow_holder(self, state: AppState) -> None:
        """Show what the one who edits the project has saved, and who that is."""
        if self._lock is None or self._folder is None:
            return
        if str(self._lock.holder) != state.part(FilesState).holder:
            self._tell_holder(was_ours=False)
        listing = _listing(self._folder)
        if listing == self._listing:
            return
        try:
            project = load_project(self._folder, found := Findings())
        except CommissionError:
            return  # perhaps in the middle of a save: again at the next look
        self._listing = listing
        if project != state.project:
            self.context.post(Reloaded(project, found.lines()))

    def _begin_to_edit(self) -> None:
        """Go on where the one who edited the project has left off, saved or not."""
        if self._folder is None:
            return
        project = open_project(self._folder).project
        self._restored = self._edit(self._folder, project)
        self._listing = _listing(self._folder)
        self.context.post(HeldByUs(project))
        self._tell_restored()

    def _edit(self, folder: Path, project: Project) -> Restored | None:
        """Begin a journal; return what the last one held."""
        remove_leftovers(folder)
        restored = restore(folder, project)
        self._journal = Journal(folder, project, restored)
        return restored

    def _lose(self) -> None:
        """Edit no more: every edit until now is in the journal, and whoever has taken over makes it again."""
        if self._journal is not None:
            self._journal.close()
            self._journal = None
            self._listing = _listing(self._folder)
            self._tell_holder(was_ours=True)

    def _keep_in(self, folder: Path, saved: Project, now: Project) -> None:
        """Keep the project where a copy of it was written, and let go of the folder until now."""
        lock, journal = ProjectLock(folder), Journal(folder, saved)
        lock.look()
        with suppress(FileFormatError):
            journal.append(now, "edits while it was saved")
        if self._journal is not None:
            self._journal.discard()
            self._journal.close()
        if self._lock is not None:
            self._lock.release()
        self._folder, self._lock, self._journal = folder, lock, journal
        self._listing = _listing(folder)

    def _tell_holder(self, *, was_ours: bool) -> None:
        if self._lock is not None and self._lock.holder is not None:
            self.context.post(HeldByOther(str(self._lock.holder), was_ours=was_ours))
            log.warning("%s is edited by %s: read-only here", self._folder, self._lock.holder)

    def _tell_restored(self) -> None:
        """Have the edits made again that a journal held, or say that it could not be read."""
        restored, self._restored = self._restored, None
        if restored is not None and restored.edits:
            self.context.post(EditsRestored(restored.project, restored.summary(), restored.foreign_changes))
        elif restored is not None:
            self.context.post(Report(restored.summary()))


def _copied(project: Project, folder: Path, *, overwrite: bool) -> list[Action]:
    """Write a copy, or ask before another project is replaced; returns what came of it."""
    found = project_in(folder)
    if found and not overwrite:
        return [AskToReplace(folder, found)]
    kept = save_copy(project, folder, force=overwrite)
    aside = f"unsaved edits of the project that was there are kept in {kept}"
    told: list[Action] = [] if kept is None else [Report(aside, failed=False)]
    return [*told, ProjectSaved(project, folder, time.strftime("%H:%M"))]


def _listing(folder: Path | None) -> frozenset[tuple[str, int, int]]:
    """Names, times and sizes of the files beside the project: cheap to compare often."""
    found: set[tuple[str, int, int]] = set()
    if folder is None or not folder.is_dir():
        return frozenset()
    with os.scandir(folder) as entries:
        for entry in entries:
            try:
                if entry.is_file() and not entry.name.startswith(OWN_PREFIX):
                    found.add((entry.name, entry.stat().st_mtime_ns, entry.stat().st_size))
            except OSError:
                continue  # removed in between
    return frozenset(found)


def name_of_edit(action: Action, before: AppState, after: AppState) -> str:
    """Return what the journal calls an edit: the undo step's name, or which one was taken back or made again.

    Parameters
    ----------
    action : that made the edit.
    before, after : the state before it and the one that follows.
    """
    match action:
        case actions.Undo() if before.undo:
            return f"undo {before.undo[-1].name}"
        case actions.Redo() if before.redo:
            return f"redo {before.redo[-1].name}"
        case _:
            return after.undo[-1].name if after.undo else "edit"
