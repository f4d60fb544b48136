"""Two browsers on one site: the one that closes disturbs nobody, the one that reloads is where it was."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from commission.app.floor_map.align_tool import AlignTool
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive


def where(page: OpenPage) -> tuple[float, ...]:
    """Pixels of two places of the floor."""
    return (*page.pixel_of((3.0, 6.0)), *page.pixel_of((4.0, 6.0)))


def clicked(served: Served, browser: int) -> tuple[tuple[float, float], ...]:
    """Points by which a browser is about to align the map [m]."""
    tool = served.editor(browser).tool
    return tool.marks() if isinstance(tool, AlignTool) else ()


def begin_to_align(page: OpenPage, served: Served, browser: int) -> None:
    """Click the first point."""
    page.page.keyboard.press("g")
    served.until(lambda: isinstance(served.editor(browser).tool, AlignTool), 10.0)
    page.click_at((3.0, 6.0))
    served.until(lambda: len(clicked(served, browser)) == 1, 10.0)


def test_closing_one_browser_disturbs_nobody_and_a_reload_keeps_tab_folder_and_place(
    window: Callable[..., OpenPage],
) -> None:
    with standing_drive(room()) as served:
        page, other = window(served.server, (1024, 700)), window(served.server, (1024, 700))
        client = page.open()
        page.open_tab("Plan")
        page.open_tab("Site")
        page.fold("Vehicle")
        page.open_tab("Layers")
        page.page.mouse.move(*page.pixel_of((3.0, 6.0)))
        for _ in range(4):
            page.page.mouse.wheel(0, -300)
        page.wait_until_still()
        place = where(page)
        other.open()
        other.close()
        served.until(lambda: len(served.state.browsers) == 1)
        assert client.client_id in served.state.browsers
        assert where(page) == place
        assert page.page.get_by_role("tab", name="Layers", exact=True).get_attribute("aria-selected") == "true"
        begin_to_align(page, served, client.client_id)
        before = set(served.server.get_clients())
        page.page.reload()
        back = page.wait_for_client(before)
        page.wait_until_drawn()
        served.until(lambda: clicked(served, back.client_id) != (), 30.0)
        assert clicked(served, back.client_id)[0] == pytest.approx((3.0, 6.0), abs=0.05)
        page.row("Wheel separation").wait_for(state="visible")
        for name in ("Site", "Layers"):
            assert page.page.get_by_role("tab", name=name, exact=True).get_attribute("aria-selected") == "true"
        served.until(lambda: where(page) == pytest.approx(place, abs=1.0), seconds=30.0)
        page.page.wait_for_function("() => window.commissionStands === true")  # it is not fitted anew any more
        page.wait_until_still()
        assert where(page) == pytest.approx(place, abs=1.0), "and it stays there"
        page.press("Fit")
        page.page.wait_for_function("() => JSON.parse(sessionStorage['commission-view']).camera === null")
        page.page.set_viewport_size({"width": 900, "height": 700})
        before = set(served.server.get_clients())
        page.page.reload()
        page.wait_for_client(before)
        page.wait_until_drawn()
        floor = page.page.locator("canvas").first.bounding_box()
        assert floor is not None
        corners = [page.pixel_of((x, y)) for x in (0.0, 12.0) for y in (0.0, 8.0)]
        assert all(floor["x"] < x < floor["x"] + floor["width"] for x, _ in corners), "who saw all sees all again"
        assert page.errors == []
