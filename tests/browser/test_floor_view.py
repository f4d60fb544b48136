"""The floor as a map, and keys: where the pointer is, how long things are, zoom to it, moving, playing, all keys."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from commission.app.editing.editor import editors_of
from commission.app.run.actions import ChooseSource, Play, VirtualDrive
from commission.app.run.state import RunState
from tests.app.sites import room
from tests.browser.page import Button, OpenPage
from tests.browser.serving import Served

PLACE = (3.0, 2.0)


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def page(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests, in their order."""
    opened = lasting_window(served.server)
    opened.open(nodes=["/grid/lines"])
    return opened


_LIT_SHEETS = """() => {
  const found = [];
  window.__viserMutable.scene.traverseVisible(node => {
    if (!node.isMesh || !node.material.lights && !/Standard|Toon|Phong/.test(node.material.type)) return;
    node.geometry.computeBoundingSphere();
    if (!node.material.wireframe && node.geometry.boundingSphere.radius > 5) found.push(node.material.type);
  });
  return found;
}"""
"""Filled meshes beyond the size of a vehicle with light at each pixel."""


_FRAMES_ASKED_FOR = """() => {
  const asked = window.__asked = { frames: 0, postponed: 0 };
  const later = window.setTimeout;
  window.__viserMutable.requestRender = () => { asked.frames += 1; };
  window.setTimeout = (...given) => { asked.postponed += given[1] === 150; return later(...given); };
}"""
"""Counts from now on frames that are asked for, instead of drawing them, and those that were put off by 150 ms."""


def metre(page: OpenPage) -> float:
    """Length of a metre of the floor on the screen [pixels]."""
    return float(np.hypot(*(np.array(page.pixel_of((1.0, 0.0))) - page.pixel_of((0.0, 0.0)))))


def ruler(page: OpenPage) -> tuple[float, float]:
    """What the scale bar says [m], and how long it is [pixels]."""
    number, unit = page.page.locator(".c-length").inner_text().split()
    return float(number) * {"m": 1.0, "cm": 0.01, "mm": 0.001}[unit], page.page.evaluate(
        "document.querySelector('.c-ruler').getBoundingClientRect().width"
    )


def test_the_edge_says_where_the_pointer_is_and_how_long_things_are(page: OpenPage) -> None:
    page.page.mouse.move(*page.pixel_of(PLACE))
    page.page.wait_for_function("document.querySelector('.c-place').textContent !== ''")
    found = re.findall(r"-?\d+\.\d+", page.page.locator(".c-place").inner_text())
    # The pointer stands on whole pixels.
    assert [float(number) for number in found] == pytest.approx(PLACE, abs=1.0 / metre(page))
    length, pixels = ruler(page)
    assert pixels == pytest.approx(length * metre(page), abs=3.5)  # with its border
    page.page.mouse.move(5, 5)
    page.page.wait_for_function("document.querySelector('.c-place').textContent === ''")


def test_nothing_as_large_as_the_floor_is_lit(page: OpenPage) -> None:
    # Without a graphics card the sheet that takes drags, filled, was half the time of a picture.
    assert page.page.evaluate(_LIT_SHEETS) == []


def test_the_wheel_zooms_to_the_pointer(page: OpenPage) -> None:
    at, before = np.array(page.pixel_of(PLACE)), metre(page)
    page.page.mouse.move(*at)
    for _ in range(4):
        page.page.mouse.wheel(0, -200)
    # The camera may stand still before it has heard of the wheel.
    for _ in range(100):
        if metre(page) > 1.3 * before:
            break
        page.page.wait_for_timeout(50)
    page.wait_until_still()
    assert metre(page) > 1.3 * before
    assert np.hypot(*(np.array(page.pixel_of(PLACE)) - at)) < 6.0
    length, pixels = ruler(page)
    assert pixels == pytest.approx(length * metre(page), abs=3.5)


