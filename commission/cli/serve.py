"""The commands that open the page: `demo` and `serve`. The page itself is the room below."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

from commission.errors import UsageError

if TYPE_CHECKING:
    from commission.io.vda5050_states import StateFile

DEFAULT_PORT = 8080
LAST_PORT = 65535


@dataclass(frozen=True, kw_only=True)
class _Page:
    """Where the page is served."""

    host: str = "127.0.0.1"
    """Address to listen on; any other than this computer's own needs a token."""
    port: int = DEFAULT_PORT
    """TCP port; 0 takes a free one and prints it."""
    token: Annotated[str | None, arg(metavar="TEXT")] = None
    """Secret of at least 16 letters that a browser must bring; `auto` makes one and prints it. None: that of the
    variable COMMISSION_TOKEN, or none at all, which only this computer's own address allows."""
    token_file: Annotated[Path | None, arg(metavar="FILE")] = None
    """File whose first line is that secret."""
    public_url: Annotated[str | None, arg(metavar="URL")] = None
    """Address of a proxy with TLS in front of the page, such as https://agv.example.com; needs a token."""
    files: Annotated[UseAppendAction[tuple[Path, ...]], arg(metavar="DIR")] = ()
    """Folder that browsers of other computers may read from and save to, beside the project's own; repeatable."""
    connect_to: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="ADDRESS[/BITS]")] = ()
    """Network in which a browser may name live sources, beside this computer and the private networks; repeatable. What
    --source names needs none."""
    open: bool = True
    """Whether to open the page in this computer's browser."""

    def serve(
        self,
        project: Path,
        recording: Path | None = None,
        *,
        demo: bool = False,
        sources: tuple[str, ...] = (),
        states: StateFile | None = None,
    ) -> None:
        """Serve the page until it is interrupted."""
        if not 0 <= self.port <= LAST_PORT:
            raise UsageError(f"--port is {self.port}; expected 0 to {LAST_PORT}")
        from commission.app.base.access import Access, chosen_token
        from commission.app.base.logs import told_on
        from commission.app.launch import serve

        # Ctrl-C is how the page is meant to be closed.
        with told_on(sys.stdout), contextlib.suppress(KeyboardInterrupt):
            access = Access(
                host=self.host,
                port=self.port,
                token=chosen_token(self.token, self.token_file),
                public_url=self.public_url,
                files=tuple(self.files),
                networks=tuple(self.connect_to),
            )
            serve(
                project, access, open_browser=self.open, recording=recording, demo=demo, sources=sources, states=states
            )


@dataclass(frozen=True, kw_only=True)
class Demo(_Page):
    """Open the page with a bundled site in which a virtual AGV is driving."""

    site: Annotated[str, arg(metavar="NAME")] = "laboratory"
    """Bundled site: laboratory, shop_floor, warehouse, loading_bay (a vehicle with two scanners) or assembly (four
    omnidirectional wheels, and a camera that sees tags)."""

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
    source: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME[@SCANNER]:HOST:PORT")] = ()
    """Live source to listen to at once, such as json:127.0.0.1:6061; repeat it for several. NAME is one of json,
    sick-safety, cola, nav350, compact, rosbridge. Datagrams come to HOST, an address of this computer; devices are
    connected to."""

    vda5050: Annotated[Path | None, arg(metavar="FILE")] = None
    """New file for state messages of VDA 5050 of the live vehicle, written while it drives, one JSON object a line."""
    vda5050_version: Literal["2.1.0", "3.0.0"] = "2.1.0"
    """Version of these messages."""
    vda5050_map_id: Annotated[str | None, arg(metavar="ID")] = None
    """Identification of the map in these messages, as the orders have it. None: the project's name."""

    def run(self) -> None:
        """Serve the project; a recording that is none is an error now, not only on the page."""
        if self.recording is not None:
            from commission.io.recordings.base import open_recording

            open_recording(self.recording)
        if self.source:
            from commission.io.live.registry import SourceAddress

            for text in self.source:
                SourceAddress.parse(text)
        states = None
        if self.vda5050 is not None:
            from commission.io.vda5050_states import StateFile, StateVersion

            if self.vda5050.exists():
                raise UsageError(f"{self.vda5050} exists; expected a new file for the state messages")
            version = StateVersion(self.vda5050_version)
            states = StateFile(path=self.vda5050, map_id=self.vda5050_map_id, version=version)
        self.serve(self.project, self.recording, sources=tuple(self.source), states=states)
