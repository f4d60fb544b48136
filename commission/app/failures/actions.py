"""What a person can ask about failing reflectors, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action


@dataclass(frozen=True, slots=True)
class ChooseFailure(Action):
    """Let something else happen to each reflector in turn."""

    failure: str
    """A `Failure`."""


@dataclass(frozen=True, slots=True)
class RankReflectors(Action):
    """Rank the reflectors by what depends on them, with none failed before."""


@dataclass(frozen=True, slots=True)
class DropRanking(Action):
    """Stop ranking, or forget the ranking."""


@dataclass(frozen=True, slots=True)
class ShowFailure(Action):
    """Show on the floor what fails with one reflector."""

    name: str
    """Its id; empty: none."""


@dataclass(frozen=True, slots=True)
class ClickReflector(Action):
    """Show what fails with the reflector at a place, while there is a ranking."""

    place: tuple[float, float]
    """Where it was clicked [m], map frame."""
    reach: float
    """How near to a reflector counts as on it [m]."""


@dataclass(frozen=True, slots=True)
class AlsoFails(Action):
    """Let a reflector fail beside those that have failed already, and rank the others again."""

    name: str
    """Its id."""
