"""What the actions of the live sources mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.live.actions import Connect, Disconnect
from commission.app.live.effects import CloseSources, OpenSources
from commission.app.live.state import LiveState
from commission.errors import UsageError
from commission.io.live.registry import SourceAddress


@reduce.register
def connect(action: Connect, state: AppState, sender: Sender) -> Outcome:
    """Listen to sources."""
    if not action.sources:
        raise UsageError("no source is named; expected one such as json:127.0.0.1:6061, several with commas between")
    asked = state.part(LiveState)
    # What the program itself was started with is not questioned.
    check = asked.permission.checked if sender.browser is not None else _parsed
    sources = tuple(map(str, check(action.sources)))
    asked = replace(asked, sources=sources, start=action.start, connected=True)
    return Outcome(state.with_part(asked), (OpenSources(sources, action.start),))


def _parsed(texts: Iterable[str]) -> tuple[SourceAddress, ...]:
    return tuple(map(SourceAddress.parse, texts))


@reduce.register
def disconnect(_action: Disconnect, state: AppState, _sender: Sender) -> Outcome:
    """Listen no longer."""
    return Outcome(state.with_part(replace(state.part(LiveState), connected=False)), (CloseSources(),))
