"""The owner thread: drains actions, reduces them, runs what is due, publishes a frozen view. Knows no widget.

Only this thread touches state, session and page. Callbacks, jobs and browsers reach it through one queue.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Protocol, TypeAlias

from commission.app.base import actions, reducer, reduction
from commission.app.base.actions import Action, Source, View
from commission.app.base.background import PREDICT, Background
from commission.app.base.jobs import JobReport, JobState
from commission.app.base.state import AppState
from commission.app.base.view import PageView, RunView
from commission.app.editing import actions as editing
from commission.app.floor_map.actions import MapResult
from commission.app.plan.view import PlanView
from commission.app.project.project_folder import name_of_edit
from commission.app.run.session import Drive, Session
from commission.errors import CommissionError
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress
from commission.site.project import Project

FRAME_S = 0.04
"""Shortest time between two pictures: 25 Hz [s]."""
SLOW_FRAME_S = 0.2
"""The same for plots, trails and numbers [s]."""
IDLE_S = 0.5
LOOK_AT_DISK_S = 2.0
"""Time between two looks at the project's folder [s]."""

PREPARE, COMPILE = "Preparing the drive", "Compiling"


@dataclass(frozen=True, slots=True)
class BrowserCame:
    """A browser connected."""

    client: int
    """Number of its connection."""


@dataclass(frozen=True, slots=True)
class BrowserLeft:
    """A browser is gone."""

    client: int
    """Number of its connection."""


Message: TypeAlias = Action | JobReport | BrowserCame | BrowserLeft


class PageLike(Protocol):
    """What the runtime draws on: the page, or a list in a test."""

    def show_site(self, state: AppState) -> None:
        """Draw the project."""

    def draw(self, view: PageView, *, slowly: bool) -> None:
        """Draw a view."""

    def tell(self, text: str, *, failed: bool) -> None:
        """Notify every browser."""

    def show_view(self, client_id: int, view: View) -> None:
        """Change what one browser looks at."""

    def look_at(self, client_id: int, place: tuple[float, float]) -> None:
        """Bring a place into one browser's view."""

    def send_file(self, client_id: int, name: str, content: bytes) -> None:
        """Let one browser save a file."""

    def connected(self, client_id: int) -> None:
        """Set up a browser."""

    def disconnected(self, client_id: int) -> None:
        """Forget a browser."""


@dataclass(frozen=True, slots=True)
class Work:
    """What the runtime has done by others, in the background or on disk; tests put their own in."""

    prepare: Callable[[Project, Source, Progress], Drive]
    """From a source to a drive."""
    predict: Callable[[Drive, LocalizerSetup], tuple[tuple[float, float], ...]]
    """Fail episodes [s] of a whole run with these parameters."""
    save: Callable[[Project, Path, bool], None]
    """Write a project into a folder; the last says whether what others changed there is replaced."""
    compile: Callable[[Progress], None]
    """Compile all kernels."""
    note: Callable[[Project, str], None] = lambda _project, _what: None
    """Journal an edit by its name."""
    foreign_changes: Callable[[], tuple[str, ...] | None] = lambda: None
    """Files of the project that somebody else has changed; none when nothing has happened since the last call."""
    close: Callable[[], None] = lambda: None
    """Bring the journal to the disk."""
    load: Callable[[Path], Project] | None = None
    """Read a project from a folder; none: it cannot be read again."""


