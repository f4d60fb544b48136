"""A browser that closes throws nothing at the others, whatever the owner thread is doing at that moment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from commission.app.base.actions import Camera, Sender
from commission.app.base.effects import FlyTo, PlaceCamera, SendFile, Tell
from tests.app.raw_client import RawClient
from tests.app.sites import room
from tests.browser.serving import Served


class Leaving:
    """A page with two browsers, of which one has gone and the owner thread does not know it."""

    def __init__(self) -> None:
        self.served = Served(room())
        self.gone, self.other = RawClient(self.served.server), RawClient(self.served.server)
        self.served.until(lambda: len(self.served.state.browsers) == 2)
        self.number = min(self.served.state.browsers)
        self.served.runtime.stop()
        self.gone.close()
        self.served.until(lambda: len(self.served.server.get_clients()) == 1)
        self.page: Any = self.served.runtime._page

    def close(self) -> None:
        self.other.close()
        self.served.server.stop()


@pytest.fixture(scope="module")
def leaving() -> Iterator[Leaving]:
    opened = Leaving()
    yield opened
    opened.close()


def test_a_picture_is_drawn_for_those_who_are_there(leaving: Leaving) -> None:
    view = leaving.served.runtime.view()
    state = replace(view.state, project=replace(view.state.project, name="another"))
    for slowly in (False, True):
        leaving.page.draw(replace(view, state=state), slowly=slowly)
    leaving.page.show_site(state)


@pytest.mark.parametrize(
    "effect",
    [Tell("saved", failed=False), PlaceCamera(Camera.FIT, everywhere=True), FlyTo((1.0, 2.0)), SendFile("a", b"x")],
    ids=lambda effect: type(effect).__name__,
)
def test_what_is_asked_for_by_a_browser_that_has_gone_is_no_fault(leaving: Leaving, effect: Any) -> None:
    leaving.page.carry_out(effect, Sender(leaving.number))


def test_a_browser_that_came_and_went_at_once_is_no_fault(leaving: Leaving) -> None:
    leaving.page.connected(leaving.number)
    leaving.page.disconnected(leaving.number)
    leaving.page.disconnected(leaving.number)


def test_a_fault_in_the_panels_of_a_browser_that_is_there_stays_one(
    leaving: Leaving, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("a mistake of ours")

    there = leaving.page._browsers[max(leaving.page._browsers)]
    monkeypatch.setattr(type(there.panels[0]), "draw", fail)
    with pytest.raises(RuntimeError, match="a mistake of ours"):
        leaving.page.draw(leaving.served.runtime.view(), slowly=False)
