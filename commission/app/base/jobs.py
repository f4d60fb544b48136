"""Background work: the one mechanism by which anything is done while the page stays quick.

A job carries its continuation: what is to be done with its result, as a function that the owner thread calls and that
returns the action to reduce. So nobody has to find out whose result has come. Nothing here knows what a job computes.
Jobs share no state with the thread that owns the project: they get values, and their news (progress, result, error) go
through a callback, normally the owner's queue.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from queue import SimpleQueue
from typing import Any, TypeVar

from commission.compiled import telling_of_compilations
from commission.errors import CommissionError, JobCancelled, JobError, fault_line
from commission.progress import Progress

_log = logging.getLogger(__name__)

COMPILING = "compiling"
"""Said of a job that compiles kernels."""
_QUIET_S = 0.05
"""Shortest time between two reports of progress: 20 a second look smooth and do not crowd out other actions."""

Result = TypeVar("Result")


class Lane(StrEnum):
    """Who waits for whom: jobs of one lane are done one after the other, lanes beside each other."""

    QUICK = "quick"
    """Milliseconds: what follows every edit."""
    RUN = "run"
    """The drive on the page, localized again after an edit: nobody waits for it, and it waits for nobody."""
    FILES = "files"
    """A file that somebody has just sent, or asked for."""
    SAVING = "saving"
    """The project's own files: they wait for nothing else."""
    USUAL = "usual"
    """Seconds."""
    PATIENT = "patient"
    """Minutes; nothing else must wait for it."""


