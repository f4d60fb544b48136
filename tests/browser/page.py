"""The page as a person uses it: looked at and clicked in a real browser.

What is known here of viser's page (names of its windows' variables, classes of its widgets) is known nowhere else in
the tests.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import viser
from playwright.sync_api import Browser, BrowserContext, Locator, Page

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
)
FLAGS_OF_TESTS = (
    *FLAGS,
    # Smoothed edges cost a processor that draws without a graphics card up to three times as long.
    "--webgl-antialiasing-mode=none",
    # Pages of the browser's own that come with each window; the others are those that playwright leaves out.
    "--disable-features=WebUIOmniboxPopup,WebUIOmniboxAimPopup,WebUIOmniboxFullPopup,"
    "AimEnabled,AvoidCorsURLLoaderRestartOnRedirect,AvoidUnnecessaryBeforeUnloadCheckSync,"
    "DestroyProfileOnBrowserClose,HttpsFirstBalancedModeAutoEnable,HttpsUpgrades,LensOverlay,MediaRouter,"
    "NetworkTimeServiceQuerying,OptimizationHints,PaintHolding,PreconnectToSearch,ThirdPartyStoragePartitioning",
)
"""With what nobody looks at left out: pictures and benchmarks are drawn as they are for a person."""
WIDE = (1600, 900)
SMALL = (1280, 720)

_HIDE_TOAST = ".mantine-Notifications-root{display:none !important}"
"""Without a graphics card viser warns, in a box that covers the floor."""

_PIXEL_OF = """([x, y, z]) => {
  const viewer = window.__viserMutable;
  const [x0, y0] = window.commissionOrigin ?? [0, 0];
  const point = viewer.camera.position.clone().set(x - x0, y - y0, z);
  viewer.camera.updateMatrixWorld();
  point.applyMatrix4(viewer.nodeRefFromName[''].matrixWorld).project(viewer.camera);
  const box = viewer.canvas.getBoundingClientRect();
  return [box.left + (point.x + 1) / 2 * box.width, box.top + (1 - point.y) / 2 * box.height];
}"""

_IS_SETTLED = """() => {
  const viewer = window.__viserMutable, box = viewer.canvas.getBoundingClientRect();
  const names = Object.keys(viewer.nodeRefFromName), camera = viewer.camera;
  const now = [box.left, box.top, box.width, box.height, names.length, camera.fov,
               ...camera.position.toArray(), ...viewer.nodeRefFromName[''].matrixWorld.elements].join();
  if (window.__layout?.now !== now) window.__layout = {now, since: performance.now()};
  for (let element = viewer.canvas; element; element = element.parentElement)
    if (getComputedStyle(element).opacity < 1) return false;
  return performance.now() - window.__layout.since > 400;
}"""
"""Panels, styles and the camera's place arrive one by one, and the floor fades in: a click in between misses."""

_IS_STILL = """() => {
  const { camera, cameraControl } = window.__viserMutable;
  const now = camera.position.clone(), end = cameraControl.getPosition(now.clone(), true), at = now.toArray().join();
  if (window.__still?.at !== at) window.__still = {at, since: performance.now()};
  return now.distanceTo(end) < 1e-5 * now.length() && performance.now() - window.__still.since > 150;
}"""
"""A camera glides to where a wheel or a hand has sent it; on a busy computer it stands in between, too."""

_COLLECT_NOTES = """window.__notes = [];
new MutationObserver(() => {
  for (const note of document.querySelectorAll('.mantine-Notification-description'))
    if (!window.__notes.includes(note.textContent)) window.__notes.push(note.textContent);
}).observe(document, {subtree: true, childList: true, characterData: true});"""
"""Notes go by themselves after some seconds, and a busy machine looks later than that."""

_FRAME = "window.__viserTestpoints?.rendererInfo?.render?.frame ?? -1"

Button = Literal["left", "middle", "right"]


