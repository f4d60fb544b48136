"""What a person can ask for in the step Tune, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.base.actions import Action

ParameterValue: TypeAlias = bool | int | float | str


@dataclass(frozen=True, slots=True)
class SetParameter(Action):
    """Change one tunable of the localizer."""

    key: str
    """`group.name`, as in `project.yaml`."""
    value: ParameterValue
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class SetUncertainty(Action):
    """Say how well a constant is known."""

    name: str
    """Its field in the project's uncertainty."""
    value: ParameterValue | None
    """New 1-sigma, SI and radians."""


@dataclass(frozen=True, slots=True)
class ResetParameters(Action):
    """Go back to the parameters and the uncertainty of the saved project."""
