"""The map against the drive that is shown: asked for, ticked, and corrected in one undo step. Pure.

Importing it registers its actions with `reduce`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.shown_run import LearnedFromDrive
from commission.app.base.state import AppState, Edit, edited
from commission.app.tune.calibration_state import CalibrationState
from commission.errors import UsageError
from commission.site.project import Project
from commission.studies.map_correction import corrected, why_not
from commission.studies.map_findings import MapFault, MapFinding
from commission.studies.run import RunInput


@dataclass(frozen=True, slots=True)
class CheckMap(Action):
    """Hold the reflector map against the drive that is shown; what was found before is dropped."""


@dataclass(frozen=True, slots=True)
class DropMapCheck(Action):
    """Drop what was found, or stop looking."""


@dataclass(frozen=True, slots=True)
class TickFinding(Action):
    """Let a finding be corrected with the others, or not."""

    id: str
    """Of its reflector."""
    wanted: bool
    """Whether it is to be corrected."""


@dataclass(frozen=True, slots=True)
class CorrectMap(LearnedFromDrive):
    """Correct the map by what is ticked, in one undo step."""

    findings: tuple[MapFinding, ...]
    """What was ticked, as it was seen on the page."""


@dataclass(frozen=True, slots=True)
class MapCheckState:
    """What is asked for."""

    project: Project | None = None
    """The site as it was when it was asked for; none: nothing is asked for."""
    drive: RunInput | None = None
    """The drive that it is held against."""
    asked: int = 0
    """How often it was asked for."""
    turned: frozenset[str] = frozenset()
    """Reflectors whose tick is not as it is at first."""

    def is_ticked(self, finding: MapFinding) -> bool:
        """Whether a finding is to be corrected: what may be a shiny column is not, unless a person says so."""
        at_first = finding.fault in {MapFault.MOVED, MapFault.MISSING}
        return at_first is not (finding.id in self.turned)


@reduce.register
def check_map(_action: CheckMap, state: AppState, _sender: Sender) -> Outcome:
    """Look at the drive that is shown with the project as it is now; raises UsageError where there is none."""
    shown = state.part(CalibrationState).shown
    if shown is None:
        raise UsageError("no drive is shown that the map could be held against; open a recording, or drive a route")
    asked = state.part(MapCheckState).asked + 1
    return Outcome(state.with_part(MapCheckState(state.project, shown.inputs, asked)))


@reduce.register
def drop_map_check(_action: DropMapCheck, state: AppState, _sender: Sender) -> Outcome:
    """Forget what was found; what was corrected stays."""
    return Outcome(state.with_part(MapCheckState(asked=state.part(MapCheckState).asked)))


@reduce.register
def tick_finding(action: TickFinding, state: AppState, _sender: Sender) -> Outcome:
    """Turn the tick of one finding."""
    asked = state.part(MapCheckState)
    turned = asked.turned ^ {action.id}
    return Outcome(state.with_part(replace(asked, turned=turned)))


@reduce.register
def correct_map(action: CorrectMap, state: AppState, sender: Sender) -> Outcome:
    """Correct all that is ticked, or nothing; raises UsageError where one of them can no longer be corrected."""
    if not action.findings:
        raise UsageError("nothing is ticked; expected at least one finding to correct the map by")
    for finding in action.findings:
        reason = why_not(state.project.reflectors, finding)
        if reason:
            raise UsageError(f"{finding.id}: {reason}; the map stays as it is")
    reflectors = corrected(state.project.reflectors, action.findings, add_new=True)
    edit = Edit("correct the map", sender)
    return Outcome(edited(state, replace(state.project, reflectors=reflectors), edit))
