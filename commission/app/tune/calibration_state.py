"""What is asked of a calibration: the feature's part of the page's state."""

from __future__ import annotations

from dataclasses import dataclass

from commission.studies.calibration_values import CalibrationInput
from commission.studies.run import RunResult


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationState:
    """Drive, request, and the figure that is looked at."""

    shown: RunResult | None = None
    """The run on the page; none: there is none, or a vehicle drives now."""
    inputs: CalibrationInput | None = None
    """What is, or was, calibrated by; none: nothing is asked for."""
    asked: int = 0
    """How often it was asked for."""
    chosen: str = ""
    """Name of the figure of which all is shown; empty: the first that is not accepted yet."""
    accepted: str = ""
    """Name of the figure that was accepted last; empty: none yet."""
    before: RunResult | None = None
    """The run as it was before that."""
