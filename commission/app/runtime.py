"""The owner thread: drains actions, reduces them, lets services do what is due, publishes a frozen view.

Only this thread touches state, services and page. Callbacks, jobs and browsers reach it through one queue. It knows no
widget and no feature: those it is given.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Protocol, TypeAlias, TypeVar

from commission.app.base import page_reducer
from commission.app.base.actions import PROGRAM, Action, Envelope, Join, Leave, Report, Sender
from commission.app.base.effects import CancelJob, Effect, FlyTo, PlaceCamera
from commission.app.base.feature import Feature
from commission.app.base.jobs import Job, JobReport, Jobs
from commission.app.base.service import IDLE_S, Context, Due, Service
from commission.app.base.state import AppState
from commission.app.base.view import PageView, view_of
from commission.errors import CommissionError, fault_line
from commission.site.project import Project

log = logging.getLogger(__name__)

FRAME_S = 0.04
"""Shortest time between two pictures: 25 Hz [s]."""
SLOW_FRAME_S = 0.2
"""The same for plots, trails and numbers [s]."""
ANSWER_S = 0.06
"""The same once a browser has asked for something: what is selected or sought is said within 100 ms [s]."""
DRAWING = 3.0
"""Such a picture waits that many times as long as the last one took: who asks without a pause (a drag, a script) leaves
the owner thread most of its time for what is asked, and for the journal."""
AFTER_A_FAULT_S = 0.2
"""Pause of the owner thread after a fault that it could not even tell [s]."""
SAME_FAULT_AFTER_S = 5.0
"""Time after which everybody is told the same fault again [s]."""

REDUCERS = (page_reducer,)
"""Modules with the handlers of the actions that no feature owns."""

Found = TypeVar("Found", bound=Service)


@dataclass(frozen=True, slots=True)
class BrowserCame:
    """A browser connected."""

    number: int
    """Number of its connection."""


@dataclass(frozen=True, slots=True)
class BrowserLeft:
    """A browser is gone."""

    number: int
    """Number of its connection."""


Message: TypeAlias = Action | Envelope | JobReport | BrowserCame | BrowserLeft


class PageLike(Protocol):
    """What the runtime draws on: the page, or a list in a test."""

    def show_site(self, state: AppState) -> None:
        """Draw the project."""

    def draw(self, view: PageView, *, slowly: bool) -> None:
        """Draw a view."""

    def carry_out(self, effect: Effect, sender: Sender) -> None:
        """Do one thing that only the page can do, in the sender's browser or in all of them."""

    def connected(self, browser: int) -> None:
        """Set up a browser."""

    def disconnected(self, browser: int) -> None:
        """Forget a browser."""


