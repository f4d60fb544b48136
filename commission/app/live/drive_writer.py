"""Writes the drive that is on the page, be it recorded or virtual, into an MCAP file in the background."""

from __future__ import annotations

import time
from pathlib import Path

from commission.app.base.actions import Envelope, Report, Sender
from commission.app.base.effects import Effect
from commission.app.base.service import Service
from commission.app.base.state import AppState
from commission.app.live.effects import WriteDrive
from commission.app.live.service import FOLDER
from commission.io.live.session_recorder import new_recording
from commission.io.recordings.run_recording import write_run

WRITE = "Recording the drive"
"""Name of the job."""


class DriveWriter(Service):
    """The job that writes drives."""

    effects = (WriteDrive,)

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Write it; where it is, or why it is not, is told to who asked."""
        if not isinstance(effect, WriteDrive):
            return
        drive, scanners = effect.drive, state.project.scanners
        if effect.path is not None:
            path = state.reach.checked(effect.path, sender)
        elif state.folder is not None:
            path = new_recording(state.folder / FOLDER, time.strftime("%Y%m%d-%H%M%S"), "drive")
        else:
            return
        self.context.jobs.start(
            WRITE,
            lambda progress: write_run(path, drive.inputs, drive.columns, scanners, progress),
            then=lambda size: Envelope(_written(path, size, len(drive.columns)), sender),
            failed=lambda job: Envelope(Report(f"{job.name}: {job.error}", listed=f"{job.name} failed"), sender),
        )


def _written(path: Path, size: int, cycles: int) -> Report:
    return Report(f"{path}: {cycles} scans with their estimates, {size / 1e6:.1f} MB", failed=False)
