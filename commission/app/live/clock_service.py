"""Finds the offsets of the scanners' clocks in the background."""

from __future__ import annotations

from commission.app.base.actions import Envelope, Report, Sender
from commission.app.base.effects import Effect
from commission.app.base.service import Service
from commission.app.base.state import AppState
from commission.app.live.actions import ClocksFound
from commission.app.live.effects import StudyClocks
from commission.studies.calibration_values import CalibrationInput
from commission.studies.clock import clock_offsets

FIND = "Clocks by motion"
"""Name of the job."""


class ClockService(Service):
    """The job that finds clocks."""

    effects = (StudyClocks,)

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Find them; why they cannot be found is told to who asked."""
        if not isinstance(effect, StudyClocks):
            return
        inputs = CalibrationInput.of(state.project, effect.drive.log, effect.drive.start)
        self.context.jobs.start(
            FIND,
            lambda progress: clock_offsets(inputs, progress),
            then=ClocksFound,
            failed=lambda job: Envelope(Report(f"{job.name}: {job.error}", listed=f"{job.name} failed"), sender),
        )
