"""What a person can ask for, and what jobs report, while a floor map is loaded; frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action, Point
from commission.app.floor_map.draft import MapFile, Read, ReadOptions
from commission.site.floor_map import FloorMap


@dataclass(frozen=True, slots=True)
class OpenMap(Action):
    """Read a file to load a floor map from."""

    file: MapFile
    """The file."""


@dataclass(frozen=True, slots=True)
class SetReading(Action):
    """Read the file again in another way."""

    reading: ReadOptions
    """How."""


@dataclass(frozen=True, slots=True)
class SetMapOption(Action):
    """Choose one thing that the file leaves open."""

    name: str
    """Field of `MapOptions`."""
    value: object
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class ClickPicture(Action):
    """Click on the two points of a picture (anew)."""


@dataclass(frozen=True, slots=True)
class MakeMap(Action):
    """Make the floor map of the file that was read."""


@dataclass(frozen=True, slots=True)
class StopMapJob(Action):
    """Stop reading or drawing."""


@dataclass(frozen=True, slots=True)
class DiscardMap(Action):
    """Forget the file that was read or waits for another."""


@dataclass(frozen=True, slots=True)
class SetPen(Action):
    """Change how the floor map's tools draw."""

    name: str
    """Field of `MapPen`."""
    value: object
    """New value, SI."""


@dataclass(frozen=True, slots=True)
class SetPlantPoint(Action):
    """Name one of the points to align by, and say where it lies in the plant."""

    index: int
    """Which point, from 0: the others stay as they are, for who types quickly is ahead of what is shown."""
    plant: Point
    """Where it lies [m], plant coordinates."""
    name: str = ""
    """What it is called."""


@dataclass(frozen=True, slots=True)
class ForgetPoint(Action):
    """Forget points to align by."""

    everything: bool = False
    """Whether all of them; else the one that was clicked last."""


@dataclass(frozen=True, slots=True)
class SetAligned(Action):
    """Choose what moves with the floor map."""

    everything: bool
    """Whether reflectors, routes and stations do."""


@dataclass(frozen=True, slots=True)
class SetSurveyed(Action):
    """Align by a table of points in the plant, named as reflectors, stations or clicked points are."""

    table: str
    """Pasted rows of name, x, y; empty: by the clicked ones alone."""


@dataclass(frozen=True, slots=True)
class AlignMap(Action):
    """Move and turn the floor map by the points."""


@dataclass(frozen=True, slots=True)
class MapOpened(Action):
    """A file was read that leaves something open."""

    file: MapFile
    """The file."""
    read: Read
    """What was read."""
    reading: ReadOptions
    """How."""


@dataclass(frozen=True, slots=True)
class MapMade(Action):
    """A floor map was made."""

    file: MapFile
    """The file that it was made of."""
    floor_map: FloorMap
    """The map."""
    notes: tuple[str, ...] = ()
    """What was left out or assumed, one line each."""


@dataclass(frozen=True, slots=True)
class ImageMissing(Action):
    """A `map_server` YAML file came without its image."""

    file: MapFile
    """The YAML file."""
    image: str
    """What it calls its image."""


@dataclass(frozen=True, slots=True)
class MapFailed(Action):
    """A file could not be loaded."""

    text: str
    """Why, in one line."""
