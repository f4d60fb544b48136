"""Routes and stations as an engineer edits them: clicks and drags on the floor, seen by a second engineer."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Locator

from commission.app.editing.site_tools import StationTool
from commission.app.problems.view import inspection_of
from commission.io.project_file import load_project, save_project
from commission.studies.violations import ViolationKind
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served

NODES = ("/floor/map", "/routes", "/stations/marks", "/violations/fatal")


class OpenSite(Served):
    """A served project in a folder; nothing drives."""

    def __init__(self, folder: Path) -> None:
        save_project(room(), folder)
        super().__init__(load_project(folder), folder)


@pytest.fixture
def site(tmp_path: Path) -> Iterator[OpenSite]:
    opened = OpenSite(tmp_path)
    yield opened
    opened.close()


def row_of(page: OpenPage, name: str) -> Locator:
    """Row of a station in the table, once it is there."""
    found = page.page.locator(f".c-data:visible tr[data-key='{name}']")
    found.wait_for()
    return found


def test_a_station_is_placed_typed_dragged_and_seen_by_another_browser(
    site: OpenSite, window: Callable[..., OpenPage]
) -> None:
    page, other = window(site.server, SMALL), window(site.server, SMALL)
    client = page.open(nodes=NODES).client_id
    theirs = other.open(nodes=NODES).client_id
    page.press(StationTool.name)
    site.until(lambda: isinstance(site.editor(client).tool, StationTool))
    page.click_until((3.0, 2.1), lambda: len(site.state.project.stations) == 1)
    # It stands on the route, which passes 0.1 m below the click, and looks along it.
    station = site.state.project.stations[0]
    curve = site.state.project.routes[0].segments[0].spline()
    foot = curve.point(curve.closest((station.x, station.y), 0.5))
    np.testing.assert_allclose((station.x, station.y), foot, atol=1e-6)
    assert abs(station.heading) < math.radians(30.0)
    label = f"/station_names/{station.name.encode().hex()}"
    other.wait_until_drawn((label,))
    assert site.editor(theirs).posed is None
    assert site.editor(theirs).tool is None
    other.open_tab("Routes")
    assert "100" in row_of(other, station.name).inner_text().split()
    assert other.errors == []
    # Without a graphics card two windows draw too slowly for the drag that follows.
    other.close()
    page.press("Select")
    page.fill("Name", "Dock <b>1</b>")
    site.until(lambda: site.state.project.stations[0].name == "Dock <b>1</b>")
    page.fill("Within [mm]", "12")
    site.until(lambda: site.state.project.stations[0].required_accuracy == 0.012)
    page.drag((station.x, station.y), (3.0, 5.0))
    site.until(lambda: site.state.project.stations[0].y > 4.5)
    page.wait_for_text("Undo move Dock <b>1</b>")
    page.open_tab("Routes")
    assert "12" in row_of(page, "Dock <b>1</b>").inner_text().split()
    assert page.errors == []
    assert site.state.faults == ()


def test_a_route_that_is_bent_into_a_wall_is_marked_plotted_and_found_from_its_problem(
    site: OpenSite, window: Callable[..., OpenPage]
) -> None:
    page = window(site.server)
    client = page.open(nodes=NODES).client_id
    page.open_tab("Route")
    page.wait_for_text("Select a route on the floor")
    page.click_at((4.0, 2.1))
    site.until(lambda: site.editor(client).point is not None)
    page.wait_for_text("nothing violated")
    assert page.page.locator(".uplot:visible").count() == 3
    # The end of the route, onto the pillar that begins at x 7.5 m, y 3.5 m.
    page.drag((6.0, 3.0), (7.7, 3.7))
    site.until(lambda: ViolationKind.WALL in {v.kind for v in inspection_of(site.runtime.view()).violations})
    page.wait_for_text("cuts walls")
    page.page.keyboard.press("Escape")
    site.until(lambda: site.editor(client).point is None)
    page.wait_for_text("Select a route on the floor")
    page.open_tab("Problems")
    page.page.get_by_role("button", name="cuts a wall").first.click()
    site.until(lambda: site.editor(client).point is not None)
    page.page.keyboard.press("Control+z")
    site.until(lambda: inspection_of(site.runtime.view()).violations == ())
    assert page.errors == []
