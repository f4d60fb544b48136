"""Reading and making files in the background, with a worker of its own: an import does not wait for a simulation."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TypeAlias, cast

from commission.app.base.jobs import JobReport, Jobs, JobState
from commission.app.base.reduction import ExportProject, ReadFile, StopReading
from commission.app.base.uploads import Upload
from commission.app.exchange import actions
from commission.app.exchange.actions import ExchangeAction
from commission.app.exchange.pending import ImportSource, Pasted, ServerFile
from commission.app.exchange.preview import compare
from commission.io.exports import export
from commission.io.imports import Imported, LayoutChoice, read_import, read_named, read_pasted
from commission.progress import Progress

Asked: TypeAlias = tuple[int, int | None]
"""Number of the browser's connection, and of what it asked for; none for a file that is made."""


class Exchanger:
    """Does what the reducer asks for and posts what becomes of it.

    Parameters
    ----------
    post : takes actions, from any thread.
    """

    def __init__(self, post: Callable[[ExchangeAction], None]) -> None:
        self._post = post
        self._names = (f"exchange {number}" for number in itertools.count(1))
        self._asked: dict[str, Asked] = {}
        self._reading: dict[int, int] = {}
        self._jobs = Jobs(self._hear)

    def carry_out(self, effect: ReadFile | StopReading | ExportProject) -> None:
        """Start or stop work; called by the owner thread only."""
        match effect:
            case ReadFile(client, number):
                self._stop(client)
                self._reading[client] = self._start((client, number), lambda progress: _answer(effect, progress))
            case ExportProject(client, wanted, project):
                self._start(
                    (client, None),
                    lambda progress: actions.FileMade(client, export(project, wanted, progress=progress)),
                )
            case StopReading(client):
                self._stop(client)

    def close(self) -> None:
        """Stop everything."""
        self._jobs.close()

    def _start(self, asked: Asked, work: Callable[[Progress], ExchangeAction]) -> int:
        """Queue work that returns what to post; returns the number of its job."""
        name = next(self._names)
        self._asked[name] = asked
        return self._jobs.start(name, work).number

    def _stop(self, client: int) -> None:
        """Cancel what is being read for a browser; nothing happens when that is nothing."""
        if client in self._reading:
            self._jobs.stop(self._reading.pop(client))

    def _hear(self, report: JobReport) -> None:
        """Turn a report of a job into an action; called by the worker's thread, too."""
        job = report.job
        client, number = self._asked[job.name]
        if job.state is JobState.RUNNING and number is not None:
            self._post(actions.ExchangeProgressed(client, number, job.fraction, job.message))
        elif job.state is JobState.FAILED:
            self._post(actions.ExchangeFailed(client, job.error, number))
        elif job.state is JobState.DONE:
            self._post(cast(ExchangeAction, report.result))
        if job.state in (JobState.DONE, JobState.FAILED, JobState.CANCELLED):
            del self._asked[job.name]


def _answer(asked: ReadFile, progress: Progress) -> ExchangeAction:
    """Read a file and compare it."""
    imported = read(asked.source, asked.choice, progress)
    progress(0.9, "comparing")
    return actions.ImportRead(asked.client, asked.number, asked.choice, imported, compare(asked.project, imported))


def read(source: ImportSource, choice: LayoutChoice, progress: Progress) -> Imported:
    """Read a source; raises CommissionError as the readers do."""
    match source:
        case Upload(name=name, content=content):
            return read_import(name, content, choice, progress=progress)
        case ServerFile(path):
            return read_named(path, choice, progress=progress)
        case Pasted(text):
            return read_pasted(text, progress=progress)
