"""What the actions of the live sources mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

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
def connect(action: Connect, state: AppState, _sender: Sender) -> Outcome:
    """Listen to sources."""
    if not action.sources:
        raise UsageError("no source is named; expected one such as json:127.0.0.1:6061, several with commas between")
    for text in action.sources:
        SourceAddress.parse(text)
    asked = LiveState(sources=action.sources, start=action.start, connected=True)
    return Outcome(state.with_part(asked), (OpenSources(action.sources, action.start),))


@reduce.register
def disconnect(_action: Disconnect, state: AppState, _sender: Sender) -> Outcome:
    """Listen no longer."""
    return Outcome(state.with_part(replace(state.part(LiveState), connected=False)), (CloseSources(),))
