"""A project written to another place than its own: what lies there is replaced when asked to, and never thrown away."""

from __future__ import annotations

import os
from pathlib import Path

from commission.errors import UsageError
from commission.io.journal_place import FILE_NAME as JOURNAL
from commission.io.journal_replay import set_aside
from commission.io.overwriting import project_in
from commission.io.project_file import save_project
from commission.io.project_lock import Hold, ProjectLock
from commission.site.project import Project


def refuse_to_replace(folder: Path, *, force: bool) -> None:
    """Raise UsageError when a folder holds another project or parts of one, unless that may be replaced by `force`.

    A project that somebody edits is never replaced: its edits would come back over what was written.
    """
    if not _exists(folder):
        return
    if not folder.is_dir():
        raise UsageError(f"{folder} is a file; expected a folder")
    found = project_in(folder)
    if found and not force:
        raise UsageError(f"{folder} holds {found}; expected another folder, or --force to overwrite")
    lock = ProjectLock(folder)
    try:
        if found and lock.look() is Hold.THEIRS:
            raise UsageError(f"{folder} holds {found}, edited by {lock.holder}; expected another folder")
    finally:
        lock.release()


def save_copy(project: Project, folder: Path, *, force: bool) -> Path | None:
    """Write a project into a folder of its own.

    Parameters
    ----------
    project : what to write.
    folder : made when missing.
    force : whether another project that lies there is replaced.

    Returns
    -------
    kept : where the journal of unsaved edits that lay there is kept; None: there was none.

    Raises
    ------
    UsageError
        the folder holds another project, and `force` is False, or somebody edits it.
    FileFormatError
        it cannot be written: what was there stays as it was.
    """
    refuse_to_replace(folder, force=force)
    save_project(project, folder)
    # The edits of another project would be made again over this one.
    return set_aside(folder / JOURNAL, "replaced") if os.path.lexists(folder / JOURNAL) else None


def _exists(folder: Path) -> bool:
    if "\0" in str(folder):
        raise UsageError(f"{str(folder)!r} is no path (embedded null byte); expected the path of a folder")
    return os.path.lexists(folder)
