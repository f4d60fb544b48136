"""A page without a browser whose edits are drawn and journaled, for benchmarks that time them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import reduce
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.launch import FEATURES
from commission.app.page import Page
from commission.app.project.project_folder import ProjectFolder
from commission.io.project_file import save_project
from commission.site.project import Project
from tests.app.owning import Owner

ME = 1
"""Number of the browser that edits."""


class EditedPage:
    """The page of a project that is kept in a folder.

    Parameters
    ----------
    project, folder : what is edited, and where it is saved first.
    clock : returns seconds: what time counts.
    """

    def __init__(self, project: Project, folder: Path, clock: Callable[[], float]) -> None:
        save_project(project, folder)
        self._clock = clock
        self._server = start_server("127.0.0.1", 0)
        self.state = AppState(project=project, saved=project, folder=folder).joined(ME)
        self._files = Owner(ProjectFolder, self.state).service
        self._page = Page(self._server, lambda _action: None, self.state, FEATURES)
        self._page.show_site(self.state)

    def do(self, *asked: Action) -> float:
        """Do what a person asks for; returns how long that took, journal and picture included [s]."""
        begun = self._clock()
        for each in asked:
            before = self.state.project
            self.state = reduce(each, self.state, Sender(ME)).state
            if self.state.project is not before:
                self._files.note(self.state.project, "edit")
                self._page.show_site(self.state)
        return self._clock() - begun

    def close(self) -> None:
        """Bring the journal to the disk and end the page."""
        self._files.close()
        self._server.stop()
