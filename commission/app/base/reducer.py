"""What an action means: the next state, and what has to be done besides. Pure; knows no widget, no file, no clock."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from typing import Any

from commission.app.base import actions
from commission.app.base.actions import ParameterValue
from commission.app.base.reduction import (
    ApplyParameters,
    CancelJob,
    LoadSource,
    MoveTo,
    PlaceCamera,
    ProcessOneScan,
    ReadProject,
    Reduction,
    Tell,
    WriteProject,
    reduce,
)
from commission.app.base.state import AppState, Edit, Step, edited, with_maps_packed
from commission.app.editing import site_reducer, station_reducer
from commission.app.editing.editor import Tool
from commission.app.editing.reducer import editor_of
from commission.app.exchange import reducer as exchange_reducer
from commission.app.floor_map import reducer as map_reducer
from commission.app.placement import reducer as layout_reducer
from commission.app.plan import reducer as plan
from commission.app.plan.actions import AlsoFails, ClearEllipses, ReadFloor, SetPlan
from commission.errors import UsageError
from commission.site.parameters import Parameters

PROBLEMS_KEPT = 20

# The other reducers are imported because they register what their actions mean.
__all__ = [
    "exchange_reducer",
    "layout_reducer",
    "map_reducer",
    "parameter",
    "reduce",
    "site_reducer",
    "station_reducer",
    "with_parameter",
]


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


@reduce.register
def _(action: actions.SetParameter, state: AppState) -> Reduction:
    if parameter(state.project.parameters, action.key) == action.value:
        return Reduction(state)
    parameters = with_parameter(state.project.parameters, action.key, action.value)
    name = action.key.partition(".")[2].replace("_", " ")
    edit = Edit(f"set {name}", key=action.key, at=action.at)
    changed = edited(state, replace(state.project, parameters=parameters), edit)
    return Reduction(changed, (ApplyParameters(),))


@reduce.register
def _(_action: actions.ResetParameters, state: AppState) -> Reduction:
    if state.project.parameters == state.saved.parameters:
        return Reduction(state)
    project = replace(state.project, parameters=state.saved.parameters)
    return Reduction(edited(state, project, Edit("reset parameters")), (ApplyParameters(),))


@reduce.register
def _(action: actions.Undo, state: AppState) -> Reduction:
    if not state.undo:
        return Reduction(state)
    step = state.undo[-1]
    if _is_anothers(step, action.client, state):
        return Reduction(state, (_in_the_way(step, "undo"),))
    taken_back = Step(state.project, step.name, step.client)
    redo = with_maps_packed((*state.redo, taken_back))
    before = replace(state, project=step.whole, undo=state.undo[:-1], redo=redo, last_edit=None)
    return Reduction(before, (ApplyParameters(),))


@reduce.register
def _(action: actions.Redo, state: AppState) -> Reduction:
    if not state.redo:
        return Reduction(state)
    step = state.redo[-1]
    if _is_anothers(step, action.client, state):
        return Reduction(state, (_in_the_way(step, "redo"),))
    made_again = Step(state.project, step.name, step.client)
    undo = with_maps_packed((*state.undo, made_again))
    after = replace(state, project=step.whole, undo=undo, redo=state.redo[:-1], last_edit=None)
    return Reduction(after, (ApplyParameters(),))


def _is_anothers(step: Step, client: int | None, state: AppState) -> bool:
    """Whether a step belongs to another browser that is still there: only that one takes it back."""
    return client is not None and step.client not in (None, client) and step.client in state.editors


def _in_the_way(step: Step, what: str) -> Tell:
    return Tell(
        f"nothing to {what} here: the newest step, {step.name}, is that of browser {step.client}; "
        f"{what} it there, or here once that browser is closed",
        failed=False,
    )


@reduce.register
def _(action: actions.Save, state: AppState) -> Reduction:
    folder = action.folder or state.folder
    if folder is None:
        raise UsageError("this project is bundled with the program and stays as it is; name a folder to save a copy in")
    return Reduction(state, (WriteProject(state.project, folder, action.overwrite),))


@reduce.register
def _(action: actions.ProjectSaved, state: AppState) -> Reduction:
    saved = replace(
        state,
        saved=action.project,
        folder=action.folder,
        saved_at=action.time_of_day,
        last_edit=None,
        foreign=(),
        greeting="",
    )
    return Reduction(saved, (Tell(f"saved in {action.folder}", failed=False),))


@reduce.register
def _(action: actions.ChangedOnDisk, state: AppState) -> Reduction:
    if action.files == state.foreign:
        return Reduction(state)
    text = f"changed on disk by somebody else: {', '.join(action.files)}; read it again, or save to overwrite it"
    told = (Tell(text, failed=True),) if action.files else ()
    return Reduction(replace(state, foreign=action.files), told)


@reduce.register
def _(_action: actions.Reload, state: AppState) -> Reduction:
    if state.folder is None:
        raise UsageError("this project is bundled with the program; expected one in a folder")
    return Reduction(state, (ReadProject(state.folder),))


@reduce.register
def _(action: actions.Reloaded, state: AppState) -> Reduction:
    read = replace(state, saved=action.project, foreign=())
    return Reduction(edited(read, action.project, Edit("read again from disk")), (ApplyParameters(),))


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
def _(action: actions.RenameProject, state: AppState) -> Reduction:
    name = " ".join(action.name.split())
    if not name:
        raise UsageError("the project was given no name; expected some letters")
    if name == state.project.name:
        return Reduction(state)
    return Reduction(edited(state, replace(state.project, name=name), Edit("rename the project", action.client)))


@reduce.register
def _(action: actions.StopJob, state: AppState) -> Reduction:
    return Reduction(state, (CancelJob(action.number),))


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


@reduce.register
def _(action: SetPlan, state: AppState) -> Reduction:
    return Reduction(replace(state, plan=plan.changed(action, state.plan, state.project)))


@reduce.register
def _(action: ReadFloor, state: AppState) -> Reduction:
    if action.client is not None and editor_of(state, action.client).tool is not Tool.SELECT:
        return Reduction(state)
    return Reduction(replace(state, plan=plan.clicked(action, state.plan, state.project)))


@reduce.register
def _(_action: ClearEllipses, state: AppState) -> Reduction:
    return Reduction(replace(state, plan=replace(state.plan, spots=())))


@reduce.register
def _(action: AlsoFails, state: AppState) -> Reduction:
    return Reduction(replace(state, plan=plan.also_fails(action, state.plan, state.project)))
