"""What an editing action means: tools, selection, gestures, and edits of reflectors. Pure, like `app.reducer`.

Importing this module registers its actions with `reduce`.
"""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.reduction import ApplyParameters, FlyTo, Reduction, Tell, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import actions
from commission.app.editing.editor import AlignmentDraft, Drag, Editor, Grab, Tool
from commission.app.editing.gestures import (
    grabbed,
    marked_place,
    moved,
    reflector_at,
    reflectors_in,
    selected_of,
    to_place,
)
from commission.app.editing.route_gestures import route_at
from commission.app.editing.station_actions import DeleteStation, MoveStation, PlaceStation
from commission.app.editing.station_gestures import moved_station, station_at
from commission.app.floor_map import tools as map_tools
from commission.app.floor_map.actions import FinishShape
from commission.app.plan.actions import FreeAreas, KeepOut
from commission.errors import UsageError
from commission.site.editing import reflectors as edits
from commission.site.editing.snapping import snap_to_wall
from commission.site.reflectors import ReflectorMap


def editor_of(state: AppState, client: int) -> Editor:
    """Return how a browser edits."""
    return state.editor(client)


def counted(state: AppState, editor: Editor) -> str:
    """Return what the selection is called on a button: `R3`, `12 reflectors`."""
    selected = selected_of(state.project, editor)
    return selected[0].id if len(selected) == 1 else f"{len(selected)} reflectors"


def with_reflectors(state: AppState, reflectors: ReflectorMap, edit: Edit) -> Reduction:
    """Return what follows from another reflector map: one undo step, and the running localizer uses it."""
    if reflectors == state.project.reflectors:
        return Reduction(state)
    project = replace(state.project, reflectors=reflectors)
    return Reduction(edited(state, project, edit), (ApplyParameters(),))


def _selection(state: AppState, client: int) -> tuple[Editor, tuple[str, ...]]:
    """Return a browser's editor and the ids of what it has selected; raises UsageError when that is nothing."""
    editor = editor_of(state, client)
    ids = tuple(r.id for r in selected_of(state.project, editor))
    if not ids:
        raise UsageError("no reflector is selected; expected one or more")
    return editor, ids


def _telling_of_locked(state: AppState, ids: tuple[str, ...], reduction: Reduction) -> Reduction:
    """Add a word about the reflectors that an edit left alone."""
    locked = edits.locked_among(state.project.reflectors, ids)
    if not locked:
        return reduction
    shown = ", ".join(locked[:5]) + (f" and {len(locked) - 5} more" if len(locked) > 5 else "")
    told = Tell(f"locked and left as they are: {shown}", failed=False)
    return replace(reduction, effects=(*reduction.effects, told))


@reduce.register
def _(action: actions.Join, state: AppState) -> Reduction:
    greeting = (Tell(state.greeting, failed=False),) if state.greeting else ()
    return Reduction(state.with_editor(action.client, Editor()), greeting)


@reduce.register
def _(action: actions.Leave, state: AppState) -> Reduction:
    left = {client: editor for client, editor in state.editors.items() if client != action.client}
    return Reduction(replace(state, editors=left))


@reduce.register
def _(action: actions.ChooseTool, state: AppState) -> Reduction:
    editor = replace(
        editor_of(state, action.client), tool=action.tool, drag=None, draft=(), measured=(), alignment=AlignmentDraft()
    )
    return Reduction(state.with_editor(action.client, editor))


@reduce.register
def _(action: actions.ChooseSnapping, state: AppState) -> Reduction:
    return Reduction(
        state.with_editor(action.client, replace(editor_of(state, action.client), snapping=action.snapping))
    )


@reduce.register
def _(action: actions.Cancel, state: AppState) -> Reduction:
    editor = editor_of(state, action.client)
    if editor.drag is not None or editor.draft or editor.measured or editor.alignment.points:
        editor = replace(editor, drag=None, draft=(), measured=(), alignment=AlignmentDraft())
    elif editor.tool is not Tool.SELECT:
        editor = replace(editor, tool=Tool.SELECT)
    else:
        editor = editor.selecting()
    return Reduction(state.with_editor(action.client, editor))


@reduce.register
def _(action: actions.Finish, state: AppState) -> Reduction:
    is_route = editor_of(state, action.client).tool is Tool.ROUTE
    return reduce(actions.FinishRoute(action.client) if is_route else FinishShape(action.client), state)


