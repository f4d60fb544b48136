"""The owner thread cannot end silently, and tells what went wrong to whom it concerns."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import pytest

from commission.app import runtime as runtime_module
from commission.app.base.actions import Action, Magnify, Report, Sender
from commission.app.base.effects import Effect, Tell
from commission.app.base.feature import Feature
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.project.actions import RenameProject
from commission.app.runtime import BrowserCame, Runtime
from commission.errors import FileFormatError
from commission.site.project import Project
from tests.app.asking import by


@dataclass(frozen=True, slots=True)
class Fail(Action):
    """Something whose handler, or effect, fails."""

    error: Exception
    in_effect: bool = False


@dataclass(frozen=True, slots=True)
class Failing(Effect):
    error: Exception


@reduce.register
def fail(action: Fail, state: AppState, _sender: Sender) -> Outcome:
    if action.in_effect:
        return Outcome(state, (Failing(action.error),))
    raise action.error


@dataclass(frozen=True, slots=True)
class EditAndFail(Action):
    """An edit of which an effect follows that fails."""


@reduce.register
def edit_and_fail(_action: EditAndFail, state: AppState, _sender: Sender) -> Outcome:
    return Outcome(replace(state, project=replace(state.project, name="another")), (Failing(RuntimeError("no")),))


class Probe(Service):
    """A service that fails where it is told to, and notes the order of what it is asked."""

    effects = (Failing,)

    def __init__(self, context: Context, asked: list[str], broken: set[str]) -> None:
        super().__init__(context)
        self._asked, self._broken = asked, broken

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:
        self._asked.append("journal")
        self._fail("project_changed")

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        self._asked.append("effect")
        assert isinstance(effect, Failing)
        raise effect.error

    def follow(self, state: AppState) -> Due:
        self._fail("follow")
        return Due.NEVER

    def rest(self, state: AppState) -> float:
        self._fail("rest")
        return 0.005

    def _fail(self, name: str) -> None:
        if name in self._broken:
            raise RuntimeError(f"{name} is broken")


class Window:
    """A page that notes who is told what, and fails where it is told to."""

    def __init__(self) -> None:
        self.told: list[tuple[int | None, str]] = []
        self.broken: set[str] = set()
        self.pictures = 0

    def show_site(self, state: AppState) -> None:
        pass

    def draw(self, view: PageView, *, slowly: bool) -> None:
        if "draw" in self.broken:
            raise RuntimeError("draw is broken")
        self.pictures += 1

    def carry_out(self, effect: Effect, sender: Sender) -> None:
        if "tell" in self.broken:
            raise RuntimeError("tell is broken")
        if isinstance(effect, Tell):
            self.told.append((None if effect.everywhere else sender.browser, effect.text))

    def connected(self, browser: int) -> None:
        if "connect" in self.broken:
            raise RuntimeError("connect is broken")

    def disconnected(self, browser: int) -> None:
        pass


class Owner:
    """A runtime that runs, with a probe in it."""

    def __init__(self, project: Project) -> None:
        self.window, self.asked, self.broken = Window(), list[str](), set[str]()
        probe = partial(Probe, asked=self.asked, broken=self.broken)
        self.runtime = Runtime(
            AppState(project=project, saved=project, folder=Path("hall")), [Feature(name="probe", services=(probe,))]
        )
        self.runtime.start(self.window)

    def until(self, reached: Callable[[], bool]) -> None:
        end = time.monotonic() + 10.0
        while not reached():
            assert time.monotonic() < end, (self.window.told, self.asked)
            time.sleep(0.005)

    def lives_on(self) -> bool:
        """Whether something that is asked for now is done."""
        self.runtime.post(by(7, Magnify(3.0 if self.runtime.state.magnify == 1.0 else 1.0)))
        before = self.runtime.state.magnify
        self.until(lambda: self.runtime.state.magnify != before)
        return True


@pytest.fixture
def owner(project: Project) -> Iterator[Owner]:
    running = Owner(project)
    yield running
    running.runtime.stop()


def test_what_one_browser_is_refused_is_told_to_it_alone_and_listed_for_nobody(owner: Owner) -> None:
    owner.runtime.post(by(3, Magnify(1e9)))
    owner.until(lambda: bool(owner.window.told))
    assert owner.window.told == [(3, "ellipse scale is 1e+09; expected 1 to 100")]
    assert owner.runtime.state.faults == ()


def test_what_a_file_holds_is_quoted_to_who_asked_for_it_and_to_nobody_else(owner: Owner) -> None:
    secret = FileFormatError("passwd", "line 1", "found 'root:x:0:0'", "a number")
    for error in (secret, KeyError("root:x:0:0")):
        for in_effect in (False, True):
            owner.runtime.post(by(3, Fail(error, in_effect)))
    owner.until(lambda: len(owner.window.told) == 4)
    fault = "a fault of the program (KeyError); its log says where"
    assert owner.window.told == [(3, str(secret)), (3, str(secret)), (3, fault), (3, fault)]
    assert set(owner.runtime.state.faults) == {fault}


def test_what_a_job_of_one_browser_leads_to_is_refused_to_that_browser_alone(owner: Owner) -> None:
    secret = "found 'root:x:0:0'; expected a number"
    for error in (FileFormatError("passwd", "line 1", "found 'root:x:0:0'", "a number"), ValueError(secret)):
        owner.runtime._jobs.start("Reading", lambda _: 1, then=lambda _, error=error: by(3, Fail(error)), key=id(error))
    owner.until(lambda: len(owner.window.told) == 2)
    assert {browser for browser, _ in owner.window.told} == {3}
    assert owner.runtime.state.faults == ()


@pytest.mark.parametrize("kind", [KeyError, ValueError, TypeError, RuntimeError])
def test_the_bare_text_of_a_fault_is_for_the_log_and_no_browser(owner: Owner, kind: type[Exception]) -> None:
    owner.runtime._jobs.start("Study", lambda _: (_ for _ in ()).throw(kind("5")))
    owner.runtime._jobs.start("Another", lambda _: 1, then=lambda _: Fail(kind("5")))
    owner.until(lambda: len(owner.window.told) == 2)
    fault = f"a fault of the program ({kind.__name__}); its log says where"
    assert sorted(owner.window.told, key=str) == [(None, f"Study: {fault}"), (None, fault)]


def test_what_the_program_itself_meets_is_told_to_everybody_and_listed(owner: Owner) -> None:
    owner.runtime.post(Report("the disk is full"))
    owner.until(lambda: bool(owner.window.told))
    assert owner.window.told == [(None, "the disk is full")]
    assert owner.runtime.state.faults == ("the disk is full",)


def test_a_mistake_of_ours_is_in_the_log_with_its_traceback_and_a_refusal_is_not(
    owner: Owner, caplog: pytest.LogCaptureFixture
) -> None:
    owner.runtime.post(by(3, Magnify(1e9)))
    owner.runtime.post(by(3, Fail(KeyError("x"))))
    owner.until(lambda: len(owner.window.told) == 2)
    logged = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert [record.getMessage() for record in logged] == ["a fault on the page"]
    assert logged[0].exc_info is not None
    assert isinstance(logged[0].exc_info[1], KeyError)


@pytest.mark.parametrize("where", ["follow", "rest", "draw", "tell", "connect", "project_changed"])
def test_nothing_that_fails_ends_the_owner_thread(owner: Owner, where: str, caplog: pytest.LogCaptureFixture) -> None:
    owner.broken.add(where)
    owner.window.broken.add(where)
    owner.runtime.post(BrowserCame(5))
    owner.runtime.post(by(5, RenameProject("another")))
    owner.runtime.post(Report("something else"))
    time.sleep(0.3)
    owner.broken.clear()
    owner.window.broken.clear()
    assert owner.lives_on()
    assert where in {str(record.exc_info[1]).split()[0] for record in caplog.records if record.exc_info}


def test_an_error_while_an_error_is_told_is_logged(owner: Owner, caplog: pytest.LogCaptureFixture) -> None:
    owner.window.broken.add("tell")
    owner.runtime.post(by(3, Magnify(1e9)))
    owner.until(lambda: bool(caplog.records))
    assert "a fault while telling 'ellipse scale is 1e+09; expected 1 to 100'" in caplog.text
    owner.window.broken.clear()
    assert owner.lives_on()


def test_what_fails_at_every_turn_is_told_once_in_five_seconds(owner: Owner, monkeypatch: pytest.MonkeyPatch) -> None:
    owner.broken.add("follow")
    time.sleep(0.5)
    assert owner.window.told == [(None, "a fault of the program (RuntimeError); its log says where")]
    monkeypatch.setattr(runtime_module, "SAME_FAULT_AFTER_S", 0.0)
    owner.until(lambda: len(owner.window.told) > 1)


def test_how_long_the_owner_has_been_silent_can_be_asked_for(owner: Owner) -> None:
    go_on = threading.Event()

    class Slow(Window):
        def draw(self, view: PageView, *, slowly: bool) -> None:
            go_on.wait(10.0)

    owner.until(lambda: owner.runtime.silent_for() < 0.2)
    owner.runtime._page = Slow()
    owner.until(lambda: owner.runtime.silent_for() > 0.6)
    go_on.set()
    owner.until(lambda: owner.runtime.silent_for() < 0.2)


def test_the_journal_is_written_before_effects_are_carried_out(owner: Owner) -> None:
    owner.runtime.post(by(3, EditAndFail()))
    owner.until(lambda: bool(owner.window.told))
    assert owner.asked[:2] == ["journal", "effect"]
