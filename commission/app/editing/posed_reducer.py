"""What actions about stations and tags mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

import math
from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import posed_actions as actions
from commission.app.editing.editor import PosedKey, PosedKind, editor_of
from commission.app.editing.posed_kinds import KINDS, PosedMark, mark_of, marks_of
from commission.app.editing.table_actions import SetRows
from commission.errors import UsageError
from commission.site.fields import with_field
from commission.site.quantity import counted_text


def _selected(state: AppState, kind: PosedKind, sender: Sender, called: str = "") -> PosedMark:
    """Return the mark of a kind that is called so, else the one that a browser has selected; UsageError for none."""
    key = PosedKey(kind, called) if called else editor_of(state, sender.browser).posed
    mark = mark_of(state.project, key)
    if key is None or key.kind is not kind or mark is None:
        raise UsageError(f"no {kind} is called {called!r}" if called else f"no {kind} is selected; expected one")
    return mark


def _with_marks(
    state: AppState, kind: PosedKind, marks: tuple[PosedMark, ...], edit: Edit, selected: str | None
) -> Outcome:
    """Return what follows from other marks of a kind: one undo step, and one of them is selected."""
    field = KINDS[kind].field
    if marks == getattr(state.project, field):
        return Outcome(state)
    after = edited(state, replace(state.project, **{field: marks}), edit)
    browser, key = edit.sender.browser, None if selected is None else PosedKey(kind, selected)
    return Outcome(after.with_browser(browser, editor_of(after, browser).selecting(posed=key)))


def _with_mark(state: AppState, kind: PosedKind, mark: PosedMark, edit: Edit, name: str | None = None) -> Outcome:
    """Return what follows from a new mark, or a changed one in place of that with a name."""
    posed = KINDS[kind]
    marks = posed.named.put(posed.all_of(state.project), mark, name)
    return _with_marks(state, kind, marks, edit, posed.named.key_of(mark))


@reduce.register
def select_posed(action: actions.SelectPosed, state: AppState, sender: Sender) -> Outcome:
    selecting = state.with_browser(sender.browser, editor_of(state, sender.browser).selecting(posed=action.key))
    mark = mark_of(state.project, action.key)
    return Outcome(selecting, (FlyTo((mark.x, mark.y)),) if action.fly and mark is not None else ())


@reduce.register
def place_posed(action: actions.PlacePosed, state: AppState, sender: Sender) -> Outcome:
    posed = KINDS[action.kind]
    placed = posed.placed(state.project, posed.fresh(state.project, action.place), action.reach)
    return _with_mark(state, action.kind, placed, Edit(f"place {posed.called(placed)}", sender))


@reduce.register
def move_posed(action: actions.MovePosed, state: AppState, sender: Sender) -> Outcome:
    posed, mark = KINDS[action.kind], _selected(state, action.kind, sender)
    verb = "turn" if action.place == (mark.x, mark.y) else "move"
    moved = replace(mark, x=action.place[0], y=action.place[1], heading=action.heading)
    edit = Edit(f"{verb} {posed.called(mark)}", sender)
    return _with_mark(state, action.kind, moved, edit, posed.named.key_of(mark))


@reduce.register
def set_posed(action: actions.SetPosed, state: AppState, sender: Sender) -> Outcome:
    posed, mark = KINDS[action.kind], _selected(state, action.kind, sender, action.of)
    if not action.of and len(marks_of(state.project, editor_of(state, sender.browser))) > 1:
        return reduce(SetRows(posed.field, action.field, action.value), state, sender)
    changed = with_field(mark, action.field, action.value, f"field of a {action.kind}")
    called, field = posed.called(mark), action.field
    is_name = field == posed.named.key
    what = f"rename {called}" if is_name else f"set {posed.words.get(field, field)} of {called}"
    edit = Edit(what, sender, "" if is_name else f"{called}:{field}")
    return _with_mark(state, action.kind, changed, edit, posed.named.key_of(mark))


@reduce.register
def align_station(_action: actions.AlignStation, state: AppState, sender: Sender) -> Outcome:
    posed, station = KINDS[PosedKind.STATION], _selected(state, PosedKind.STATION, sender)
    if not state.project.routes:
        raise UsageError("the project has no route to put the station on; expected one")
    aligned, name = posed.moved(state.project, station, math.inf), posed.named.key_of(station)
    return _with_mark(state, PosedKind.STATION, aligned, Edit(f"align {name}", sender), name)


@reduce.register
def delete_posed(action: actions.DeletePosed, state: AppState, sender: Sender) -> Outcome:
    posed, mark = KINDS[action.kind], _selected(state, action.kind, sender)
    marks = marks_of(state.project, editor_of(state, sender.browser))
    left = tuple(each for each in posed.all_of(state.project) if each not in marks)
    what = posed.called(mark) if len(marks) == 1 else counted_text(len(marks), action.kind)
    return _with_marks(state, action.kind, left, Edit(f"delete {what}", sender), None)