class Runtime:
    """State, session and the loop around them.

    Parameters
    ----------
    state : what the page begins with.
    work : background work and files.
    clock : returns seconds; another one only in tests.
    """

    def __init__(self, state: AppState, work: Work, clock: Callable[[], float] = time.monotonic) -> None:
        self.state = state
        self.session: Session | None = None
        self._work = work
        self._clock = clock
        self._queue: SimpleQueue[Message] = SimpleQueue()
        self._background = Background(self._queue.put)
        self._page: PageLike | None = None
        self._shown: Project | None = None
        self._dirty = True
        self._slow_dirty = True
        self._drawn_at = self._drawn_slowly_at = self._ticked_at = self._looked_at = clock()
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._loop, name="owner", daemon=True)

    def post(self, message: Message) -> None:
        """Hand something to the owner thread; returns at once, from any thread."""
        self._queue.put(message)

    def start(self, page: PageLike) -> None:
        """Begin to own the page."""
        self._page = page
        self._background.drives.start(COMPILE, self._work.compile)
        if self.state.source is not None:
            self.post(actions.ChooseSource(self.state.source))
        self._thread.start()

    def stop(self) -> None:
        """End the loop and the background work."""
        self._stopped.set()
        self._background.close()
        self._thread.join(timeout=2.0)
        self._work.close()

    def _loop(self) -> None:
        self._guarded(self._show_site)
        while not self._stopped.is_set():
            for message in self._drained():
                self._guarded(lambda message=message: self.handle(message))
            self._guarded(self.tick)

    def _guarded(self, what: Callable[[], None]) -> None:
        """Do something; whatever goes wrong is shown, and the page lives on."""
        try:
            what()
        except Exception as error:
            text = str(error) if isinstance(error, CommissionError | ValueError) else f"{type(error).__name__}: {error}"
            self._apply(actions.Report(text))

    def _drained(self) -> list[Message]:
        """Wait until something is due and return what has arrived; of seeks and drags in a row only the newest."""
        messages: list[Message] = []
        try:
            messages.append(self._queue.get(timeout=self._time_left()))
            while True:
                messages.append(self._queue.get_nowait())
        except Empty:
            pass
        return [
            message
            for message, following in itertools.zip_longest(messages, messages[1:])
            if not _is_outdated(message, following)
        ]

    def _time_left(self) -> float:
        """Time until the next picture or slice of work is due [s]."""
        if self.session is not None and self.session.seeking is not None:
            return 0.001
        due = self._drawn_at + FRAME_S if self._dirty or self._is_running() else self._drawn_at + IDLE_S
        if self._slow_dirty:
            due = min(due, self._drawn_slowly_at + SLOW_FRAME_S)
        return min(max(due - self._clock(), 0.001), IDLE_S)

    def _is_running(self) -> bool:
        return self.state.playing and self.session is not None

    def handle(self, message: Message) -> None:
        """Do what one message says."""
        page = self._page
        if isinstance(message, JobReport):
            self._hear(message)
        elif isinstance(message, BrowserCame):
            self._apply(editing.Join(message.client))
            if page is not None:
                page.connected(message.client)
        elif isinstance(message, BrowserLeft):
            self._apply(editing.Leave(message.client))
            if page is not None:
                page.disconnected(message.client)
        else:
            self._apply(message)
        self._dirty = self._slow_dirty = True

    def _apply(self, action: Action) -> None:
        """Reduce an action and carry out what follows."""
        before = self.state
        outcome = reducer.reduce(action, before)
        self.state = outcome.state
        if self.session is not None:
            self.session.covered = self.state.covered
        self._dirty = self._slow_dirty = True
        for effect in outcome.effects:
            self._carry_out(effect)
        if outcome.state.project is not before.project:
            self._work.note(outcome.state.project, name_of_edit(action, before, outcome.state))

    def _carry_out(self, effect: reduction.Effect) -> None:
        """Do one thing that the reducer asks for."""
        match effect:
            case reduction.LoadSource(source):
                project = self.state.project
                self._background.drives.start(PREPARE, lambda progress: self._work.prepare(project, source, progress))
            case reduction.ReadProject(folder):
                if self._work.load is not None:
                    self.post(actions.Reloaded(self._work.load(folder)))
            case reduction.WriteProject(project, folder, overwrite):
                self._work.save(project, folder, overwrite)
                self.post(actions.ProjectSaved(project, folder, time.strftime("%H:%M")))
            case reduction.ApplyParameters() | reduction.MoveTo() | reduction.ProcessOneScan():
                if self.session is not None:
                    self._act_on_run(self.session, effect)
            case reduction.Tell() | reduction.PlaceCamera() | reduction.FlyTo() | reduction.SendFile():
                self._show_effect(effect)
            case _:
                self._background.carry_out(effect)

    def _show_effect(self, effect: reduction.PageEffect) -> None:
        """Do what only the page can do; a camera is fitted to the site as it is now, not as it was drawn last."""
        page = self._page
        if page is None:
            return
        if isinstance(effect, reduction.PlaceCamera | reduction.FlyTo) and self.state.project is not self._shown:
            self._show_site()
        match effect:
            case reduction.Tell(text, failed):
                page.tell(text, failed=failed)
            case reduction.PlaceCamera(client, view):
                page.show_view(client, view)
            case reduction.FlyTo(client, place):
                page.look_at(client, place)
            case reduction.SendFile(client, name, content):
                page.send_file(client, name, content)

    def _act_on_run(
        self, session: Session, effect: reduction.ApplyParameters | reduction.MoveTo | reduction.ProcessOneScan
    ) -> None:
        """Do what concerns the drive that is there."""
        match effect:
            case reduction.ApplyParameters():
                session.set_setup(LocalizerSetup.of(self.state.project))
                self._predict()
            case reduction.MoveTo(seconds, afresh):
                session.seek(seconds, afresh=afresh)
            case reduction.ProcessOneScan():
                session.step()

    def _hear(self, report: JobReport) -> None:
        """Follow a job; take its result or its error."""
        if report.job.state is JobState.FAILED:
            self._apply(actions.Report(f"{report.job.name}: {report.job.error}"))
        match self._background.hear(report):
            case Drive() as drive:
                self._begin(drive)
            case result if isinstance(result, MapResult):
                self._apply(result)
            case tuple() as episodes if self.session is not None:
                self.session.predicted = episodes
            case _:
                pass

    def _begin(self, drive: Drive) -> None:
        """Run the localizer over a new drive, playing."""
        self.session = Session(drive, LocalizerSetup.of(self.state.project))
        self.session.covered = self.state.covered
        self._apply(actions.Play(playing=True))
        self._predict()

    def _predict(self) -> None:
        """Look ahead in the background: where the supervisor will stop the vehicle with these parameters."""
        if self.session is None:
            return
        drive, setup = self.session.drive, self.session.setup

        def work(progress: Progress) -> object:
            progress(0.0, "")
            return self._work.predict(drive, setup)

        self._background.drives.start(PREDICT, work)

    def tick(self) -> None:
        """Let the run go on for the time that has passed, and draw when a picture is due."""
        now = self._clock()
        elapsed, self._ticked_at = now - self._ticked_at, now
        session = self.session
        if session is not None and (self.state.playing or session.seeking is not None):
            self._advance(session, elapsed)
        if now - self._looked_at >= LOOK_AT_DISK_S:
            self._looked_at = now
            files = self._work.foreign_changes()
            if files is not None:
                self._apply(actions.ChangedOnDisk(files))
        if self._background.planner.follow(self.state):
            self._dirty = self._slow_dirty = True
        if self._page is None:
            return
        self._background.inspection.follow(self.state)
        if self.state.project is not self._shown:
            self._show_site()
        slowly = self._slow_dirty and now - self._drawn_slowly_at >= SLOW_FRAME_S
        if slowly or (self._dirty and now - self._drawn_at >= FRAME_S):
            self._drawn_at = now
            self._dirty = False
            if slowly:
                self._drawn_slowly_at, self._slow_dirty = now, False
            self._page.draw(self.view(whole=slowly), slowly=slowly)

    def _advance(self, session: Session, elapsed: float) -> None:
        """Process what is due, and see to the end of the drive."""
        # A long pause of this thread (a huge drawing) is not made up for: the clock stood still.
        if session.advance(min(elapsed, 0.25) * self.state.speed):
            self._dirty = True
        self._slow_dirty = True
        if session.at_end and session.seeking is None and self.state.playing:
            if self.state.repeat:
                session.seek(0.0, afresh=True)
            else:
                self._apply(actions.Play(playing=False))

    @property
    def plan(self) -> PlanView:
        """What the step Plan has found so far."""
        return self._background.planner.view

    def view(self, *, whole: bool = True) -> PageView:
        """Return everything the page shows; `whole` with what is drawn slowly, too."""
        run: RunView | None = None if self.session is None else self.session.view(whole=whole)
        seen = self._background.inspection
        jobs = self._background.progress()
        return PageView(self.state, run, jobs, self.plan, seen.problems, seen.violations, seen.profiles)

    def _show_site(self) -> None:
        if self._page is not None:
            self._shown = self.state.project
            self._page.show_site(self.state)


def _is_outdated(message: Message, following: Message | None) -> bool:
    """Whether the message behind makes this one pointless: the newest place of the time line or of a drag counts."""
    match message, following:
        case actions.Seek(), actions.Seek():
            return True
        case (editing.DragFloor(phase="update"), editing.DragFloor(phase="update")) | (
            editing.DragSelection(phase="update"),
            editing.DragSelection(phase="update"),
        ):
            return message.client == following.client
        case _:
            return False
