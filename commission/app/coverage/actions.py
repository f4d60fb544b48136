"""What a person can ask of the heatmap, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.base.inputs import Setting
from commission.app.coverage.settings import Place


@dataclass(frozen=True, slots=True)
class SetCoverage(Action):
    """Change one setting of the heatmap."""

    name: str
    """Field of `CoverageSettings`."""
    value: Setting
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class ReadFloor(Action):
    """Read the values at a place of the floor."""

    place: Place
    """Where it was clicked [m], map frame."""
    reach: float
    """How near to a reflector counts as on it [m]: some pixels at the browser's zoom."""


@dataclass(frozen=True, slots=True)
class ClearEllipses(Action):
    """Drop the ellipses that were asked for by clicks."""
