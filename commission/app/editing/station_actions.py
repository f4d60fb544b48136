"""What a person can ask for about stations, as frozen values; `client` is the number of the browser's connection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.editing.editor import Point


@dataclass(frozen=True, slots=True)
class SelectStation:
    """Select a station and nothing else."""

    client: int
    """Number of the browser's connection."""
    name: str
    """Its name."""
    fly: bool = False
    """Whether to bring it into view."""


@dataclass(frozen=True, slots=True)
class PlaceStation:
    """Put a new station somewhere: on a route and along it where one is near."""

    client: int
    """Number of the browser's connection."""
    place: Point
    """Where [m], map frame."""
    reach: float
    """How near a route has to be to attract it [m]."""


@dataclass(frozen=True, slots=True)
class MoveStation:
    """Put the selected station somewhere else, or turn it."""

    client: int
    """Number of the browser's connection."""
    place: Point
    """Where [m], map frame."""
    heading: float
    """Heading of the vehicle there, map frame [rad]."""


@dataclass(frozen=True, slots=True)
class SetStation:
    """Set one field of the selected station."""

    client: int
    """Number of the browser's connection."""
    field: str
    """Field of `Station`."""
    value: float | str
    """New value, SI and radians."""
    at: float = 0.0
    """When [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class AlignStation:
    """Put the selected station onto the nearest route, looking along it."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class DeleteStation:
    """Delete the selected station."""

    client: int
    """Number of the browser's connection."""


StationAction: TypeAlias = SelectStation | PlaceStation | MoveStation | SetStation | AlignStation | DeleteStation
