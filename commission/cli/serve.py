"""The commands that open the page: `demo` and `serve`. The page itself is the room below."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from commission.errors import UsageError

DEFAULT_PORT = 8080
LAST_PORT = 65535


@dataclass(frozen=True, kw_only=True)
class _Page:
    """Where the page is served."""

    host: str = "127.0.0.1"
    """Address to listen on; any other than this computer's own needs --token."""
    port: int = DEFAULT_PORT
    """TCP port; 0 takes a free one and prints it."""
    token: Annotated[str | None, arg(metavar="TEXT")] = None
    """Secret that a browser must bring, at least when --host is not this computer's own. None: none is asked for."""
    open: bool = True
    """Whether to open the page in this computer's browser."""

    def serve(self, project: Path, recording: Path | None = None, *, demo: bool = False) -> None:
        """Serve the page until it is interrupted."""
        if not 0 <= self.port <= LAST_PORT:
            raise UsageError(f"--port is {self.port}; expected 0 to {LAST_PORT}")
        from commission.app.launch import serve

        # Ctrl-C is how the page is meant to be closed.
        with _told_on_stdout(), contextlib.suppress(KeyboardInterrupt):
            serve(
                project,
                host=self.host,
                port=self.port,
                token=self.token,
                open_browser=self.open,
                recording=recording,
                demo=demo,
            )


@contextlib.contextmanager
def _told_on_stdout() -> Generator[None]:
    """Let what the page logs for the user, its address above all, appear on stdout."""
    handler = logging.StreamHandler(sys.stdout)
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger = logging.getLogger("commission")
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)


@dataclass(frozen=True, kw_only=True)
class Demo(_Page):
    """Open the page with a bundled site in which a virtual AGV is driving."""

    site: Annotated[str, arg(metavar="NAME")] = "laboratory"
    """Bundled site: laboratory, shop_floor or warehouse."""

    def run(self) -> None:
        """Serve the bundled site."""
        from commission.io.bundled import bundled_folder

        sites = {folder.name: folder for folder in bundled_folder("maps").iterdir() if folder.is_dir()}
        if self.site not in sites:
            raise UsageError(f"no bundled site is called {self.site!r}; there are: {', '.join(sorted(sites))}")
        self.serve(sites[self.site], demo=True)


@dataclass(frozen=True, kw_only=True)
class Serve(_Page):
    """Open the page for a project."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml); one that is empty or does not exist yet begins a new project."""
    recording: Annotated[Path | None, arg(metavar="PATH")] = None
    """Recording to play: a CSV folder. None: choose it on the page, or drive a virtual AGV."""

    def run(self) -> None:
        """Serve the project; a recording that is none is an error now, not only on the page."""
        if self.recording is not None:
            from commission.io.recordings.base import open_recording

            open_recording(self.recording)
        self.serve(self.project, self.recording)
