"""What a feature does besides drawing: it follows the state, computes, carries effects out, and adds to the view.

Called by the owner thread alone. Knows no widget.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from commission.app.base.actions import Action, Envelope, Sender
from commission.app.base.effects import Effect
from commission.app.base.jobs import Jobs
from commission.app.base.state import AppState

IDLE_S = 0.5
"""Time after which services are asked again though nothing has happened [s]."""


class Due(IntEnum):
    """How soon something has to be drawn."""

    NEVER = 0
    SLOWLY = 1
    SOON = 2


@dataclass(frozen=True, slots=True)
class Context:
    """What a service is made with."""

    state: AppState
    """As the page begins."""
    post: Callable[[Action | Envelope], None]
    """Takes actions, from any thread; those without an envelope are the program's own."""
    clock: Callable[[], float]
    """Returns seconds."""
    jobs: Jobs
    """Background work: `jobs.start(name, study, then=action)`."""


class Service:
    """A service that does nothing: each one overrides what it needs.

    Parameters
    ----------
    context : what it is made with.
    """

    effects: tuple[type[Effect], ...] = ()
    """Types of the effects that it carries out; nobody else carries out the same."""

    def __init__(self, context: Context) -> None:
        self.context = context

    def start(self) -> None:
        """Begin; called once, when the page is there."""

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:
        """Take note of another project, before the effects of the action are carried out.

        Parameters
        ----------
        action : what changed it.
        before, after : the state before the action and the one that follows.
        """

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Do one thing that a handler asks for, in the state that follows, on behalf of who sent the action.

        Parameters
        ----------
        effect : one of the types in `effects`.
        state : the state that follows from the action.
        sender : who sent the action.
        """

    def follow(self, state: AppState) -> Due:  # noqa: ARG002 - a default
        """Do what is due in this state, at most some milliseconds of it; return when its parts have to be drawn."""
        return Due.NEVER

    def rest(self, state: AppState) -> float:  # noqa: ARG002 - a default
        """Return the time after which it wants to follow again though nothing has happened [s]."""
        return IDLE_S

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - a default
        """Return its parts of the view; `slowly` with what is drawn slowly, too."""
        return ()

    def close(self) -> None:
        """Stop everything."""