class Runtime:
    """State, services and the loop around them.

    Parameters
    ----------
    state : what the page begins with.
    features : what there is on the page.
    clock : returns seconds; another one only in tests.
    """

    def __init__(
        self, state: AppState, features: Sequence[Feature], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.state = state
        self._clock = clock
        self._queue: SimpleQueue[Message] = SimpleQueue()
        self._jobs = Jobs(self._queue.put, failed=_told)
        context = Context(state, self.post, clock, self._jobs)
        self._services = tuple(make(context) for feature in features for make in feature.services)
        self._owners = {kind: service for service in self._services for kind in service.effects}
        self._page: PageLike | None = None
        self._shown: Project | None = None
        self._due = Due.SOON
        self._is_asked, self._drawing_s = False, 0.0
        self._drawn_at = self._drawn_slowly_at = self._turned_at = clock()
        self._told = "", -math.inf
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._loop, name="owner", daemon=True)

    def service(self, kind: type[Found]) -> Found:
        """Return the service of a type; raises LookupError when no feature has one."""
        for service in self._services:
            if isinstance(service, kind):
                return service
        raise LookupError(f"no feature has a {kind.__name__}")

    def post(self, message: Message) -> None:
        """Hand something to the owner thread; returns at once, from any thread."""
        self._queue.put(message)

    def start(self, page: PageLike) -> None:
        """Begin to own the page."""
        self._page = page
        for service in self._services:
            service.start()
        self._thread.start()

    def stop(self) -> None:
        """End the loop and the background work."""
        self._stopped.set()
        self._jobs.close()
        self._thread.join(timeout=2.0)
        for service in self._services:
            service.close()

    def _loop(self) -> None:
        self._guarded(self._show_site)
        while not self._stopped.is_set():
            try:
                self._turn()
            except Exception:  # nothing ends this thread but `stop`
                log.exception("a fault of the owner thread")
                self._stopped.wait(AFTER_A_FAULT_S)

    def _turn(self) -> None:
        """Do what has arrived and what is due."""
        messages = self._drained()
        self._turned_at = self._clock()
        for message in messages:
            self._guarded(lambda message=message: self.handle(message), _sender_of(message))
        self._guarded(self.tick)

    def silent_for(self) -> float:
        """Return the time since the owner thread has last begun a turn [s]; any thread may ask."""
        return self._clock() - self._turned_at

    def _guarded(self, what: Callable[[], None], sender: Sender = PROGRAM) -> None:
        """Do something; whatever goes wrong is told to who asked for it, and the page lives on."""
        try:
            what()
        except Exception as error:
            report = _reported(error, sender)
            if self._has_just_been_told(report, sender):
                return
            try:
                self._apply(report, sender)
            except Exception:
                log.exception("a fault while telling '%s'", report.text)

    def _has_just_been_told(self, report: Report, sender: Sender) -> bool:
        """Whether the program would tell everybody the same again: what fails while drawing fails 25 times a second."""
        if sender.browser is not None:
            return False
        before, at = self._told
        now = self._clock()
        if report.text == before and now - at < SAME_FAULT_AFTER_S:
            return True
        self._told = report.text, now
        return False

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
            if not _is_superseded(message, following)
        ]

    def _time_left(self) -> float:
        """Time until the next picture or slice of work is due [s]."""
        rest = min((service.rest(self.state) for service in self._services), default=IDLE_S)
        due = self._clock() + rest
        if self._due is Due.SOON:
            due = min(due, self._drawn_at + FRAME_S)
        elif self._due is Due.SLOWLY:
            due = min(due, self._drawn_slowly_at + self._slow_frame_s)
        return min(max(due - self._clock(), 0.001), IDLE_S)

    @property
    def _slow_frame_s(self) -> float:
        """Shortest time between two whole pictures as things are [s]."""
        return min(max(ANSWER_S, DRAWING * self._drawing_s), SLOW_FRAME_S) if self._is_asked else SLOW_FRAME_S

    def handle(self, message: Message) -> None:
        """Do what one message says."""
        page = self._page
        match message:
            case JobReport():
                following = self._jobs.hear(message)
                if isinstance(following, Action | Envelope):
                    # What one browser's file or wish leads to is refused to that browser, not to everybody.
                    self._guarded(lambda: self.handle(following), _sender_of(following))
            case BrowserCame(number):
                self._apply(Join(), Sender(number, self._clock()))
                if page is not None:
                    page.connected(number)
            case BrowserLeft(number):
                self._apply(Leave(), Sender(number, self._clock()))
                if page is not None:
                    page.disconnected(number)
            case Envelope(action, sender):
                self._is_asked |= sender.browser is not None
                self._apply(action, sender)
            case _:
                self._apply(message)
        self._due = Due.SOON

    def _apply(self, action: Action, sender: Sender = PROGRAM) -> None:
        """Reduce an action and carry out what follows."""
        before = self.state
        outcome = page_reducer.reduce(action, before, sender)
        self.state = outcome.state
        self._due = Due.SOON
        if outcome.state.project is not before.project:
            for service in self._services:
                # An edit that cannot be journaled stands, and so does what follows from it.
                self._guarded(lambda service=service: service.project_changed(action, before, outcome.state))
        for effect in outcome.effects:
            self._carry_out(effect, sender)

    def _carry_out(self, effect: Effect, sender: Sender) -> None:
        """Let somebody do one thing: the service that owns it, or the page."""
        owner = self._owners.get(type(effect))
        if owner is not None:
            owner.carry_out(effect, self.state, sender)
        elif isinstance(effect, CancelJob):
            self._jobs.stop(effect.number)
        elif self._page is not None:
            # A camera is fitted to the site as it is now, not as it was drawn last.
            if isinstance(effect, PlaceCamera | FlyTo) and self.state.project is not self._shown:
                self._show_site()
            self._page.carry_out(effect, sender)

    def tick(self) -> None:
        """Let services do what is due, and draw when a picture is."""
        for service in self._services:
            self._due = max(self._due, service.follow(self.state))
        if self._page is None:
            return
        if self.state.project is not self._shown:
            self._show_site()
        now = self._clock()
        slowly = self._due > Due.NEVER and now - self._drawn_slowly_at >= self._slow_frame_s
        if slowly or (self._due is Due.SOON and now - self._drawn_at >= FRAME_S):
            self._drawn_at = now
            # What is drawn slowly is still to come after a quick picture.
            self._due = Due.NEVER if slowly else Due.SLOWLY
            if slowly:
                self._drawn_slowly_at, self._is_asked = now, False
            self._page.draw(self.view(whole=slowly), slowly=slowly)
            if slowly:
                self._drawing_s = self._clock() - now

    def view(self, *, whole: bool = True) -> PageView:
        """Return everything the page shows; `whole` with what is drawn slowly, too."""
        parts = (part for service in self._services for part in service.parts(slowly=whole))
        return view_of(self.state, *parts, jobs=self._jobs.running(), waiting=self._jobs.waiting())

    def _show_site(self) -> None:
        if self._page is not None:
            self._shown = self.state.project
            self._page.show_site(self.state)


def _reported(error: Exception, sender: Sender) -> Report:
    """Return what is told of an error; where a mistake of ours was is written to the log, too."""
    if isinstance(error, CommissionError):
        return Report(str(error))
    if isinstance(error, ValueError) and sender.browser is not None:  # a handler refuses what a person asked for
        return Report(str(error))
    log.error("a fault on the page", exc_info=error)
    text = fault_line(error)
    return Report(text, listed=text)


def _sender_of(message: Message) -> Sender:
    """Return who is told when a message leads to an error."""
    match message:
        case Envelope(_, sender):
            return sender
        case BrowserCame(number) | BrowserLeft(number):
            return Sender(number)
        case _:
            return PROGRAM


def _told(job: Job) -> Action:
    """Say that a job failed."""
    return Report(f"{job.name}: {job.error}")


def _is_superseded(message: Message, following: Message | None) -> bool:
    """Whether the message behind makes this one pointless."""
    match message, following:
        case Envelope(earlier, one), Envelope(later, other):
            return one.browser == other.browser and later.supersedes(earlier)
        case Action(), Action():
            return following.supersedes(message)
        case _:
            return False
