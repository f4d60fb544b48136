"""What an editing action means: tools, selection, gestures, and edits of reflectors. Pure.

Importing this module registers its actions with `reduce`.
"""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import ClickFloor, DragFloor, Sender
from commission.app.base.effects import FlyTo, Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import actions
from commission.app.editing.editor import Drag, Editor, Grab, editor_of
from commission.app.editing.gestures import (
    grabbed,
    moved,
    reflector_at,
    reflectors_in,
    selected_of,
)
from commission.app.editing.posed_actions import DeletePosed, MovePosed
from commission.app.editing.posed_gestures import moved_posed, posed_at
from commission.app.editing.posed_kinds import mark_of
from commission.app.editing.route_gestures import route_at
from commission.errors import UsageError
from commission.site.editing import reflectors as edits
from commission.site.editing.snapping import snap_to_wall
from commission.site.fields import with_field
from commission.site.reflectors import ReflectorMap


def counted(state: AppState, editor: Editor) -> str:
    """Return what the selection is called on a button: `R3`, `12 reflectors`."""
    selected = selected_of(state.project, editor)
    return selected[0].id if len(selected) == 1 else f"{len(selected)} reflectors"


def with_reflectors(state: AppState, reflectors: ReflectorMap, edit: Edit) -> Outcome:
    """Return what follows from another reflector map: one undo step.

    Parameters
    ----------
    state : before.
    reflectors : the other map.
    edit : what the step is called, and who made it.
    """
    if reflectors == state.project.reflectors:
        return Outcome(state)
    project = replace(state.project, reflectors=reflectors)
    return Outcome(edited(state, project, edit))


def _selection(state: AppState, sender: Sender) -> tuple[Editor, tuple[str, ...]]:
    """Return a browser's editor and the ids of what it has selected; raises UsageError when that is nothing."""
    editor = editor_of(state, sender.browser)
    ids = tuple(r.id for r in selected_of(state.project, editor))
    if not ids:
        raise UsageError("no reflector is selected; expected one or more")
    return editor, ids


def _telling_of_locked(state: AppState, ids: tuple[str, ...], outcome: Outcome) -> Outcome:
    """Add a word about the reflectors that an edit left alone."""
    locked = edits.locked_among(state.project.reflectors, ids)
    if not locked:
        return outcome
    shown = ", ".join(locked[:5]) + (f" and {len(locked) - 5} more" if len(locked) > 5 else "")
    told = Tell(f"locked and left as they are: {shown}", failed=False)
    return replace(outcome, effects=(*outcome.effects, told))


@reduce.register
def choose_tool(action: actions.ChooseTool, state: AppState, sender: Sender) -> Outcome:
    return Outcome(state.with_browser(sender.browser, editor_of(state, sender.browser).using(action.tool, state)))


