"""What a person can ask of variants of the drive, as frozen values, and what the run then has to do."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.base.effects import Effect


@dataclass(frozen=True, slots=True)
class KeepVariant(Action):
    """Keep the run that is shown beside what is tried next."""


@dataclass(frozen=True, slots=True)
class DropVariant(Action):
    """Forget a variant."""

    letter: str
    """Which one."""


@dataclass(frozen=True, slots=True)
class UseVariant(Action):
    """Take the parameters and the uncertainty of a variant back into the project."""

    letter: str
    """Which one."""


@dataclass(frozen=True, slots=True)
class KeepRun(Effect):
    """Keep the run that is shown."""

    letter: str
    """What it is called."""


@dataclass(frozen=True, slots=True)
class DropRun(Effect):
    """Let a run go."""

    letter: str
    """What it is called."""
