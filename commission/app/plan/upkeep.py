"""One thing that is kept up to date in the background: computed when wanted, again when what it depends on changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeAlias, TypeVar

from commission.app.base.actions import Report
from commission.app.base.jobs import Job, Jobs, Lane
from commission.progress import Progress

Result = TypeVar("Result")
Key: TypeAlias = tuple[object, ...]
"""What a result depends on: parts of the project, told apart by identity, and plain settings, by value."""


class Upkeep(Generic[Result]):
    """A result and the job that makes it; called by the owner thread alone.

    A running job goes on when its inputs change, and another one follows: were it cancelled each time, a dragged
    reflector would never see a result. It is cancelled when its result is not wanted any more.

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
        self.key: Key = ()
        """What the result depends on."""
        self._jobs, self._lane, self._is_shown = jobs, lane, is_shown
        self._running: Key | None = None

    @property
    def is_running(self) -> bool:
        """Whether a job is under way."""
        return self._running is not None

    def keep(self, key: Key, work: Callable[[Progress], Result]) -> None:
        """Start the job unless the result is there, or one is under way."""
        if self._running is not None or is_same(key, self.key):
            return
        self._running = key
        self._jobs.start(
            self.name,
            work,
            then=self._take,
            failed=self._failed,
            stopped=self._end,
            lane=self._lane,
            is_shown=self._is_shown,
        )

    def ask(self, key: Key, work: Callable[[Progress], Result]) -> None:
        """Start the job where the key is another one than before; what the one before led to is dropped."""
        before = self.key if self._running is None else self._running
        if not is_same(key, before):
            self.drop()
            self.keep(key, work)

    def drop(self) -> None:
        """Forget the result and stop the job: it is not wanted any more."""
        if self._running is not None:
            self._jobs.cancel(self.name)
        self.result, self.key, self._running = None, (), None

    def _take(self, result: Result) -> None:
        self._end()
        self.result = result

    def _end(self) -> None:
        """Take note that the job has ended; what failed or was stopped is not tried again until something changes."""
        self.key, self.result, self._running = self._running or (), None, None

    def _failed(self, job: Job) -> Report:
        self._end()
        return Report(f"{job.name}: {job.error}")


def is_same(one: Key, other: Key) -> bool:
    """Whether two keys agree; arrays inside parts of a project have no truth of their own, so identity decides."""
    return len(one) == len(other) and all(
        a is b or (isinstance(a, bool | int | float | str) and type(a) is type(b) and a == b)
        for a, b in zip(one, other, strict=True)
    )
