"""What a person can ask for in the step Plan, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.placement.suggestion import Suggestion
from commission.app.plan.settings import Place, PlanValue
from commission.site.layout_brief import Rectangle


@dataclass(frozen=True, slots=True)
class SetPlan(Action):
    """Change one setting of the step Plan."""

    name: str
    """Field of `PlanSettings`."""
    value: PlanValue
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class ReadFloor(Action):
    """Read the values at a place of the floor, or ask for a reflector there."""

    place: Place
    """Where it was clicked [m], map frame."""
    reach: float
    """How near to a reflector counts as on it [m]: some pixels at the browser's zoom."""


@dataclass(frozen=True, slots=True)
class ClearEllipses(Action):
    """Drop the ellipses that were asked for by clicks."""


@dataclass(frozen=True, slots=True)
class AlsoFails(Action):
    """Let a reflector fail beside those that have failed already, and rank the others again."""

    name: str
    """Its id."""


@dataclass(frozen=True, slots=True)
class SetLayout(Action):
    """Change one option of the suggested layout."""

    name: str
    """`extend`, or `group.name` of the demands or candidates of `LayoutBrief`."""
    value: PlanValue
    """New value, SI and radians."""


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

    place: Place | None = None
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

    suggestion: Suggestion
    """What was seen on the page when it was accepted."""
