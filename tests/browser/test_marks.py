"""Marks of the floor on the screen: as large from near and far, and an inlier within the ellipse that is drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from io import BytesIO

import numpy as np
import pytest
import viser
from PIL import Image

from commission.app.base import theme
from commission.app.base.actions import Magnify
from commission.app.run.detection_layer import PIXELS
from commission.localization.estimate import Status
from tests.app.run.test_drawn_detections import gate_of, is_inside
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

HEIGHTS = (4.0, 1.0, 0.3)
"""Metres of the floor from the upper to the lower edge of the picture."""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room(), at=6.0) as opened:
        yield opened


def look_at(page: OpenPage, client: viser.ClientHandle, place: np.ndarray, height: float) -> None:
    x, y = map(float, place)
    page.page.evaluate("() => { if (!window.commissionStands) window.commissionMovedNow(); }")
    page.page.wait_for_function("() => window.commissionStands === true")  # as if by hand: nothing is fitted anew
    client.camera.position, client.camera.look_at = (x, y, height / 0.02), (x, y, 0.0)
    page.page.wait_for_timeout(600)
    page.wait_until_still()
    page.wait_until_drawn()


def pixels_of(page: OpenPage, around: tuple[float, float], color: theme.Color, reach: int = 60) -> np.ndarray:
    """(N, 2) offsets of the pixels of a color near a point of the window [pixels], right and down."""
    x, y = around
    shot = page.page.screenshot(clip={"x": x - reach, "y": y - reach, "width": 2 * reach, "height": 2 * reach})
    picture = np.asarray(Image.open(BytesIO(shot)).convert("RGB"), dtype=np.int64)
    rows, columns = np.nonzero(np.abs(picture - np.array(color)).sum(axis=2) < 60)
    return np.stack([columns, rows], axis=1) - reach


@pytest.mark.parametrize("magnify", [1.0, 10.0])
def test_an_inlier_is_a_thin_cross_of_one_size_inside_the_drawn_ellipse_at_every_zoom(
    served: Served, window: Callable[..., OpenPage], magnify: float
) -> None:
    page = window(served.server, sharp=True)
    client = page.open(nodes=["/run/gates", f"/run/detections/inlier/{PIXELS['sparkle']}px"])
    served.runtime.post(Magnify(magnify))
    served.until(lambda: served.state.magnify == magnify)
    run = served.view
    assert run is not None
    assert run.estimate is not None
    index = int(np.flatnonzero(run.estimate.status == Status.INLIER)[0])
    center = run.segment.setup.reflectors.centers[run.estimate.reflector[index]]
    place = center + magnify * (run.judged_map[index] - center)
    gate = gate_of(run, center, magnify)
    assert gate is not None
    sizes: list[float] = []
    for height in HEIGHTS:
        look_at(page, client, place, height)
        mark = pixels_of(page, page.pixel_of(place), theme.INLIER)
        near = mark[np.abs(mark).max(axis=1) <= PIXELS["sparkle"]]
        sizes.append(np.ptp(near, axis=0).max())
        assert len(near) < 0.3 * PIXELS["sparkle"] ** 2, "thin"
        # Where the cross and the ellipse are on the screen, not where they were meant to be.
        middle = np.array(page.pixel_of(place)) + near.mean(axis=0)
        assert is_inside(middle, np.array([page.pixel_of(corner) for corner in gate])), height
    assert all(0.7 * PIXELS["sparkle"] <= size <= 1.1 * PIXELS["sparkle"] for size in sizes), sizes
    assert np.ptp(sizes) <= 2, sizes
    assert ("offsets 10x" in page.text()) == (magnify == 10.0)
    assert page.errors == []
