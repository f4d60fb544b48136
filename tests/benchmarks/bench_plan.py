"""How closely the page follows a dragged reflector with a heatmap on: the warehouse, 120 reflectors.

First the service of the heatmap alone, from a place of the drag to its picture; then the whole server, at the rate of
a hand's drag: required are 5 heatmaps a second. At last a browser under a real mouse, where a machine without a
graphics card is bound by its own few frames a second: printed, not required. Run: python -m tests.benchmarks.bench_plan
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from playwright.sync_api import sync_playwright

from commission.app.base.actions import DragFloor, Envelope, Sender
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.coverage.actions import SetCoverage
from commission.app.coverage.scale import picture
from commission.app.coverage.service import CoverageService
from commission.app.coverage.settings import NAME, CoverageSettings, Figure
from commission.app.editing.editor import Drag, Editor, Grab
from commission.app.launch import open_page
from commission.app.runtime import BrowserCame
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.planning.dilution import Heading
from commission.site.project import Project
from commission.site.reflectors import Reflector
from tests.app.owning import Owner
from tests.browser.page import CHROMIUM, FLAGS, WIDE, OpenPage

REQUIRED = 5.0
DRAGS = 60
SECONDS = 6.0
TINY = (640, 480)
"""Without a graphics card the time of a frame goes with its pixels."""
COUNT = """() => {
  window.__maps = new Set(); window.__frames = 0;
  const look = () => {
    window.__frames += 1;
    window.__viserMutable.nodeRefFromName['/plan/heat']?.traverse(node => {
      const map = node.material?.map;
      if (map) window.__maps.add(map.uuid + map.version);
    });
    requestAnimationFrame(look);
  };
  look();
}"""


def until(reached: Callable[[], bool]) -> None:
    """Wait, at most three minutes."""
    end = time.monotonic() + 180.0
    while not reached():
        assert time.monotonic() < end
        time.sleep(0.01)


def central(project: Project) -> Reflector:
    """A reflector that much of the floor sees."""
    centers = project.reflectors.centers
    return project.reflectors.reflectors[int(np.argmin(np.hypot(*(centers - centers.mean(axis=0)).T)))]


def measure_server(project: Project, settings: CoverageSettings) -> None:
    """Print how long the service takes from a place of a drag to the picture."""
    state = AppState(project=project, saved=project).joined(1).with_part(settings).with_part(FloorPicture(owner=NAME))
    owner = Owner(CoverageService, state)
    owner.settle(state)
    service = owner.service
    reflector, times = central(project), []
    for number in range(DRAGS):
        drag = Drag(Grab.REFLECTORS, (0.0, 0.0), (0.0, 0.05 * (number + 1)))
        state = state.with_browser(1, Editor(selected=(reflector.id,), drag=drag))
        start = time.perf_counter()
        service.follow(state)
        heat = service.view.heat
        assert heat is not None
        picture(heat.classes, heat.scale, 0.8)
        times.append(time.perf_counter() - start)
    owner.close()
    median, worst = 1000 * np.median(times), 1000 * max(times)
    name = f"{settings.figure.value}, {settings.heading.value}"
    print(f"server, {name:>32}: {median:6.1f} ms (median), {worst:.1f} ms (worst) of {1000 / REQUIRED:.0f} ms")


def measure_browser(project: Project, size: tuple[int, int]) -> None:
    """Drag with the mouse in a browser; print the heatmaps and frames per second that it drew."""
    server = start_server("127.0.0.1", 0)
    runtime = open_page(server, project)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        page = OpenPage(browser, server, size)
        page.open(nodes=["/floor/map", "/reflectors/marks"])
        runtime.post(SetCoverage("figure", Figure.POSITION_DOP.value))
        until(lambda: runtime.service(CoverageService).view.heat is not None)
        page.wait_until_drawn(["/plan/heat"])
        reflector = central(project)
        x, y = page.pixel_of((reflector.x, reflector.y))
        page.page.evaluate(COUNT)
        views, start, step = dict[int, object](), time.monotonic(), 0
        page.page.mouse.move(x, y)
        page.page.mouse.down()
        while time.monotonic() - start < SECONDS:
            step += 1
            page.page.mouse.move(x + 2 * step % 120, y + step % 60)
            page.page.wait_for_timeout(40)
            heat = runtime.service(CoverageService).view.heat
            views[id(heat)] = heat  # kept, so that no other one gets its number
        seconds = time.monotonic() - start
        page.page.mouse.up()
        maps, frames = page.page.evaluate("[window.__maps.size, window.__frames]")
        page.close()
        browser.close()
    runtime.stop()
    server.stop()
    print(
        f"browser, software WebGL, {size[0]} x {size[1]} pixels: {maps / seconds:.1f} heatmaps/s shown of "
        f"{step / seconds:.1f} moves/s that it took from the mouse, {frames / seconds:.1f} frames/s drawn; "
        f"server: {(len(views) - 1) / seconds:.1f} heatmaps/s"
    )


def measure_runtime(project: Project) -> float:
    """Drag without a browser, at the rate of a hand; print and return the heatmaps per second that are drawn."""
    server = start_server("127.0.0.1", 0)
    runtime = open_page(server, project)
    runtime.post(BrowserCame(1))
    runtime.post(SetCoverage("figure", Figure.POSITION_DOP.value))
    until(lambda: runtime.service(CoverageService).view.heat is not None)
    reflector, seen = central(project), set[int]()
    place, keep, start, step = (reflector.x, reflector.y), [], time.monotonic(), 0
    cpu = time.process_time()
    while time.monotonic() - start < SECONDS:
        now = (place[0] + 0.05 * (step % 40), place[1])
        runtime.post(
            Envelope(DragFloor(phase="update" if step else "start", start=place, now=now, reach=0.3), Sender(1))
        )
        time.sleep(0.05)
        step += 1
        heat = runtime.service(CoverageService).view.heat
        if id(heat) not in seen:
            seen.add(id(heat))
            keep.append(heat)  # kept, so that no other one gets its number
    seconds = time.monotonic() - start
    print(
        f"whole page, no browser: {len(keep) / seconds:.1f} heatmaps/s of {step / seconds:.1f} places/s,"
        f" {100 * (time.process_time() - cpu) / seconds:.0f} % of one core"
    )
    runtime.stop()
    server.stop()
    return len(keep) / seconds


def main() -> int:
    """Print and return the exit code."""
    project = load_project(bundled_folder("maps") / "warehouse")
    for settings in (
        CoverageSettings(figure=Figure.POSITION_DOP),
        CoverageSettings(figure=Figure.POSITION_SIGMA, ellipse_grid=True),
        CoverageSettings(figure=Figure.POSITION_SIGMA, heading=Heading.WORST),
    ):
        measure_server(project, settings)
    passed = measure_runtime(project) >= REQUIRED
    for size in (WIDE, TINY):
        measure_browser(project, size)
    print("passed" if passed else f"FAILED: expected {REQUIRED:g} heatmaps a second")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
