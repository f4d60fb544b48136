"""What a person can ask for about tags, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.editing.editor import Point


@dataclass(frozen=True, slots=True)
class SelectTag(Action):
    """Select a tag and nothing else."""

    id: str
    """What is read on it."""
    fly: bool = False
    """Whether to bring it into view."""


@dataclass(frozen=True, slots=True)
class PlaceTag(Action):
    """Put a new tag somewhere, like the one placed last."""

    place: Point
    """Where [m], map frame."""


@dataclass(frozen=True, slots=True)
class MoveTag(Action):
    """Put the selected tag somewhere else, or turn it."""

    place: Point
    """Where [m], map frame."""
    heading: float
    """Direction of its x axis, map frame [rad]."""


@dataclass(frozen=True, slots=True)
class SetTag(Action):
    """Set one field of the selected tag."""

    field: str
    """Field of `Tag`."""
    value: object
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class DeleteTag(Action):
    """Delete the selected tag."""
