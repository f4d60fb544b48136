"""What can be asked for and what can happen while files come and go; `client` is the number of the connection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.exchange.pending import ImportSource
from commission.app.exchange.preview import Preview
from commission.io.exports import Exported, Format
from commission.io.imports import WHOLE, Imported, LayoutChoice


@dataclass(frozen=True, slots=True)
class ReadImport:
    """Read a file and show what it would change."""

    client: int
    """Number of the browser's connection."""
    source: ImportSource
    """Which file."""
    choice: LayoutChoice = WHOLE
    """Which part of it."""


@dataclass(frozen=True, slots=True)
class ChooseLayout:
    """Read another part of the file that is being looked at."""

    client: int
    """Number of the browser's connection."""
    choice: LayoutChoice
    """Which part."""


@dataclass(frozen=True, slots=True)
class RemoveAbsent:
    """Choose between merging and replacing."""

    client: int
    """Number of the browser's connection."""
    remove: bool
    """Whether what is in the project and not in the file is removed."""


@dataclass(frozen=True, slots=True)
class AcceptImport:
    """Change the project as the preview says."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class DropImport:
    """Leave the project as it is; what is being read is stopped."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class MakeFile:
    """Make a file of the project and hand it to the browser."""

    client: int
    """Number of the browser's connection."""
    wanted: Format
    """In which format."""


@dataclass(frozen=True, slots=True)
class ExchangeProgressed:
    """Reading has come farther."""

    client: int
    """Number of the browser's connection."""
    number: int
    """What was asked for."""
    fraction: float
    """Part that is done [0..1]."""
    message: str
    """What is done now."""


@dataclass(frozen=True, slots=True)
class ImportRead:
    """A file was read."""

    client: int
    """Number of the browser's connection."""
    number: int
    """What was asked for."""
    choice: LayoutChoice
    """Which part of the file."""
    imported: Imported
    """What it holds."""
    found: Preview
    """What it would change."""


@dataclass(frozen=True, slots=True)
class FileMade:
    """A file was made."""

    client: int
    """Number of the browser's connection."""
    file: Exported
    """The file."""


@dataclass(frozen=True, slots=True)
class ExchangeFailed:
    """A file could not be taken, read or made."""

    client: int
    """Number of the browser's connection."""
    text: str
    """Why, in one line."""
    number: int | None = None
    """What was asked for; none: it did not come so far."""


ExchangeAction: TypeAlias = (
    ReadImport
    | ChooseLayout
    | RemoveAbsent
    | AcceptImport
    | DropImport
    | MakeFile
    | ExchangeProgressed
    | ImportRead
    | FileMade
    | ExchangeFailed
)
