"""What loading a floor map means for the page's state. Pure; importing it registers its actions with `reduce`."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from typing import Any

from commission.app.base.actions import View
from commission.app.base.extent import extent_of
from commission.app.base.reduction import PlaceCamera, Reduction, Tell, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.base.uploads import Upload
from commission.app.editing.editor import Tool
from commission.app.floor_map import actions, tools
from commission.app.floor_map.draft import (
    ENDINGS,
    MAP_ENDINGS,
    PICTURE_ENDINGS,
    MapDraft,
    MapLoading,
    MapOptions,
    Stage,
    WaitingMap,
)
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.errors import UsageError
from commission.io.image_map import Picture
from commission.io.mesh import Model
from commission.site.project import Project


@reduce.register
def _(action: actions.OpenMap, state: AppState) -> Reduction:
    file, mapping = action.file, replace(state.mapping, trouble="", notes=())
    if file.ending not in ENDINGS:
        known = ", ".join(f".{ending}" for ending in ENDINGS)
        return reduce(actions.MapFailed(f"{file.name}: is no floor map; expected a file that ends in {known}"), state)
    if not isinstance(file.source, Upload):
        return Reduction(replace(state, mapping=mapping), (ReadMapFile(action.client, file),))
    if file.ending in MAP_ENDINGS:
        read = ReadMapFile(action.client, file, image=mapping.image)
        return Reduction(replace(state, mapping=replace(mapping, waiting=None)), (read,))
    if file.ending not in PICTURE_ENDINGS:
        return Reduction(replace(state, mapping=mapping), (ReadMapFile(action.client, file),))
    waiting = mapping.waiting
    if waiting is not None and file.name != waiting.image:
        text = f"{file.name}: is not the image of {waiting.file.name}; expected {waiting.image}"
        return reduce(actions.MapFailed(text), state)
    mapping = replace(mapping, image=file)
    read = ReadMapFile(action.client, file) if waiting is None else ReadMapFile(action.client, waiting.file, image=file)
    return Reduction(replace(state, mapping=mapping), (read,))


@reduce.register
def _(action: actions.ImageMissing, state: AppState) -> Reduction:
    waiting = WaitingMap(action.file, action.image)
    text = f"{action.file.name} needs its image: upload {action.image}, too"
    return Reduction(
        replace(state, mapping=replace(state.mapping, waiting=waiting, draft=None)), (Tell(text, failed=False),)
    )


@reduce.register
def _(action: actions.MapFailed, state: AppState) -> Reduction:
    text = " ".join(action.text.split())
    return Reduction(replace(state, mapping=replace(state.mapping, trouble=text)), (Tell(text, failed=True),))


@reduce.register
def _(action: actions.MapOpened, state: AppState) -> Reduction:
    before = state.mapping.draft
    options = before.options if before is not None and before.file is action.file else _usual(action, state.project)
    draft = MapDraft(action.file, action.read, action.reading, options)
    if isinstance(action.read, Picture):
        draft = replace(draft, stage=_stage(action.read, state.project))
    opened = replace(state, mapping=replace(state.mapping, draft=draft, waiting=None, trouble=""))
    return (
        reduce(actions.ClickPicture(action.client), opened) if isinstance(action.read, Picture) else Reduction(opened)
    )


def _usual(action: actions.MapOpened, project: Project) -> MapOptions:
    """Return the options to begin with: a model is cut where the reflectors hang."""
    heights = sorted({r.height for r in project.reflectors.reflectors})[:20]
    return MapOptions(heights=tuple(heights)) if isinstance(action.read, Model) and heights else MapOptions()


def _stage(picture: Picture, project: Project) -> Stage:
    """Return where to show a picture: in the middle of what is in view, as large as that."""
    extent, (columns, rows) = extent_of(project), picture.size
    (width, height), (x, y) = extent.size, extent.center
    pixel = min(width / columns, height / rows)
    return Stage(pixel, x - 0.5 * columns * pixel, y + 0.5 * rows * pixel)


@reduce.register
def _(action: actions.ClickPicture, state: AppState) -> Reduction:
    draft = _draft(state)
    editor = replace(state.editor(action.client), tool=Tool.CALIBRATE, drag=None, draft=(), measured=())
    cleared = replace(state, mapping=replace(state.mapping, draft=replace(draft, pixels=())))
    return Reduction(cleared.with_editor(action.client, editor), (PlaceCamera(action.client, View.FIT),))


@reduce.register
def _(action: actions.SetReading, state: AppState) -> Reduction:
    draft = _draft(state)
    if action.reading == draft.reading:
        return Reduction(state)
    return Reduction(state, (ReadMapFile(action.client, draft.file, action.reading),))


@reduce.register
def _(action: actions.SetMapOption, state: AppState) -> Reduction:
    draft = _draft(state)
    if action.name not in {field.name for field in dataclasses.fields(MapOptions)}:
        raise UsageError(f"a floor map has no option {action.name!r}")
    changes: dict[str, Any] = {action.name: action.value}
    options = replace(draft.options, **changes)
    return Reduction(replace(state, mapping=replace(state.mapping, draft=replace(draft, options=options))))


@reduce.register
def _(action: actions.MakeMap, state: AppState) -> Reduction:
    return Reduction(state, (DrawMap(action.client, _draft(state)),))


@reduce.register
def _(_action: actions.StopMapJob, state: AppState) -> Reduction:
    return Reduction(state, (StopMapWork(),))


@reduce.register
def _(_action: actions.DiscardMap, state: AppState) -> Reduction:
    return Reduction(_without_calibration(replace(state, mapping=MapLoading())), (StopMapWork(),))


@reduce.register
def _(action: actions.SetPen, state: AppState) -> Reduction:
    return Reduction(state.with_editor(action.client, replace(state.editor(action.client), pen=action.pen)))


@reduce.register
def _(action: actions.FinishShape, state: AppState) -> Reduction:
    return tools.finished(state, action.client)


@reduce.register
def _(action: actions.SetPlantPoint, state: AppState) -> Reduction:
    points = list(state.editor(action.client).alignment.points)
    if action.index < len(points):
        points[action.index] = replace(points[action.index], plant=action.plant, name=action.name)
    return _aligning(state, action.client, points=tuple(points))


@reduce.register
def _(action: actions.SetAligned, state: AppState) -> Reduction:
    return _aligning(state, action.client, everything=action.everything)


def _aligning(state: AppState, client: int, **changes: Any) -> Reduction:
    """Change what one browser aligns by."""
    editor = state.editor(client)
    alignment = replace(editor.alignment, **changes)
    return Reduction(state.with_editor(client, replace(editor, alignment=alignment)))


@reduce.register
def _(action: actions.AlignMap, state: AppState) -> Reduction:
    return tools.align_map(action, state)


@reduce.register
def _(action: actions.MapMade, state: AppState) -> Reduction:
    width, height = action.floor_map.size
    said = f"{action.file.name}: {width:.1f} x {height:.1f} m, cells of {1000 * action.floor_map.resolution:.4g} mm"
    project = replace(state.project, floor_map=action.floor_map)
    edit = Edit(f"load floor map {action.file.name}", action.client)
    loaded = replace(edited(state, project, edit), mapping=MapLoading(notes=(said, *action.notes)))
    # The site may be elsewhere now, for everybody.
    cameras = tuple(PlaceCamera(client, View.FIT) for client in state.editors)
    return Reduction(_without_calibration(loaded), cameras)


def _without_calibration(state: AppState) -> AppState:
    """Return the state with nobody clicking on a picture that is not there any more."""
    editors = {
        client: replace(editor, tool=Tool.SELECT) if editor.tool is Tool.CALIBRATE else editor
        for client, editor in state.editors.items()
    }
    return replace(state, editors=editors)


def _draft(state: AppState) -> MapDraft:
    draft = state.mapping.draft
    if draft is None:
        raise UsageError("no file is open to load a floor map from; expected one")
    return draft
