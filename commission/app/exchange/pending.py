"""What one browser is importing and what it has taken away: frozen values, each browser's own. Nothing is read here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from commission.app.base.uploads import Upload
from commission.app.exchange.preview import Preview, compare
from commission.io.imports import PASTED, Imported, LayoutChoice, shown_name
from commission.site.project import Project


@dataclass(frozen=True, slots=True)
class ServerFile:
    """A file of the computer that serves the page."""

    path: Path
    """Where it is."""

    @property
    def title(self) -> str:
        """What it is called on the page."""
        return shown_name(self.path.name)


@dataclass(frozen=True, slots=True)
class Pasted:
    """Text from the clipboard."""

    text: str
    """Cells of a spreadsheet, or the content of a file."""

    @property
    def title(self) -> str:
        """What it is called on the page."""
        return PASTED


ImportSource: TypeAlias = Upload | ServerFile | Pasted


@dataclass(frozen=True, slots=True, eq=False)
class FileReading:
    """A file that is being read in the background."""

    source: ImportSource
    """Which one."""
    fraction: float = 0.0
    """Part that is done [0..1]."""
    message: str = ""
    """What is done now."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Pending:
    """What was read and waits for a yes or no; the project is as before."""

    source: ImportSource
    """Where it comes from; it is read again when another part of it is wanted."""
    choice: LayoutChoice
    """Which part of it was read."""
    imported: Imported
    """Reflectors, routes or a project."""
    found: Preview
    """What it would change of the project that it was compared with."""
    remove: bool = False
    """Whether what is in the project and not in the file is removed."""

    def preview(self, project: Project) -> Preview:
        """Return what it would change; compared anew where the project is another one by now."""
        return self.found if self.found.project is project else compare(project, self.imported)


@dataclass(frozen=True, slots=True, eq=False)
class Sent:
    """A file that was made and handed to the browser."""

    name: str
    """Name of the file."""
    losses: tuple[str, ...] = ()
    """What its format cannot carry."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Exchange:
    """One browser's imports and exports; two are equal only when they are one, which is found out at once."""

    number: int = 0
    """Counts what was asked for; an answer to an earlier question is too late."""
    reading: FileReading | None = None
    """What is being read."""
    pending: Pending | None = None
    """What waits for a yes or no."""
    problem: str = ""
    """Why the last file could not be read or made."""
    sent: Sent | None = None
    """The last file that was made."""
