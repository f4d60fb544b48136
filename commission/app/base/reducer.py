"""What follows from an action: the next state, and effects to carry out. The one function `reduce`.

What each action means is registered with it by a named handler of the feature that declares the action:

    @reduce.register
    def set_parameter(action: SetParameter, state: AppState, sender: Sender) -> Outcome: ...

A handler is pure: it knows no widget, no file, no clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

from commission.app.base.actions import Action, Sender
from commission.app.base.effects import Effect
from commission.app.base.state import AppState


@dataclass(frozen=True, slots=True)
class Outcome:
    """What follows from one action."""

    state: AppState
    """The next state."""
    effects: tuple[Effect, ...] = ()
    """What has to be done besides, in this order."""


@singledispatch
def reduce(action: Action, state: AppState, sender: Sender) -> Outcome:
    """Return what follows from an action.

    Parameters
    ----------
    action : what was asked for.
    state : the state it was asked in.
    sender : who asked, and when.

    Raises
    ------
    CommissionError, ValueError
        the action asks for something that does not exist or is out of range; the state stays as it is.
    """
    raise TypeError(
        f"{type(action).__name__} of {sender} has no handler among those for {len(state.browsers)} browsers; expected "
        "the module that registers it to be imported"
    )
