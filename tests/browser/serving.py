"""A served page and its runtime, for tests that look at both sides."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.editing.editor import Editor, editor_of
from commission.app.launch import open_page
from commission.app.run.actions import Play, Seek, Source, VirtualDrive
from commission.app.run.service import RunService
from commission.app.run.view import RunView
from commission.app.runtime import Runtime
from commission.site.project import Project


class Served:
    """The page of a project; parameters as for `open_page`."""

    def __init__(
        self, project: Project, folder: Path | None = None, *, source: Source | None = None, is_new: bool = False
    ) -> None:
        self.server = start_server("127.0.0.1", 0)
        self.runtime: Runtime = open_page(self.server, project, folder=folder, source=source, is_new=is_new)

    @property
    def state(self) -> AppState:
        """What the owner thread has made of all that happened."""
        return self.runtime.state

    def editor(self, browser: int) -> Editor:
        """How a browser edits."""
        return editor_of(self.state, browser)

    @property
    def view(self) -> RunView | None:
        """The run as it is now."""
        return self.runtime.service(RunService).view()

    def seek(self, seconds: float) -> None:
        """Go to a moment of the drive [s], and wait until it is shown."""
        self.runtime.post(Seek(seconds))
        self.until(lambda: self.view is not None and abs(self.view.time - seconds) < 1e-6)

    def until(self, reached: Callable[[], bool], seconds: float = 120.0) -> None:
        """Wait until something has happened on the server; compilation may be included."""
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, f"it did not happen within {seconds} s: {self.state.faults}"
            time.sleep(0.02)

    def close(self) -> None:
        """End the page."""
        self.runtime.stop()
        self.server.stop()


@contextmanager
def standing_drive(project: Project, folder: Path | None = None, *, at: float | None = None) -> Iterator[Served]:
    """The page of a project whose first route a virtual vehicle has driven; the drive stands still.

    Parameters
    ----------
    project, folder : as for `open_page`.
    at : moment of the drive that is shown [s]; none: wherever it was when it was stopped, near its beginning.
    """
    opened = Served(project, folder, source=VirtualDrive(project.routes[0].name))
    try:
        opened.until(lambda: opened.view is not None)
        opened.runtime.post(Play(playing=False))
        if at is not None:
            opened.seek(at)
        yield opened
    finally:
        opened.close()
