"""What meets the eye of who has just come: no run yet, a small window, a wheel turned at once, letters in a number."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import Callable, Iterator

import pytest

from commission.app.base.theme import LEFT_PX, RIGHT_PX
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive
from tests.browser.test_floor_view import metre


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room()) as opened:
        yield opened


@pytest.fixture(scope="module")
def opened(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests but those of its opening, which is what takes longest."""
    page = lasting_window(served.server)
    page.open()
    return page


@pytest.fixture
def page(opened: OpenPage) -> OpenPage:
    """The window, without what it said to the test before."""
    opened.forget_refusals()
    return opened


def test_without_a_run_the_page_says_what_to_do_and_offers_nothing_that_does_nothing(
    window: Callable[..., OpenPage],
) -> None:
    served = Served(room())
    try:
        page = window(served.server)
        page.open()
        page.wait_for_text("no run: see step Run")
        assert not page.page.get_by_role("button", name="Play", exact=True).is_visible()
        assert not page.page.locator(".c-plots").is_visible()
        assert "offsets ×" not in page.text()
        assert page.errors == []
    finally:
        served.close()


@pytest.mark.parametrize("size", [(1024, 700), (1280, 720), (1600, 900)])
def test_name_and_numbers_beside_the_badge_are_seen_whole_at_every_width(page: OpenPage, size: tuple[int, int]) -> None:
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_until_drawn()
    name = page.page.locator(".c-top span").first
    assert name.inner_text() == "Room"
    cut = "e => e.getBoundingClientRect().right > e.parentElement.getBoundingClientRect().right + 0.5"
    assert not name.evaluate(cut)
    beside = page.page.locator(".c-beside")
    beside.wait_for(state="visible")
    assert "mm" in beside.inner_text()
    assert "°" in beside.inner_text()
    boxes = [each.bounding_box() for each in (page.page.locator(".c-badge"), beside, name)]
    ends = [(box["x"], box["x"] + box["width"]) for box in boxes if box is not None]
    assert len(ends) == 3
    assert all(one[1] <= other[0] for one, other in itertools.pairwise(ends)), "beside each other"
    undo = page.page.get_by_role("button", name="Undo").first.bounding_box()
    assert undo is not None
    assert ends[-1][1] <= undo["x"]


def test_who_turns_the_wheel_while_the_page_builds_up_keeps_what_was_zoomed_to(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server)
    page.open()
    fitted = metre(page)
    page.page.mouse.move(*page.pixel_of((3.0, 6.0)))
    for _ in range(5):
        page.page.mouse.wheel(0, -300)
    page.page.wait_for_function("() => window.commissionStands === true")  # the program has heard of it
    page.wait_until_still()
    zoomed = metre(page)
    assert zoomed > 1.25 * fitted
    page.page.set_viewport_size({"width": 1580, "height": 900})  # for this the whole site would be fitted anew
    page.wait_until_drawn()
    assert metre(page) == pytest.approx(zoomed)


@pytest.mark.parametrize(
    ("typed", "told"), [("1e-1", '"e" is not taken'), ("1e2", '"e" is not taken'), ("1-1", '"-" is not taken')]
)
def test_an_entry_with_letters_inside_is_refused_and_what_held_before_stays(
    served: Served, page: OpenPage, typed: str, told: str
) -> None:
    page.open_tab("Tune")
    field = page.row("Range jump").locator("input").last
    before, state = field.input_value(), served.state.project
    field.click()
    page.page.keyboard.press("Control+A")
    page.page.keyboard.type(typed)
    page.page.keyboard.press("Enter")
    page.page.wait_for_function(
        "told => document.querySelector('[data-refused]')?.dataset.refused.startsWith(told)", arg=told
    )
    assert "nothing is entered" in page.page.locator("[data-refused]").first.get_attribute("data-refused")
    assert field.input_value() == before
    assert served.state.project is state


def test_what_is_pasted_into_a_number_and_is_none_is_refused_whole(served: Served, page: OpenPage) -> None:
    page.open_tab("Tune")
    field = page.row("Range jump").locator("input").last
    before, state = field.input_value(), served.state.project
    field.click()
    page.page.keyboard.press("Control+A")
    page.page.evaluate(
        """() => {
            const clipboardData = new DataTransfer();
            clipboardData.setData('text/plain', '1e-1');
            const pasted = new ClipboardEvent('paste', { clipboardData, bubbles: true, cancelable: true });
            document.activeElement.dispatchEvent(pasted);
        }"""
    )
    page.page.wait_for_function(
        "() => document.querySelector('[data-refused]')?.dataset.refused.startsWith('found \"1e-1\"; expected')"
    )
    page.page.keyboard.press("Enter")
    assert field.input_value() == before
    assert served.state.project is state


