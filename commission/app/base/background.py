"""What works while the page stays quick: the runners of jobs, who asks them for what, and what is shown of it.

Called by the owner thread alone; what jobs report comes back through the owner's queue and `hear`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, TypeAlias

from commission.app.base import reduction
from commission.app.base.jobs import Job, JobReport, Jobs, JobState
from commission.app.base.view import Progress
from commission.app.exchange.work import Exchanger
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.app.floor_map.work import MapWork
from commission.app.plan.planner import Planner
from commission.app.problems.inspection import Inspection

PREDICT = "Predicting the rest"
"""Name of a job that is too quick, and started too often, to be shown."""

BackgroundEffect: TypeAlias = reduction.CancelJob | reduction.MapEffect | reduction.ExchangeEffect


class Background:
    """All background work of one page.

    Parameters
    ----------
    post : takes reports of jobs, and actions of the exchange, from any thread.
    """

    def __init__(self, post: Callable[[Any], None]) -> None:
        numbers = itertools.count(1)
        # Looking at the site takes milliseconds and does not wait for a simulation, nor does a file that was just sent;
        # a suggested layout takes so long that everything else must not wait for it.
        self.drives, patient, looking, reading = (Jobs(post, numbers=numbers) for _ in range(4))
        self.planner = Planner(self.drives, patient)
        self.inspection = Inspection(looking)
        self._map_work = MapWork(reading)
        self._exchanger = Exchanger(post)
        self._runners = (self.drives, patient, reading)
        self._shown: dict[int, Job] = {}

    def carry_out(self, effect: BackgroundEffect) -> None:
        """Start or stop something."""
        match effect:
            case reduction.CancelJob(number):
                for jobs in self._runners:
                    jobs.stop(number)
            case ReadMapFile() | DrawMap() | StopMapWork():
                self._map_work.do(effect)
            case reduction.ReadFile() | reduction.StopReading() | reduction.ExportProject():
                self._exchanger.carry_out(effect)

    def hear(self, report: JobReport) -> object:
        """Follow a job; return the result that is the owner's to act on, None for any other news."""
        job = report.job
        if self.inspection.hear(report):
            return None
        if job.state in (JobState.WAITING, JobState.RUNNING):
            self._shown[job.number] = job
            return None
        self._shown.pop(job.number, None)
        return None if self.planner.hear(report) else report.result

    def progress(self) -> tuple[Progress, ...]:
        """Return what is under way, as the page shows it."""
        return tuple(
            Progress(job.number, job.name, job.message, job.fraction)
            for job in self._shown.values()
            if job.state is JobState.RUNNING and job.name != PREDICT
        )

    def close(self) -> None:
        """Stop everything."""
        for each in (*self._runners, self.inspection, self._exchanger):
            each.close()
