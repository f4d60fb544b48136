"""Opens the page for a project and keeps it open: the one function behind `serve` and `demo`."""

from __future__ import annotations

import logging
import os
import signal
import threading
import webbrowser
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType

import viser

from commission.app.ambiguity import feature as ambiguity
from commission.app.base import page_feature
from commission.app.base.access import CLEAR_TEXT, Access, address_here, announced
from commission.app.base.extent import extent_of
from commission.app.base.reach import EVERYWHERE, Reach
from commission.app.base.server import PageServer, start_server
from commission.app.base.state import MAGNIFICATIONS, NOTHING_SAVED, AppState
from commission.app.coverage import feature as coverage
from commission.app.editing import feature as editing
from commission.app.exchange import feature as exchange
from commission.app.failures import feature as failures
from commission.app.floor_map import feature as floor_map
from commission.app.layouts import feature as layouts
from commission.app.live import feature as live
from commission.app.live.state import LiveState
from commission.app.page import Page
from commission.app.placement import feature as placement
from commission.app.prediction import feature as prediction
from commission.app.problems import feature as problems
from commission.app.project import feature as project
from commission.app.run import feature as run
from commission.app.run.accumulated_layer import AccumulatedLayer
from commission.app.run.actions import RecordedDrive, Source, VirtualDrive
from commission.app.run.state import RunState
from commission.app.runtime import BrowserCame, BrowserLeft, Runtime
from commission.app.tune import feature as tune
from commission.io.findings import Findings
from commission.io.live.permission import Permission
from commission.io.project_file import OpenedProject, load_project, open_project
from commission.io.vda5050_states import StateFile
from commission.site.project import Project

log = logging.getLogger(__name__)

FEATURES = (
    page_feature.FEATURE,
    project.FEATURE,
    floor_map.FEATURE,
    editing.FEATURE,
    exchange.FEATURE,
    problems.FEATURE,
    coverage.FEATURE,
    prediction.FEATURE,
    failures.FEATURE,
    ambiguity.FEATURE,
    placement.FEATURE,
    layouts.FEATURE,
    run.FEATURE,
    live.FEATURE,
    tune.FEATURE,
)
"""What there is on the page: a new feature is a folder and a line here."""

END_AFTER_S = 8.0
"""Time after Ctrl-C in which all background work has to end [s]: each of its threads is waited for up to 2 s."""
SEEN_SHARE = 0.02
"""Size of a validation area, as a share of the site's, from which it is seen."""


def serve(
    project: Path,
    access: Access,
    *,
    open_browser: bool = True,
    recording: Path | None = None,
    demo: bool = False,
    sources: tuple[str, ...] = (),
    states: StateFile | None = None,
) -> None:
    """Serve the page until the program is interrupted.

    Parameters
    ----------
    project : folder of the project; one that holds none, or does not exist yet, begins a new one.
    access : where, and what a browser must bring.
    open_browser : whether to open the page in this computer's browser.
    recording : what to play; none: choose on the page.
    demo : whether the project is a bundled one, which is never written to; its first route is driven at once.
    sources : live ones that are listened to at once, each as `NAME[@SCANNER]:HOST:PORT`.
    states : where messages of the state of a live vehicle are written.

    Raises
    ------
    CommissionError
        the project cannot be read, or the page cannot be served as asked.
    """
    opened = bundled(project) if demo else open_project(project)
    loaded, folder = opened.project, None if demo else opened.folder
    permission = Permission.of(sources, access.networks, is_shared=access.lets_others_in)
    with ExitStack() as open_things:
        # Ctrl-C may come at any moment from here on, and what is running would keep the program alive.
        token = None if access.token is None else access.token.text
        server = start_server(access.host, access.port, token, access.public_url)
        open_things.callback(server.stop)
        source = first_source(loaded, recording, demo)
        reach = Reach.within((folder, *access.files)) if access.lets_others_in else EVERYWHERE
        runtime = open_page(
            server,
            loaded,
            folder=folder,
            source=source,
            is_new=opened.is_new,
            reach=reach,
            notes=opened.notes,
            live=LiveState(sources=sources, permission=permission, states=states),
        )
        open_things.callback(runtime.stop)
        wait_for_interruption = open_things.enter_context(interruption())
        log.info("page at %s", announced(access, server.get_port()))
        if access.lets_others_in and access.public_url is None:
            log.warning(CLEAR_TEXT)
        if open_browser:
            webbrowser.open(address_here(access, server.get_port()))
        wait_for_interruption()
        end_at_last()


