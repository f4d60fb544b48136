"""Fixtures that open the page in Debian's chromium."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import viser
from playwright.sync_api import Browser, sync_playwright

from tests.browser.page import CHROMIUM, FLAGS_OF_TESTS, WIDE, OpenPage


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark everything in this folder, so that `-m "not browser"` leaves it out."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A running chromium; a module's and not the session's, since playwright occupies the thread's event loop."""
    if not CHROMIUM.exists():
        reason = f"{CHROMIUM} is absent: the page can only be tested in a browser (apt-get install chromium)"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS_OF_TESTS))
        yield chromium
        chromium.close()


COARSE = 0.5
"""Resolution of the floor where a test does not look at its pixels: without a graphics card, drawing it is what a test
in a browser spends most of its time on."""


def _windows(browser: Browser) -> Iterator[Callable[..., OpenPage]]:
    windows: list[OpenPage] = []

    def make(server: viser.ViserServer, size: tuple[int, int] = WIDE, *, sharp: bool = False) -> OpenPage:
        windows.append(OpenPage(browser, server, size, 1.0 if sharp else COARSE))
        return windows[-1]

    yield make
    for one in windows:
        one.close()


@pytest.fixture
def window(browser: Browser) -> Iterator[Callable[..., OpenPage]]:
    """Makes windows for a server's page (`sharp`: to look at the pixels of the floor), and closes them at the end."""
    yield from _windows(browser)


@pytest.fixture(scope="module")
def lasting_window(browser: Browser) -> Iterator[Callable[..., OpenPage]]:
    """Makes windows that all tests of a module share: opening one is what takes longest."""
    yield from _windows(browser)
