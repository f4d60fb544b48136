"""Background work that loading a floor map asks for, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass, field

from commission.app.base.effects import Effect
from commission.app.floor_map.draft import MapDraft, MapFile, ReadOptions


@dataclass(frozen=True, slots=True)
class ReadMapFile(Effect):
    """Read a file."""

    file: MapFile
    """The file."""
    reading: ReadOptions = field(default_factory=ReadOptions)
    """How."""
    image: MapFile | None = None
    """Image that was sent with a `map_server` YAML file."""

    @property
    def job(self) -> str:
        """What the job is called."""
        return f"Reading {self.file.name}"


@dataclass(frozen=True, slots=True)
class DrawMap(Effect):
    """Make the floor map of a file that was read."""

    draft: MapDraft
    """The file with all that it left open."""

    @property
    def job(self) -> str:
        """What the job is called."""
        return f"Loading {self.draft.file.name}"


@dataclass(frozen=True, slots=True)
class StopMapWork(Effect):
    """Stop what is under way."""
