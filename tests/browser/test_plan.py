"""The step Plan in a real browser: a heatmap is switched on, seen, read, and follows a reflector."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import maximum_filter, minimum_filter

from commission.app.coverage.scale import FIRST
from commission.app.coverage.service import CoverageService
from commission.app.coverage.settings import Figure
from commission.app.coverage.view import CoverageView, HeatView
from commission.app.placement.reducer import ACCEPT
from commission.app.placement.service import PlacementService
from commission.app.placement.view import LayoutView
from commission.app.prediction.service import PredictionService
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served

SPOT = (22.7, 36.3)


class OpenSite(Served):
    """The warehouse, served."""

    def __init__(self) -> None:
        self.project = load_project(bundled_folder("maps") / "warehouse")
        super().__init__(self.project)

    @property
    def floor(self) -> CoverageView:
        return self.runtime.service(CoverageService).view

    @property
    def heat(self) -> HeatView | None:
        return self.floor.heat

    @property
    def layout(self) -> LayoutView | None:
        return self.runtime.service(PlacementService).view


CASED = """(expected) => {
  const found = [];
  window.__viserMutable.nodeRefFromName["/zones/outlines_casing"]?.traverse((part) => {
    if (part.isMesh) found.push(part.visible);
  });
  return found.length > 0 && found.every((each) => each === expected);
}"""
"""Whether what is around thin marks is drawn."""


@pytest.fixture(scope="module")
def site() -> Iterator[OpenSite]:
    opened = OpenSite()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def page(site: OpenSite, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    opened = lasting_window(site.server, SMALL, sharp=True)
    opened.open(nodes=["/floor/map", "/reflectors/marks"])
    opened.open_tab("Plan")
    return opened


def shot_of(page: OpenPage) -> Image.Image:
    """What the window shows."""
    return Image.open(io.BytesIO(page.page.screenshot())).convert("RGB")


def even_spot(heat: HeatView) -> tuple[int, tuple[float, float]]:
    """The spot nearest to `SPOT` around which the heatmap is of one class, and its index: colors are mixed at edges."""
    classes = heat.classes
    low, high = minimum_filter(classes, 9), maximum_filter(classes, 9)
    rows, columns = np.nonzero((low == high) & (classes >= FIRST))
    points = heat.lattice.points().reshape(*classes.shape, 2)[rows, columns]
    best = int(np.argmin(np.hypot(*(points - SPOT).T)))
    return int(rows[best] * classes.shape[1] + columns[best]), (float(points[best, 0]), float(points[best, 1]))


def test_a_heatmap_is_switched_on_seen_and_read(page: OpenPage, site: OpenSite) -> None:
    before = shot_of(page)
    page.page.wait_for_function(CASED, arg=False)  # a third of the time of a picture, where it is hardly seen
    page.choose("Show", "Visible reflectors")
    site.until(lambda: site.heat is not None)
    page.wait_until_drawn(["/plan/heat"])
    page.page.wait_for_function(CASED, arg=True)
    page.page.wait_for_timeout(1500)
    heat = site.heat
    assert heat is not None
    index, spot = even_spot(heat)
    x, y = (round(value) for value in page.pixel_of(spot))
    without, seen = before.getpixel((x, y)), shot_of(page).getpixel((x, y))
    assert seen != without
    # The floor's own dark shines through: nearest of the scale, not equal to it.
    ramp = 0.8 * heat.scale.colors().astype(float) + 0.2 * np.array(without)
    nearest = int(np.argmin(np.linalg.norm(ramp - np.array(seen), axis=1)))
    assert nearest == int(heat.classes.ravel()[index]) - FIRST, (seen, ramp.tolist())
    page.click_at(spot)
    page.wait_for_text("Clicked at x, y")
    reading = site.floor.reading
    assert reading is not None
    assert abs(reading.place[0] - spot[0]) < 0.2
    assert abs(reading.place[1] - spot[1]) < 0.2
    assert page.errors == []


def test_the_heatmap_follows_a_dragged_reflector(page: OpenPage, site: OpenSite) -> None:
    before = site.heat
    assert before is not None
    reflector = next(r for r in site.project.reflectors.reflectors if 40.0 < r.x < 60.0 and 20.0 < r.y < 50.0)
    page.drag((reflector.x, reflector.y), (reflector.x, reflector.y - 3.0))
    site.until(lambda: bool(site.runtime.state.undo))
    site.until(lambda: site.heat is not before)
    after = site.heat
    assert after is not None
    assert (after.classes != before.classes).any()


def test_a_route_is_predicted_over_its_metres(page: OpenPage, site: OpenSite) -> None:
    page.fold("Prediction along a route")
    page.choose("Route", site.project.routes[0].name)
    page.wait_for_text("Supervisor stops")
    assert site.runtime.service(PredictionService).view is not None
    assert page.errors == []


def test_a_layout_is_suggested_accepted_and_taken_back(page: OpenPage, site: OpenSite) -> None:
    page.choose("Show", "Position dilution (DOP)")
    site.until(lambda: site.heat is not None and site.heat.scale.figure is Figure.POSITION_DOP)
    before, whole = site.heat, site.runtime.state.project
    page.fold("Prediction along a route")
    page.fold("Suggested layout")
    page.tick("Keep present")
    page.fold("Routes that count")
    for route in site.project.routes[1:]:
        page.tick(route.name)
    site.until(lambda: len(site.runtime.state.project.layout.ignored_routes) == len(site.project.routes) - 1)
    project = site.runtime.state.project
    page.press("Suggest reflectors")
    page.wait_for_text("Fewest possible")
    found = site.layout
    assert found is not None
    placement = found.suggestion.placement
    assert 0 < placement.at_least <= placement.added < len(whole.reflectors)
    assert site.runtime.state.project is project
    page.page.get_by_text(f"{placement.added} new").first.wait_for(state="visible")
    page.press("Accept")
    site.until(lambda: site.runtime.state.project is not project)
    assert site.runtime.state.project.reflectors == placement.reflectors
    assert site.runtime.state.undo[-1].name == ACCEPT
    site.until(lambda: site.layout is None)
    site.until(lambda: site.heat is not None and site.heat is not before and not site.heat.outdated)
    page.page.get_by_role("button", name="Undo").first.click()
    site.until(lambda: site.runtime.state.project is project)
    assert page.errors == []
