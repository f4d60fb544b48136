"""What a person can ask for, and what jobs report, while a floor map is loaded; frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.editing.editor import MapPen, Point
from commission.app.floor_map.draft import MapFile, Read, ReadOptions
from commission.site.floor_map import FloorMap

OptionValue: TypeAlias = float | bool | tuple[str, ...] | tuple[float, ...]


@dataclass(frozen=True, slots=True)
class OpenMap:
    """Read a file to load a floor map from."""

    client: int
    """Number of the browser's connection."""
    file: MapFile
    """The file."""


@dataclass(frozen=True, slots=True)
class SetReading:
    """Read the file again in another way."""

    client: int
    """Number of the browser's connection."""
    reading: ReadOptions
    """How."""


@dataclass(frozen=True, slots=True)
class SetMapOption:
    """Choose one thing that the file leaves open."""

    name: str
    """Field of `MapOptions`."""
    value: OptionValue
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class ClickPicture:
    """Click on the two points of a picture (anew)."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class MakeMap:
    """Make the floor map of the file that was read."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class StopMapJob:
    """Stop reading or drawing."""


@dataclass(frozen=True, slots=True)
class DiscardMap:
    """Forget the file that was read or waits for another."""


@dataclass(frozen=True, slots=True)
class SetPen:
    """Change how the floor map's tools draw."""

    client: int
    """Number of the browser's connection."""
    pen: MapPen
    """How they draw from now on."""


@dataclass(frozen=True, slots=True)
class FinishShape:
    """Draw the wall or the obstacle, or erase the area, whose points were clicked."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class SetPlantPoint:
    """Name one of the points to align by, and say where it lies in the plant."""

    client: int
    """Number of the browser's connection."""
    index: int
    """Which point, 0 or 1: the other one stays as it is, for who types quickly is ahead of what is shown."""
    plant: Point
    """Where it lies [m], plant coordinates."""
    name: str = ""
    """What it is called."""


@dataclass(frozen=True, slots=True)
class SetAligned:
    """Choose what moves with the floor map."""

    client: int
    """Number of the browser's connection."""
    everything: bool
    """Whether reflectors, routes and stations do."""


@dataclass(frozen=True, slots=True)
class AlignMap:
    """Move and turn the floor map by the two points."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class MapOpened:
    """A file was read that leaves something open."""

    client: int
    """Number of the browser that asked."""
    file: MapFile
    """The file."""
    read: Read
    """What was read."""
    reading: ReadOptions
    """How."""


@dataclass(frozen=True, slots=True)
class MapMade:
    """A floor map was made."""

    client: int
    """Number of the browser that asked."""
    file: MapFile
    """The file that it was made of."""
    floor_map: FloorMap
    """The map."""
    notes: tuple[str, ...] = ()
    """What was left out or assumed, one line each."""


@dataclass(frozen=True, slots=True)
class ImageMissing:
    """A `map_server` YAML file came without its image."""

    file: MapFile
    """The YAML file."""
    image: str
    """What it calls its image."""


@dataclass(frozen=True, slots=True)
class MapFailed:
    """A file could not be loaded."""

    text: str
    """Why, in one line."""


MapResult: TypeAlias = MapOpened | MapMade | ImageMissing | MapFailed
"""What a job may come back with."""
MapAction: TypeAlias = (
    OpenMap
    | SetReading
    | SetMapOption
    | ClickPicture
    | MakeMap
    | StopMapJob
    | DiscardMap
    | SetPen
    | FinishShape
    | SetPlantPoint
    | SetAligned
    | AlignMap
    | MapOpened
    | MapMade
    | ImageMissing
    | MapFailed
)
