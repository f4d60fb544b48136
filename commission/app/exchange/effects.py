"""Background work that imports and exports ask for, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.effects import Effect
from commission.app.exchange.pending import ImportSource
from commission.io.exports import Format
from commission.io.imports import LayoutChoice
from commission.site.project import Project


@dataclass(frozen=True, slots=True)
class ReadFile(Effect):
    """Read what the browser wants to import."""

    number: int
    """Goes with the answer."""
    source: ImportSource
    """Which file."""
    choice: LayoutChoice
    """Which part of it."""
    project: Project
    """What it is compared with."""


@dataclass(frozen=True, slots=True)
class StopReading(Effect):
    """Stop reading what the browser wanted to import."""


@dataclass(frozen=True, slots=True)
class ExportProject(Effect):
    """Make a file of a project for the browser."""

    wanted: Format
    """In which format."""
    project: Project
    """Of what."""
