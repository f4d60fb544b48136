"""What the actions about failing reflectors mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.editing.editor import editor_of
from commission.app.editing.gestures import reflector_at
from commission.app.failures.actions import (
    AlsoFails,
    ChooseFailure,
    ClickReflector,
    DropRanking,
    RankReflectors,
    ShowFailure,
)
from commission.app.failures.settings import FailureSettings
from commission.errors import UsageError
from commission.site.fields import with_field


@reduce.register
def choose_failure(action: ChooseFailure, state: AppState, _sender: Sender) -> Outcome:
    """Choose what happens to each; whose failure was shown is forgotten."""
    settings = with_field(state.part(FailureSettings), "failure", action.failure)
    return Outcome(state.with_part(replace(settings, failed="")))


@reduce.register
def rank_reflectors(_action: RankReflectors, state: AppState, _sender: Sender) -> Outcome:
    """Ask for a ranking; counted, so that asking again after an edit is told apart from having asked."""
    settings = state.part(FailureSettings)
    return Outcome(state.with_part(replace(settings, ranking=settings.ranking + 1, fallen=())))


@reduce.register
def drop_ranking(_action: DropRanking, state: AppState, _sender: Sender) -> Outcome:
    """Want no ranking any more."""
    return Outcome(state.with_part(replace(state.part(FailureSettings), ranking=0, fallen=(), failed="")))


@reduce.register
def show_failure(action: ShowFailure, state: AppState, _sender: Sender) -> Outcome:
    """Show another one."""
    return Outcome(state.with_part(replace(state.part(FailureSettings), failed=action.name)))


@reduce.register
def click_reflector(action: ClickReflector, state: AppState, sender: Sender) -> Outcome:
    """A click on a ranked reflector asks for what depends on it."""
    settings = state.part(FailureSettings)
    if not settings.ranking or editor_of(state, sender.browser).tool is not None:
        return Outcome(state)
    name = reflector_at(state.project.reflectors, action.place, action.reach)
    return Outcome(state if name is None else state.with_part(replace(settings, failed=name)))


@reduce.register
def let_fail(action: AlsoFails, state: AppState, _sender: Sender) -> Outcome:
    """Go on from one more failure; raises UsageError where there is no such reflector."""
    if all(reflector.id != action.name for reflector in state.project.reflectors.reflectors):
        raise UsageError(f"no reflector is called {action.name!r}")
    settings = state.part(FailureSettings)
    fallen = (*settings.fallen, action.name)
    return Outcome(state.with_part(replace(settings, fallen=fallen, failed="", ranking=settings.ranking + 1)))
