"""A calibration as its panel draws it: each figure with what becomes of it, held against the project of now."""

from __future__ import annotations

import math
from dataclasses import dataclass

from commission.app.tune.calibration_state import CalibrationState
from commission.localization.setup import LocalizerSetup
from commission.site.project import Project
from commission.studies.calibration import Calibration
from commission.studies.calibration_values import Value, value_in

SAME = 1e-12
"""Angles are wrapped: a figure that was accepted may differ by the last bit [m, rad, s]."""


@dataclass(frozen=True, slots=True)
class ProposedFigure:
    """A figure that the drive speaks for."""

    value: Value
    """What was found."""
    now: float | None
    """What the project says by now, SI and radians; none: it has no such scanner or reflector any more."""

    @property
    def is_accepted(self) -> bool:
        """Whether the project says what the drive says."""
        return self.now is not None and math.isclose(self.now, self.value.proposed, abs_tol=SAME)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationView:
    """What was found, and how it stands to the project of now."""

    calibration: Calibration
    """What was found."""
    proposed: tuple[ProposedFigure, ...]
    """Figures that can be accepted, or are."""
    chosen: ProposedFigure | None
    """The one of which all is shown; none: all are accepted, or there is none."""
    is_of_drive: bool
    """Whether it was made of the drive that is shown."""
    asked: CalibrationState
    """What is asked for, with the run before the newest acceptance and the run of now."""


def calibration_view(found: Calibration, project: Project, asked: CalibrationState) -> CalibrationView:
    """Hold a calibration against the project of now.

    Parameters
    ----------
    found : what was found.
    project : as it is now.
    asked : which figure is looked at, and the run that is shown.
    """
    setup = LocalizerSetup.of(project)
    proposed = tuple(ProposedFigure(value, value_in(setup, value.key)) for value in found.proposed)
    named = next((each for each in proposed if each.value.key == asked.chosen), None)
    return CalibrationView(
        calibration=found,
        proposed=proposed,
        chosen=named or next((each for each in proposed if not each.is_accepted), None),
        is_of_drive=asked.shown is not None and asked.shown.inputs.log is found.inputs.log,
        asked=asked,
    )
