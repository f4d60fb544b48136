"""What is asked of the clocks of the scanners. Pure; importing it registers the handlers with `reduce`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.live.actions import ClocksFound, FindClocks, SetClock, UseArrivalClocks, UseClocks
from commission.app.live.effects import StudyClocks
from commission.app.live.state import ClockState
from commission.errors import UsageError
from commission.site.fields import with_field
from commission.site.project import Project
from commission.studies.arrival import ArrivalOffset
from commission.studies.clock import ClockOffset


@reduce.register
def set_clock(action: SetClock, state: AppState, sender: Sender) -> Outcome:
    """Set one scanner's clock by hand."""
    project = _with_clocks(state.project, {action.name: action.value})
    if project is state.project:
        return Outcome(state)
    return Outcome(edited(state, project, Edit("set a clock", sender, f"clock {action.name}")))


@reduce.register
def find_clocks(action: FindClocks, state: AppState, _sender: Sender) -> Outcome:
    """Find the clocks in the background; what was found before is of another drive."""
    return Outcome(state.with_part(ClockState()), (StudyClocks(action.drive),))


@reduce.register
def clocks_found(action: ClocksFound, state: AppState, _sender: Sender) -> Outcome:
    """Show what was found."""
    return Outcome(state.with_part(ClockState(action.found)))


@reduce.register
def use_clocks(_action: UseClocks, state: AppState, sender: Sender) -> Outcome:
    """Set all clocks of which the drive says that they are others."""
    return _used(state, state.part(ClockState).found, ("the drive", Edit("set clocks by motion", sender)))


@reduce.register
def use_arrival_clocks(action: UseArrivalClocks, state: AppState, sender: Sender) -> Outcome:
    """Set all clocks of which arrival says that they are others."""
    return _used(state, action.found, ("arrival", Edit("set clocks by arrival", sender)))


def _used(state: AppState, found: Sequence[ClockOffset] | Sequence[ArrivalOffset], by: tuple[str, Edit]) -> Outcome:
    """Set what is found of clocks; raises UsageError where none is another one than the project says."""
    clocks = {scanner.name: scanner.clock_offset for scanner in state.project.scanners}
    shown = {
        each.scanner: each.offset
        for each in found
        if each.scanner in clocks and each.differs_from(clocks[each.scanner])
    }
    if not shown:
        raise UsageError(f"{by[0]} shows no clock that is another one; expected one that differs by more than 2-sigma")
    project = _with_clocks(state.project, shown)
    return Outcome(state if project is state.project else edited(state, project, by[1]))


def _with_clocks(project: Project, offsets: Mapping[str, object]) -> Project:
    """Return the project with the clocks [s] of some scanners; the same one where nothing changes."""
    scanners = tuple(
        with_field(each, "clock_offset", offsets[each.name], "scanner") if each.name in offsets else each
        for each in project.scanners
    )
    before = [each.clock_offset for each in project.scanners]
    if [each.clock_offset for each in scanners] == before:
        return project
    return replace(project, scanners=scanners)
