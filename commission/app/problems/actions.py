"""What a person can ask for about problems of the site, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.studies.problems import Problem


@dataclass(frozen=True, slots=True)
class FaceFromWalls(Action):
    """Show where plates of unknown direction face, turned away from the walls that they hang on."""


@dataclass(frozen=True, slots=True)
class AcceptFacing(Action):
    """Turn the plates as shown."""


@dataclass(frozen=True, slots=True)
class DropFacing(Action):
    """Leave the plates as they are."""


@dataclass(frozen=True, slots=True)
class ShowProblem(Action):
    """Select what a problem is about and go to its place."""

    problem: Problem
    """Which one."""
