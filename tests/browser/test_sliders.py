"""Sliders as a hand uses them: live, one undo step for each drag, a tick where the saved project has the value."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Locator

from commission.app.base.actions import Undo
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served
from tests.conftest import few_of


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def opened(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests: opening one is what takes longest."""
    page = lasting_window(served.server)
    page.open()
    page.open_tab("Tune")
    return page


@pytest.fixture
def page(opened: OpenPage, served: Served) -> OpenPage:
    """The window with the project as it was saved."""
    while served.state.undo:
        steps = len(served.state.undo)
        served.runtime.post(Undo())
        served.until(lambda steps=steps: len(served.state.undo) < steps, 10.0)
    return opened


def box_of(found: Locator) -> dict[str, float]:
    box = found.bounding_box()
    assert box is not None
    return dict(box)


def gate_of(served: Served) -> float:
    return served.state.project.parameters.association.gate_probability


def test_the_gate_has_a_scale_logarithmic_in_what_is_missing_and_its_number_stays_in_percent(
    served: Served, page: OpenPage
) -> None:
    slider = page.row("Gate").locator(".c-tail-slider")
    slider.wait_for()
    box = box_of(slider)
    # Half the way from 50 to 0.01 percent missing is 0.71: the square root of their product.
    page.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    served.until(lambda: len(served.state.undo) == 1, 10.0)
    assert 100.0 * (1.0 - gate_of(served)) == pytest.approx((50.0 * 0.01) ** 0.5, rel=0.08)
    page.page.wait_for_function(
        "shown => document.activeElement && [...document.querySelectorAll('.mantine-NumberInput-input')]"
        ".some(input => input.value === shown)",
        arg=f"{100.0 * gate_of(served):g}",
    )
    # The tick stays at the 95 % that are saved: where log(50 / 5) of log(50 / 0.01) is.
    tick = box_of(page.row("Gate").locator(".c-tail-tick"))
    share = (tick["x"] + 0.5 * tick["width"] - box["x"] - 8.0) / (box["width"] - 16.0)
    assert share == pytest.approx(0.2703, abs=0.02)
    # Typed in percent as before; the slider follows.
    page.fill("Gate", "99.9")
    served.until(lambda: gate_of(served) == pytest.approx(0.999), 10.0)
    page.page.wait_for_function("Math.abs(document.querySelector('.c-tail-slider').value - 730) < 12")
    assert page.errors == []


@pytest.mark.parametrize("label", few_of(("Gate", "Range jump"), ("Gate",)))
def test_a_slow_drag_acts_live_and_is_one_undo_step_and_the_next_one_another(
    served: Served, page: OpenPage, label: str
) -> None:
    kind = ".c-tail-slider" if label == "Gate" else ".mantine-Slider-track"
    slider = page.row(label).locator(kind)
    slider.scroll_into_view_if_needed()
    box = box_of(slider)
    seen: list[object] = []

    def drag(*shares: float) -> None:
        middle = box["y"] + 0.5 * box["height"]
        page.page.mouse.move(box["x"] + shares[0] * box["width"], middle)
        page.page.mouse.down()
        for share in shares[1:]:
            page.page.mouse.move(box["x"] + share * box["width"], middle, steps=4)
            # Longer than a second, after which another change would be another step.
            page.page.wait_for_timeout(1300)
            seen.append(served.state.project.parameters)
        page.page.mouse.up()

    drag(0.2, 0.4, 0.6, 0.8)
    assert len(set(map(id, seen))) == 3, "it acts while it is moved"
    assert len(served.state.undo) == 1
    drag(0.8, 0.5)
    served.until(lambda: len(served.state.undo) == 2, 10.0)
    page.page.get_by_role("button", name="Undo").first.click()
    served.until(lambda: len(served.state.undo) == 1, 10.0)
    assert served.state.project.parameters == seen[2]
    assert page.errors == []


def test_a_tick_says_where_the_saved_project_has_it_and_the_hint_what_may_be_entered(
    served: Served, page: OpenPage
) -> None:
    row = page.row("Range jump")
    row.scroll_into_view_if_needed()
    saved = box_of(row.locator(".mantine-Slider-mark"))
    before = box_of(row.locator("[role=slider]"))
    middles = [each["x"] + 0.5 * each["width"] for each in (saved, before)]
    assert middles[0] == pytest.approx(middles[1], abs=2.0)
    page.fill("Range jump", "700")
    served.until(lambda: len(served.state.undo) == 1, 10.0)
    assert box_of(row.locator(".mantine-Slider-mark")) == saved
    assert box_of(row.locator("[role=slider]"))["x"] > before["x"] + 20.0
    page.row("Gate").locator("input").last.hover()
    page.wait_for_text("50 to 99.99 %.")
    # The same that is said where it is refused.
    page.fill("Gate", "45")
    page.page.wait_for_function(
        "() => document.querySelector('[data-refused]')?.dataset.refused.endsWith('found 45; expected 50 to 99.99')"
    )
    assert len(served.state.undo) == 1
    assert page.errors == []
