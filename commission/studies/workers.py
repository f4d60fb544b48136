"""Who does the runs of a study that are independent of each other: this machine's cores here, others in `io.cluster`.

It knows nothing of the work. Results come as they are done; who asked puts them in their order.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Protocol, TypeVar

from commission.errors import JobCancelled
from commission.progress import Progress

Given = TypeVar("Given")
Task = TypeVar("Task")
Result = TypeVar("Result")
Given_contra = TypeVar("Given_contra", contravariant=True)
Task_contra = TypeVar("Task_contra", contravariant=True)
Result_co = TypeVar("Result_co", covariant=True)


class Work(Protocol[Given_contra, Task_contra, Result_co]):
    """One task of a study: a function of a module, so that another process finds it by its name."""

    def __call__(self, given: Given_contra, task: Task_contra, progress: Progress, /) -> Result_co:
        """Do it.

        Parameters
        ----------
        given : what all tasks read.
        task : what is different in this one.
        progress : called on the way; raises JobCancelled when nobody wants the result any more.
        """
        ...


class Workers(Protocol):
    """Who does tasks."""

    @property
    def count(self) -> int:
        """How many work at once."""
        ...

    @property
    def shares_memory(self) -> bool:
        """Whether what is given is the same object for all, so that it may hold what one of them can compute."""
        ...

    def each(
        self, work: Work[Given, Task, Result], given: Given, tasks: Iterable[Task]
    ) -> Iterator[tuple[Task, Result]]:
        """Do all tasks, and give each with its result as soon as it is done.

        Parameters
        ----------
        work : what is done; must not depend on anything but its arguments.
        given : what all tasks read.
        tasks : in the order in which they begin.
        """
        ...


@dataclass(frozen=True, slots=True)
class Threads:
    """Cores of this machine. Kernels hold no lock, so that threads use them, and nothing is copied."""

    number: int | None = None
    """How many; as many as cores when None."""

    @property
    def count(self) -> int:
        """How many work at once."""
        return self.number or os.cpu_count() or 1

    @property
    def shares_memory(self) -> bool:
        """They do."""
        return True

    def each(
        self, work: Work[Given, Task, Result], given: Given, tasks: Iterable[Task]
    ) -> Iterator[tuple[Task, Result]]:
        """Do all tasks; no more are under way than there are threads.

        A thread holds a whole run: what waits would hold memory for nothing, and could not be stopped.

        Parameters
        ----------
        work, given, tasks : as in `Workers`.
        """
        stopped, rest = threading.Event(), iter(tasks)

        def progress(_fraction: float, _message: str, /) -> None:
            if stopped.is_set():
                raise JobCancelled

        with ThreadPoolExecutor(self.count) as pool:
            under_way: dict[Future[Result], Task] = {
                pool.submit(work, given, task, progress): task for task in itertools.islice(rest, self.count)
            }
            try:
                while under_way:
                    for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                        task = under_way.pop(future)
                        yield task, future.result()
                        for following in itertools.islice(rest, 1):
                            under_way[pool.submit(work, given, following, progress)] = following
            finally:
                # Cancelled, or one has failed: the others stop at their next word of progress.
                stopped.set()
