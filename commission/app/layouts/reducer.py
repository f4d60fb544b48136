"""What the actions about kept layouts mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit
from commission.app.editing.reducer import with_reflectors
from commission.app.layouts import actions
from commission.app.layouts.state import NAME, LayoutsState
from commission.errors import UsageError
from commission.site.fields import with_field


@reduce.register
def keep_layout(_action: actions.KeepLayout, state: AppState, _sender: Sender) -> Outcome:
    """Keep the reflectors of now; they are what later ones are compared with."""
    reflectors = state.project.reflectors
    if not len(reflectors):
        raise UsageError("there are no reflectors to keep; expected one or more")
    kept = state.part(LayoutsState).with_kept(reflectors)
    own = kept.of(reflectors)
    return Outcome(state.with_part(replace(kept, against=kept.against if own is None else own.number)))


@reduce.register
def forget_layout(action: actions.ForgetLayout, state: AppState, _sender: Sender) -> Outcome:
    """Forget one; the floor is left where none is compared any more."""
    part = state.part(LayoutsState)
    gone = part.layout(action.number)
    left = tuple(each for each in part.kept if each is not gone)
    against = part.against if part.against != gone.number else (left[-1].number if left else 0)
    state = state.with_part(replace(part, kept=left, against=against))
    return Outcome(state if against else state.with_part(state.part(FloorPicture).left_by(NAME)))


@reduce.register
def switch_layout(action: actions.SwitchLayout, state: AppState, sender: Sender) -> Outcome:
    """Put one up in one undo step; what stands now is kept and compared with it, so that one can switch back."""
    part, now = state.part(LayoutsState), state.project.reflectors
    wanted = part.layout(action.number)
    if wanted.reflectors == now:
        return Outcome(state)
    kept = part.with_kept(now) if len(now) else part
    left = kept.of(now)
    kept = replace(kept, against=wanted.number if left is None else left.number)
    return with_reflectors(state.with_part(kept), wanted.reflectors, Edit(f"switch to layout {wanted.number}", sender))


@reduce.register
def set_comparison(action: actions.SetComparison, state: AppState, _sender: Sender) -> Outcome:
    """Compare with another one or none, or color the floor otherwise: a figure takes the floor for its picture."""
    before = state.part(LayoutsState)
    part = with_field(before, action.name, action.value, "setting of the comparison")
    if part.against:
        part.layout(part.against)
    picture = state.part(FloorPicture)
    shows = bool(part.figure and part.against)
    if action.name == "figure" or not part.against:
        state = state.with_part(picture.taken_by(NAME) if shows else picture.left_by(NAME))
    return Outcome(state.with_part(part))
