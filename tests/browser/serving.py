"""A served page and its runtime, for tests that look at both sides."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.editing.editor import Editor, editor_of
from commission.app.launch import open_page
from commission.app.run.actions import Source
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