class OpenPage:
    """One browser window with the page in it.

    Parameters
    ----------
    browser : the running chromium.
    server : the server whose page is opened; None when the window shows something else.
    size : width and height of the window [pixels].
    resolution : pixels of the floor for each one of the window; None: as a person gets it, which viser lowers while the
        machine is busy.
    """

    def __init__(
        self,
        browser: Browser,
        server: viser.ViserServer,
        size: tuple[int, int] = WIDE,
        resolution: float | None = None,
    ) -> None:
        self.server = server
        self._resolution = resolution
        self._context: BrowserContext = browser.new_context(viewport={"width": size[0], "height": size[1]})
        self.page: Page = self._context.new_page()
        self.page.add_init_script(_COLLECT_NOTES)
        self.page.set_default_timeout(60_000)  # without a graphics card, on a busy machine: 2 frames a second
        self.errors: list[str] = []
        """What the browser complained about."""
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))

    @property
    def address(self) -> str:
        """Where the page is, with the slash at its end."""
        return f"http://127.0.0.1:{self.server.get_port()}/"

    def open(self, query: str = "", nodes: Sequence[str] = ()) -> viser.ClientHandle:
        """Open the page and wait until it is connected, has these scene nodes and has drawn them."""
        before = set(self.server.get_clients())
        if self._resolution is not None:
            query += f"{'&' if query else '?'}fixedDpr={self._resolution}"
        self.page.goto(self.address + query)
        client = self.wait_for_client(before)
        self.wait_until_drawn(nodes)
        return client

    def wait_for_client(self, before: set[int]) -> viser.ClientHandle:
        """The client that is connected now and was not before; viser numbers them anew at each connection."""
        for _ in range(1200):
            clients = self.server.get_clients()
            new = sorted(set(clients) - before)
            if new:
                return clients[new[-1]]
            self.page.wait_for_timeout(50)
        raise TimeoutError("no browser connected within a minute")

    def wait_until_drawn(self, nodes: Sequence[str] = ()) -> None:
        """Wait for these scene nodes and for a frame that is drawn after they came."""
        self.page.add_style_tag(content=_HIDE_TOAST)
        for name in ("", *nodes):
            self.page.wait_for_function("name => name in window.__viserMutable.nodeRefFromName", arg=name)
        self.page.wait_for_function(_IS_SETTLED, polling=50)
        frame = self.page.evaluate(_FRAME)
        self.page.evaluate("window.__viserMutable.requestRender()")
        self.page.wait_for_function(f"frame => ({_FRAME}) > frame", arg=frame)

    def wait_until_still(self) -> None:
        """Wait until the camera has come to where the wheel or a hand has sent it."""
        self.page.wait_for_function(_IS_STILL, polling=50)

    def forget_refusals(self) -> None:
        """Leave the field that is typed into, and take back what was said at the fields, for the next test to see."""
        self.page.keyboard.press("Escape")
        self.page.evaluate("document.querySelectorAll('[data-refused]').forEach(e => delete e.dataset.refused)")

    def pixel_of(self, point_map: Sequence[float]) -> tuple[float, float]:
        """Where a point of the scene is seen, from the window's upper left corner [pixels]."""
        x, y = self.page.evaluate(_PIXEL_OF, [*point_map, 0.0][:3])
        return float(x), float(y)

    def click_at(self, point_map: Sequence[float], button: Button = "left", modifier: str | None = None) -> None:
        """Click on a point of the scene, perhaps while a key ("Shift", "Control") is held."""
        if modifier is not None:
            self.page.keyboard.down(modifier)
        self.page.mouse.click(*self.pixel_of(point_map), button=button)
        if modifier is not None:
            self.page.keyboard.up(modifier)

    def click_until(self, point_map: Sequence[float], is_heard: Callable[[], bool]) -> None:
        """Click until the program has heard of it.

        The server knows of a tool before a busy browser does, which then takes the first click for none: a person
        clicks again.
        """
        for patience in (5.0, 10.0, 20.0, 40.0):
            self.click_at(point_map)
            end = time.monotonic() + patience
            while not is_heard() and time.monotonic() < end:
                time.sleep(0.02)
            if is_heard():
                return
        raise AssertionError(f"four clicks at {tuple(point_map)} were not heard of")

    def drag(self, start_map: Sequence[float], end_map: Sequence[float], button: Button = "left") -> None:
        """Drag from one point of the scene to another, in steps as a hand does."""
        end = self.pixel_of(end_map)
        self.page.mouse.move(*self.pixel_of(start_map))
        self.page.mouse.down(button=button)
        self.page.mouse.move(*end, steps=10)
        self.page.wait_for_timeout(100)  # the last place travels to the server at most every 50 ms
        self.page.mouse.up(button=button)

    def press(self, name: str) -> None:
        """Press the button of this name in a panel or a bar: those of the floor's card lead to them."""
        named = self.page.get_by_role("button", name=name, exact=True)
        named.and_(self.page.locator(":not([data-go])")).click()

    def open_tab(self, name: str) -> None:
        """Bring this tab of a panel to the front."""
        self.page.get_by_role("tab", name=name, exact=True).click()

    def fold(self, name: str) -> None:
        """Press the head of a folder: it opens, or closes."""
        whole = re.compile(rf"^{re.escape(name)}$")
        self.page.locator(".mantine-Paper-root").filter(has_text=whole, visible=True).first.click()

    def unfold(self, name: str, holds: str) -> None:
        """Open a folder unless it is open: then this text of it can be seen."""
        if not self.page.get_by_text(holds).first.is_visible():
            self.fold(name)
            self.wait_for_text(holds)

    def row(self, label: str) -> Locator:
        """The row of widgets behind the label that begins so."""
        begins = re.compile(rf"^\s*{re.escape(label)}")
        return self.page.locator("label", has_text=begins).locator("xpath=ancestor::*[contains(@class,'Flex-root')][1]")

    def fill(self, label: str, text: str) -> None:
        """Type into the input of this label and leave it."""
        field = self.row(label).locator("input").last
        field.fill(text)
        field.press("Tab")

    def choose(self, label: str, option: str) -> None:
        """Choose from the drop-down list of this label."""
        self.row(label).locator("input").first.click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def tick(self, label: str) -> None:
        """Change the check box of this label."""
        self.row(label).locator("input[type=checkbox]").click()

    def slide(self, label: str, fraction: float) -> None:
        """Click on the slider's track; keys on its thumb would turn the camera too."""
        track = self.row(label).locator(".mantine-Slider-track")
        box = track.bounding_box()
        assert box is not None, f"the slider {label} is not visible"
        self.page.mouse.click(box["x"] + fraction * box["width"], box["y"] + box["height"] / 2)

    def value_of(self, label: str) -> str:
        """What the input of this label shows."""
        return self.row(label).locator("input").last.input_value()

    def text(self) -> str:
        """All text that can be read on the page."""
        return self.page.locator("body").inner_text()

    def wait_for_text(self, text: str) -> None:
        """Wait until this can be read on the page."""
        self.page.get_by_text(text).first.wait_for(state="visible")

    def wait_until_told(self, text: str) -> None:
        """Wait until a note has said this, if only for some seconds; tests hide notes, which cover the floor."""
        self.page.wait_for_function("text => window.__notes.some(note => note.includes(text))", arg=text)

    def screenshot(self, path: Path) -> None:
        """Keep a picture of the window."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=path)

    def close(self) -> None:
        """Close the window and forget its cookies."""
        self._context.close()
