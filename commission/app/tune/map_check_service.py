"""Holds the map against the drive in the background, and says how what it finds stands to the map of now."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.jobs import Lane
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.tune.calibration_state import CalibrationState
from commission.app.tune.map_check import MapCheckState
from commission.progress import Progress
from commission.site.project import Project
from commission.studies.map_correction import why_not
from commission.studies.map_findings import MapFinding
from commission.studies.monitor import Monitor, MonitorInput, diagnosed_drive, monitor
from commission.studies.run import RunInput

MAP_CHECK = "Map against the drive"
"""Name of the job."""
THIS_DRIVE = "this drive"
"""What the monitor calls the one on the page."""


@dataclass(frozen=True, slots=True)
class FindingLine:
    """One finding on the page."""

    finding: MapFinding
    """What was found."""
    why_not: str
    """Why it changes nothing in the map of now; empty: it would."""
    is_ticked: bool
    """Whether it is to be corrected with the others."""


@dataclass(frozen=True, slots=True, eq=False)
class MapCheckView:
    """What was found, and how it stands to the map of now."""

    found: Monitor
    """What the drive shows."""
    lines: tuple[FindingLine, ...]
    """One for each finding."""
    is_of_drive: bool
    """Whether it is of the drive that is shown."""

    @property
    def ticked(self) -> tuple[MapFinding, ...]:
        """What is to be corrected."""
        return tuple(line.finding for line in self.lines if line.is_ticked)


def map_check_view(found: Monitor, state: AppState) -> MapCheckView:
    """Hold what was found against the map of now.

    Parameters
    ----------
    found : what the drive shows.
    state : the project of now, the ticks, and the drive that is shown.
    """
    asked, shown = state.part(MapCheckState), state.part(CalibrationState).shown
    lines: list[FindingLine] = []
    for finding in found.findings:
        reason = why_not(state.project.reflectors, finding)
        lines.append(FindingLine(finding, reason, not reason and asked.is_ticked(finding)))
    is_of_drive = shown is not None and asked.drive is not None and shown.inputs.log is asked.drive.log
    return MapCheckView(found, tuple(lines), is_of_drive)


class MapCheckService(Service):
    """What was found by the newest request."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[RunInput, Monitor](MAP_CHECK, context.jobs, Lane.PATIENT)
        self._memo = Memo[MapCheckView | None]()
        self._asked = 0
        self.view: MapCheckView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Look once for each time that it is asked for; what was found before is dropped then."""
        asked, before = state.part(MapCheckState), self.view
        project, drive = asked.project, asked.drive
        if project is None or drive is None or asked.asked != self._asked:
            self._asked = asked.asked
            self._kept.drop()
        if project is not None and drive is not None:
            self._kept.ask(asked.asked, drive, lambda progress: _looked(project, drive, progress))
        found = self._kept.result
        key = (found, state.project, asked, state.part(CalibrationState).shown)
        self.view = self._memo.of(key, lambda: None if found is None else map_check_view(found, state))
        return Due.NEVER if self.view is before else Due.SOON


def _looked(project: Project, drive: RunInput, progress: Progress) -> Monitor:
    """Hold one drive against the map."""
    found = diagnosed_drive(project, drive.log, drive.start, progress)
    return monitor(MonitorInput(names=(THIS_DRIVE,), diagnoses=(found,)))
