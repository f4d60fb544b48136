"""Checks the site after every edit: keeps what a check can use again. One background thread calls it."""

from __future__ import annotations

from commission.progress import Progress
from commission.site.project import Project
from commission.studies.problems import ProblemsInput, ProblemsResult, problems


class Checker:
    """The newest findings."""

    def __init__(self) -> None:
        self._found: ProblemsResult | None = None

    def check(self, project: Project, progress: Progress) -> ProblemsResult:
        """Return what is wrong with a project.

        Parameters
        ----------
        project : what to check.
        progress : called between the steps; may raise to cancel.
        """
        self._found = problems(ProblemsInput.of(project), progress, self._found)
        return self._found
