"""What a person can ask for in the step Plan, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.plan.settings import Place, PlanValue


@dataclass(frozen=True, slots=True)
class SetPlan:
    """Change one setting of the step Plan."""

    name: str
    """Field of `PlanSettings`."""
    value: PlanValue
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class ReadFloor:
    """Read the values at a place of the floor, or ask for a reflector there."""

    place: Place
    """Where it was clicked [m], map frame."""
    reach: float
    """How near to a reflector counts as on it [m]: some pixels at the browser's zoom."""


PlanAction: TypeAlias = SetPlan | ReadFloor
