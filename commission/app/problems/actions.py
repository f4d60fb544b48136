"""What a person can ask for about problems of the site, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.studies.problems import Problem


@dataclass(frozen=True, slots=True)
class FaceFromWalls(Action):
    """Turn every plate of unknown direction away from the wall that it hangs on."""


@dataclass(frozen=True, slots=True)
class ShowProblem(Action):
    """Select what a problem is about and go to its place."""

    problem: Problem
    """Which one."""
