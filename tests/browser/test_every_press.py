"""A busy browser carries out several presses at once: each of them is told of, and none stands for the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

AT_ONCE = """async (places) => {
  const canvas = window.__viserMutable.canvas;
  const send = (kind, [clientX, clientY]) => canvas.dispatchEvent(new PointerEvent(kind, {
    bubbles: true, cancelable: true, clientX, clientY, pointerId: 1, isPrimary: true, pointerType: 'mouse',
    buttons: kind === 'pointerdown' ? 1 : 0 }));
  for (const place of places) for (const kind of ['pointermove', 'pointerdown', 'pointerup']) {
    send(kind, place);
    await null; // what waits for no timer is done between events
  }
}"""
"""Clicks on the floor that were waiting in a row: no timer comes between them."""
PRESSED = """async ([name, count]) => {
  const button = [...document.querySelectorAll('button')].find((each) => each.textContent.startsWith(name));
  for (let i = 0; i < count; i++) { button.click(); await null; }
}"""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room(), at=4.0) as opened:
        yield opened


@pytest.fixture(scope="module")
def page(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    opened = lasting_window(served.server)
    opened.open(nodes=["/reflectors/marks", "/vehicle"])
    return opened


def test_each_of_several_clicks_on_the_floor_places_a_reflector(served: Served, page: OpenPage) -> None:
    browser, count = next(iter(served.state.browsers)), len(served.state.project.reflectors)
    page.press("Place")
    served.until(lambda: served.editor(browser).tool is not None)
    page.wait_for_text("Place: click on the floor for a reflector")
    places = [(3.0, 4.0), (5.0, 5.0), (7.0, 5.5), (9.0, 6.0), (10.0, 4.0)]
    page.page.evaluate(AT_ONCE, [page.pixel_of(place) for place in places])
    served.until(lambda: len(served.state.project.reflectors) >= count + len(places), 10.0)
    found = [(r.x, r.y) for r in served.state.project.reflectors.reflectors[count:]]
    assert [pytest.approx(place, abs=0.05) for place in places] == found
    page.page.keyboard.press("Escape")
    assert page.errors == []


def test_each_of_several_presses_of_a_button_counts(served: Served, page: OpenPage) -> None:
    steps = len(served.state.undo)
    assert steps >= 3
    page.wait_for_text("Undo place")  # what it undoes comes with the next picture
    page.page.evaluate(PRESSED, ["Undo place", 3])
    served.until(lambda: len(served.state.undo) <= steps - 3, 10.0)
    page.page.wait_for_timeout(300)
    assert len(served.state.undo) == steps - 3
