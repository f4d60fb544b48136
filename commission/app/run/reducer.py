"""What the actions of the run mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.run import actions
from commission.app.run.effects import CoverFromHere, DriveAgain, LoadSource, MoveByScans, MoveTo, PlayOn, RunAfresh
from commission.app.run.state import SPEEDS, RunState
from commission.site.fields import with_field


def _with(state: AppState, **changes: Any) -> AppState:
    """Return the state with the run asked to do something else."""
    return state.with_part(replace(state.part(RunState), **changes))


@reduce.register
def choose_source(action: actions.ChooseSource, state: AppState, _sender: Sender) -> Outcome:
    """Load what drives."""
    if isinstance(action.source, actions.VirtualDrive):
        state.project.route(action.source.route)
    return Outcome(_with(state, source=action.source), (LoadSource(action.source),))


@reduce.register
def play(action: actions.Play, state: AppState, _sender: Sender) -> Outcome:
    """Start or stop the play clock."""
    playing = not state.part(RunState).playing if action.playing is None else action.playing
    backward = action.backward and playing
    effects = (PlayOn(backward),) if playing else ()
    return Outcome(_with(state, playing=playing, backward=backward), effects)


@reduce.register
def step_scan(action: actions.StepScan, state: AppState, _sender: Sender) -> Outcome:
    """Pause and go on, or back, by one scan."""
    return Outcome(_with(state, playing=False), (MoveByScans(-1 if action.back else 1),))


@reduce.register
def set_speed(action: actions.SetSpeed, state: AppState, _sender: Sender) -> Outcome:
    """Let the play clock run at another speed."""
    if not SPEEDS[0] <= action.factor <= SPEEDS[-1]:
        raise ValueError(f"speed is {action.factor:g}; expected {SPEEDS[0]:g} to {SPEEDS[-1]:g} times real time")
    return Outcome(_with(state, speed=action.factor))


@reduce.register
def seek(action: actions.Seek, state: AppState, _sender: Sender) -> Outcome:
    """Go to a time of the drive."""
    if not action.time >= 0.0:
        raise ValueError(f"time is {action.time:g}; expected 0 s or more")
    return Outcome(state, (MoveTo(action.time),))


@reduce.register
def restart(_action: actions.Restart, state: AppState, _sender: Sender) -> Outcome:
    """Begin again."""
    return Outcome(state, (RunAfresh(),))


@reduce.register
def repeat(action: actions.Repeat, state: AppState, _sender: Sender) -> Outcome:
    """Choose what happens at the end of the drive."""
    return Outcome(_with(state, repeat=action.repeat))


@reduce.register
def cover(action: actions.Cover, state: AppState, _sender: Sender) -> Outcome:
    """Cover or uncover the reflectors."""
    return Outcome(state, (CoverFromHere(action.covered),))


@reduce.register
def color_trail(action: actions.ColorTrail, state: AppState, _sender: Sender) -> Outcome:
    """Choose what the trail shows."""
    return Outcome(_with(state, trail_by=action.by))


@reduce.register
def edit_from_here_on(action: actions.EditFromHereOn, state: AppState, _sender: Sender) -> Outcome:
    """Choose what edits act on."""
    return Outcome(_with(state, from_here_on=action.from_here_on))


@reduce.register
def move_only_the_map(action: actions.MoveOnlyTheMap, state: AppState, _sender: Sender) -> Outcome:
    """Choose whether the hall follows the site."""
    return Outcome(_with(state, only_the_map=action.only_the_map), (DriveAgain(),))


@reduce.register
def set_disturbance(action: actions.SetDisturbance, state: AppState, sender: Sender) -> Outcome:
    """Change one number of the virtual world: one undo step for a moved slider."""
    disturbances = with_field(state.project.disturbances, action.name, action.value, "disturbance")
    if disturbances == state.project.disturbances:
        return Outcome(state)
    edit = Edit("change the virtual world", sender, f"disturbances.{action.name}")
    return Outcome(edited(state, replace(state.project, disturbances=disturbances), edit))
