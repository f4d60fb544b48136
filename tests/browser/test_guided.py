"""The way of who has never seen the page: from an empty folder to a driving vehicle by what the page itself offers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from commission.io.map_server import write_floor_map
from commission.io.project_file import open_project
from commission.site.reflectors import Reflector
from commission.studies.prediction import PredictionInput, prediction
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served, standing_drive


def second(served: Served) -> Reflector:
    return served.state.project.reflectors.reflectors[1]


def press_on_card(page: OpenPage, title: str) -> None:
    page.page.locator(".c-card button", has_text=title).click()


def test_the_card_of_an_empty_site_leads_to_a_driving_vehicle(window: Callable[..., OpenPage], tmp_path: Path) -> None:
    opened = open_project(tmp_path / "hall")
    served = Served(opened.project, opened.folder, is_new=True)
    try:
        page = window(served.server, (1024, 700))
        client = page.open().client_id
        card = page.page.locator(".c-card")
        card.wait_for(state="visible")
        drive = card.locator("button", has_text="Drive")
        assert drive.is_disabled()
        assert "first: reflectors and a route" in card.inner_text()
        assert page.page.get_by_role("tab", name="Tune", exact=True).get_attribute("title").startswith("missing: refl")
        press_on_card(page, "Place reflectors")
        served.until(lambda: served.editor(client).tool is not None)
        page.page.locator(".c-card-line").wait_for(state="visible")  # out of the way of the clicks
        for count, place in enumerate(((-3.0, -3.0), (3.0, -3.0), (0.0, 4.0)), start=1):
            page.click_at(place)
            served.until(lambda count=count: len(served.state.project.reflectors) == count)
        press_on_card(page, "Draw a route")
        served.until(lambda: served.editor(client).tool is not None and "oute" in served.editor(client).tool.name)
        for count, place in enumerate(((-2.0, 0.0), (0.0, 0.0), (1.0, 0.0), (2.0, 1.0)), start=1):
            page.click_at(place)
            served.until(lambda count=count: len(served.editor(client).points) == count)
        page.page.keyboard.press("Enter")
        served.until(lambda: len(served.state.project.routes) == 1)
        page.page.wait_for_function("() => !document.querySelector('.c-card li:last-child button').disabled")
        press_on_card(page, "Drive")
        served.until(lambda: served.view is not None)
        card.wait_for(state="hidden")
        page.page.wait_for_function(
            "() => document.querySelector('[role=tab][data-lacks]').title.includes('floor map')"
        )
        tune = page.page.get_by_role("tab", name="Tune", exact=True)
        assert tune.get_attribute("title") == "has all that it needs"
        assert page.errors == []
    finally:
        served.close()


def test_who_reads_only_the_page_comes_from_an_empty_folder_to_a_prediction_without_a_wrong_turn(
    window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    """Each press is on what can be read at that moment, each wait for what a person waits for."""
    floor_map, opened = room().floor_map, open_project(tmp_path / "hall")
    assert floor_map is not None
    write_floor_map(floor_map, tmp_path / "hall" / "floor.yaml")
    served = Served(opened.project, opened.folder, is_new=True)
    try:
        page = window(served.server, SMALL)
        page.open()
        page.wait_for_text("A new site, from nothing to a driving vehicle")
        press_on_card(page, "Load a floor map")
        page.page.wait_for_function("() => document.activeElement.tagName === 'INPUT'")  # where its path belongs
        page.page.keyboard.type(str(tmp_path / "hall" / "floor.yaml"))
        page.press("Open")
        page.wait_for_text("12.0 x 8.0 m")
        page.wait_until_still()
        page.wait_until_drawn(["/floor/map"])
        press_on_card(page, "Place reflectors")
        page.wait_for_text("Place: click on the floor for a reflector")
        for count, place in enumerate(((0.4, 2.0), (0.4, 6.0), (11.6, 2.0), (11.6, 6.0)), start=1):
            page.click_at(place)
            page.page.wait_for_function(f"() => /Reflectors\\s+{count}/.test(document.body.innerText)")
        press_on_card(page, "Draw a route")
        page.wait_for_text("Route: click its points")
        for count, place in enumerate(((2.0, 2.0), (4.0, 2.0), (6.0, 2.5), (8.0, 2.5)), start=1):
            page.click_at(place)
            page.wait_for_text(f"{count} so far")
        page.page.keyboard.press("Enter")
        page.wait_for_text("Route 1")
        page.page.locator(".c-card button:enabled", has_text="Drive").click()
        page.page.locator(".c-badge", has_text="OPERATIONAL").wait_for()
        page.open_tab("Plan")
        page.page.get_by_text("Prediction along a route").click()
        page.wait_for_text("Choose a route: the error to be expected along it")
        row = page.page.get_by_text("Choose a route:").locator(
            "xpath=preceding::label[text()='Route'][1]/ancestor::*[contains(@class,'Flex-root')][1]"
        )
        row.locator("input").first.click()
        page.page.get_by_role("option", name="Route 1", exact=True).locator("visible=true").click()
        page.wait_for_text("Worst 2σ position / limit")
        found = prediction(PredictionInput.of(served.state.project, "Route 1")).prediction.covariances[:, :2, :2]
        largest = 2000.0 * float(np.sqrt(np.linalg.eigvalsh(found)[:, -1].max()))
        said = re.search(r"Worst 2σ position / limit\s+([\d.]+) / 100 mm", page.text())
        assert said is not None
        assert float(said[1]) == pytest.approx(largest, abs=0.05)
        assert re.search(r"Supervisor stops\s+nowhere", page.text())
        assert page.errors == []
    finally:
        served.close()


def test_arrows_move_the_selection_by_millimetres_and_escape_cancels_wherever_the_focus_is(
    window: Callable[..., OpenPage],
) -> None:
    with standing_drive(room(), at=6.0) as served:
        page = window(served.server, (1024, 700))
        client = page.open()
        page.click_at((0.25, 6.5))
        served.until(lambda: served.editor(client.client_id).selected == ("R2",))
        before = tuple(client.camera.position)
        for key in ("ArrowRight", "ArrowRight", "ArrowRight", "Shift+ArrowUp"):
            page.page.keyboard.press(key)
        served.until(lambda: round(second(served).y, 6) == 6.51)
        assert round(second(served).x, 6) == 0.253
        page.page.wait_for_timeout(300)
        assert tuple(client.camera.position) == before
        badge, name = page.page.locator(".c-badge").bounding_box(), page.page.locator(".c-top").bounding_box()
        assert badge is not None
        assert name is not None
        assert badge["x"] < 12.0, "at the left end"
        assert badge["x"] + badge["width"] < name["x"]
        page.open_tab("Layers")
        box = page.page.locator("input[type=checkbox]:visible").first
        box.focus()
        page.page.keyboard.press("Escape")
        served.until(lambda: not served.editor(client.client_id).has_selection)
        assert page.errors == []