def end_at_last() -> None:
    """End the program even where a thread of a library does not; every edit has been journaled when it was made."""
    last = threading.Timer(END_AFTER_S, os._exit, (0,))
    last.daemon = True
    last.start()


@contextmanager
def interruption() -> Generator[Callable[[], None]]:
    """Give a function that waits for the first Ctrl-C, also for one that has come before; the second one is as usual.

    Raised as an exception, Ctrl-C could come in the middle of a callback from compiled code, which drops it. Told by an
    event or a queue, it could come when the main thread has looked for signals the last time before it sleeps, and be
    heard of with the next one only. So the interpreter's own handler writes it into a pipe.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)

    def handle(_number: int, _frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def wait() -> None:
        while os.read(reader, 1) != bytes([signal.SIGINT]):
            pass

    # Who has it ignored (a job in the background of a shell) keeps it so.
    before = signal.getsignal(signal.SIGINT)
    is_ours = before is signal.default_int_handler and threading.current_thread() is threading.main_thread()
    pipe_before = -1
    if is_ours:
        pipe_before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
        signal.signal(signal.SIGINT, handle)
    try:
        yield wait
    finally:
        if is_ours:
            signal.signal(signal.SIGINT, before)
            signal.set_wakeup_fd(pipe_before)
        os.close(writer)
        os.close(reader)


def bundled(folder: Path) -> OpenedProject:
    """Read a project that comes with the program, and is never written to."""
    found = Findings()
    return OpenedProject(load_project(folder, found), folder, False, found.lines())


def first_source(project: Project, recording: Path | None, demo: bool) -> Source | None:
    """Return what drives when the page opens.

    Parameters
    ----------
    project : its first route is what the demonstration drives.
    recording : folder or file to play; none: not asked for.
    demo : whether a virtual AGV is to drive.
    """
    if recording is not None:
        return RecordedDrive(recording)
    return VirtualDrive(project.routes[0].name) if demo and project.routes else None


def open_page(
    server: PageServer,
    project: Project,
    *,
    folder: Path | None = None,
    source: Source | None = None,
    is_new: bool = False,
    reach: Reach = EVERYWHERE,
    notes: tuple[str, ...] = (),
    live: LiveState | None = None,
) -> Runtime:
    """Fill a server with the page of a project and start its owner thread; returns at once.

    Parameters
    ----------
    server : a started server without content.
    project : what to show.
    folder : where it is saved to; none: nowhere unless a folder is named. Edits that a killed program left in the
        journal there are made again.
    source : what drives at once; none: nothing yet.
    is_new : whether nothing of the project is on disk yet.
    reach : where browsers may read and write.
    notes : what was doubted while the project was read, one line each; listed among the problems.
    live : sources that are listened to at once; none: no such.
    """
    greeting = f"A new project in {folder}: it is empty until you load a map or place something" if is_new else ""
    state = AppState(
        project=project,
        saved=NOTHING_SAVED if is_new else project,
        folder=folder,
        reach=reach,
        hidden=frozenset({AccumulatedLayer.name}),
        magnify=seen_magnification(project),
        greeting=greeting,
        faults=notes,
    ).with_part(RunState(source=source, repeat=folder is None))
    state = state.with_part(live or LiveState())
    runtime = Runtime(state, FEATURES)
    page = Page(server, runtime.post, state, FEATURES)

    @server.on_client_connect
    def connected(client: viser.ClientHandle) -> None:
        runtime.post(BrowserCame(client.client_id))

    @server.on_client_disconnect
    def disconnected(client: viser.ClientHandle) -> None:
        runtime.post(BrowserLeft(client.client_id))

    server.alive = lambda: {"owner_s": runtime.silent_for()}
    runtime.start(page)
    return runtime


def seen_magnification(project: Project) -> float:
    """Return the factor at which validation areas can be seen when the whole site is in view."""
    wanted = SEEN_SHARE * min(extent_of(project).size)
    noise = project.parameters.observation
    sigma = max(each.detection_sigmas(noise.range_sigma, noise.bearing_sigma)[0] for each in project.scanners)
    factor = wanted / (2.45 * sigma)
    return max(m for m in MAGNIFICATIONS if m <= max(factor, MAGNIFICATIONS[0]))
