"""A result that is kept: computed in the background when wanted, and again when what it depends on changes.

What it depends on is the frozen input of its study, which is its key.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from commission.app.base.actions import Report
from commission.app.base.jobs import Job, Jobs, Lane
from commission.progress import Progress

Input = TypeVar("Input", bound=Hashable)
Result = TypeVar("Result")


class Kept(Generic[Input, Result]):
    """A result and the job that makes it; called by the owner thread alone.

    Parameters
    ----------
    name : of the job, in the user's words.
    jobs : where it runs.
    lane : in which it waits.
    is_shown : whether the page shows the job.
    """

    def __init__(self, name: str, jobs: Jobs, lane: Lane = Lane.USUAL, *, is_shown: bool = True) -> None:
        self.name = name
        self.result: Result | None = None
        """The newest result; none where there is none yet, or the newest job failed or was stopped."""
        self.inputs: Input | None = None
        """What the result was made from, or what the job that failed was given."""
        self._jobs, self._lane, self._is_shown = jobs, lane, is_shown
        self._running: Input | None = None
        self._request: Hashable = None

    @property
    def is_running(self) -> bool:
        """Whether a job is under way."""
        return self._running is not None

    def is_of(self, inputs: Input) -> bool:
        """Whether the result is that of an input."""
        return self.inputs == inputs

    def keep(self, inputs: Input, study: Callable[[Progress], Result]) -> None:
        """Start the study where the result is that of another input.

        A job that is under way goes on when the input changes, and another one follows: were it cancelled each time, a
        dragged reflector would never see a result.

        Parameters
        ----------
        inputs : what the study reads.
        study : computes the result from just these inputs.
        """
        if self._running is None and not self.is_of(inputs):
            self._start(inputs, study)

    def ask(self, request: Hashable, inputs: Input, study: Callable[[Progress], Result]) -> None:
        """Start the study once for each request, whatever changes afterwards: what takes long waits to be asked for.

        Parameters
        ----------
        request : tells one request from another; the newest ends the one before.
        inputs, study : as for `keep`.
        """
        if request != self._request:
            self._request = request
            self._start(inputs, study)

    def drop(self) -> None:
        """Forget the result and stop the job: it is not wanted any more."""
        if self._running is not None:
            self._jobs.cancel(self.name)
        self.result, self.inputs, self._running, self._request = None, None, None, None

    def follow(self, inputs: Input) -> None:
        """Take note that the result was brought up to date in place, and is that of another input now."""
        self.inputs = inputs

    def _start(self, inputs: Input, study: Callable[[Progress], Result]) -> None:
        self._running = inputs
        self._jobs.start(
            self.name,
            study,
            then=self._take,
            failed=self._failed,
            stopped=self._end,
            lane=self._lane,
            is_shown=self._is_shown,
        )

    def _take(self, result: Result) -> None:
        self._end()
        self.result = result

    def _end(self) -> None:
        """Take note that the job has ended; what failed or was stopped is not tried again until something changes."""
        self.result, self.inputs, self._running = None, self._running, None

    def _failed(self, job: Job) -> Report:
        self._end()
        return Report(f"{job.name}: {job.error}")
