"""Layouts compared as a person does: keep one, move a reflector, read what changed, switch there and back, undo."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from commission.app.layouts.service import LayoutsService
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served

ROWS = ".c-layouts table tr"


@pytest.fixture
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


def rows(page: OpenPage) -> dict[str, list[str]]:
    cells = [[cell.inner_text() for cell in row.locator("td").all()] for row in page.page.locator(ROWS).all()]
    return {name: values for name, *values in cells if values}


def settled(served: Served) -> None:
    served.until(lambda: (found := served.runtime.service(LayoutsService).view) is not None and not found.outdated)


def test_a_kept_layout_is_compared_with_a_changed_one_in_numbers_and_colors_and_switched_to_and_back(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server)
    page.open(nodes=["/floor/map"])
    page.open_tab("Plan")
    page.fold("Heatmap of the floor")
    page.fold("Compare layouts")
    page.wait_for_text("Keep the layout, change it")
    page.press("Keep this layout")
    page.wait_for_text("Reflectors stand as in layout 1")
    settled(served)
    page.choose("Floor shows", "position error, 1σ [mm]")
    chosen = page.row("Floor shows").locator("input").first
    assert chosen.evaluate("e => e.scrollWidth <= e.clientWidth"), "its unit can be read"
    assert page.page.get_by_role("button", name="Switch to layout 1").is_disabled()

    # One reflector less: worse everywhere, and the page says so in words, numbers and colors.
    page.click_at((11.75, 5.5))
    page.page.keyboard.press("Delete")
    served.until(lambda: len(served.state.project.reflectors) == 3)
    settled(served)
    page.page.wait_for_function("() => /Reflectors\\s+4\\s+3/.test(document.querySelector('.c-layouts').innerText)")
    found = served.runtime.service(LayoutsService).view
    assert found is not None
    assert found.difference is not None
    assert found.before is not None
    assert found.after is not None
    shown = rows(page)
    assert shown[""] == ["layout 1", "now"]
    for row, value in (
        ("All there [mm]", lambda each: 1000.0 * each.figures.routes[0].intact.position),
        ("Ambiguous start [m²]", lambda each: each.ambiguous_area),
    ):
        assert shown[row] == [f"{value(found.before):.1f}", f"{value(found.after):.1f}"]
    assert page.page.locator(".c-layouts .c-worse").count() > 3
    assert page.page.locator(".c-layouts .c-better").count() == 0
    page.wait_until_drawn(nodes=["/plan/difference"])
    page.open_tab("Layers")
    page.wait_for_text("Now against layout 1: position error")
    assert found.difference.better == 0.0
    assert found.difference.worse > 0.3

    # There and back, and undone: each is what a person sees in the column of now.
    page.press("Switch to layout 1")
    page.page.wait_for_function("() => /Reflectors\\s+3\\s+4/.test(document.querySelector('.c-layouts').innerText)")
    assert rows(page)[""] == ["layout 2", "now"]
    assert page.page.locator(".c-layouts .c-worse").count() == 0
    page.press("Switch to layout 2")
    page.page.wait_for_function("() => /Reflectors\\s+4\\s+3/.test(document.querySelector('.c-layouts').innerText)")
    page.page.get_by_role("button", name="Undo switch to layout 2").click()
    served.until(lambda: len(served.state.project.reflectors) == 4)
    page.page.wait_for_function("() => /Reflectors\\s+3\\s+4/.test(document.querySelector('.c-layouts').innerText)")
    assert page.errors == []
