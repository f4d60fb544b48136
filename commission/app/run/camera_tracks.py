"""How a camera moved over the drive, where its recording has a contour: found in the background, beside the run."""

from __future__ import annotations

from pathlib import Path

from commission.app.base.actions import Report
from commission.app.base.jobs import Job
from commission.app.base.service import Context
from commission.app.run.actions import RecordedDrive, Source
from commission.io.recordings.contour_file import CONTOUR, read_contour
from commission.progress import Progress
from commission.studies.run import RunResult
from commission.studies.vision import VisionInput, VisionResult, vision

JOB = "Camera by its contour"
"""Name of the job."""


class CameraTracks:
    """Both tracks of the camera; called by the owner thread alone.

    Parameters
    ----------
    context : what the service of the run is made with.
    """

    def __init__(self, context: Context) -> None:
        self._jobs = context.jobs
        self.found: VisionResult | None = None
        """The tracks of the drive that is there; none where its recording has no contour, or one that tells nothing."""

    def take(self, result: RunResult, source: Source | None) -> None:
        """Find how the camera moved over a drive.

        Parameters
        ----------
        result : the whole drive.
        source : what drove it; its recording may have a contour.
        """
        self.found = None
        self._jobs.cancel(JOB)
        path = source.path / CONTOUR if isinstance(source, RecordedDrive) else None
        if path is not None and path.is_file():
            self._start(result, path)

    def _start(self, result: RunResult, path: Path) -> None:
        def look(progress: Progress) -> VisionResult:
            return vision(VisionInput.of(result.columns, read_contour(path)), progress)

        self._jobs.start(JOB, look, then=self._keep, failed=_told)

    def _keep(self, found: VisionResult) -> None:
        self.found = found


def _told(job: Job) -> Report:
    return Report(f"{job.name}: {job.error}")
