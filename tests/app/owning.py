"""A test plays the owner thread for one service: it hears out its jobs, and collects what it posts."""

from __future__ import annotations

import time
from collections.abc import Callable
from queue import SimpleQueue
from typing import Generic, TypeVar

from commission.app.base.actions import Action, Envelope
from commission.app.base.jobs import JobReport, Jobs
from commission.app.base.service import Context, Service
from commission.app.base.state import AppState

Owned = TypeVar("Owned", bound=Service)
LONGEST_S = 60.0
"""Time that jobs may take, compilation included [s]."""


class Owner(Generic[Owned]):
    """One service with its queue.

    Parameters
    ----------
    make : makes the service.
    state : the state it begins with.
    """

    def __init__(self, make: Callable[[Context], Owned], state: AppState) -> None:
        self.queue: SimpleQueue[Action | Envelope | JobReport] = SimpleQueue()
        self.jobs = Jobs(self.queue.put)
        self.posted: list[Action | Envelope] = []
        """What the service has posted, and what followed from its jobs."""
        self.service = make(Context(state, self.queue.put, time.monotonic, self.jobs))

    def hear(self) -> None:
        """Take the next message."""
        message = self.queue.get(timeout=LONGEST_S)
        following = self.jobs.hear(message) if isinstance(message, JobReport) else message
        if isinstance(following, Action | Envelope):
            self.posted.append(following)

    def settle(self, state: AppState) -> None:
        """Follow a state, and hear every job out."""
        end = time.monotonic() + LONGEST_S
        self.service.follow(state)
        while self.jobs.unfinished() or not self.queue.empty():
            assert time.monotonic() < end
            self.hear()
            self.service.follow(state)

    def close(self) -> None:
        """Stop everything."""
        self.jobs.close()
        self.service.close()
