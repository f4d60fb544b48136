"""Time from a click in one browser until another one has the edit in its scene: two real browsers, one server.

Run as `python -m tests.benchmarks.bench_two_browsers`. It needs chromium and playwright. Both browsers and the server
share this machine and draw without a graphics card, which takes most of the time. So a third client listens that draws
nothing: when it hears of an edit the way over the server has been made, and what is left is the drawing.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import viser
from playwright.sync_api import sync_playwright
from websockets.exceptions import ConnectionClosed

from commission.app.base.server import start_server
from commission.app.editing.editor import editor_of
from commission.app.editing.site_tools import PlaceTool
from commission.app.launch import open_page
from commission.io.project_file import load_project, save_project
from tests.app.raw_client import RawClient
from tests.app.sites import room
from tests.browser.page import CHROMIUM, FLAGS, SMALL, OpenPage

EDITS, REQUIRED_S = 20, 0.5
FRAMES_IN_A_SECOND = """() => new Promise(done => {
  let frames = 0;
  const count = () => { frames += 1; requestAnimationFrame(count); };
  requestAnimationFrame(count);
  setTimeout(() => done(frames), 1000);
})"""


class Listener:
    """Notes when each bundle of messages came."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.client = RawClient(server)
        self._heard: list[tuple[float, bytes]] = []
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                bundle = self.client.hear()
                self._heard.append((time.perf_counter(), bundle))

    def heard_at(self, name: str) -> float:
        """Time at which the first message came that speaks of a name; it must have been sent."""
        while True:
            for at, bundle in tuple(self._heard):
                if name.encode() in bundle:
                    return at
            time.sleep(0.005)


def main() -> int:
    """Print the times and return 1 when one of them is longer than required."""
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        save_project(room(), Path(name))
        server = start_server("127.0.0.1", 0)
        runtime = open_page(server, load_project(Path(name)), folder=Path(name))
        browsers = [playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS)) for _ in range(2)]
        one, other = (OpenPage(browser, server, SMALL) for browser in browsers)
        client = one.open(nodes=("/floor/map",)).client_id
        other.open(nodes=("/floor/map",))
        one.press(PlaceTool().value)
        while editor_of(runtime.state, client).tool is not PlaceTool() or len(runtime.state.browsers) < 2:
            time.sleep(0.05)
        listener = Listener(server)
        to_server: list[float] = []
        to_listener: list[float] = []
        to_other: list[float] = []
        for number in range(EDITS):
            x, y = one.pixel_of((1.5 + 0.4 * number, 4.5))
            node = f"/reflector_names/{f'R{5 + number}'.encode().hex()}"
            begun = time.perf_counter()
            one.page.mouse.click(x, y)
            while len(runtime.state.project.reflectors) < 5 + number:
                time.sleep(0.001)
            to_server.append(time.perf_counter() - begun)
            other.page.wait_for_function(
                "name => name in window.__viserMutable.nodeRefFromName", arg=node, polling=5, timeout=10_000
            )
            to_other.append(time.perf_counter() - begun)
            to_listener.append(listener.heard_at(node) - begun - to_server[-1])
        frames = [page.page.evaluate(FRAMES_IN_A_SECOND) for page in (one, other)]
        listener.client.close()
        for browser in browsers:
            browser.close()
        runtime.stop()
        server.stop()
    for what, spent in (
        ("from a click in one browser to the server's project", to_server),
        ("from there to a client that draws nothing", to_listener),
        ("from the click to the other's scene", to_other),
    ):
        sys.stdout.write(f"{what}: median {1e3 * np.median(spent):.0f} ms, longest {1e3 * max(spent):.0f} ms\n")
    sys.stdout.write(f"frames per second of the two browsers: {frames[0]}, {frames[1]}\n")
    sys.stdout.write(f"required: {1e3 * REQUIRED_S:.0f} ms\n")
    return int(max(to_other) > REQUIRED_S)


if __name__ == "__main__":
    sys.exit(main())
