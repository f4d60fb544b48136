"""Reading and making files in the background: an import does not wait for a simulation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

from commission.app.base.actions import Action, Envelope, Sender
from commission.app.base.effects import Effect
from commission.app.base.jobs import Lane
from commission.app.base.reach import Reach
from commission.app.base.service import Context, Service
from commission.app.base.state import AppState
from commission.app.base.uploads import Upload
from commission.app.exchange import actions
from commission.app.exchange.effects import ExportProject, ReadFile, StopReading
from commission.app.exchange.pending import ImportSource, Pasted, ServerFile
from commission.app.exchange.preview import compare
from commission.io.exports import export
from commission.io.imports import Imported, LayoutChoice, read_import, read_named, read_pasted
from commission.progress import Progress

QUIET_S = 0.05
"""Shortest time between two words about how far reading is [s]."""


class ExchangeService(Service):
    """Does what a handler asks for; a browser's newest file ends the reading of the one before."""

    effects = (ReadFile, StopReading, ExportProject)

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._exports = itertools.count(1)

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Start or stop work on behalf of a browser."""
        match effect:
            case ReadFile(number, source):
                within = _within(source, state.reach, sender)

                def read_it(progress: Progress) -> Action:
                    return _answer(effect, within, self._telling(progress, number, sender))

                self._start(sender, read_it, number, key=_reading_of(sender))
            case ExportProject(wanted, project):
                self._start(sender, lambda progress: actions.FileMade(export(project, wanted, progress=progress)))
            case _:
                self.context.jobs.cancel(_reading_of(sender))

    def _start(
        self,
        sender: Sender,
        work: Callable[[Progress], Action],
        number: int | None = None,
        *,
        key: tuple[object, ...] | None = None,
    ) -> None:
        """Queue work that returns what follows; of exports, each is made."""
        self.context.jobs.start(
            "Files",
            work,
            then=lambda action: Envelope(action, sender),
            failed=lambda job: Envelope(actions.ExchangeFailed(job.error, number), sender),
            key=key or ("export", next(self._exports)),
            lane=Lane.FILES,
            is_shown=False,
        )

    def _telling(self, progress: Progress, number: int, sender: Sender) -> Progress:
        """Progress that is shown in the browser that asked, not in all of them."""
        told_at = -math.inf

        def tell(fraction: float, message: str, /) -> None:
            nonlocal told_at
            progress(fraction, message)
            now = self.context.clock()
            if now - told_at >= QUIET_S:
                told_at = now
                self.context.post(Envelope(actions.ExchangeProgressed(number, fraction, message), sender))

        return tell


def _reading_of(sender: Sender) -> tuple[object, ...]:
    return "import", sender.browser


def _within(source: ImportSource, reach: Reach, sender: Sender) -> ImportSource:
    """Return what a browser may read; a file of this computer as it is after all links."""
    return ServerFile(reach.checked(source.path, sender)) if isinstance(source, ServerFile) else source


def _answer(asked: ReadFile, source: ImportSource, progress: Progress) -> Action:
    """Read a file and compare it."""
    imported = read(source, asked.choice, progress)
    progress(0.9, "comparing")
    return actions.ImportRead(asked.number, asked.choice, imported, compare(asked.project, imported))


def read(source: ImportSource, choice: LayoutChoice, progress: Progress) -> Imported:
    """Read a source; raises CommissionError as the readers do.

    Parameters
    ----------
    source : an upload, a file of the server, or pasted text.
    choice : which layout and vehicle type of a file that holds several.
    progress : told how far it is; may raise to cancel.
    """
    match source:
        case Upload(name=name, content=content):
            return read_import(name, content, choice, progress=progress)
        case ServerFile(path):
            return read_named(path, choice, progress=progress)
        case Pasted(text):
            return read_pasted(text, progress=progress)
