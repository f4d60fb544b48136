"""The step Tune: every parameter of the localizer, and what a drive says of it and of the map."""

from __future__ import annotations

from commission.app.base.feature import TUNE, Docked, Feature
from commission.app.tune import calibration_reducer, diagnosis, map_check, reducer
from commission.app.tune.calibration_panel import CalibrationPanel
from commission.app.tune.calibration_service import CalibrationService
from commission.app.tune.diagnosis import DiagnosisPanel, DiagnosisService
from commission.app.tune.map_check_panel import MapCheckPanel
from commission.app.tune.map_check_service import MapCheckService
from commission.app.tune.tune_panel import TunePanel

FEATURE = Feature(
    name="tune",
    reducers=(reducer, calibration_reducer, diagnosis, map_check),
    services=(CalibrationService, DiagnosisService, MapCheckService),
    panels=(
        Docked(make=lambda at: CalibrationPanel(at.gui, at.post), tab=TUNE, rank=-4, folder="Calibration"),
        Docked(make=lambda at: MapCheckPanel(at.gui, at.post), tab=TUNE, rank=-3, folder="Map against the drive"),
        Docked(make=lambda at: DiagnosisPanel(at.gui, at.post), tab=TUNE, rank=-2, folder="Residuals of the drive"),
        Docked(make=lambda at: TunePanel(at.gui, at.post, at.state), tab=TUNE),
    ),
)
