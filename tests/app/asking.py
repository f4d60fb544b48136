"""How tests of handlers ask for something: as a browser, at a time. Every handler of the page is registered."""

from __future__ import annotations

from collections.abc import Callable

from commission.app.base.actions import Action, Envelope, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.launch import FEATURES

__all__ = ["FEATURES", "ME", "OTHER", "after", "by", "joined", "taking"]

ME, OTHER = 1, 2
"""Numbers of two browsers."""


def by(browser: int | None, action: Action, at: float = 0.0) -> Envelope:
    """Return what another browser asks for, or what is asked for at a time [s]."""
    return Envelope(action, Sender(browser, at))


def after(state: AppState, *asked: Action | Envelope, browser: int | None = ME) -> Outcome:
    """Return the state after all that was asked for, by one browser unless an envelope says otherwise.

    The effects are those of the last one.
    """
    outcome = Outcome(state)
    for each in asked:
        envelope = each if isinstance(each, Envelope) else by(browser, each)
        outcome = reduce(envelope.action, outcome.state, envelope.sender)
    return outcome


def joined(state: AppState, *browsers: int) -> AppState:
    """Return the state with these browsers, or with both."""
    for browser in browsers or (ME, OTHER):
        state = state.joined(browser)
    return state


def taking(actions: list[Action]) -> Callable[[Envelope], None]:
    """Return what takes the envelopes of widgets, and keeps the actions in them."""
    return lambda envelope: actions.append(envelope.action)
