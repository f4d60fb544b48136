"""What an action means: the next state, and what has to be done besides. Pure; knows no widget, no file, no clock."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, replace
from functools import singledispatch
from pathlib import Path
from typing import Any, TypeAlias

from commission.app import actions
from commission.app.actions import Action, ParameterValue, Source, View
from commission.app.store import AppState, LastEdit
from commission.errors import UsageError
from commission.site.parameters import Parameters
from commission.site.project import Project

UNDO_STEPS = 200
MERGE_WITHIN_S = 1.0
PROBLEMS_KEPT = 20


@dataclass(frozen=True, slots=True)
class LoadSource:
    """Simulate or read what drives."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True)
class ApplyParameters:
    """Hand the project's parameters to the running localizer."""


@dataclass(frozen=True, slots=True)
class WriteProject:
    """Write the project."""

    project: Project
    """What to write."""
    folder: Path
    """Where to."""


@dataclass(frozen=True, slots=True)
class MoveTo:
    """Bring the run to a time of the drive."""

    time: float
    """Seconds after its start [s]."""
    afresh: bool = False
    """Whether it begins again at the initial pose even when the time is ahead."""


@dataclass(frozen=True, slots=True)
class ProcessOneScan:
    """Let the localizer process one more scan."""


@dataclass(frozen=True, slots=True)
class Tell:
    """Show a notification."""

    text: str
    """One line."""
    failed: bool
    """Whether something went wrong."""


@dataclass(frozen=True, slots=True)
class PlaceCamera:
    """Change what one browser looks at."""

    client: int
    """Number of the browser's connection."""
    view: View
    """What it looks at."""


Effect: TypeAlias = LoadSource | ApplyParameters | WriteProject | MoveTo | ProcessOneScan | Tell | PlaceCamera


@dataclass(frozen=True, slots=True)
class Reduction:
    """Outcome of one action."""

    state: AppState
    """The next state."""
    effects: tuple[Effect, ...] = ()
    """What has to be done besides, in this order."""


def parameter(parameters: Parameters, key: str) -> ParameterValue:
    """Return the value of `group.name`; raises UsageError when there is none."""
    group, _, name = key.partition(".")
    value = getattr(getattr(parameters, group, None), name, None) if name.isidentifier() else None
    if not isinstance(value, bool | int | float | str):
        raise UsageError(f"no parameter is called {key!r}; expected group.name as in project.yaml")
    return value


def with_parameter(parameters: Parameters, key: str, value: ParameterValue) -> Parameters:
    """Return parameters with one changed; raises UsageError (unknown) or ValueError (out of range)."""
    parameter(parameters, key)
    group, _, name = key.partition(".")
    changes: dict[str, Any] = {group: dataclasses.replace(getattr(parameters, group), **{name: value})}
    return dataclasses.replace(parameters, **changes)


@singledispatch
def reduce(action: Action, state: AppState) -> Reduction:
    """Return what follows from an action.

    Parameters
    ----------
    action : what was asked for.
    state : the state it was asked in.

    Raises
    ------
    CommissionError, ValueError
        the action asks for something that does not exist or is out of range; the state stays as it is.
    """
    raise TypeError(f"{type(action).__name__} is not an action; state has playing = {state.playing}")


@reduce.register
def _(action: actions.SetParameter, state: AppState) -> Reduction:
    if parameter(state.project.parameters, action.key) == action.value:
        return Reduction(state)
    parameters = with_parameter(state.project.parameters, action.key, action.value)
    last = state.last_edit
    merged = last is not None and last.key == action.key and action.at - last.at <= MERGE_WITHIN_S
    undo = state.undo if merged else (*state.undo, state.project)[-UNDO_STEPS:]
    edited = replace(
        state,
        project=replace(state.project, parameters=parameters),
        undo=undo,
        redo=(),
        last_edit=LastEdit(action.key, action.at),
    )
    return Reduction(edited, (ApplyParameters(),))


@reduce.register
def _(_action: actions.ResetParameters, state: AppState) -> Reduction:
    if state.project.parameters == state.saved.parameters:
        return Reduction(state)
    edited = replace(
        state,
        project=replace(state.project, parameters=state.saved.parameters),
        undo=(*state.undo, state.project)[-UNDO_STEPS:],
        redo=(),
        last_edit=None,
    )
    return Reduction(edited, (ApplyParameters(),))


