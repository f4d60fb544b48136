"""What the page says when the program behind it is gone, stands still, or does not get on."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served

# One call each, since a new badge takes the place of the old one with every picture: whoever finds the element first
# and asks it then hears nothing of one that is no longer there.
SAID = "getComputedStyle(document.querySelector('.c-badge') ?? document.body, '::after').content"
COLOR = "getComputedStyle(document.querySelector('.c-badge') ?? document.body).backgroundColor"
GRAY = "rgb(74, 79, 87)"


@dataclass(frozen=True, slots=True)
class Sleep(Action):
    """Keep the owner thread from everything else."""

    seconds: float


@reduce.register
def sleep(action: Sleep, state: AppState, _sender: Sender) -> Outcome:
    time.sleep(action.seconds)
    return Outcome(state)


@pytest.fixture
def program() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A program of its own that serves the demo, and its address."""
    command = [sys.executable, "-m", "commission", "demo", "--no-open", "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2])
    assert process.stdout is not None
    yield process, process.stdout.readline().removeprefix("page at ").strip()
    process.send_signal(signal.SIGCONT)
    process.kill()
    process.wait()
    process.stdout.close()


def until(reached: Callable[[], bool], page: Page, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not reached():
        assert time.monotonic() < end, page.evaluate(SAID)
        page.wait_for_timeout(100)


def test_the_badge_is_gray_and_says_since_when_the_program_stands_still_or_is_gone(
    browser: Browser, program: tuple[subprocess.Popen[str], str]
) -> None:
    process, address = program
    page = browser.new_page()
    page.set_default_timeout(60_000)
    page.goto(address)
    page.locator(".c-badge").wait_for()
    page.wait_for_function("window.commissionWatch === true")
    # Without a run the badge is gray of itself. Kernels may have to be compiled first, which keeps the program from
    # answering now and then.
    until(lambda: page.evaluate(SAID) == "none", page, 120.0)
    page.get_by_text("OPERATIONAL", exact=True).wait_for(timeout=120_000)
    assert page.evaluate(COLOR) != GRAY

    for end in (signal.SIGSTOP, signal.SIGKILL):
        os.kill(process.pid, end)
        stopped = time.monotonic()
        until(lambda: "NO CONNECTION SINCE" in page.evaluate(SAID), page)
        page.wait_for_timeout(3_000)
        said = page.evaluate(SAID)
        seconds = re.fullmatch(r'"NO CONNECTION SINCE (\d+) s"', said)
        assert seconds is not None, said
        # Counted from the last answer, which is at most two seconds older than the end.
        assert abs(int(seconds[1]) - (time.monotonic() - stopped)) < 4.0
        assert page.evaluate(COLOR) == GRAY
        if end is signal.SIGSTOP:
            os.kill(process.pid, signal.SIGCONT)
            until(lambda: page.evaluate(SAID) == "none", page, 90.0)  # all of the page is sent and drawn again
            assert page.evaluate(COLOR) != GRAY
    page.close()


@pytest.mark.with_all_seeds
def test_every_page_says_when_the_owner_thread_does_not_get_on(window: Callable[..., OpenPage]) -> None:
    served = Served(room())
    try:
        opened = window(served.server)
        other = window(served.server)
        for each in (opened, other):
            each.open()
            each.page.wait_for_function("window.commissionWatch === true")
        served.runtime.post(Sleep(9.0))
        for each in (opened, other):
            until(lambda page=each.page: "BUSY SINCE" in page.evaluate(SAID), each.page, 9.0)
        until(lambda: opened.page.evaluate(SAID) == "none", opened.page)
        assert opened.errors == []
    finally:
        served.close()
