"""The step Tune: every parameter of the localizer, and its calibration by a drive."""

from __future__ import annotations

from commission.app.base.feature import TUNE, Docked, Feature
from commission.app.tune import calibration_reducer, diagnosis, reducer
from commission.app.tune.calibration_panel import CalibrationPanel
from commission.app.tune.calibration_service import CalibrationService
from commission.app.tune.diagnosis import DiagnosisPanel, DiagnosisService
from commission.app.tune.tune_panel import TunePanel

FEATURE = Feature(
    name="tune",
    reducers=(reducer, calibration_reducer, diagnosis),
    services=(CalibrationService, DiagnosisService),
    panels=(
        Docked(make=lambda at: CalibrationPanel(at.gui, at.post), tab=TUNE, rank=-4, folder="Calibration"),
        Docked(make=lambda at: DiagnosisPanel(at.gui, at.post), tab=TUNE, rank=-3, folder="Residuals of the drive"),
        Docked(make=lambda at: TunePanel(at.gui, at.post, at.state), tab=TUNE),
    ),
)
