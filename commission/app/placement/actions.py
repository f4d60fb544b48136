"""What a person can ask about a suggested layout, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action, Point
from commission.app.base.inputs import Setting
from commission.site.layout_brief import Rectangle
from commission.studies.placement import PlacementResult


@dataclass(frozen=True, slots=True)
class SetLayout(Action):
    """Change one option of the suggested layout."""

    name: str
    """`extend`, or `group.name` of the demands or candidates of `LayoutBrief`."""
    value: Setting
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class TakePreset(Action):
    """Ask of the suggested layout what a preset says."""

    name: str
    """One of `DEMAND_PRESETS`."""


@dataclass(frozen=True, slots=True)
class EndSearch(Action):
    """End the search with the best layout found so far; without one, nothing is suggested."""


@dataclass(frozen=True, slots=True)
class CountRoute(Action):
    """Let a route count for the suggested layout, or not."""

    name: str
    """Name of the route."""
    counts: bool
    """Whether it counts."""


@dataclass(frozen=True, slots=True)
class KeepOut(Action):
    """Keep new reflectors out of one more area."""

    area: Rectangle
    """Two opposite corners [m], map frame."""


@dataclass(frozen=True, slots=True)
class FreeAreas(Action):
    """Allow new reflectors again where they were kept out."""

    place: Point | None = None
    """In the areas around this place [m]; none: everywhere."""


@dataclass(frozen=True, slots=True)
class AskLayout(Action):
    """Suggest a layout; one that is being looked for or shown is dropped."""


@dataclass(frozen=True, slots=True)
class DiscardLayout(Action):
    """Drop the suggested layout, or stop looking for one."""


@dataclass(frozen=True, slots=True)
class AcceptLayout(Action):
    """Put up the suggested reflectors."""

    suggestion: PlacementResult
    """What was seen on the page when it was accepted."""
