"""What the actions of the live sources mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.live.actions import Connect, Disconnect, LocateVehicle, Record, RecordDrive, StopRecording
from commission.app.live.effects import CloseRecording, CloseSources, LocateNow, OpenRecording, OpenSources, WriteDrive
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


@reduce.register
def locate_vehicle(_action: LocateVehicle, state: AppState, _sender: Sender) -> Outcome:
    """Throw its pose away."""
    if not state.part(LiveState).connected:
        raise UsageError("nothing is connected to; expected a connection to the vehicle that is to be located")
    return Outcome(state, (LocateNow(),))


@reduce.register
def record(action: Record, state: AppState, _sender: Sender) -> Outcome:
    """Record from now on."""
    if not state.part(LiveState).connected:
        raise UsageError("nothing is connected to; expected a connection whose records can be recorded")
    _check_place(action.path, state)
    return Outcome(state, (OpenRecording(action.path),))


@reduce.register
def record_drive(action: RecordDrive, state: AppState, _sender: Sender) -> Outcome:
    """Write the drive on the page."""
    _check_place(action.path, state)
    return Outcome(state, (WriteDrive(action.drive, action.path),))


def _check_place(path: Path | None, state: AppState) -> None:
    """Refuse a recording that has no place."""
    if path is None and state.folder is None:
        raise UsageError("the project is in no folder; expected the path of a new file that ends in .mcap")


@reduce.register
def stop_recording(_action: StopRecording, state: AppState, _sender: Sender) -> Outcome:
    """Record no longer."""
    return Outcome(state, (CloseRecording(),))
