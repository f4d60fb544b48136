"""What a person can ask for about stations and tags, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.editing.editor import Point, PosedKey, PosedKind


@dataclass(frozen=True, slots=True)
class SelectPosed(Action):
    """Select a station or a tag and nothing else."""

    key: PosedKey
    """Which one."""
    fly: bool = False
    """Whether to bring it into view."""


@dataclass(frozen=True, slots=True)
class PlacePosed(Action):
    """Put a new one somewhere, like the one placed last: a station on a route and along it where one is near."""

    kind: PosedKind
    """Station or tag."""
    place: Point
    """Where [m], map frame."""
    reach: float
    """How near a route has to be to attract it [m]."""


@dataclass(frozen=True, slots=True)
class MovePosed(Action):
    """Put the selected one somewhere else, or turn it."""

    kind: PosedKind
    """Station or tag."""
    place: Point
    """Where [m], map frame."""
    heading: float
    """Of the vehicle at a station, of a tag's x axis; map frame [rad]."""


@dataclass(frozen=True, slots=True)
class SetPosed(Action):
    """Set one field of a station or a tag."""

    kind: PosedKind
    """Station or tag: an entry that is finished by selecting something else sets nothing of that."""
    field: str
    """Field of `Station` or `Tag`."""
    value: object
    """New value, SI and radians."""
    of: str = ""
    """What it is called; empty: the one that is selected."""


@dataclass(frozen=True, slots=True)
class DeletePosed(Action):
    """Delete the selected one."""

    kind: PosedKind
    """Station or tag."""


@dataclass(frozen=True, slots=True)
class AlignStation(Action):
    """Put the selected station onto the nearest route, looking along it."""