@reduce.register
def _(_action: actions.Undo, state: AppState) -> Reduction:
    if not state.undo:
        return Reduction(state)
    before = replace(
        state, project=state.undo[-1], undo=state.undo[:-1], redo=(*state.redo, state.project), last_edit=None
    )
    return Reduction(before, (ApplyParameters(),))


@reduce.register
def _(_action: actions.Redo, state: AppState) -> Reduction:
    if not state.redo:
        return Reduction(state)
    after = replace(
        state, project=state.redo[-1], redo=state.redo[:-1], undo=(*state.undo, state.project), last_edit=None
    )
    return Reduction(after, (ApplyParameters(),))


@reduce.register
def _(action: actions.Save, state: AppState) -> Reduction:
    folder = action.folder or state.folder
    if folder is None:
        raise UsageError("this project is bundled with the program and stays as it is; name a folder to save a copy in")
    return Reduction(state, (WriteProject(state.project, folder),))


@reduce.register
def _(action: actions.ProjectSaved, state: AppState) -> Reduction:
    saved = replace(state, saved=action.project, folder=action.folder, saved_at=action.time_of_day, last_edit=None)
    return Reduction(saved, (Tell(f"saved in {action.folder}", failed=False),))


@reduce.register
def _(action: actions.ChooseSource, state: AppState) -> Reduction:
    if isinstance(action.source, actions.VirtualDrive):
        state.project.route(action.source.route)
    return Reduction(replace(state, source=action.source), (LoadSource(action.source),))


@reduce.register
def _(action: actions.Play, state: AppState) -> Reduction:
    playing = not state.playing if action.playing is None else action.playing
    return Reduction(replace(state, playing=playing))


@reduce.register
def _(_action: actions.Step, state: AppState) -> Reduction:
    return Reduction(replace(state, playing=False), (ProcessOneScan(),))


@reduce.register
def _(action: actions.SetSpeed, state: AppState) -> Reduction:
    if not 0.25 <= action.factor <= 50.0:
        raise ValueError(f"speed is {action.factor:g}; expected 0.25 to 50 times real time")
    return Reduction(replace(state, speed=action.factor))


@reduce.register
def _(action: actions.Seek, state: AppState) -> Reduction:
    if not action.time >= 0.0:
        raise ValueError(f"time is {action.time:g}; expected 0 s or more")
    return Reduction(state, (MoveTo(action.time),))


@reduce.register
def _(_action: actions.Restart, state: AppState) -> Reduction:
    return Reduction(state, (MoveTo(0.0, afresh=True),))


@reduce.register
def _(action: actions.Repeat, state: AppState) -> Reduction:
    return Reduction(replace(state, repeat=action.repeat))


@reduce.register
def _(action: actions.Cover, state: AppState) -> Reduction:
    return Reduction(replace(state, covered=action.covered))


@reduce.register
def _(action: actions.ShowLayer, state: AppState) -> Reduction:
    hidden = state.hidden - {action.name} if action.visible else state.hidden | {action.name}
    return Reduction(replace(state, hidden=hidden))


@reduce.register
def _(action: actions.Magnify, state: AppState) -> Reduction:
    if not 1.0 <= action.factor <= 100.0:
        raise ValueError(f"ellipse scale is {action.factor:g}; expected 1 to 100")
    return Reduction(replace(state, magnify=action.factor))


@reduce.register
def _(action: actions.SetView, state: AppState) -> Reduction:
    return Reduction(state, (PlaceCamera(action.client, action.view),))


@reduce.register
def _(action: actions.Report, state: AppState) -> Reduction:
    text = " ".join(action.text.split())
    told = (Tell(text, action.failed),)
    if not action.failed:
        return Reduction(state, told)
    return Reduction(replace(state, problems=(*state.problems, text)[-PROBLEMS_KEPT:]), told)


@reduce.register
def _(_action: actions.ClearProblems, state: AppState) -> Reduction:
    return Reduction(replace(state, problems=()))
