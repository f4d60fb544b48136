"""What loading a floor map means for the page's state. Pure; importing it registers its actions with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Camera, Sender
from commission.app.base.effects import PlaceCamera, Tell
from commission.app.base.extent import extent_of
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.base.uploads import Upload
from commission.app.editing.editor import editor_of, with_tool
from commission.app.floor_map import actions, align_tool
from commission.app.floor_map.align_tool import AlignTool, PlantSurvey
from commission.app.floor_map.draft import (
    ENDINGS,
    MAP_ENDINGS,
    PICTURE_ENDINGS,
    MapDraft,
    MapLoading,
    MapOptions,
    MapTrouble,
    Stage,
    WaitingMap,
)
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.app.floor_map.pen import MapPen
from commission.app.floor_map.tools import CalibrateTool
from commission.errors import UsageError
from commission.io.image_map import Picture
from commission.io.mesh import Model
from commission.io.plant_points import surveyed_points
from commission.site.editing.plant_fit import fit_points
from commission.site.fields import with_field
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES


@reduce.register
def open_map(action: actions.OpenMap, state: AppState, sender: Sender) -> Outcome:
    file, loading = action.file, replace(state.part(MapLoading), notes=())
    state = state.with_browser(sender.browser, MapTrouble())
    if file.ending not in ENDINGS:
        known = ", ".join(f".{ending}" for ending in ENDINGS)
        return reduce(
            actions.MapFailed(f"{file.name}: is no floor map; expected a file that ends in {known}"), state, sender
        )
    if not isinstance(file.source, Upload):
        return Outcome(state.with_part(loading), (ReadMapFile(file),))
    if file.ending in MAP_ENDINGS:
        read = ReadMapFile(file, image=loading.image)
        return Outcome(state.with_part(replace(loading, waiting=None)), (read,))
    if file.ending not in PICTURE_ENDINGS:
        return Outcome(state.with_part(loading), (ReadMapFile(file),))
    waiting = loading.waiting
    if waiting is not None and file.name != waiting.image:
        text = f"{file.name}: is not the image of {waiting.file.name}; expected {waiting.image}"
        return reduce(actions.MapFailed(text), state, sender)
    loading = replace(loading, image=file)
    read = ReadMapFile(file) if waiting is None else ReadMapFile(waiting.file, image=file)
    return Outcome(state.with_part(loading), (read,))


@reduce.register
def image_missing(action: actions.ImageMissing, state: AppState, _sender: Sender) -> Outcome:
    waiting = WaitingMap(action.file, action.image)
    text = f"{action.file.name} needs its image: upload {action.image}, too"
    return Outcome(
        state.with_part(replace(state.part(MapLoading), waiting=waiting, draft=None)), (Tell(text, failed=False),)
    )


@reduce.register
def map_failed(action: actions.MapFailed, state: AppState, sender: Sender) -> Outcome:
    text = " ".join(action.text.split())
    return Outcome(state.with_browser(sender.browser, MapTrouble(text)), (Tell(text, failed=True),))


@reduce.register
def map_opened(action: actions.MapOpened, state: AppState, sender: Sender) -> Outcome:
    before = state.part(MapLoading).draft
    options = before.options if before is not None and before.file is action.file else _usual(action, state.project)
    draft = MapDraft(file=action.file, read=action.read, reading=action.reading, options=options)
    if isinstance(action.read, Picture):
        draft = replace(draft, stage=_stage(action.read, state.project))
    opened = state.with_part(replace(state.part(MapLoading), draft=draft, waiting=None))
    return reduce(actions.ClickPicture(), opened, sender) if isinstance(action.read, Picture) else Outcome(opened)


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
def click_picture(_action: actions.ClickPicture, state: AppState, sender: Sender) -> Outcome:
    draft = _draft(state)
    editor = replace(editor_of(state, sender.browser), tool=CalibrateTool(), drag=None)
    cleared = state.with_part(replace(state.part(MapLoading), draft=replace(draft, pixels=())))
    return Outcome(cleared.with_browser(sender.browser, editor), (PlaceCamera(Camera.FIT),))


@reduce.register
def set_reading(action: actions.SetReading, state: AppState, _sender: Sender) -> Outcome:
    draft = _draft(state)
    if action.reading == draft.reading:
        return Outcome(state)
    return Outcome(state, (ReadMapFile(draft.file, action.reading),))


@reduce.register
def set_map_option(action: actions.SetMapOption, state: AppState, _sender: Sender) -> Outcome:
    draft = _draft(state)
    options = with_field(draft.options, action.name, action.value, "option of a floor map")
    return Outcome(state.with_part(replace(state.part(MapLoading), draft=replace(draft, options=options))))


@reduce.register
def make_map(_action: actions.MakeMap, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(state, (DrawMap(_draft(state)),))


@reduce.register
def stop_map_job(_action: actions.StopMapJob, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(state, (StopMapWork(),))


@reduce.register
def discard_map(_action: actions.DiscardMap, state: AppState, sender: Sender) -> Outcome:
    cleared = state.with_part(MapLoading()).with_browser(sender.browser, MapTrouble())
    return Outcome(_without_calibration(cleared), (StopMapWork(),))


@reduce.register
def set_pen(action: actions.SetPen, state: AppState, sender: Sender) -> Outcome:
    pen = with_field(state.of_browser(sender.browser, MapPen), action.name, action.value, "property of the pen")
    return Outcome(state.with_browser(sender.browser, pen))


@reduce.register
def set_plant_point(action: actions.SetPlantPoint, state: AppState, sender: Sender) -> Outcome:
    tool = editor_of(state, sender.browser).tool
    if not isinstance(tool, AlignTool) or action.index >= len(tool.known):
        return Outcome(state)
    known = list(tool.known)
    known[action.index] = replace(known[action.index], plant=action.plant, name=action.name)
    return Outcome(with_tool(state, sender, replace(tool, known=tuple(known)).paired(state.project)))


@reduce.register
def forget_point(action: actions.ForgetPoint, state: AppState, sender: Sender) -> Outcome:
    tool = editor_of(state, sender.browser).tool
    if not isinstance(tool, AlignTool):
        return Outcome(state)
    left = tool.without_any() if action.everything else tool.without_last()
    return Outcome(with_tool(state, sender, left.paired(state.project)))


@reduce.register
def set_aligned(action: actions.SetAligned, state: AppState, sender: Sender) -> Outcome:
    tool = editor_of(state, sender.browser).tool
    if not isinstance(tool, AlignTool):
        return Outcome(state)
    return Outcome(with_tool(state, sender, replace(tool, everything=action.everything)))


@reduce.register
def set_surveyed(action: actions.SetSurveyed, state: AppState, sender: Sender) -> Outcome:
    tool = editor_of(state, sender.browser).tool
    if not isinstance(tool, AlignTool):
        return Outcome(state)
    told: tuple[Tell, ...] = ()
    table = tuple(surveyed_points(action.table)) if action.table.strip() else ()
    found = replace(tool, survey=PlantSurvey(table)).paired(state.project)
    if table:
        unknown = [name for name, _x, _y in table if name not in {pair.name for pair in found.surveyed}]
        if len(found.pairs()) >= 2:
            fit_points(found.pairs())
        if unknown:
            text = f"nothing is called {', '.join(unknown[:5])}: left out, until a clicked point has that name"
            told = (Tell(text, failed=False),)
    return Outcome(with_tool(state, sender, found), told)


@reduce.register
def align_map(_action: actions.AlignMap, state: AppState, sender: Sender) -> Outcome:
    return align_tool.align_map(state, sender)


@reduce.register
def map_made(action: actions.MapMade, state: AppState, sender: Sender) -> Outcome:
    width, height = action.floor_map.size
    cell = MILLIMETRES.text(action.floor_map.resolution, ".4g")
    said = f"{action.file.name}: {width:.1f} x {height:.1f} m, cells of {cell}"
    project = replace(state.project, floor_map=action.floor_map)
    edit = Edit(f"load floor map {action.file.name}", sender)
    loaded = edited(state, project, edit).with_part(MapLoading(notes=(said, *action.notes)))
    # The site may be elsewhere now, for everybody.
    return Outcome(_without_calibration(loaded), (PlaceCamera(Camera.FIT, everywhere=True),))


def _without_calibration(state: AppState) -> AppState:
    """Return the state with nobody clicking on a picture that is not there any more."""
    for browser in state.browsers:
        editor = editor_of(state, browser)
        if isinstance(editor.tool, CalibrateTool):
            state = state.with_browser(browser, replace(editor, tool=None))
    return state


def _draft(state: AppState) -> MapDraft:
    draft = state.part(MapLoading).draft
    if draft is None:
        raise UsageError("no file is open to load a floor map from; expected one")
    return draft