@pytest.mark.parametrize(("button", "key"), [("middle", None), ("left", "Space")])
def test_the_middle_button_or_space_and_a_drag_moves_the_floor(
    served: Served, page: OpenPage, button: Button, key: str | None
) -> None:
    at, before, playing = np.array(page.pixel_of(PLACE)), metre(page), served.state.part(RunState).playing
    page.page.mouse.move(*at)
    if key:
        page.page.keyboard.down(key)
    page.page.mouse.down(button=button)
    page.page.mouse.move(at[0] + 90.0, at[1] + 40.0, steps=6)
    page.wait_until_still()  # where the processor draws, the hand is farther than the picture
    page.page.mouse.up(button=button)
    if key:
        page.page.keyboard.up(key)
    page.wait_until_still()
    assert metre(page) == pytest.approx(before, rel=1e-3)
    np.testing.assert_allclose(np.array(page.pixel_of(PLACE)) - at, (90.0, 40.0), atol=6.0)
    # It was no rectangle of a selection, nor was Space the key that plays.
    assert all(each.drag is None and not each.has_selection for each in editors_of(served.state))
    assert served.state.part(RunState).playing is playing
    assert page.errors == []


def test_the_status_line_says_how_large_things_are_drawn_and_what_attracts(page: OpenPage) -> None:
    page.page.wait_for_function("document.querySelector('.c-zoom').textContent !== ''")
    shown = float(page.page.locator(".c-zoom").inner_text().removesuffix("px/m"))
    assert shown == pytest.approx(metre(page), rel=0.01)
    status = page.page.locator(".c-status")
    assert status.inner_text().endswith("snap: walls")
    page.open_tab("Selection")
    page.unfold("Snapping", "To walls")
    page.tick("To walls")
    page.page.wait_for_function("document.querySelector('.c-status').textContent.endsWith('snap: off')")
    page.tick("To walls")


def test_space_plays_and_pauses_wherever_nothing_is_typed(served: Served, page: OpenPage) -> None:
    served.runtime.post(ChooseSource(VirtualDrive(served.state.project.routes[0].name)))
    served.until(lambda: served.view is not None)
    served.runtime.post(Play(playing=False))
    served.until(lambda: not served.state.part(RunState).playing)
    page.press("Step")  # the focus is on a button
    page.page.keyboard.press("Space")
    served.until(lambda: served.state.part(RunState).playing, 10.0)
    page.page.keyboard.press("Space")
    served.until(lambda: not served.state.part(RunState).playing, 10.0)
    page.open_tab("Site")
    page.fold("Project")
    name = page.row("Name").locator("input")
    name.click()
    page.page.keyboard.press("End")
    page.page.keyboard.type(" two")
    assert name.input_value().endswith(" two")
    assert not served.state.part(RunState).playing
    name.press("Escape")


def test_a_question_mark_shows_all_keys(page: OpenPage) -> None:
    page.page.mouse.click(*page.pixel_of(PLACE))
    page.page.keyboard.press("?")
    page.wait_for_text("Play or pause")
    assert page.errors == []


def test_a_frame_for_the_pointer_waits_for_a_press_and_one_for_a_drag_does_not(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    # Without a graphics card a frame takes a tenth of a second, and what is pressed is answered behind it.
    page = window(served.server)
    page.open(nodes=["/reflectors/marks"])
    page.page.mouse.move(5, 5)  # beside the floor, which can be pressed
    page.page.wait_for_timeout(500)
    page.page.evaluate(_FRAMES_ASKED_FOR)
    page.page.mouse.move(*page.pixel_of(PLACE))
    page.page.wait_for_function("window.__asked.frames > 0", timeout=10_000)
    assert page.page.evaluate("window.__asked.postponed >= window.__asked.frames")
    x, y = page.pixel_of(PLACE)
    page.page.mouse.move(x, y)
    page.page.mouse.down(button="middle")
    page.page.wait_for_timeout(500)
    page.page.evaluate("window.__asked.frames = window.__asked.postponed = 0")
    page.page.mouse.move(x + 30.0, y)
    page.page.wait_for_function("window.__asked.frames > 0")
    assert page.page.evaluate("window.__asked.postponed") == 0
    page.page.mouse.up(button="middle")