class JobState(StrEnum):
    """Where a job stands."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """How one job stands at one moment."""

    number: int
    """Counts up from 1; tells apart two jobs of one name."""

    name: str
    """What is being done, in the user's words: "Coverage"."""

    key: Hashable = None
    """What a newer job must share with it to end it."""

    lane: Lane = Lane.USUAL
    """In which it waits."""

    is_shown: bool = True
    """Whether the page shows it: not what is too quick, or started too often."""

    state: JobState = JobState.WAITING
    """Where it stands."""

    fraction: float = 0.0
    """Part that is done, 0 to 1."""

    message: str = ""
    """What it does now, in one line."""

    compiles: bool = False
    """Whether it compiles kernels at the moment: the first of their kind take up to a minute, without progress."""

    error: str = ""
    """Why it failed, in one line; empty unless it did."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.fraction <= 1.0:
            raise ValueError(f"fraction is {self.fraction}; expected 0 to 1")

    @property
    def does(self) -> str:
        """What it does now; that it compiles kernels is part of it."""
        if not self.compiles or COMPILING in self.message:
            return self.message
        return f"{self.message}, {COMPILING}" if self.message else COMPILING

    @property
    def line(self) -> str:
        """How it stands, in one line."""
        return f"{self.name}{self.does and ': '}{self.does} {self.fraction:.0%}"

    @property
    def has_ended(self) -> bool:
        """Whether it neither waits nor runs."""
        return self.state not in (JobState.WAITING, JobState.RUNNING)


@dataclass(frozen=True, slots=True)
class JobReport:
    """News about a job, handed to the owner, who hands it to `Jobs.hear`."""

    job: Job
    """How it stands now."""

    result: object = None
    """What the work returned; only in the report that says `JobState.DONE`."""


def _nothing(*_: object) -> None:
    """Continuation of a job of which nothing follows."""


@dataclass(frozen=True, slots=True)
class _Continuation:
    """What follows from the end of a job: each returns an action for the owner, or None."""

    key: Hashable
    then: Callable[[Any], object]
    failed: Callable[[Job], object]
    stopped: Callable[[], object]


class Jobs:
    """Runs work in the background.

    Parameters
    ----------
    post : takes each `JobReport`, from the thread in which it arises. It should only put it into the owner's queue.
        Reports about one job arrive in order. Progress is thinned out; a change of state or message never is.
    failed : from a job that failed to the action that says so, for all jobs that do not see to it themselves.
    """

    def __init__(self, post: Callable[[JobReport], None], failed: Callable[[Job], object] = _nothing) -> None:
        self._post, self._failed = post, failed
        self._numbers = itertools.count(1)
        # Held while a report is posted, so that they arrive in order; re-entrant, in case `post` looks at the jobs.
        self._lock = threading.RLock()
        self._unfinished: dict[int, Job] = {}
        self._stopped: set[int] = set()
        # Of every job whose end the owner has not heard of and still wants to.
        self._continuations: dict[int, _Continuation] = {}
        self._lanes: dict[Lane, SimpleQueue[tuple[int, Callable[[Progress], object]] | None]] = {}
        self._workers: list[threading.Thread] = []
        self._is_closed = False

    def start(
        self,
        name: str,
        work: Callable[[Progress], Result],
        *,
        then: Callable[[Result], object] = _nothing,
        failed: Callable[[Job], object] | None = None,
        stopped: Callable[[], object] = _nothing,
        key: Hashable = None,
        lane: Lane = Lane.USUAL,
        is_shown: bool = True,
    ) -> Job:
        """Queue work; an unfinished job of the same key is cancelled, since its result would be outdated.

        Parameters
        ----------
        name : what is being done, in the user's words.
        work : does it and returns the result; calls the given progress often enough to be stopped without annoyance.
        then : called by the owner thread with the result, unless the job was cancelled before; returns the action that
            follows, or None.
        failed : called by the owner thread where the work raised; returns the action that says so.
        stopped : called by the owner thread where somebody stopped the job; returns the action that follows, or None.
        key : of the jobs of which only the newest counts; the name when None.
        lane : in which it waits.
        is_shown : whether the page shows it.

        Raises
        ------
        JobError
            The runner is closed.
        """
        with self._lock:
            if self._is_closed:
                raise JobError(f"{name} cannot start: the program is closing")
            key = name if key is None else key
            self.cancel(key)
            job = Job(number=next(self._numbers), name=name, key=key, lane=lane, is_shown=is_shown)
            self._continuations[job.number] = _Continuation(key, then, failed or self._failed, stopped)
            self._record(job)
            self._lane(lane).put((job.number, work))
            return job

    def cancel(self, key: Hashable) -> None:
        """Let nothing follow any more from the job of a key: it is not wanted.

        A waiting one never starts, a running one ends at its next call of progress. Where it has ended already and the
        owner has not heard of it yet, it never will. Where there is none, nothing happens.
        """
        with self._lock:
            self._continuations = {number: each for number, each in self._continuations.items() if each.key != key}
            for job in self.unfinished():
                if job.key == key:
                    self._end(job)

    def stop(self, number: int) -> None:
        """End a job because a person asked for it: as for `cancel`, and its `stopped` is what follows.

        A job that has ended, or never existed, cannot be stopped: nothing happens.
        """
        with self._lock:
            job = self._unfinished.get(number)
            if job is not None:
                self._end(job)

    def hear(self, report: JobReport) -> object:
        """Take a report back from the owner's queue; return the action that follows from it, or None.

        Called by the owner thread alone: what it has cancelled before is never heard of.
        """
        job = report.job
        if not job.has_ended:
            return None
        with self._lock:
            continuation = self._continuations.pop(job.number, None)
        if continuation is None:
            return None
        match job.state:
            case JobState.DONE:
                return continuation.then(report.result)
            case JobState.FAILED:
                return continuation.failed(job)
            case _:
                return continuation.stopped()

    def unfinished(self) -> tuple[Job, ...]:
        """Jobs that wait or run, oldest first."""
        with self._lock:
            return tuple(self._unfinished.values())

    def running(self) -> tuple[Job, ...]:
        """Jobs that run and that the page shows, oldest first."""
        return self._shown(JobState.RUNNING)

    def waiting(self) -> tuple[Job, ...]:
        """Jobs that wait and that the page shows, oldest first."""
        return self._shown(JobState.WAITING)

    def _shown(self, state: JobState) -> tuple[Job, ...]:
        return tuple(job for job in self.unfinished() if job.is_shown and job.state is state)

    def close(self, timeout: float = 2.0) -> bool:
        """Cancel everything and wait for the workers, at most `timeout` seconds in all; whether they have ended."""
        with self._lock:
            self._is_closed = True
            self._continuations.clear()
            for job in self.unfinished():
                self._end(job)
            for queue in self._lanes.values():
                queue.put(None)
        end = time.monotonic() + timeout
        for worker in self._workers:
            worker.join(max(0.0, end - time.monotonic()))
        return not any(worker.is_alive() for worker in self._workers)

    def _lane(self, lane: Lane) -> SimpleQueue[tuple[int, Callable[[Progress], object]] | None]:
        """Queue of a lane; its worker starts with its first job. The lock is held."""
        if lane not in self._lanes:
            queue = self._lanes[lane] = SimpleQueue()
            # A daemon: work that ignores its cancellation must not keep the program from ending.
            worker = threading.Thread(target=self._work_off, args=(queue,), name=f"jobs {lane}", daemon=True)
            self._workers.append(worker)
            worker.start()
        return self._lanes[lane]

    def _work_off(self, queue: SimpleQueue[tuple[int, Callable[[Progress], object]] | None]) -> None:
        """Loop of a worker's thread."""
        while (item := queue.get()) is not None:
            number, work = item
            with self._lock:
                job = self._unfinished.get(number)
                if job is None:  # cancelled while it waited
                    continue
                self._record(replace(job, state=JobState.RUNNING))
            self._run(number, work)

    def _run(self, number: int, work: Callable[[Progress], object]) -> None:
        """Do one job and record how it ended."""
        state, result, error = JobState.DONE, None, ""
        try:
            with telling_of_compilations(partial(self._compiles, number)):
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
            self._record(replace(job, state=state, fraction=fraction, error=error, compiles=False), result)

    def _compiles(self, number: int, compiles: bool) -> None:
        """Say that a job compiles kernels now, or does not any more."""
        with self._lock:
            self._record(replace(self._unfinished[number], compiles=compiles))

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

    def _end(self, job: Job) -> None:
        """Let an unfinished job end: at once while it waits, at its next progress while it runs. The lock is held."""
        if job.state is JobState.WAITING:
            self._record(replace(job, state=JobState.CANCELLED))
        else:
            self._stopped.add(job.number)

    def _record(self, job: Job, result: object = None) -> None:
        """Keep and report how a job stands now; an ended one is forgotten. The lock is held."""
        if job.has_ended:
            del self._unfinished[job.number]
            self._stopped.discard(job.number)
        else:
            self._unfinished[job.number] = job
        self._post(JobReport(job, result))


def _one_line(problem: Exception) -> str:
    """What went wrong, for the user."""
    text = " ".join(str(problem).split())
    return text if text and isinstance(problem, CommissionError) else fault_line(problem)
