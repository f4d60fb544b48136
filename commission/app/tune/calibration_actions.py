"""What a person can ask for of a calibration, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.base.shown_run import LearnedFromDrive
from commission.studies.calibration import Calibration


@dataclass(frozen=True, slots=True)
class CalibrateByDrive(Action):
    """Calibrate by the drive that is shown; what was found before is dropped."""


@dataclass(frozen=True, slots=True)
class DropCalibration(Action):
    """Drop what was found, or stop calibrating."""


@dataclass(frozen=True, slots=True)
class LookAtFigure(Action):
    """Show all that was found of one figure."""

    key: str
    """Its name, as in the calibration."""


@dataclass(frozen=True, slots=True)
class AcceptFigure(LearnedFromDrive):
    """Let the project say of one figure what the drive says."""

    key: str
    """Its name, as in the calibration."""
    calibration: Calibration
    """What was seen on the page when it was accepted."""
