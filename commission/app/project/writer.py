"""Writes the project's files while the page stays quick, one thing after the other, and knows whether it is at it."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from typing import TypeAlias

from commission.app.base.actions import Action, Envelope, Report, Sender
from commission.app.base.jobs import Job, Lane
from commission.app.base.service import Context

SAVE = "Saving"

Write: TypeAlias = Callable[[], Sequence[Action]]
"""Writes files and returns what came of it; what it raises is told."""


class Writer:
    """Background work on the project's files. It is not shown, as it cannot be stopped halfway.

    Parameters
    ----------
    context : that of the service; where the work is done, and what takes the actions that follow.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._numbers = itertools.count()

    @property
    def is_busy(self) -> bool:
        """Whether something is being written, or waits for it."""
        return any(job.name == SAVE for job in self._context.jobs.unfinished())

    def put(self, write: Write, sender: Sender) -> None:
        """Write when what was asked for before is written; `sender` is told what came of it."""

        def follows(outcome: Sequence[Action]) -> None:
            for action in outcome:
                self._context.post(Envelope(action, sender))

        def failed(job: Job) -> Envelope:
            return Envelope(Report(job.error), sender)

        # Each has a key of its own: a later save does not end an earlier one.
        key = (SAVE, next(self._numbers))
        self._context.jobs.start(
            SAVE, lambda _progress: write(), then=follows, failed=failed, key=key, lane=Lane.SAVING, is_shown=False
        )

    def wait(self, seconds: float) -> None:
        """Wait until all is written, at most so long [s]."""
        end = time.monotonic() + seconds
        while self.is_busy and time.monotonic() < end:
            time.sleep(0.005)
