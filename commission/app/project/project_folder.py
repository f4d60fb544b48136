"""The folder of the project: its files, the journal beside them, and an eye on what others change there."""

from __future__ import annotations

import os
import time
from pathlib import Path

from commission.app.base import actions
from commission.app.base.actions import Action, Envelope, Report, Sender
from commission.app.base.effects import Effect
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.project.actions import ChangedOnDisk, ProjectSaved, Reloaded, Restored
from commission.app.project.effects import ReadProject, WriteProject
from commission.app.project.state import FilesState
from commission.io.journal import Journal
from commission.io.journal_replay import restore
from commission.io.project_file import load_project, save_project
from commission.site.project import Project

OWN_PREFIX = ".commission."
LOOK_AT_DISK_S = 2.0
"""Time between two looks at the project's folder [s]."""


class ProjectFolder(Service):
    """The files of the project that is being edited."""

    effects = (WriteProject, ReadProject)

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        folder, project = context.state.folder, context.state.project
        self._folder = folder
        self._restored = None if folder is None else restore(folder, project)
        self._journal = None if folder is None else Journal(folder, project, self._restored)
        self._listing = _listing(folder)
        self._looked_at = context.clock()

    def start(self) -> None:
        """Make the edits again that a killed program left in the journal."""
        restored = self._restored
        if restored is not None and restored.edits:
            self.context.post(Restored(restored.project, restored.summary(), restored.foreign_changes))
        elif restored is not None:
            self.context.post(Report(restored.summary()))

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:
        """Journal an edit."""
        self.note(after.project, name_of_edit(action, before, after))

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:  # noqa: ARG002 - the protocol's
        """Write or read the project."""
        match effect:
            case WriteProject(project, folder, overwrite):
                self.save(project, folder, overwrite)
                self.context.post(Envelope(ProjectSaved(project, folder, time.strftime("%H:%M")), sender))
            case ReadProject(folder):
                self.context.post(Envelope(Reloaded(self.load(folder)), sender))
            case _:
                pass

    def follow(self, state: AppState) -> Due:
        """Look now and then at what others do in the folder."""
        now = self.context.clock()
        if now - self._looked_at >= LOOK_AT_DISK_S:
            self._looked_at = now
            files = self.foreign_changes()
            if files is not None and files != state.part(FilesState).foreign:
                self.context.post(ChangedOnDisk(files))
        return Due.NEVER

    def note(self, project: Project, what: str) -> None:
        """Journal an edit; see `Journal.append`."""
        if self._journal is not None:
            self._journal.append(project, what)

    def save(self, project: Project, folder: Path, overwrite: bool) -> None:
        """Write a project; from then on it is kept in that folder.

        Raises
        ------
        ProjectError
            somebody else has changed the files, and `overwrite` is False.
        FileFormatError
            a file cannot be written.
        """
        if self._journal is not None and folder == self._folder:
            self._journal.save(project, overwrite=overwrite)
        else:
            save_project(project, folder)
            self._begin(folder, project)
        self._listing = _listing(folder)

    def load(self, folder: Path) -> Project:
        """Read the project from its files again; the journal of what was edited until now ends.

        Raises
        ------
        FileFormatError
            a file cannot be read.
        """
        project = load_project(folder)
        self._begin(folder, project)
        return project

    def foreign_changes(self) -> tuple[str, ...] | None:
        """Return the files that somebody else has changed; none when nothing has happened since the last call."""
        if self._journal is None:
            return None
        listing = _listing(self._folder)
        if listing == self._listing:
            return None
        self._listing = listing
        return self._journal.foreign_changes()

    def _begin(self, folder: Path, project: Project) -> None:
        """Keep a project in a folder whose files hold it already."""
        if self._journal is not None:
            self._journal.discard()
            self._journal.close()
        self._folder, self._journal = folder, Journal(folder, project)
        self._listing = _listing(folder)

    def close(self) -> None:
        """Bring the journal to the disk; it stays for the next start when something is unsaved."""
        if self._journal is not None:
            self._journal.close()


def _listing(folder: Path | None) -> frozenset[tuple[str, int, int]]:
    """Names, times and sizes of the files beside the project: cheap to compare often."""
    if folder is None or not folder.is_dir():
        return frozenset()
    with os.scandir(folder) as entries:
        files = [entry for entry in entries if entry.is_file() and not entry.name.startswith(OWN_PREFIX)]
        return frozenset((entry.name, entry.stat().st_mtime_ns, entry.stat().st_size) for entry in files)


def name_of_edit(action: Action, before: AppState, after: AppState) -> str:
    """Return what the journal calls an edit: the undo step's name, or which one was taken back or made again."""
    match action:
        case actions.Undo() if before.undo:
            return f"undo {before.undo[-1].name}"
        case actions.Redo() if before.redo:
            return f"redo {before.redo[-1].name}"
        case _:
            return after.undo[-1].name if after.undo else "edit"
