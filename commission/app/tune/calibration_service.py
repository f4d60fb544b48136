"""Calibrates when it is asked for, and makes the view."""

from __future__ import annotations

from commission.app.base.jobs import Lane
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.tune.calibration_state import CalibrationState
from commission.app.tune.calibration_view import CalibrationView, calibration_view
from commission.studies.calibration import Calibration, calibrate
from commission.studies.calibration_values import CalibrationInput

CALIBRATION = "Calibration"
"""Name of the job."""


class CalibrationService(Service):
    """The calibration that was asked for last."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[CalibrationInput, Calibration](CALIBRATION, context.jobs, Lane.PATIENT)
        self._memo = Memo[CalibrationView]()
        self._asked = 0
        self.view: CalibrationView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Calibrate once for each time that it is asked for; what was found before is dropped then."""
        asked, before = state.part(CalibrationState), self.view
        inputs = asked.inputs
        if inputs is None or asked.asked != self._asked:
            self._asked = asked.asked
            self._kept.drop()
        if inputs is not None:
            self._kept.ask(asked.asked, inputs, lambda progress: calibrate(inputs, progress))
        found, project = self._kept.result, state.project
        self.view = self._memo.of((found, project, asked), lambda: found and calibration_view(found, project, asked))
        return Due.NEVER if self.view is before else Due.SOON
