"""From an empty folder to a driving vehicle with nothing but the browser: a real map, and what an engineer does."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from commission.app.editing.site_tools import PlaceTool, RouteTool
from commission.app.run.actions import SetSpeed
from commission.io.project_file import load_project, save_project
from tests.browser.page import OpenPage
from tests.browser.test_floor_map import NewSite, choose, click

MIDDLE = (9.0, 9.5)
"""Of the hall in the east of the building, 7 x 16 m [m]."""
NEAR_WALLS = tuple((x, y + shift) for x, shift in ((6.0, 0.0), (12.4, 0.6)) for y in (3.0, 5.2, 8.3, 10.5, 12.6, 13.8))
AROUND = ((8.0, 3.5), (8.0, 6.0), (8.0, 9.0), (8.3, 12.0), (9.3, 14.0), (10.5, 12.0), (10.6, 9.0), (10.6, 6.0))
PIXELS_PER_M = 25.0
"""Zoom at which a click is good for a few centimetres."""


def zoom_to(page: OpenPage, place: tuple[float, float], pixels_per_m: float) -> None:
    """Bring a place into the middle with the right mouse button, then turn the wheel until it is large enough."""
    box = page.page.locator("canvas").first.bounding_box()
    assert box is not None
    middle = (box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    for _ in range(60):
        here, beside = page.pixel_of(place), page.pixel_of((place[0] + 1.0, place[1]))
        if beside[0] - here[0] >= pixels_per_m and math.dist(here, middle) < 50.0:
            return
        page.page.mouse.move(*here)
        page.page.mouse.down(button="right")
        page.page.mouse.move(*middle, steps=5)
        page.page.mouse.up(button="right")
        if beside[0] - here[0] < pixels_per_m:
            page.page.mouse.wheel(0, -400)
        page.page.wait_for_timeout(300)
    raise TimeoutError("the place does not come near")


@pytest.mark.slow
def test_a_site_is_built_from_an_empty_folder_and_a_vehicle_drives_in_it(
    tmp_path: Path, shared_data: Path, window: Callable[..., OpenPage]
) -> None:
    site = NewSite(tmp_path / "hall")
    try:
        page = window(site.server)
        client = page.open().client_id
        load_the_map(site, page, shared_data / "maps" / "utexas_gdc_3" / "3.yaml")
        choose_the_equipment(site, page)
        zoom_to(page, MIDDLE, PIXELS_PER_M)
        page.wait_until_drawn()
        place_the_reflectors(site, page, client)
        draw_the_route(site, page, client)
        page.press("Save")
        # The page says "unsaved" until then.
        site.until(lambda: site.state.saved is site.state.project)
        page.wait_for_text("saved ")
        # Files hold tenths of a millimetre; what is saved again from them is the same to the last digit.
        saved = load_project(tmp_path / "hall")
        save_project(site.state.project, tmp_path / "again")
        assert load_project(tmp_path / "again") == saved
        assert [r.x for r in saved.reflectors.reflectors] == pytest.approx(
            [r.x for r in site.state.project.reflectors.reflectors], abs=6e-5
        )
        drive(site, page)
        assert page.errors == []
        assert site.state.faults == ()
    finally:
        site.close()


def load_the_map(site: NewSite, page: OpenPage, path: Path) -> None:
    page.open_tab("Site")
    page.fill("Map file", str(path))
    page.press("Open")
    site.until(lambda: site.state.project.floor_map is not None)
    page.page.wait_for_timeout(1000)  # the view is fitted once the map is there
    page.wait_until_drawn(("/floor/map",))


def choose_the_equipment(site: NewSite, page: OpenPage) -> None:
    for folder in ("Scanner", "Vehicle"):
        page.fold(folder)
    page.choose("Preset", "SICK TiM781")
    site.until(lambda: site.state.project.scanners[0].rate == 15.0)
    page.choose("Kind", "tricycle")
    site.until(lambda: site.state.project.vehicle.kind == "tricycle")


def place_the_reflectors(site: NewSite, page: OpenPage, client: int) -> None:
    choose(site, page, client, PlaceTool())
    for place in NEAR_WALLS:
        click(site, page, client, place, lambda: len(site.state.project.reflectors))
    reflectors = site.state.project.reflectors
    distances = site.floor_map.occupancy().distance_field()
    cells = site.floor_map.occupancy().cells_at(reflectors.centers)
    gaps = distances[cells[:, 0], cells[:, 1]] - reflectors.radii
    assert len(reflectors) == 12
    assert np.all(np.abs(gaps) < site.floor_map.resolution), "each one touches a wall"


def draw_the_route(site: NewSite, page: OpenPage, client: int) -> None:
    choose(site, page, client, RouteTool())
    for place in AROUND:
        click(site, page, client, place, lambda: len(site.editor(client).points))
    page.press("Finish the route")
    site.until(lambda: len(site.state.project.routes) == 1)


def drive(site: NewSite, page: OpenPage) -> None:
    page.open_tab("Run")
    page.press("Drive")
    site.until(lambda: site.view is not None)
    site.runtime.post(SetSpeed(50.0))
    site.until(lambda: site.view is not None and site.view.at_end)
    page.wait_for_text("OPERATIONAL")
    run = site.view
    assert run is not None
    assert run.lived == run.result.cycles > 500
    assert run.result.episodes == ()
    assert run.result.position_errors.max() < 0.1
