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
    """Whether files that somebody else has changed meanwhile are replaced."""


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


@dataclass(frozen=True, slots=True)
class Restored(Action):
    """The journal held edits that were not saved."""

    project: Project
    """What they led to."""
    text: str
    """What was restored, in one line."""
    foreign: tuple[str, ...] = ()
    """Files that somebody else has changed since."""
