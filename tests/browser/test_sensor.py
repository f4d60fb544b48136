"""The raw-sensor view as a person uses it: sees the peaks, drags the threshold over them, and the drive follows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from commission.app.base.view import view_of
from commission.app.live.sensor_panel import scan_of
from commission.app.run.actions import Play, Seek, VirtualDrive
from commission.app.run.service import RunService
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    project = room()
    light = replace(project.disturbances.intensity, enabled=True)
    project = replace(project, disturbances=replace(project.disturbances, intensity=light))
    opened = Served(project, source=VirtualDrive(project.routes[0].name))
    opened.until(lambda: opened.view is not None)
    opened.runtime.post(Play(playing=False))
    opened.runtime.post(Seek(6.0))
    opened.until(lambda: opened.view is not None and opened.view.time == pytest.approx(6.0))
    yield opened
    opened.close()


def test_a_person_drags_the_threshold_over_the_peaks_and_takes_it_back(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server, (1024, 700))
    page.open()
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
    assert page.errors == []
