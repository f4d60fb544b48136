"""What the actions of the run mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from commission.app.base.actions import Sender
from commission.app.base.effects import SendFile
from commission.app.base.growing import RunGrew
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.run import actions
from commission.app.run.actions import ShowLive
from commission.app.run.charts import BY_TITLE
from commission.app.run.effects import (
    CoverFromHere,
    DriveAgain,
    LoadSource,
    LocateFromHere,
    MakeCurves,
    MoveByScans,
    MoveTo,
    PlayOn,
    RunAfresh,
    ShowGrown,
)
from commission.app.run.found_table import BY_KEY
from commission.app.run.state import SPEEDS, PlotWindow, RunState
from commission.site.fields import with_field

LONGEST_DRIVE_S = 1e9
SHORTEST_SPAN_S = 0.01
"""Shortest stretch that plots show [s]."""


def _with(state: AppState, **changes: Any) -> AppState:
    """Return the state with the run asked to do something else."""
    return state.with_part(replace(state.part(RunState), **changes))


@reduce.register
def choose_source(action: actions.ChooseSource, state: AppState, _sender: Sender) -> Outcome:
    """Load what drives; what drives now stays what is shown until that has come."""
    if isinstance(action.source, actions.VirtualDrive):
        state.project.route(action.source.route)
    return Outcome(state, (LoadSource(action.source),))


@reduce.register
def source_loaded(action: actions.SourceLoaded, state: AppState, _sender: Sender) -> Outcome:
    """Say that it drives."""
    return Outcome(_with(state, source=action.source, live=False))


@reduce.register
def run_grew(action: RunGrew, state: AppState, _sender: Sender) -> Outcome:
    """Show a live run as far as it has come, unless something else was chosen since it began."""
    return Outcome(state, (ShowGrown(action),))


@reduce.register
def show_live(_action: ShowLive, state: AppState, _sender: Sender) -> Outcome:
    """Say that a vehicle drives now."""
    return Outcome(_with(state, source=None, live=True, playing=False))


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
def locate(_action: actions.Locate, state: AppState, _sender: Sender) -> Outcome:
    """Throw the pose away."""
    return Outcome(state, (LocateFromHere(),))


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


@reduce.register
def show_span(action: actions.ShowSpan, state: AppState, sender: Sender) -> Outcome:
    """Show a stretch of the drive, or all of it."""
    span = action.span
    if span is not None:
        begin, end = span
        if not 0.0 <= begin < end <= LONGEST_DRIVE_S:
            raise ValueError(f"the plots are to show {begin:g} to {end:g} s; expected 0 s or more, and the end later")
        middle, half = 0.5 * (begin + end), 0.5 * max(end - begin, SHORTEST_SPAN_S)
        span = max(middle - half, 0.0), middle + half
    return Outcome(_with_window(state, sender, span=span))


@reduce.register
def show_charts(action: actions.ShowCharts, state: AppState, sender: Sender) -> Outcome:
    """Choose which plots are shown."""
    unknown = [title for title in action.titles if title not in BY_TITLE]
    if unknown or not action.titles:
        found = repr(unknown[0]) if unknown else "none"
        raise ValueError(f"the plots are to show {found}; expected one or more of {', '.join(BY_TITLE)}")
    titles = tuple(title for title in BY_TITLE if title in action.titles)
    return Outcome(_with_window(state, sender, titles=titles))


@reduce.register
def color_reflectors(action: actions.ColorReflectors, state: AppState, _sender: Sender) -> Outcome:
    """Choose the figure that the floor shows."""
    if action.figure and action.figure not in BY_KEY:
        raise ValueError(f"reflectors are to be colored by {action.figure!r}; expected one of {', '.join(BY_KEY)}")
    return Outcome(_with(state, figure=action.figure))


@reduce.register
def save_curves(_action: actions.SaveCurves, state: AppState, sender: Sender) -> Outcome:
    """Begin to write a table of what is shown."""
    return Outcome(state, (MakeCurves(state.of_browser(sender.browser, PlotWindow)),))


@reduce.register
def curves_made(action: actions.CurvesMade, state: AppState, _sender: Sender) -> Outcome:
    """Let the browser save it."""
    return Outcome(state, (SendFile(action.name, action.content),))


def _with_window(state: AppState, sender: Sender, **changes: Any) -> AppState:
    """Return the state in which one browser's plots show something else."""
    window = state.of_browser(sender.browser, PlotWindow)
    return state.with_browser(sender.browser, replace(window, **changes))
