"""How soon the page answers: its first picture, a reflector that is clicked, a time that is gone to.

Run as `python -m tests.benchmarks.bench_response [SITE]`. It needs chromium and playwright. The server's share is from
the action until a client that draws nothing has heard what follows; the browser's from the click or key until the panel
says it, and until the picture after that. Without a graphics card the browser takes most of it.
"""

from __future__ import annotations

import sys
import threading
import time
from contextlib import suppress

import numpy as np
from playwright.sync_api import sync_playwright
from websockets.exceptions import ConnectionClosed

from commission.app.base.actions import Envelope, Sender
from commission.app.base.server import start_server
from commission.app.editing.actions import SelectReflectors
from commission.app.launch import open_page
from commission.app.run.actions import Play, Seek, VirtualDrive
from commission.app.run.service import RunService
from commission.app.runtime import Runtime
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from tests.app.raw_client import RawClient
from tests.browser.page import CHROMIUM, FLAGS, WIDE, OpenPage

TIMES = 12
FIRST_S, BROWSER_S, SERVER_S = 3.0, 0.25, 0.1
WATCH = """(what) => {
  window.__answered = new Promise((done) => {
    let begun = 0;
    const begin = () => { begun ||= performance.now(); };
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, begin, { capture: true, once: true });
    const before = document.querySelector(what)?.innerText ?? "";
    const observer = new MutationObserver(() => {
      const now = document.querySelector(what)?.innerText ?? "";
      if (!begun || now === before || now === "") return;
      observer.disconnect();
      const said = performance.now() - begun;
      requestAnimationFrame(() => requestAnimationFrame(() => done([said, performance.now() - begun])));
    });
    observer.observe(document.body, { subtree: true, childList: true, characterData: true });
  });
}"""
"""Times the way from the next click or key until a text is another one, and until the second frame after that [ms]."""


class Ear:
    """Notes when a client that draws nothing has heard of something."""

    def __init__(self, client: RawClient) -> None:
        self._client, self._heard = client, list[tuple[float, bytes]]()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        with suppress(ConnectionClosed, TimeoutError):
            while True:
                bundle = self._client.hear()
                self._heard.append((time.perf_counter(), bundle))

    def since(self, begun: float, sought: bytes) -> float:
        """Time until the first message after a moment that holds some bytes [s]."""
        while time.perf_counter() < begun + 10.0:
            for at, bundle in tuple(self._heard):
                if at >= begun and sought in bundle:
                    return at - begun
            time.sleep(0.001)
        raise TimeoutError(f"nothing was heard of {sought!r}")


def of_server(runtime: Runtime, ear: Ear, number: int) -> tuple[list[float], list[float]]:
    """Times of selections and seeks [s], as a client hears of them."""
    selected: list[float] = []
    sought: list[float] = []
    for index, each in enumerate(runtime.state.project.reflectors.reflectors[:TIMES]):
        begun = time.perf_counter()
        runtime.post(Envelope(SelectReflectors((each.id,)), Sender(number)))
        selected.append(ear.since(begun, f"Reflector {each.id}<".encode()))
        time.sleep(0.3)
        begun = time.perf_counter()
        runtime.post(Envelope(Seek(3.0 + 2.0 * index), Sender(number)))
        sought.append(ear.since(begun, b"c-now"))
        time.sleep(0.3)
    return selected, sought


def of_browser(page: OpenPage, runtime: Runtime) -> tuple[np.ndarray, np.ndarray]:
    """(TIMES, 2) times of selections and of seeks [ms]: until it is said, until the picture after that."""
    selected: list[list[float]] = []
    sought: list[list[float]] = []
    for index, each in enumerate(runtime.state.project.reflectors.reflectors[:TIMES]):
        page.page.evaluate(WATCH, ".c-selected")
        page.click_at((each.x, each.y))
        selected.append(page.page.evaluate("window.__answered"))
        page.page.wait_for_timeout(500)
        page.page.evaluate(WATCH, ".c-now")
        canvas = page.page.locator(".c-plots-body canvas").first.bounding_box()
        assert canvas is not None
        page.page.mouse.click(canvas["x"] + 60.0 + 20.0 * index, canvas["y"] + 0.3 * canvas["height"])
        sought.append(page.page.evaluate("window.__answered"))
        page.page.wait_for_timeout(500)
    return np.array(selected), np.array(sought)


def main(site: str = "shop_floor") -> None:
    """Measure and print."""
    project = load_project(bundled_folder("maps") / site)
    server = start_server("127.0.0.1", 0)
    runtime = open_page(server, project, source=VirtualDrive(project.routes[0].name))
    while runtime.service(RunService).view() is None:
        time.sleep(0.1)
    runtime.post(Play(playing=False))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        firsts: list[float] = []
        for _ in range(3):
            page = OpenPage(browser, server, WIDE)
            begun = time.perf_counter()
            page.page.goto(page.address)
            page.page.wait_for_function(
                "() => '/floor/map' in (window.__viserMutable?.nodeRefFromName ?? {}) && "
                "window.__viserTestpoints.rendererInfo.render.frame > 2",
                polling=20,
            )
            firsts.append(time.perf_counter() - begun)
            page.wait_until_drawn(("/vehicle/outline",))
            page.close()
        page = OpenPage(browser, server, WIDE)
        page.open(nodes=("/floor/map", "/vehicle/outline"))
        page.page.wait_for_timeout(5000)
        selected, sought = of_browser(page, runtime)
        page.close()
        browser.close()
    client = RawClient(server)
    time.sleep(1.0)
    of = of_server(runtime, Ear(client), max(runtime.state.browsers))
    client.close()
    runtime.stop()
    server.stop()
    print(f"first picture: {', '.join(f'{each:.2f}' for each in firsts)} s (required: {FIRST_S:g} s, warm)")
    for what, there, here in (("selection", selected, of[0]), ("seek", sought, of[1])):
        said, drawn = np.median(there, axis=0)
        print(
            f"{what}: browser {said:.0f} ms until it is said, {drawn:.0f} ms until the picture after it "
            f"(longest {there[:, 0].max():.0f}, {there[:, 1].max():.0f}; required: {1e3 * BROWSER_S:.0f} ms); "
            f"server {1e3 * np.median(here):.0f} ms, longest {1e3 * max(here):.0f} (required: {1e3 * SERVER_S:.0f} ms)"
        )


if __name__ == "__main__":
    main(*sys.argv[1:2])