@reduce.register
def set_snapping(action: actions.SetSnapping, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    snapping = with_field(editor.snapping, action.name, action.value, "attraction")
    return Outcome(state.with_browser(sender.browser, replace(editor, snapping=snapping)))


@reduce.register
def cancel(_action: actions.Cancel, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    tool = editor.tool
    if tool is not None and tool.stays:
        editor = editor.using(None, state)
    elif editor.drag is not None or (tool is not None and tool.is_half_done):
        editor = replace(editor, drag=None, tool=None if tool is None else type(tool)())
    elif tool is not None:
        editor = replace(editor, tool=None)
    else:
        editor = editor.selecting()
    return Outcome(state.with_browser(sender.browser, editor))


@reduce.register
def finish(_action: actions.Finish, state: AppState, sender: Sender) -> Outcome:
    tool = editor_of(state, sender.browser).tool
    return Outcome(state) if tool is None else tool.finished(state, sender)


@reduce.register
def click_floor(action: ClickFloor, state: AppState, sender: Sender) -> Outcome:
    editor = replace(editor_of(state, sender.browser), reach=action.reach, last_click=action.place, drag=None)
    if editor.tool is None:
        return Outcome(state.with_browser(sender.browser, _picked(state, editor, action)))
    return editor.tool.clicked(state.with_browser(sender.browser, editor), action, sender)


def _picked(state: AppState, editor: Editor, action: ClickFloor) -> Editor:
    """Select what was clicked; nothing when nothing was, unless the click adds."""
    found = reflector_at(state.project.reflectors, action.place, action.reach)
    if found is not None:
        if not action.add:
            return editor.selecting((found,))
        others = tuple(name for name in editor.selected if name != found)
        return editor.selecting(others if found in editor.selected else (*others, found))
    if action.add:
        return editor
    posed = posed_at(state.project, action.place, action.reach)
    if posed is not None:
        return editor.selecting(posed=posed)
    return editor.selecting(point=route_at(state.project, action.place, action.reach))


@reduce.register
def drag_floor(action: DragFloor, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    if editor.tool is not None:
        return editor.tool.dragged(state, action, sender)
    drag = editor.drag
    if action.phase == "start" or drag is None:
        begun = replace(editor, reach=action.reach)
        editor = grabbed(state.project, begun, Drag(Grab.RECTANGLE, action.start, action.now, action.add))
    else:
        editor = replace(editor, drag=replace(drag, now=action.now))
    if action.phase != "end":
        return Outcome(state.with_browser(sender.browser, editor))
    return _dropped(state, editor, sender)


@reduce.register
def drag_selection(action: actions.DragSelection, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    selected = [r for r in selected_of(state.project, editor) if not r.locked]
    if not selected:
        return Outcome(state)
    middle = middle_of(state, editor)
    editor = replace(editor, drag=Drag(Grab.REFLECTORS, middle, action.now))
    if action.phase != "end":
        return Outcome(state.with_browser(sender.browser, editor))
    return _dropped(state, editor, sender)


def middle_of(state: AppState, editor: Editor) -> tuple[float, float]:
    """Return the middle of the selected reflectors that can be moved [m]; the origin when there are none."""
    movable = [r for r in selected_of(state.project, editor) if not r.locked]
    if not movable:
        return 0.0, 0.0
    return sum(r.x for r in movable) / len(movable), sum(r.y for r in movable) / len(movable)


@reduce.register
def nudge(action: actions.Nudge, state: AppState, sender: Sender) -> Outcome:
    editor, (dx, dy) = editor_of(state, sender.browser), action.by
    ids = tuple(r.id for r in selected_of(state.project, editor))
    if ids:
        edit = Edit(f"move {counted(state, editor)}", sender, f"{ids}:nudge")
        moved_map = edits.move(state.project.reflectors, ids, action.by)
        return _telling_of_locked(state, ids, with_reflectors(state, moved_map, edit))
    mark = mark_of(state.project, editor.posed)
    if editor.posed is not None and mark is not None:
        return reduce(MovePosed(editor.posed.kind, (mark.x + dx, mark.y + dy), mark.heading), state, sender)
    if editor.point is None:
        return Outcome(state)
    segments = state.project.route(editor.point.route).segments
    x, y = segments[editor.point.segment].control_points[editor.point.index]
    return reduce(actions.PlaceControlPoint((float(x) + dx, float(y) + dy)), state, sender)


def _dropped(state: AppState, editor: Editor, sender: Sender) -> Outcome:
    """Do what the drag that ends now was for."""
    drag = editor.drag
    done = replace(editor, drag=None)
    resting = state.with_browser(sender.browser, done)
    if drag is None:
        return Outcome(resting)
    match drag.grab:
        case Grab.REFLECTORS:
            return _moved(state, editor, resting, sender)
        case Grab.RECTANGLE:
            return _enclosed(state, editor, resting, sender)
        case Grab.CONTROL_POINT:
            return reduce(actions.PlaceControlPoint(drag.now, dragged=True), resting, sender)
        case Grab.POSED | Grab.HEADING:
            return _turned_or_moved(state, editor, resting, sender)


def _turned_or_moved(state: AppState, editor: Editor, resting: AppState, sender: Sender) -> Outcome:
    """Leave the dragged station or tag where it is, or looking there."""
    mark = moved_posed(state.project, editor)
    if editor.posed is None or mark is None:
        return Outcome(resting)
    return reduce(MovePosed(editor.posed.kind, (mark.x, mark.y), mark.heading), resting, sender)


def _moved(state: AppState, editor: Editor, resting: AppState, sender: Sender) -> Outcome:
    """Leave the dragged reflectors where they are."""
    if not selected_of(state.project, editor):
        return Outcome(resting)
    edit = Edit(f"move {counted(state, editor)}", sender)
    return _telling_of_locked(state, editor.selected, with_reflectors(resting, moved(state.project, editor), edit))


def _enclosed(state: AppState, editor: Editor, resting: AppState, sender: Sender) -> Outcome:
    """Select what lies in the rectangle."""
    drag = editor.drag
    if drag is None:
        return Outcome(resting)
    inside = reflectors_in(state.project.reflectors, drag.start, drag.now)
    kept = editor.selected if drag.add else ()
    chosen = (*kept, *(name for name in inside if name not in kept))
    return Outcome(resting.with_browser(sender.browser, replace(editor, drag=None).selecting(chosen)))


@reduce.register
def select_reflectors(action: actions.SelectReflectors, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    ids = tuple(name for name in editor.selected if name not in action.ids) if action.toggle else ()
    added = (name for name in action.ids if not action.toggle or name not in editor.selected)
    editor = editor.selecting((*ids, *added))
    selecting = state.with_browser(sender.browser, editor)
    if not action.fly or not selected_of(state.project, editor):
        return Outcome(selecting)
    every = selected_of(state.project, editor)
    middle = sum(r.x for r in every) / len(every), sum(r.y for r in every) / len(every)
    return Outcome(selecting, (FlyTo(middle),))


@reduce.register
def delete_selected(_action: actions.DeleteSelected, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    if editor.point is not None and editor.further:
        return reduce(actions.DeleteRoute(), state, sender)
    if editor.point is not None and not editor.selected:
        return reduce(actions.DeleteControlPoint(), state, sender)
    if editor.posed is not None:
        return reduce(DeletePosed(editor.posed.kind), state, sender)
    editor, ids = _selection(state, sender)
    edit = Edit(f"delete {counted(state, editor)}", sender)
    return _telling_of_locked(state, ids, with_reflectors(state, edits.delete(state.project.reflectors, ids), edit))


def _adding(state: AppState, sender: Sender, added: edits.Added, name: str) -> Outcome:
    """Return what follows from copies: they are selected."""
    outcome = with_reflectors(state, added.reflectors, Edit(name, sender))
    editor = editor_of(state, sender.browser).selecting(added.ids)
    return replace(outcome, state=outcome.state.with_browser(sender.browser, editor))


@reduce.register
def duplicate_selected(_action: actions.DuplicateSelected, state: AppState, sender: Sender) -> Outcome:
    editor, ids = _selection(state, sender)
    aside = 3.0 * editor.reach
    added = edits.duplicate(state.project.reflectors, ids, (aside, -aside))
    return _adding(state, sender, added, f"duplicate {counted(state, editor)}")


@reduce.register
def set_selected(action: actions.SetSelected, state: AppState, sender: Sender) -> Outcome:
    editor, ids = _selection(state, sender)
    what = counted(state, editor)
    if action.name == "locked":
        verb = "lock" if action.value else "unlock"
        changed = edits.set_locked(state.project.reflectors, ids, bool(action.value))
        return with_reflectors(state, changed, Edit(f"{verb} {what}", sender))
    changed = edits.set_value(state.project.reflectors, ids, action.name, action.value)
    edit = Edit(f"set {action.name} of {what}", sender, f"{ids}:{action.name}")
    outcome = _telling_of_locked(state, ids, with_reflectors(state, changed, edit))
    if action.name != "id":
        return outcome
    renamed = replace(editor, selected=(str(action.value),))
    return replace(outcome, state=outcome.state.with_browser(sender.browser, renamed))


@reduce.register
def set_reflector(action: actions.SetReflector, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser)
    alone = state.with_browser(sender.browser, replace(editor, selected=(action.id,)))
    outcome = reduce(actions.SetSelected(action.name, action.value), alone, sender)
    name = str(action.value) if action.name == "id" else action.id
    kept = replace(editor, selected=tuple(name if each == action.id else each for each in editor.selected))
    return replace(outcome, state=outcome.state.with_browser(sender.browser, kept))


@reduce.register
def mirror_selected(action: actions.MirrorSelected, state: AppState, sender: Sender) -> Outcome:
    editor, ids = _selection(state, sender)
    axis = edits.Axis(*action.through, action.angle)
    name = f"mirror {counted(state, editor)}"
    if action.copy:
        return _adding(state, sender, edits.duplicate_mirrored(state.project.reflectors, ids, axis), name)
    mirrored = edits.mirror(state.project.reflectors, ids, axis)
    return _telling_of_locked(state, ids, with_reflectors(state, mirrored, Edit(name, sender)))


@reduce.register
def repeat_selected(action: actions.RepeatSelected, state: AppState, sender: Sender) -> Outcome:
    editor, ids = _selection(state, sender)
    added = edits.repeat(state.project.reflectors, ids, action.step, action.count)
    return _adding(state, sender, added, f"repeat {counted(state, editor)} {action.count}x")


@reduce.register
def snap_selected(_action: actions.SnapSelected, state: AppState, sender: Sender) -> Outcome:
    editor, ids = _selection(state, sender)
    floor_map = state.project.floor_map
    if floor_map is None:
        raise UsageError("the project has no floor map to snap to; expected one")
    snapped = snap_to_wall(state.project.reflectors, ids, floor_map.occupancy())
    edit = Edit(f"snap {counted(state, editor)} to walls", sender)
    return _telling_of_locked(state, ids, with_reflectors(state, snapped, edit))
