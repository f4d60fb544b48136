"""What a person can ask for about stations, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.editing.editor import Point


@dataclass(frozen=True, slots=True)
class SelectStation(Action):
    """Select a station and nothing else."""

    name: str
    """Its name."""
    fly: bool = False
    """Whether to bring it into view."""


@dataclass(frozen=True, slots=True)
class PlaceStation(Action):
    """Put a new station somewhere: on a route and along it where one is near."""

    place: Point
    """Where [m], map frame."""
    reach: float
    """How near a route has to be to attract it [m]."""


@dataclass(frozen=True, slots=True)
class MoveStation(Action):
    """Put the selected station somewhere else, or turn it."""

    place: Point
    """Where [m], map frame."""
    heading: float
    """Heading of the vehicle there, map frame [rad]."""


@dataclass(frozen=True, slots=True)
class SetStation(Action):
    """Set one field of the selected station."""

    field: str
    """Field of `Station`."""
    value: object
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class AlignStation(Action):
    """Put the selected station onto the nearest route, looking along it."""


@dataclass(frozen=True, slots=True)
class DeleteStation(Action):
    """Delete the selected station."""
