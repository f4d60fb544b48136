"""What an action of the interchange means. Pure; importing it registers its actions with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.reduction import (
    ApplyParameters,
    ExportProject,
    ReadFile,
    Reduction,
    SendFile,
    StopReading,
    Tell,
    reduce,
)
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing.editor import Editor
from commission.app.exchange import actions
from commission.app.exchange.pending import Exchange, Pending, Reading, Sent
from commission.errors import UsageError
from commission.io.project_archive import ProjectImport

PROBLEM_LIMIT = 500
"""Characters of a problem that are shown."""


def _exchange(state: AppState, client: int) -> Exchange:
    return state.editors.get(client, Editor()).exchange


def _with(state: AppState, client: int, exchange: Exchange) -> AppState:
    """Return the state with another exchange of one browser; one that has left gets none."""
    if client not in state.editors:
        return state
    return state.with_editor(client, replace(state.editors[client], exchange=exchange))


def _pending(state: AppState, client: int) -> Pending:
    pending = _exchange(state, client).pending
    if pending is None:
        raise UsageError("no file was read; expected one that waits to be accepted")
    return pending


@reduce.register
def _(action: actions.ReadImport, state: AppState) -> Reduction:
    exchange = _exchange(state, action.client)
    number = exchange.number + 1
    reading = Exchange(number, Reading(action.source), exchange.pending)
    return Reduction(
        _with(state, action.client, reading),
        (ReadFile(action.client, number, action.source, action.choice, state.project),),
    )


@reduce.register
def _(action: actions.ChooseLayout, state: AppState) -> Reduction:
    source = _pending(state, action.client).source
    return reduce(actions.ReadImport(action.client, source, action.choice), state)


@reduce.register
def _(action: actions.ExchangeProgressed, state: AppState) -> Reduction:
    exchange = _exchange(state, action.client)
    if exchange.reading is None or action.number != exchange.number:
        return Reduction(state)
    reading = replace(exchange.reading, fraction=action.fraction, message=action.message)
    return Reduction(_with(state, action.client, replace(exchange, reading=reading)))


@reduce.register
def _(action: actions.ImportRead, state: AppState) -> Reduction:
    exchange = _exchange(state, action.client)
    if exchange.reading is None or action.number != exchange.number:
        return Reduction(state)
    # A table is usually one of several, a project is usually wanted as it is.
    whole = isinstance(action.imported, ProjectImport)
    pending = Pending(exchange.reading.source, action.choice, action.imported, action.found, remove=whole)
    return Reduction(_with(state, action.client, Exchange(exchange.number, pending=pending)))


@reduce.register
def _(action: actions.RemoveAbsent, state: AppState) -> Reduction:
    pending = replace(_pending(state, action.client), remove=action.remove)
    return Reduction(_with(state, action.client, replace(_exchange(state, action.client), pending=pending)))


@reduce.register
def _(action: actions.AcceptImport, state: AppState) -> Reduction:
    pending = _pending(state, action.client)
    project = pending.preview(state.project).accepted(remove=pending.remove)
    done = _with(state, action.client, Exchange(_exchange(state, action.client).number))
    title = pending.source.title
    if project is state.project:
        return Reduction(done, (Tell(f"{title} changes nothing", failed=False),))
    return Reduction(edited(done, project, Edit(f"import {title}", action.client)), (ApplyParameters(),))


@reduce.register
def _(action: actions.DropImport, state: AppState) -> Reduction:
    # The next number makes an answer that is on its way too late.
    dropped = Exchange(_exchange(state, action.client).number + 1)
    return Reduction(_with(state, action.client, dropped), (StopReading(action.client),))


@reduce.register
def _(action: actions.MakeFile, state: AppState) -> Reduction:
    return Reduction(state, (ExportProject(action.client, action.wanted, state.project),))


@reduce.register
def _(action: actions.FileMade, state: AppState) -> Reduction:
    sent = Sent(action.file.name, action.file.losses)
    exchange = replace(_exchange(state, action.client), sent=sent, problem="")
    sending = SendFile(action.client, action.file.name, action.file.content)
    return Reduction(_with(state, action.client, exchange), (sending,))


@reduce.register
def _(action: actions.ExchangeFailed, state: AppState) -> Reduction:
    exchange = _exchange(state, action.client)
    if action.number is not None and action.number != exchange.number:
        return Reduction(state)
    text = " ".join(action.text.split())
    text = text if len(text) <= PROBLEM_LIMIT else f"{text[: PROBLEM_LIMIT - 1]}…"
    return Reduction(_with(state, action.client, replace(exchange, reading=None, problem=text)))
