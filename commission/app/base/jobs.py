"""Background work: one worker does one job after the other while the page stays quick.

Nothing here knows what a job computes. Jobs share no state with the thread that owns the project: they get values, and
their reports (progress, result, error) go through a callback, normally the owner's queue.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from queue import SimpleQueue

from commission.errors import CommissionError, JobCancelled, JobError
from commission.progress import Progress

_log = logging.getLogger(__name__)

_QUIET_S = 0.05
"""Shortest time between two reports of progress: 20 a second look smooth and do not crowd out other actions."""


class JobState(StrEnum):
    """Where a job stands."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True)
class Job:
    """How one job stands at one moment."""

    number: int
    """Counts up from 1; tells apart two jobs of one name."""

    name: str
    """What is being done, in the user's words: "Coverage"."""

    state: JobState = JobState.WAITING
    """Where it stands."""

    fraction: float = 0.0
    """Part that is done, 0 to 1."""

    message: str = ""
    """What it does now, in one line."""

    error: str = ""
    """Why it failed, in one line; empty unless it did."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.fraction <= 1.0:
            raise ValueError(f"fraction is {self.fraction}; expected 0 to 1")


@dataclass(frozen=True, slots=True)
class JobReport:
    """News about a job, handed to the owner."""

    job: Job
    """How it stands now."""

    result: object = None
    """What the work returned; only in the report that says `JobState.DONE`."""


Work = Callable[[Progress], object]
"""Does the work and returns its result; calls the given progress often enough to be stopped without annoyance."""


class Jobs:
    """Runs work in the background, one job after the other.

    Parameters
    ----------
    post : takes each `JobReport`, from the thread in which it arises. It should only put it into the owner's queue.
        Reports about one job arrive in order. Progress is thinned out; a change of state or message never is.
    numbers : where the jobs' numbers come from; runners that report to the same owner share it.
    """

    def __init__(self, post: Callable[[JobReport], None], numbers: Iterator[int] | None = None) -> None:
        self._post = post
        self._numbers = itertools.count(1) if numbers is None else numbers
        # Held while a report is posted, so that they arrive in order; re-entrant, in case `post` looks at the jobs.
        self._lock = threading.RLock()
        self._unfinished: dict[int, Job] = {}
        self._stopped: set[int] = set()
        self._queue: SimpleQueue[tuple[int, Work] | None] = SimpleQueue()
        self._is_closed = False
        # A daemon: work that ignores its cancellation must not keep the program from ending.
        self._worker = threading.Thread(target=self._work_off, name="jobs", daemon=True)
        self._worker.start()

    def start(self, name: str, work: Work) -> Job:
        """Queue work; an unfinished job of the same name is cancelled, since its result would be outdated.

        Raises
        ------
        JobError
            The runner is closed.
        """
        with self._lock:
            if self._is_closed:
                raise JobError(f"{name} cannot start: the program is closing")
            for job in self.unfinished():
                if job.name == name:
                    self.cancel(job.number)
            job = Job(next(self._numbers), name)
            self._record(job)
            self._queue.put((job.number, work))
            return job

    def cancel(self, number: int) -> None:
        """Ask a job to stop: a waiting one never starts, a running one ends at its next call of progress.

        A job that has ended, or never existed, cannot be cancelled: nothing happens.
        """
        with self._lock:
            job = self._unfinished.get(number)
            if job is not None and job.state is JobState.WAITING:
                self._record(replace(job, state=JobState.CANCELLED))
            elif job is not None:
                self._stopped.add(number)

    def unfinished(self) -> tuple[Job, ...]:
        """Jobs that wait or run, oldest first."""
        with self._lock:
            return tuple(self._unfinished.values())

    def close(self, timeout: float = 2.0) -> bool:
        """Cancel everything and wait for the worker, at most `timeout` seconds; whether it has ended."""
        with self._lock:
            self._is_closed = True
            for job in self.unfinished():
                self.cancel(job.number)
        self._queue.put(None)
        self._worker.join(timeout)
        return not self._worker.is_alive()

    def _work_off(self) -> None:
        """Loop of the worker's thread."""
        while (item := self._queue.get()) is not None:
            number, work = item
            with self._lock:
                job = self._unfinished.get(number)
                if job is None:  # cancelled while it waited
                    continue
                self._record(replace(job, state=JobState.RUNNING))
            self._run(number, work)

    def _run(self, number: int, work: Work) -> None:
        """Do one job and record how it ended."""
        state, result, error = JobState.DONE, None, ""
        try:
            result = work(self._progress_of(number))
        except JobCancelled:
            state = JobState.CANCELLED
        except Exception as problem:
            state, error = JobState.FAILED, _one_line(problem)
            if not isinstance(problem, CommissionError):  # a mistake of ours and not of the user's: where was it?
                _log.exception("job %d failed", number)
        with self._lock:
            if number in self._stopped:  # it ended before it noticed: nobody waits for its result any more
                state, result, error = JobState.CANCELLED, None, ""
            job = self._unfinished[number]
            fraction = 1.0 if state is JobState.DONE else job.fraction
            self._record(replace(job, state=state, fraction=fraction, error=error), result)

    def _progress_of(self, number: int) -> Progress:
        """What the work of this job calls."""
        reported_at = -math.inf

        def progress(fraction: float, message: str, /) -> None:
            nonlocal reported_at
            now = time.monotonic()
            with self._lock:
                if number in self._stopped:
                    raise JobCancelled("the job was stopped")
                job = self._unfinished[number]
                is_due = now - reported_at >= _QUIET_S or message != job.message
                self._unfinished[number] = replace(job, fraction=min(max(fraction, 0.0), 1.0), message=message)
                if is_due:
                    reported_at = now
                    self._post(JobReport(self._unfinished[number]))

        return progress

    def _record(self, job: Job, result: object = None) -> None:
        """Keep and report how a job stands now; an ended one is forgotten. The lock is held."""
        if job.state in (JobState.WAITING, JobState.RUNNING):
            self._unfinished[job.number] = job
        else:
            del self._unfinished[job.number]
            self._stopped.discard(job.number)
        self._post(JobReport(job, result))


def _one_line(problem: Exception) -> str:
    """What went wrong, for the user; the class's name helps where the text was not written by us."""
    text = " ".join(str(problem).split())
    return text if text and isinstance(problem, CommissionError) else f"{type(problem).__name__}: {text}".rstrip(": ")
