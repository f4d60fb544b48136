"""What the actions about a suggested layout mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing.reducer import with_reflectors
from commission.app.placement import actions
from commission.app.placement.wish import SMALLEST_AREA, LayoutWish, placement_input
from commission.errors import UsageError
from commission.site.fields import with_field
from commission.site.layout_brief import LayoutBrief, Rectangle, low_high
from commission.site.quantity import counted_text

ACCEPT = "accept suggested layout"
"""Name of the undo step."""


def _wishing(state: AppState, wish: LayoutWish) -> Outcome:
    return Outcome(state.with_part(wish))


def _asking(state: AppState, brief: LayoutBrief, edit: Edit) -> Outcome:
    """Ask something else of the layout: one undo step."""
    if brief == state.project.layout:
        return Outcome(state)
    return Outcome(edited(state, replace(state.project, layout=brief), edit))


@reduce.register
def set_layout(action: actions.SetLayout, state: AppState, sender: Sender) -> Outcome:
    if "." not in action.name:
        return _wishing(state, with_field(state.part(LayoutWish), action.name, action.value, "wish"))
    words = action.name.rpartition(".")[2].replace("_", " ")
    edit = Edit(f"set {words} of the layout", sender, f"layout.{action.name}")
    return _asking(
        state, with_field(state.project.layout, action.name, action.value, "option of the suggested layout"), edit
    )


@reduce.register
def take_preset(action: actions.TakePreset, state: AppState, sender: Sender) -> Outcome:
    brief = state.project.layout
    edit = Edit(f"demands of {action.name}", sender)
    return _asking(state, replace(brief, demands=brief.demands.preset(action.name)), edit)


@reduce.register
def count_route(action: actions.CountRoute, state: AppState, sender: Sender) -> Outcome:
    state.project.route(action.name)
    brief = state.project.layout
    others = tuple(name for name in brief.ignored_routes if name != action.name)
    ignored = others if action.counts else (*others, action.name)
    edit = Edit(f"{'count' if action.counts else 'ignore'} {action.name}", sender)
    return _asking(state, replace(brief, ignored_routes=ignored), edit)


def _set_keep_out(state: AppState, areas: tuple[Rectangle, ...], edit: Edit) -> Outcome:
    return _asking(state, with_field(state.project.layout, "candidates.keep_out", areas), edit)


@reduce.register
def keep_out(action: actions.KeepOut, state: AppState, sender: Sender) -> Outcome:
    low, high = low_high(action.area)
    if min(high[0] - low[0], high[1] - low[1]) < SMALLEST_AREA:
        return Outcome(state)
    areas = (*state.project.layout.candidates.keep_out, (*low, *high))
    return _set_keep_out(state, areas, Edit("keep an area free of reflectors", sender))


@reduce.register
def free_areas(action: actions.FreeAreas, state: AppState, sender: Sender) -> Outcome:
    place = action.place
    areas = state.project.layout.candidates.keep_out
    left = () if place is None else tuple(area for area in areas if not _contains(area, place))
    return _set_keep_out(state, left, Edit("allow reflectors again", sender))


def _contains(area: Rectangle, place: tuple[float, float]) -> bool:
    low, high = low_high(area)
    return low[0] <= place[0] <= high[0] and low[1] <= place[1] <= high[1]


@reduce.register
def ask_layout(_action: actions.AskLayout, state: AppState, _sender: Sender) -> Outcome:
    """Look for a layout for the site as it is now; raises UsageError where none can be found."""
    wish = state.part(LayoutWish)
    inputs = placement_input(state.project, extend=wish.extend)
    return _wishing(state, replace(wish, inputs=inputs, asked=wish.asked + 1))


@reduce.register
def end_search(_action: actions.EndSearch, state: AppState, _sender: Sender) -> Outcome:
    wish = state.part(LayoutWish)
    return _wishing(state, replace(wish, enough=wish.asked))


@reduce.register
def discard_layout(_action: actions.DiscardLayout, state: AppState, _sender: Sender) -> Outcome:
    return _wishing(state, replace(state.part(LayoutWish), inputs=None))


@reduce.register
def accept_layout(action: actions.AcceptLayout, state: AppState, sender: Sender) -> Outcome:
    suggestion = action.suggestion
    if suggestion.inputs.reflectors is not state.project.reflectors:
        raise UsageError("the reflectors have changed since the layout was suggested; suggest it again")
    dropped = state.with_part(replace(state.part(LayoutWish), inputs=None))
    accepted = with_reflectors(dropped, suggestion.placement.reflectors, Edit(ACCEPT, sender))
    return replace(accepted, effects=(*accepted.effects, Tell(_told(action), failed=False)))


def _told(action: actions.AcceptLayout) -> str:
    added, removed = action.suggestion.placement.added, len(action.suggestion.removed)
    return (
        f"{counted_text(added, 'reflector')} put up"
        + (f", {removed} taken down" if removed else "")
        + "; Ctrl+Z takes it back"
    )