@pytest.mark.parametrize("letter", ["e", "a", "%"])
def test_a_letter_that_a_number_does_not_take_is_told(page: OpenPage, letter: str) -> None:
    page.open_tab("Tune")
    row = page.row("Range jump")
    field = row.locator("input").last
    field.click()
    page.page.keyboard.press("End")
    page.page.keyboard.type(letter)
    page.page.wait_for_function(
        "letter => document.querySelector('[data-refused]')?.dataset.refused.startsWith(`\"${letter}\" is not taken`)",
        arg=letter,
    )
    page.page.keyboard.press("Escape")


def test_a_digit_that_a_field_has_no_room_for_is_refused_and_nothing_is_rounded(served: Served, page: OpenPage) -> None:
    page.open_tab("Tune")
    field = page.row("Gate").locator("input").last
    before, state = field.input_value(), served.state.project
    field.click()
    page.page.keyboard.press("Control+A")
    page.page.keyboard.type("99.995")
    page.page.keyboard.press("Enter")
    page.page.wait_for_function(
        "() => document.querySelector('[data-refused]')?.dataset.refused.includes('more than the 2 decimals')"
    )
    assert field.input_value() == before
    assert served.state.project is state
    field.click()
    page.page.keyboard.press("Control+A")
    page.page.keyboard.type("99.9")
    page.page.keyboard.press("Enter")
    served.until(lambda: abs(served.state.project.parameters.association.gate_probability - 0.999) < 1e-9)


def test_a_hint_stands_beside_the_panel_and_covers_none_of_its_fields(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server, (1280, 720))
    page.open()
    page.open_tab("Run")
    page.row("Seed").locator("input").hover()
    hint = page.page.get_by_role("tooltip")
    hint.wait_for()
    page.page.wait_for_timeout(300)
    box = hint.bounding_box()
    assert box is not None
    assert box["x"] >= LEFT_PX
    assert box["x"] + box["width"] <= 1280 - RIGHT_PX
    field = page.row("Seed").bounding_box()
    assert field is not None
    assert abs(box["y"] + 0.5 * box["height"] - field["y"]) < 80, "at the height of what it explains"


@pytest.mark.parametrize("size", [(1024, 700), (1600, 900)])
def test_the_numbers_of_now_stand_above_whatever_is_selected_and_nothing_is_named_that_is_gone(
    served: Served, page: OpenPage, size: tuple[int, int]
) -> None:
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_until_drawn()
    page.open_tab("Selection")
    now, count = page.page.locator(".c-now"), len(served.state.project.reflectors)

    def stands_above() -> bool:
        """Whether mode and pose can be read, right above the tabs."""
        box, tab = now.bounding_box(), page.page.get_by_role("tab", name="Selection", exact=True).bounding_box()
        if box is None or tab is None:
            return False
        shown = now.evaluate("e => e.scrollTop === 0 && e.innerText")
        return "Position x, y" in shown and 90.0 < box["height"] and box["y"] + box["height"] <= tab["y"] + 1.0

    page.wait_for_text("Nothing is selected.")
    served.until(stands_above, 10.0)
    reflector = served.state.project.reflectors.reflectors[0]
    page.click_at((reflector.x, reflector.y))
    page.wait_for_text(f"Reflector {reflector.id}")
    served.until(stands_above, 10.0)
    field = page.page.locator("label", has_text=re.compile(r"^y \[m\]$")).bounding_box()
    below = page.page.get_by_role("tab", name="Layers", exact=True).bounding_box()
    assert field is not None
    assert below is not None
    assert field["y"] + field["height"] < below["y"], "properties have room, too"
    page.page.keyboard.press("Delete")
    served.until(lambda: len(served.state.project.reflectors) == count - 1)
    page.wait_for_text("Nothing is selected.")
    assert page.page.locator(".c-selected").count() == 0
    served.until(stands_above, 10.0)
    page.page.keyboard.press("Control+z")
    served.until(lambda: len(served.state.project.reflectors) == count)


def test_what_is_looked_at_is_lit_in_the_bar(page: OpenPage) -> None:
    names = ("2D", "3D", "Fit", "Follow")

    def lit() -> set[str]:
        """Buttons of another color than one that is never lit."""
        colors = {
            name: page.page.get_by_role("button", name=name, exact=True).evaluate(
                "e => getComputedStyle(e).backgroundColor"
            )
            for name in names
        }
        return {name for name in names if colors[name] != colors["Fit"]}

    page.page.mouse.move(0, 400)
    assert lit() == {"2D"}
    for pressed, expected in (
        ("3D", {"3D"}),
        ("Follow", {"3D", "Follow"}),
        ("2D", {"2D"}),
        ("Follow", {"2D", "Follow"}),
        ("Fit", {"2D"}),
    ):
        page.press(pressed)
        page.page.mouse.move(0, 400)
        end = time.monotonic() + 20.0
        while lit() != expected:
            assert time.monotonic() < end, f"after {pressed} lit are {lit()}; expected {expected}"
            page.page.wait_for_timeout(50)
