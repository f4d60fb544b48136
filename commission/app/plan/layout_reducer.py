"""What the actions about a suggested layout mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.editing.reducer import with_reflectors
from commission.app.plan import actions
from commission.app.plan.layout import SMALLEST_AREA, LayoutWish
from commission.app.reduction import Reduction, Tell, reduce
from commission.app.store import AppState, Edit
from commission.errors import UsageError
from commission.planning.candidates import Rectangle

ACCEPT = "accept suggested layout"
"""Name of the undo step."""


def _wishing(state: AppState, wish: LayoutWish) -> Reduction:
    return Reduction(replace(state, layout=wish))


@reduce.register
def _(action: actions.SetLayout, state: AppState) -> Reduction:
    return _wishing(state, state.layout.with_option(action.name, action.value))


@reduce.register
def _(action: actions.CountRoute, state: AppState) -> Reduction:
    state.project.route(action.name)
    ignored = state.layout.ignored - {action.name} if action.counts else state.layout.ignored | {action.name}
    return _wishing(state, replace(state.layout, ignored=ignored))


@reduce.register
def _(action: actions.KeepOut, state: AppState) -> Reduction:
    x_a, y_a, x_b, y_b = action.area
    if min(abs(x_b - x_a), abs(y_b - y_a)) < SMALLEST_AREA:
        return Reduction(state)
    area = (min(x_a, x_b), min(y_a, y_b), max(x_a, x_b), max(y_a, y_b))
    return _wishing(state, state.layout.with_keep_out((*state.layout.keep_out, area)))


@reduce.register
def _(action: actions.FreeAreas, state: AppState) -> Reduction:
    place = action.place
    left = () if place is None else tuple(area for area in state.layout.keep_out if not _contains(area, place))
    return _wishing(state, state.layout.with_keep_out(left))


def _contains(area: Rectangle, place: tuple[float, float]) -> bool:
    x_low, y_low, x_high, y_high = area
    return x_low <= place[0] <= x_high and y_low <= place[1] <= y_high


@reduce.register
def _(_action: actions.AskLayout, state: AppState) -> Reduction:
    return _wishing(state, replace(state.layout, wanted=True, asked=state.layout.asked + 1))


@reduce.register
def _(_action: actions.DiscardLayout, state: AppState) -> Reduction:
    return _wishing(state, replace(state.layout, wanted=False))


@reduce.register
def _(action: actions.AcceptLayout, state: AppState) -> Reduction:
    suggestion = action.suggestion
    if suggestion.site.reflectors is not state.project.reflectors:
        raise UsageError("the reflectors have changed since the layout was suggested; suggest it again")
    dropped = replace(state, layout=replace(state.layout, wanted=False))
    accepted = with_reflectors(dropped, suggestion.placement.reflectors, Edit(ACCEPT, action.client))
    return replace(accepted, effects=(*accepted.effects, Tell(_told(action), failed=False)))


def _told(action: actions.AcceptLayout) -> str:
    added, removed = action.suggestion.placement.added, len(action.suggestion.removed)
    return f"{added} reflectors put up" + (f", {removed} taken down" if removed else "") + "; Ctrl+Z takes it back"
