"""What a person can ask for about the project as a whole, and what happens to its files; frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from commission.app.base.actions import Action
from commission.site.project import Project


@dataclass(frozen=True, slots=True)
class RenameProject(Action):
    """Call the project something else."""

    name: str
    """New name."""


@dataclass(frozen=True, slots=True)
class Save(Action):
    """Write the project."""

    folder: Path | None = None
    """Where to; none: where it came from."""
    overwrite: bool = False
    """Whether files that somebody else has changed meanwhile, or another project that lies there, are replaced."""


@dataclass(frozen=True, slots=True)
class ProjectSaved(Action):
    """The project was written."""

    project: Project
    """What was written."""
    folder: Path
    """Where to."""
    time_of_day: str
    """When, as the page shows it."""


@dataclass(frozen=True, slots=True)
class AskToReplace(Action):
    """A copy was to be written where another project lies."""

    folder: Path
    """Where."""
    holds: str
    """What lies there, as a sentence goes on: `the project 'Hall'`."""


@dataclass(frozen=True, slots=True)
class KeepOther(Action):
    """What lies where a copy was to be written stays as it is."""


@dataclass(frozen=True, slots=True)
class ChangedOnDisk(Action):
    """The project's files were looked at, because something has happened in their folder."""

    files: tuple[str, ...]
    """Names of those that somebody else has changed since they were read or saved; empty: none."""


@dataclass(frozen=True, slots=True)
class Reload(Action):
    """Read the project from its files again, as an edit that can be undone."""


@dataclass(frozen=True, slots=True)
class Reloaded(Action):
    """The project was read again."""

    project: Project
    """As its files are."""
    notes: tuple[str, ...] = ()
    """What was doubted while it was read, one line each."""


@dataclass(frozen=True, slots=True)
class EditsRestored(Action):
    """The journal held edits that were not saved."""

    project: Project
    """What they led to."""
    text: str
    """What was restored, in one line."""
    foreign: tuple[str, ...] = ()
    """Files that somebody else has changed since."""


@dataclass(frozen=True, slots=True)
class TakeOver(Action):
    """Edit here what somebody else edits elsewhere; there it becomes read-only."""


@dataclass(frozen=True, slots=True)
class HeldByOther(Action):
    """Somebody else edits the project: here it is read-only."""

    holder: str
    """Who, where and since when, in words."""
    was_ours: bool = False
    """Whether it was edited here until now."""


@dataclass(frozen=True, slots=True)
class HeldByUs(Action):
    """The project is edited here from now on, as it was left elsewhere."""

    project: Project
    """As its files are."""


@dataclass(frozen=True, slots=True)
class Protected(Action):
    """How unsaved edits are kept has changed."""

    is_protected: bool
    """Whether all of them are in the journal."""
    kept_in: Path | None = None
    """Where they are while the project's folder is gone; none: it is there."""
