"""A hall in the coordinates of a national grid, drawn as one at zero is: to the pixel, with names that can be read."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO

import numpy as np
from PIL import Image
from playwright.sync_api import Page

from commission.app.base import theme
from tests.app.sites import moved, room
from tests.browser.page import OpenPage
from tests.browser.serving import standing_drive
from tests.browser.test_marks import pixels_of

GRID = (456_000.0, 5_712_345.0)


def floor(page: Page) -> np.ndarray:
    """What is seen of the floor, without its lower edge, which says where the pointer is."""
    box = page.locator("canvas").first.bounding_box()
    assert box is not None
    shot = page.screenshot(clip={**box, "height": box["height"] - 40.0})
    return np.asarray(Image.open(BytesIO(shot)).convert("RGB"), dtype=np.int64)


def seen_at(window: Callable[..., OpenPage], east: float, north: float) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of the reflectors' marks, and the picture of the floor; clicks and the pointer are tried on the way."""
    project = moved(room(), east, north)
    with standing_drive(project, at=6.0) as served:
        page = window(served.server, sharp=True)
        client = page.open(nodes=["/run/gates", "/vehicle"])
        page.page.wait_for_timeout(1500)
        picture = floor(page.page)
        marks = []
        for reflector in project.reflectors.reflectors:
            place = page.pixel_of((reflector.x, reflector.y))
            marks.append(np.array(place) + pixels_of(page, place, theme.REFLECTOR, reach=12).mean(axis=0))
        page.click_at((east + 0.25, north + 6.5))
        served.until(lambda: served.editor(client.client_id).selected == ("R2",), seconds=20.0)
        page.page.mouse.move(*page.pixel_of((east + 6.0, north + 4.0)))
        page.page.wait_for_timeout(300)
        _, x, _, y, _ = page.page.locator(".c-place").inner_text().split()
        assert abs(float(x) - (east + 6.0)) < 0.02
        assert abs(float(y) - (north + 4.0)) < 0.02
        assert page.errors == []
        return np.array(marks), picture


def test_at_a_national_grid_marks_names_and_clicks_are_where_they_are_at_zero(
    window: Callable[..., OpenPage],
) -> None:
    here, there = seen_at(window, 0.0, 0.0), seen_at(window, *GRID)
    assert np.abs(there[0] - here[0]).max() <= 1.0
    # Names, gates, scan, vehicle, grid and walls alike.
    differs = np.abs(there[1] - here[1]).sum(axis=2) > 90
    assert differs.mean() < 0.002
