"""What has to be done with the project's files, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from commission.app.base.effects import Effect
from commission.site.project import Project


@dataclass(frozen=True, slots=True)
class WriteProject(Effect):
    """Write the project."""

    project: Project
    """What to write."""
    folder: Path
    """Where to."""
    overwrite: bool = False
    """Whether files that somebody else has changed meanwhile, or another project that lies there, are replaced."""


@dataclass(frozen=True, slots=True)
class ReadProject(Effect):
    """Read the project from its files again."""

    folder: Path
    """Where from."""


@dataclass(frozen=True, slots=True)
class KeepProjectIn(Effect):
    """Keep the project where a copy of it was written, from now on."""

    project: Project
    """What was written."""
    folder: Path
    """Where to."""


@dataclass(frozen=True, slots=True)
class TakeProjectOver(Effect):
    """Take the project from whoever edits it elsewhere."""
