"""Checks the site after every edit: keeps what a check can use again. One background thread calls it."""

from __future__ import annotations

from commission.planning.route_check import FloorDistances
from commission.progress import Progress
from commission.site.project import Project
from commission.studies.problems import Findings, find_problems


class Checker:
    """The newest findings, and the floor map they were made on."""

    def __init__(self) -> None:
        self._findings: Findings | None = None
        self._floor: FloorDistances | None = None

    def check(self, project: Project, progress: Progress) -> Findings:
        """Return what is wrong with a project.

        Parameters
        ----------
        project : what to check.
        progress : called between the steps; may raise to cancel.
        """
        floor_map = project.floor_map
        if floor_map is None:
            self._floor = None
        elif self._floor is None or self._floor.floor_map is not floor_map:
            self._floor = FloorDistances(floor_map)
        progress(0.5, "checking")
        self._findings = find_problems(project, self._floor, self._findings)
        return self._findings
