"""The raw-sensor view as a person uses it: sees the peaks, drags the threshold over them, and the drive follows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from commission.app.base.view import view_of
from commission.app.live.sensor_panel import scan_of
from commission.app.live.state import SensorWatch
from commission.app.run.service import RunService
from commission.site.disturbances import ShinyObject
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

WORDS_IN_EACH_OTHER = """() => [...document.querySelectorAll('.c-s-plot')].flatMap((plot) => {
  const words = [...plot.querySelectorAll('.c-s-title, .c-s-top, .c-s-y, .c-s-line b')];
  const boxes = words.map((each) => each.getBoundingClientRect());
  const meet = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
  const line = plot.querySelector('.c-s-line')?.getBoundingClientRect(), at = line && line.top + line.height / 2;
  return words.flatMap((each, i) => [
    ...(each.scrollWidth > each.clientWidth + 1 && getComputedStyle(each).overflow !== 'visible'
      ? [`cut: ${each.textContent}`] : []),
    ...words.slice(i + 1).filter((_, j) => meet(boxes[i], boxes[i + 1 + j])).map(
      (other) => `${each.textContent} on ${other.textContent}`),
    ...(each.className === 'c-s-y' && at > boxes[i].top + 1 && at < boxes[i].bottom - 1
      ? [`struck through: ${each.textContent}`] : []),
  ]);
})"""
"""Words of the plots that are cut, lie on each other, or under the threshold's line."""
POST = (4.0, 5.0)
"""Where something shiny stands that is no reflector of the map [m]."""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    project = room()
    light = replace(project.disturbances.intensity, enabled=True)
    shiny = ShinyObject(x=POST[0], y=POST[1], radius=0.05)
    project = replace(project, disturbances=replace(project.disturbances, intensity=light, shiny_objects=(shiny,)))
    with standing_drive(project, at=6.0) as opened:
        yield opened


@pytest.fixture(scope="module")
def page(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for both tests, in their order."""
    opened = lasting_window(served.server, (1024, 700))
    opened.open()
    return opened


def test_a_person_drags_the_threshold_over_the_peaks_and_takes_it_back(served: Served, page: OpenPage) -> None:
    assert page.page.locator(".c-s-intensity").count() == 0, "its tab is not in front"
    page.open_tab("Sensor")
    page.page.wait_for_selector(".c-s-intensity")
    found = scan_of(view_of(served.state, *served.runtime.service(RunService).parts(slowly=False)), 0)
    assert found is not None
    assert len(found.clusters) >= 2
    assert f"{int(found.reflective.sum())} of {len(found.reflective)} beams at or above 0.5" in page.text()
    assert f"{len(found.clusters)} clusters: " in page.text()

    line = page.page.locator(".c-s-line").bounding_box()
    box = page.page.locator(".c-s-intensity").bounding_box()
    assert line is not None
    assert box is not None
    assert box["height"] > 90.0
    assert box["y"] + box["height"] < 700.0
    top = float(page.page.locator(".c-s-intensity").get_attribute("data-top") or "nan")
    middle = line["y"] + 0.5 * line["height"]
    share = (box["y"] + box["height"] - middle) / box["height"]
    assert share**2 * top == pytest.approx(0.5, abs=0.03 * top), "heights are the roots of intensities"
    # In the smallest window no word of the plots is cut, and none lies on another one.
    assert page.page.evaluate(WORDS_IN_EACH_OTHER) == []
    # Up to the very top: no peak is left.
    page.page.mouse.move(box["x"] + 80.0, middle)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 80.0, box["y"] + 30.0)
    page.page.mouse.move(box["x"] + 80.0, box["y"] + 1.0)
    page.page.mouse.up()
    served.until(lambda: served.state.project.parameters.detector.intensity_threshold > 0.95 * top)
    page.wait_for_text("0 clusters")
    page.page.keyboard.press("Control+z")
    served.until(lambda: served.state.project.parameters.detector.intensity_threshold == 0.5)
    page.wait_for_text(f"{len(found.clusters)} clusters")
    # Sensors count to 254 or 65,535: what a person reads off the picture can be typed.
    page.open_tab("Tune")
    page.row("Intensity from").locator("input").last.click()
    for typed, said in (("150.5", "0 clusters"), ("0.5", f"{len(found.clusters)} clusters")):
        page.page.keyboard.press("Control+a")
        page.page.keyboard.type(typed, delay=80)
        page.page.keyboard.press("Enter")
        served.until(lambda t=typed: served.state.project.parameters.detector.intensity_threshold == float(t), 20.0)
        page.wait_for_text(said)
    page.wait_for_text(f"{len(found.clusters)} clusters")
    assert page.errors == []


def test_what_shines_beside_the_map_is_listed_and_a_click_in_list_or_plot_marks_it_on_the_floor(
    served: Served, page: OpenPage
) -> None:
    page.open_tab("Sensor")
    row = page.page.locator(".c-s-list tbody tr").first
    row.wait_for()
    cells = row.locator("td").all_inner_texts()
    x, y = (float(each) for each in cells[0].split(", "))
    assert (x, y) == pytest.approx(POST, abs=0.1)
    assert int(cells[1]) > 20
    nearest, farthest = (float(each) for each in cells[2].split("–"))
    assert 0.5 < nearest < farthest < 12.0
    peak, threshold = (float(each) for each in cells[3].split(" / "))
    assert peak > threshold == 0.5
    body = page.page.locator(".c-s-list").bounding_box()
    assert body is not None
    assert body["x"] + body["width"] <= 1024.0
    assert body["y"] + body["height"] <= 700.0

    def is_in_the_middle(place: tuple[float, float]) -> bool:
        canvas = page.page.evaluate(
            "() => (({left, top, width, height}) => [left + width / 2, top + height / 2])"
            "(window.__viserMutable.canvas.getBoundingClientRect())"
        )
        return page.pixel_of(place) == pytest.approx(canvas, abs=6.0)

    row.click()
    served.until(lambda: watch(served).marked == pytest.approx(POST, abs=0.1))
    page.page.wait_for_selector(".c-s-list tr[aria-selected]")
    served.until(lambda: is_in_the_middle((x, y)))
    lines = "() => window.__viserMutable.nodeRefFromName['/live/seen_mark'] !== undefined"
    page.page.wait_for_function(lines)

    # A cluster of a reflector, in the plot: that reflector is selected, and the floor goes to it.
    mark = page.page.locator(".c-s-intensity .c-s-mark:not([data-reflector=''])").first
    name, box = mark.get_attribute("data-reflector"), mark.bounding_box()
    assert box is not None
    page.page.mouse.click(box["x"] + 0.5 * box["width"] + 2.0, box["y"] + 0.5 * box["height"] + 1.0)
    page.page.locator(".c-s-said", has_text=f"accepted, {name}").wait_for()
    page.wait_for_text(f"Reflector {name}")
    reflector = next(each for each in served.state.project.reflectors.reflectors if each.id == name)
    served.until(lambda: is_in_the_middle(watch(served).marked or (0.0, 0.0)))
    assert watch(served).marked == pytest.approx((reflector.x, reflector.y), abs=0.15)
    assert page.page.locator(".c-s-intensity .c-s-chosen").count() == 1
    assert page.page.locator(".c-s-list tr[aria-selected]").count() == 0
    assert page.errors == []


def watch(served: Served) -> SensorWatch:
    """What the only browser does with the view."""
    return served.state.of_browser(next(iter(served.state.browsers)), SensorWatch)
