"""What a person can ask for about zones, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.site.layout_brief import Rectangle
from commission.site.zones import ObservationKind


@dataclass(frozen=True, slots=True)
class AddZone(Action):
    """Make a zone of an area, and show it in the list."""

    area: Rectangle
    """x and y of two opposite corners [m], map frame."""


@dataclass(frozen=True, slots=True)
class ShowZone(Action):
    """Show a zone in the list, and bring it into view."""

    name: str
    """Its name."""


@dataclass(frozen=True, slots=True)
class SetZone(Action):
    """Set one field of a zone."""

    field: str
    """Field of `Zone`."""
    value: object
    """New value, SI."""
    of: str = ""
    """Name of the zone; empty: the one that is shown."""


@dataclass(frozen=True, slots=True)
class CountKind(Action):
    """Let a kind of observation correct the pose in the zone that is shown, or not."""

    kind: ObservationKind
    """Which one."""
    counts: bool
    """Whether it does."""
    of: str = ""
    """Name of the zone; empty: the one that is shown."""


@dataclass(frozen=True, slots=True)
class DeleteZone(Action):
    """Delete the zone that is shown."""
