"""From a chosen source to a drive: simulated or read, with the belief that the localizer starts from.

Runs as a background job: plain values in, a plain value out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.app.run.actions import RecordedDrive, Source, VirtualDrive
from commission.errors import SourceError
from commission.io.recordings.base import load_log
from commission.progress import Progress
from commission.simulation import scenario
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.start import Start, StartOrigin, belief_at, start_of


@dataclass(frozen=True, slots=True)
class Drive:
    """What a run goes over."""

    log: RecordLog
    """All records."""
    start: Start
    """Where the vehicle is said to be at the start, and how well that is known."""


def prepare(project: Project, source: Source, progress: Progress) -> Drive:
    """Simulate or read a drive.

    Parameters
    ----------
    project : site, vehicle, scanner, and the disturbances of a virtual drive.
    source : what drives.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    CommissionError
        the route does not exist or cannot be driven, the recording cannot be read or holds no scan.
    """
    if isinstance(source, VirtualDrive):
        return _simulated(project, source, progress)
    return _recorded(project, source, progress)


def _simulated(project: Project, source: VirtualDrive, progress: Progress) -> Drive:
    if source.people is not None:
        project = replace(project, disturbances=replace(project.disturbances, people=source.people))
    start = scenario.start_of(project, source.route)
    log = scenario.virtual_drive(project, source.route, source.seed, progress=progress)
    return Drive(log, Start(belief_at(log.first_ns, start.pose, start.sigmas.tolist()), StartOrigin.DRIVE))


def _recorded(project: Project, source: RecordedDrive, progress: Progress) -> Drive:
    progress(0.0, "reading the recording")
    log = load_log(source.path)
    if not log.scans and not len(log.detection_stamps_ns) + len(log.tags) + len(log.bearings):
        expected = "scans.npz, detections.csv, tags.csv or bearings.csv"
        raise SourceError(f"{source.path} holds no scan; expected {expected}")
    return Drive(log, start_of(project, log))
