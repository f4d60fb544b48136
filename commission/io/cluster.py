"""Workers of a Dask cluster: the tasks of a study on other machines, by the address of their scheduler.

A worker that dies loses nothing: the scheduler gives its tasks to another one. The extra `commission[cluster]` is
needed here and on every worker, which runs the same version of this package, one thread each.
"""

from __future__ import annotations

import functools
import itertools
import logging
import warnings
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import commission
from commission.errors import UsageError
from commission.progress import silent
from commission.studies.workers import Given, Result, Task, Work

PATIENCE = 5.0
"""How long a scheduler may take to answer [s]."""
AHEAD = 2
"""Tasks for each worker that are handed out at once: none waits for the next, and what is cancelled is not much."""
EXTRA = 'expected the extra: pip install "commission[cluster]"'


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Workers of a scheduler that answers."""

    client: Any
    """Its client; `distributed` ships no types."""
    count: int
    """How many workers there were when it was asked."""

    @property
    def shares_memory(self) -> bool:
        """They do not."""
        return False

    def each(
        self, work: Work[Given, Task, Result], given: Given, tasks: Iterable[Task]
    ) -> Iterator[tuple[Task, Result]]:
        """Do all tasks; what is given goes to every worker once.

        Parameters
        ----------
        work, given, tasks : as in `Workers`.
        """
        from distributed import as_completed

        rest = iter(tasks)
        shared = self.client.scatter(given, broadcast=True, hash=False)
        submit = functools.partial(self._submitted, work, shared)
        under_way = {submit(task): task for task in itertools.islice(rest, AHEAD * self.count)}
        arriving = as_completed(list(under_way), loop=self.client.loop)
        try:
            for future in arriving:
                task = under_way.pop(future)
                yield task, future.result()
                for following in itertools.islice(rest, 1):
                    under_way[added := submit(following)] = following
                    arriving.add(added)
        finally:
            # Cancelled, or one has failed: nobody waits for the others.
            self.client.cancel(list(under_way), force=True)

    def _submitted(self, work: Work[Any, Any, Any], shared: Any, task: Any) -> Any:
        """Future of a task, which lies with the scheduler: even a whole drive, so that none is lost with a worker."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph", UserWarning)
            return self.client.submit(_done, work, shared, task, pure=False)


def _done(work: Work[Any, Any, Any], given: Any, task: Any) -> Any:
    """One task, on a worker."""
    return work(given, task, silent)


def _version() -> str:
    """Version of this package on a worker."""
    return commission.__version__


@contextmanager
def cluster(address: str) -> Generator[Cluster]:
    """Connect to a scheduler, and leave it when done.

    Parameters
    ----------
    address : of the scheduler, for example tcp://192.0.2.7:8786.

    Raises
    ------
    UsageError
        the extra is not installed, nobody answers there, there is no worker, or one has another version.
    """
    try:
        from distributed import Client
    except ImportError:
        raise UsageError(f"--scheduler needs the package distributed, which is not installed; {EXTRA}") from None
    # What it has to say on its own goes into the one line of the error.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        found = str(error) or type(error).__name__
        raise UsageError(f"--scheduler {address} does not answer: {found}; expected tcp://HOST:PORT of one") from None
    try:
        yield Cluster(client, _checked(client, address))
    finally:
        client.close()


def _checked(client: Any, address: str) -> int:
    """Number of workers; raises UsageError where there is none, or one that cannot give the same result."""
    count = len(client.scheduler_info(n_workers=-1)["workers"])
    if not count:
        raise UsageError(f"--scheduler {address} has no worker; expected one at least: dask worker {address}")
    try:
        found = client.run(_version)
    except (ImportError, AttributeError) as error:
        raise UsageError(f"a worker of --scheduler {address} cannot import this package: {error}; {EXTRA}") from None
    own = commission.__version__
    for worker, version in found.items():
        if version != own:
            raise UsageError(f"worker {worker} has version {version} of this package; expected {own}, as here")
    return count