@reduce.register
def _(action: actions.ClickFloor, state: AppState) -> Reduction:
    editor = replace(editor_of(state, action.client), reach=action.reach, last_click=action.place, drag=None)
    if editor.tool in map_tools.TOOLS:
        return map_tools.clicked(state, editor, action)
    resting = state.with_editor(action.client, editor)
    match editor.tool:
        case Tool.PLACE:
            return _placed(state, editor, action)
        case Tool.STATION:
            return reduce(PlaceStation(action.client, action.place, action.reach), resting)
        case Tool.KEEP_OUT:
            return reduce(FreeAreas(action.place, action.client), resting)
        case Tool.ROUTE:
            editor = replace(editor, draft=(*editor.draft, action.place))
        case Tool.MEASURE:
            before = editor.measured if len(editor.measured) == 1 else ()
            editor = replace(editor, measured=(*before, marked_place(state.project, action.place, editor.reach)))
        case _:
            editor = _picked(state, editor, action)
    return Reduction(state.with_editor(action.client, editor))


def _picked(state: AppState, editor: Editor, action: actions.ClickFloor) -> Editor:
    """Select what was clicked; nothing when nothing was, unless the click adds."""
    found = reflector_at(state.project.reflectors, action.place, action.reach)
    if found is not None:
        if not action.add:
            return editor.selecting((found,))
        others = tuple(name for name in editor.selected if name != found)
        return editor.selecting(others if found in editor.selected else (*others, found))
    if action.add:
        return editor
    station = station_at(state.project, action.place, action.reach)
    if station is not None:
        return editor.selecting(station=station)
    return editor.selecting(point=route_at(state.project, action.place, action.reach))


def _placed(state: AppState, editor: Editor, action: actions.ClickFloor) -> Reduction:
    """Place a reflector where the click is attracted to."""
    like = to_place(state.project, action.place, editor)
    added = edits.add(state.project.reflectors, [(like.x, like.y)], like)
    reduction = with_reflectors(state, added.reflectors, Edit(f"place {added.ids[0]}", action.client))
    selecting = reduction.state.with_editor(action.client, editor.selecting(added.ids))
    return replace(reduction, state=selecting)


@reduce.register
def _(action: actions.DragFloor, state: AppState) -> Reduction:
    editor = editor_of(state, action.client)
    if editor.tool in map_tools.AREA_TOOLS:
        return map_tools.dragged(state, editor, action)
    if editor.tool not in {Tool.SELECT, Tool.KEEP_OUT}:
        return Reduction(state)
    drag = editor.drag
    if action.phase == "start" or drag is None:
        begun, whole = replace(editor, reach=action.reach), Drag(Grab.RECTANGLE, action.start, action.now, action.add)
        takes_hold = editor.tool is Tool.SELECT
        editor = grabbed(state.project, begun, whole) if takes_hold else replace(begun, drag=whole)
    else:
        editor = replace(editor, drag=replace(drag, now=action.now))
    if action.phase != "end":
        return Reduction(state.with_editor(action.client, editor))
    return _dropped(state, editor, action.client)


@reduce.register
def _(action: actions.DragSelection, state: AppState) -> Reduction:
    editor = editor_of(state, action.client)
    selected = [r for r in selected_of(state.project, editor) if not r.locked]
    if not selected:
        return Reduction(state)
    middle = middle_of(state, editor)
    editor = replace(editor, drag=Drag(Grab.REFLECTORS, middle, action.now))
    if action.phase != "end":
        return Reduction(state.with_editor(action.client, editor))
    return _dropped(state, editor, action.client)


def middle_of(state: AppState, editor: Editor) -> tuple[float, float]:
    """Return the middle of the selected reflectors that can be moved [m]; the origin when there are none."""
    movable = [r for r in selected_of(state.project, editor) if not r.locked]
    if not movable:
        return 0.0, 0.0
    return sum(r.x for r in movable) / len(movable), sum(r.y for r in movable) / len(movable)


def _dropped(state: AppState, editor: Editor, client: int) -> Reduction:
    """Do what the drag that ends now was for."""
    drag = editor.drag
    done = replace(editor, drag=None)
    resting = state.with_editor(client, done)
    if drag is None:
        return Reduction(resting)
    match drag.grab:
        case Grab.REFLECTORS:
            return _moved(state, editor, resting, client)
        case Grab.RECTANGLE:
            return _enclosed(state, editor, resting, client)
        case Grab.CONTROL_POINT:
            return reduce(actions.PlaceControlPoint(client, drag.now), resting)
        case Grab.STATION | Grab.HEADING:
            station = moved_station(state.project, editor)
            if station is None:
                return Reduction(resting)
            return reduce(MoveStation(client, (station.x, station.y), station.heading), resting)


def _moved(state: AppState, editor: Editor, resting: AppState, client: int) -> Reduction:
    """Leave the dragged reflectors where they are."""
    if not selected_of(state.project, editor):
        return Reduction(resting)
    edit = Edit(f"move {counted(state, editor)}", client)
    return _telling_of_locked(state, editor.selected, with_reflectors(resting, moved(state.project, editor), edit))


