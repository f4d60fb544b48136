"""One thing that is kept up to date in the background: computed when wanted, again when what it depends on changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeAlias, TypeVar

from commission.app.base.jobs import JobReport, Jobs, JobState
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
    kind : type of the result.
    jobs : where it runs.
    """

    def __init__(self, name: str, kind: type[Result], jobs: Jobs) -> None:
        self.name = name
        self.result: Result | None = None
        self.key: Key = ()
        """What the result depends on."""
        self._kind = kind
        self._jobs = jobs
        self._running: tuple[int, Key] | None = None

    @property
    def is_running(self) -> bool:
        """Whether a job is under way."""
        return self._running is not None

    def keep(self, key: Key, work: Callable[[Progress], Result]) -> None:
        """Start the job unless the result is there, or one is under way."""
        if self._running is None and not is_same(key, self.key):
            self._running = (self._jobs.start(self.name, work).number, key)

    def ask(self, key: Key, work: Callable[[Progress], Result]) -> None:
        """Start the job where the key is another one than before; what the one before led to is dropped."""
        before = self.key if self._running is None else self._running[1]
        if not is_same(key, before):
            self.drop()
            self.keep(key, work)

    def drop(self) -> None:
        """Forget the result and stop the job: it is not wanted any more."""
        if self._running is not None:
            self._jobs.stop(self._running[0])
        self.result, self.key, self._running = None, (), None

    def hear(self, report: JobReport) -> bool:
        """Take the end of the job; return whether it was this one's."""
        # Numbers tell jobs of one runner apart; there are several runners.
        if self._running is None or (report.job.name, report.job.number) != (self.name, self._running[0]):
            return False
        if report.job.state in (JobState.WAITING, JobState.RUNNING):
            return False
        # What failed or was stopped is not tried again until something changes.
        self.key = self._running[1]
        self.result = report.result if isinstance(report.result, self._kind) else None
        self._running = None
        return True


def is_same(one: Key, other: Key) -> bool:
    """Whether two keys agree; arrays inside parts of a project have no truth of their own, so identity decides."""
    return len(one) == len(other) and all(
        a is b or (isinstance(a, bool | int | float | str) and type(a) is type(b) and a == b)
        for a, b in zip(one, other, strict=True)
    )
