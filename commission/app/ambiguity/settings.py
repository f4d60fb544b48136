"""What is asked about ambiguous places: one frozen value in the page's state, and the actions that change it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.app.base.actions import Action
from commission.app.base.inputs import Setting
from commission.site.checks import check_fields
from commission.site.quantity import MILLIMETRES, POSITIVE, Quantity

NAME = "ambiguity"
"""Of the feature."""


@dataclass(frozen=True, slots=True)
class AmbiguitySettings:
    """Whether ambiguous places are wanted, and which pair is shown."""

    asked: int = 0
    """Number of times ambiguous places were asked for; 0: they are not wanted."""
    tolerance: Annotated[
        float,
        Quantity(label="Tolerance", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=5.0, entry=(5.0, 2000.0)),
    ] = 0.1
    """Largest distance at which a reflector still counts as standing where its look-alike does."""
    pair: int = -1
    """Which pair of look-alikes is shown, counted in the order of the list; -1: none."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True, slots=True)
class SetAmbiguity(Action):
    """Change one setting."""

    name: str
    """Field of `AmbiguitySettings`."""
    value: Setting
    """New value, SI."""


@dataclass(frozen=True, slots=True)
class FindPlaces(Action):
    """Look for ambiguous places."""


@dataclass(frozen=True, slots=True)
class DropPlaces(Action):
    """Stop looking for ambiguous places, or forget them."""


@dataclass(frozen=True, slots=True)
class ShowPair(Action):
    """Show one pair of look-alikes; the one that is shown is hidden."""

    index: int
    """In the order of the list."""