def _enclosed(state: AppState, editor: Editor, resting: AppState, client: int) -> Reduction:
    """Select what lies in the rectangle, or keep it free of reflectors."""
    drag = editor.drag
    if drag is None:
        return Reduction(resting)
    if editor.tool is Tool.KEEP_OUT:
        return reduce(KeepOut((*drag.start, *drag.now), client), resting)
    inside = reflectors_in(state.project.reflectors, drag.start, drag.now)
    kept = editor.selected if drag.add else ()
    chosen = (*kept, *(name for name in inside if name not in kept))
    return Reduction(resting.with_editor(client, replace(editor, drag=None).selecting(chosen)))


@reduce.register
def _(action: actions.SelectReflectors, state: AppState) -> Reduction:
    editor = editor_of(state, action.client).selecting(action.ids)
    selecting = state.with_editor(action.client, editor)
    if not action.fly or not selected_of(state.project, editor):
        return Reduction(selecting)
    every = selected_of(state.project, editor)
    middle = sum(r.x for r in every) / len(every), sum(r.y for r in every) / len(every)
    return Reduction(selecting, (FlyTo(action.client, middle),))


@reduce.register
def _(action: actions.DeleteSelected, state: AppState) -> Reduction:
    editor = editor_of(state, action.client)
    if editor.point is not None and not editor.selected:
        return reduce(actions.DeleteControlPoint(action.client), state)
    if editor.station:
        return reduce(DeleteStation(action.client), state)
    editor, ids = _selection(state, action.client)
    edit = Edit(f"delete {counted(state, editor)}", action.client)
    return _telling_of_locked(state, ids, with_reflectors(state, edits.delete(state.project.reflectors, ids), edit))


def _adding(state: AppState, client: int, added: edits.Added, name: str) -> Reduction:
    """Return what follows from copies: they are selected."""
    reduction = with_reflectors(state, added.reflectors, Edit(name, client))
    editor = editor_of(state, client).selecting(added.ids)
    return replace(reduction, state=reduction.state.with_editor(client, editor))


@reduce.register
def _(action: actions.DuplicateSelected, state: AppState) -> Reduction:
    editor, ids = _selection(state, action.client)
    aside = 3.0 * editor.reach
    added = edits.duplicate(state.project.reflectors, ids, (aside, -aside))
    return _adding(state, action.client, added, f"duplicate {counted(state, editor)}")


@reduce.register
def _(action: actions.SetSelected, state: AppState) -> Reduction:
    editor, ids = _selection(state, action.client)
    what = counted(state, editor)
    if action.name == "locked":
        verb = "lock" if action.value else "unlock"
        changed = edits.set_locked(state.project.reflectors, ids, bool(action.value))
        return with_reflectors(state, changed, Edit(f"{verb} {what}", action.client))
    changed = edits.set_values(state.project.reflectors, ids, {action.name: action.value})
    edit = Edit(f"set {action.name} of {what}", action.client, f"{action.client}:{ids}:{action.name}", action.at)
    reduction = _telling_of_locked(state, ids, with_reflectors(state, changed, edit))
    if action.name != "id":
        return reduction
    renamed = replace(editor, selected=(str(action.value),))
    return replace(reduction, state=reduction.state.with_editor(action.client, renamed))


@reduce.register
def _(action: actions.MirrorSelected, state: AppState) -> Reduction:
    editor, ids = _selection(state, action.client)
    axis = edits.Axis(*action.through, action.angle)
    name = f"mirror {counted(state, editor)}"
    if action.copy:
        return _adding(state, action.client, edits.duplicate_mirrored(state.project.reflectors, ids, axis), name)
    mirrored = edits.mirror(state.project.reflectors, ids, axis)
    return _telling_of_locked(state, ids, with_reflectors(state, mirrored, Edit(name, action.client)))


@reduce.register
def _(action: actions.RepeatSelected, state: AppState) -> Reduction:
    editor, ids = _selection(state, action.client)
    added = edits.repeat(state.project.reflectors, ids, action.step, action.count)
    return _adding(state, action.client, added, f"repeat {counted(state, editor)} {action.count}x")


@reduce.register
def _(action: actions.SnapSelected, state: AppState) -> Reduction:
    editor, ids = _selection(state, action.client)
    floor_map = state.project.floor_map
    if floor_map is None:
        raise UsageError("the project has no floor map to snap to; expected one")
    snapped = snap_to_wall(state.project.reflectors, ids, floor_map.occupancy())
    edit = Edit(f"snap {counted(state, editor)} to walls", action.client)
    return _telling_of_locked(state, ids, with_reflectors(state, snapped, edit))


@reduce.register
def _(action: actions.LookAt, state: AppState) -> Reduction:
    return Reduction(state, (FlyTo(action.client, action.place),))
