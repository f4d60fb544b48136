"""What an action of the interchange means. Pure; importing it registers its actions with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import SendFile, Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.exchange import actions
from commission.app.exchange.effects import ExportProject, ReadFile, StopReading
from commission.app.exchange.pending import Exchange, FileReading, Pending, Sent
from commission.errors import UsageError
from commission.io.project_archive import ProjectImport

PROBLEM_LIMIT = 500
"""Characters of a problem that are shown."""


def _pending(state: AppState, sender: Sender) -> Pending:
    pending = state.of_browser(sender.browser, Exchange).pending
    if pending is None:
        raise UsageError("no file was read; expected one that waits to be accepted")
    return pending


@reduce.register
def read_import(action: actions.ReadImport, state: AppState, sender: Sender) -> Outcome:
    exchange = state.of_browser(sender.browser, Exchange)
    number = exchange.number + 1
    reading = Exchange(number=number, reading=FileReading(action.source), pending=exchange.pending)
    return Outcome(
        state.with_browser(sender.browser, reading),
        (ReadFile(number, action.source, action.choice, state.project),),
    )


@reduce.register
def choose_layout(action: actions.ChooseLayout, state: AppState, sender: Sender) -> Outcome:
    source = _pending(state, sender).source
    return reduce(actions.ReadImport(source, action.choice), state, sender)


@reduce.register
def exchange_progressed(action: actions.ExchangeProgressed, state: AppState, sender: Sender) -> Outcome:
    exchange = state.of_browser(sender.browser, Exchange)
    if exchange.reading is None or action.number != exchange.number:
        return Outcome(state)
    reading = replace(exchange.reading, fraction=action.fraction, message=action.message)
    return Outcome(state.with_browser(sender.browser, replace(exchange, reading=reading)))


@reduce.register
def import_read(action: actions.ImportRead, state: AppState, sender: Sender) -> Outcome:
    exchange = state.of_browser(sender.browser, Exchange)
    if exchange.reading is None or action.number != exchange.number:
        return Outcome(state)
    # A table is usually one of several, a project is usually wanted as it is.
    whole = isinstance(action.imported, ProjectImport)
    pending = Pending(
        source=exchange.reading.source, choice=action.choice, imported=action.imported, found=action.found, remove=whole
    )
    return Outcome(state.with_browser(sender.browser, Exchange(number=exchange.number, pending=pending)))


@reduce.register
def remove_absent(action: actions.RemoveAbsent, state: AppState, sender: Sender) -> Outcome:
    pending = replace(_pending(state, sender), remove=action.remove)
    return Outcome(
        state.with_browser(sender.browser, replace(state.of_browser(sender.browser, Exchange), pending=pending))
    )


@reduce.register
def accept_import(_action: actions.AcceptImport, state: AppState, sender: Sender) -> Outcome:
    pending = _pending(state, sender)
    project = pending.preview(state.project).accepted(remove=pending.remove)
    done = state.with_browser(sender.browser, Exchange(number=state.of_browser(sender.browser, Exchange).number))
    title = pending.source.title
    if project is state.project:
        return Outcome(done, (Tell(f"{title} changes nothing", failed=False),))
    return Outcome(edited(done, project, Edit(f"import {title}", sender)))


@reduce.register
def drop_import(_action: actions.DropImport, state: AppState, sender: Sender) -> Outcome:
    # The next number makes an answer that is on its way too late.
    dropped = Exchange(number=state.of_browser(sender.browser, Exchange).number + 1)
    return Outcome(state.with_browser(sender.browser, dropped), (StopReading(),))


@reduce.register
def make_file(action: actions.MakeFile, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(state, (ExportProject(action.wanted, state.project),))


@reduce.register
def file_made(action: actions.FileMade, state: AppState, sender: Sender) -> Outcome:
    sent = Sent(action.file.name, action.file.losses)
    exchange = replace(state.of_browser(sender.browser, Exchange), sent=sent, problem="")
    sending = SendFile(action.file.name, action.file.content)
    return Outcome(state.with_browser(sender.browser, exchange), (sending,))


@reduce.register
def exchange_failed(action: actions.ExchangeFailed, state: AppState, sender: Sender) -> Outcome:
    exchange = state.of_browser(sender.browser, Exchange)
    if action.number is not None and action.number != exchange.number:
        return Outcome(state)
    text = " ".join(action.text.split())
    text = text if len(text) <= PROBLEM_LIMIT else f"{text[: PROBLEM_LIMIT - 1]}…"
    failed = state.with_browser(sender.browser, replace(exchange, reading=None, problem=text))
    # Who dropped the file anywhere on the page need not see the panel.
    return Outcome(failed, (Tell(text, failed=True),))
