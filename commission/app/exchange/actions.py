"""What can be asked for and what can happen while files come and go."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.exchange.pending import ImportSource
from commission.app.exchange.preview import Preview
from commission.io.exports import Exported, Format
from commission.io.imports import WHOLE, Imported, LayoutChoice


@dataclass(frozen=True, slots=True)
class ReadImport(Action):
    """Read a file and show what it would change."""

    source: ImportSource
    """Which file."""
    choice: LayoutChoice = WHOLE
    """Which part of it."""


@dataclass(frozen=True, slots=True)
class ChooseLayout(Action):
    """Read another part of the file that is being looked at."""

    choice: LayoutChoice
    """Which part."""


@dataclass(frozen=True, slots=True)
class RemoveAbsent(Action):
    """Choose between merging and replacing."""

    remove: bool
    """Whether what is in the project and not in the file is removed."""


@dataclass(frozen=True, slots=True)
class AcceptImport(Action):
    """Change the project as the preview says."""


@dataclass(frozen=True, slots=True)
class DropImport(Action):
    """Leave the project as it is; what is being read is stopped."""


@dataclass(frozen=True, slots=True)
class MakeFile(Action):
    """Make a file of the project and hand it to the browser."""

    wanted: Format
    """In which format."""


@dataclass(frozen=True, slots=True)
class ExchangeProgressed(Action):
    """Reading has come farther."""

    number: int
    """What was asked for."""
    fraction: float
    """Part that is done [0..1]."""
    message: str
    """What is done now."""


@dataclass(frozen=True, slots=True)
class ImportRead(Action):
    """A file was read."""

    number: int
    """What was asked for."""
    choice: LayoutChoice
    """Which part of the file."""
    imported: Imported
    """What it holds."""
    found: Preview
    """What it would change."""


@dataclass(frozen=True, slots=True)
class FileMade(Action):
    """A file was made."""

    file: Exported
    """The file."""


@dataclass(frozen=True, slots=True)
class ExchangeFailed(Action):
    """A file could not be taken, read or made."""

    text: str
    """Why, in one line."""
    number: int | None = None
    """What was asked for; none: it did not come so far."""
