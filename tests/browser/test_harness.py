"""The browser's tools and the server's gate, on a small page of their own: what fails here is not the application."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
import pytest
import viser
from PIL import Image

from commission.app.base.server import start_server
from tests.browser.page import SMALL, WIDE, OpenPage

Window = Callable[..., OpenPage]

OPEN_WEBSOCKET = """([port, version]) => new Promise(resolve => {
  const socket = new WebSocket(`ws://127.0.0.1:${port}/`, `viser-v${version}`);
  socket.onmessage = () => resolve("was told the scene");
  socket.onerror = () => resolve("refused");
})"""

FIELD_OF_VIEW = 0.02
HEIGHT = 10.0 / FIELD_OF_VIEW  # 10 m are seen from top to bottom


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    """A page with a floor seen from above and one widget of each kind."""
    server = start_server("127.0.0.1", 0, None)
    server.gui.configure_theme(dark_mode=True)
    camera = server.initial_camera
    camera.position, camera.look_at, camera.up = (2.0, 1.0, HEIGHT), (2.0, 1.0, 0.0), (0.0, 1.0, 0.0)
    camera.fov, camera.near, camera.far = FIELD_OF_VIEW, 10.0, 2.0 * HEIGHT
    server.scene.add_image("/floor", np.full((2, 2, 3), 255, np.uint8), 4.0, 4.0, position=(2.0, 1.0, 0.0))
    yield server
    server.stop()


def seen(queue: SimpleQueue[object], window: OpenPage) -> object:
    """Next thing that the server was told, while the browser goes on."""
    for _ in range(800):
        try:
            return queue.get_nowait()
        except Empty:
            window.page.wait_for_timeout(25)
    raise TimeoutError("the server was told nothing within 20 s")


@pytest.mark.parametrize("size", [WIDE, SMALL])
def test_a_point_of_the_floor_is_drawn_where_the_harness_says(
    server: viser.ViserServer, window: Window, size: tuple[int, int], tmp_path: Path
) -> None:
    page = window(server, size, sharp=True)
    page.open(nodes=["/floor"])
    page.screenshot(tmp_path / "page.png")
    picture = np.asarray(Image.open(tmp_path / "page.png").convert("L"))
    assert picture.shape == size[::-1]
    for x, y, is_floor in ((0.1, -0.9, True), (3.9, 2.9, True), (-0.1, 1.0, False), (2.0, -1.1, False)):
        column, row = page.pixel_of((x, y))
        assert (picture[round(row), round(column)] > 128) == is_floor
    assert page.errors == []


@pytest.mark.with_all_seeds
def test_a_click_arrives_at_the_point_that_was_meant(server: viser.ViserServer, window: Window) -> None:
    clicks: SimpleQueue[object] = SimpleQueue()

    @server.scene.on_click()
    def keep_place(event: viser.SceneClickEvent) -> None:
        origin, direction = np.asarray(event.ray_origin), np.asarray(event.ray_direction)
        clicks.put(origin - direction * origin[2] / direction[2])

    page = window(server)
    page.open(nodes=["/floor"])
    page.click_at((0.7, 1.9))
    # A pixel is 11 mm wide here, and the browser reports whole ones.
    np.testing.assert_allclose(seen(clicks, page), (0.7, 1.9, 0.0), atol=0.02)


@pytest.mark.with_all_seeds
def test_each_kind_of_widget_can_be_used(server: viser.ViserServer, window: Window) -> None:
    told: SimpleQueue[object] = SimpleQueue()
    gui = server.gui
    panel = gui.add_panel()
    with panel.add_tab("First"):
        gui.add_button("Run").on_click(lambda _: told.put("run"))
        for widget in (
            gui.add_number("Radius [mm]", 30.0, step=0.1),
            gui.add_text("Name", ""),
            gui.add_slider("Time [s]", 0.0, 100.0, 1.0, 0.0),
            gui.add_checkbox("Scan", False),
            gui.add_dropdown("Kind", ("cylinder", "flat")),
        ):
            widget.on_update(lambda event: told.put(event.target.value))
    with panel.add_tab("Second"):
        gui.add_html("<b>behind the tab</b>")
    panel.dock_left()

    page = window(server)
    page.open()
    page.press("Run")
    assert seen(told, page) == "run"
    page.tick("Scan")
    assert seen(told, page) is True
    page.choose("Kind", "flat")
    assert seen(told, page) == "flat"
    page.slide("Time [s]", 0.5)
    assert seen(told, page) == pytest.approx(50.0, abs=2.0)  # the track is some 100 pixels wide
    page.fill("Radius [mm]", "31.5")
    while (value := seen(told, page)) != 31.5:  # each key is told
        assert isinstance(value, float)
    assert page.value_of("Radius [mm]") == "31.5"
    assert "behind the tab" not in page.text()
    page.open_tab("Second")
    page.wait_for_text("behind the tab")


def test_a_browser_without_the_token_sees_nothing_and_with_it_everything(window: Window) -> None:
    server = start_server("127.0.0.1", 0, "open sesame please")
    try:
        page = window(server)
        refused = page.page.goto(page.address)
        assert refused is not None
        assert refused.status == 401
        assert "?token=" in page.text()
        refused = page.page.goto(page.address + "?token=wrong")
        assert refused is not None
        assert refused.status == 401
        assert server.get_clients() == {}

        page.open("?token=open%20sesame%20please")
        assert page.page.url == page.address  # the secret does not stay in the address bar
        assert page.page.evaluate("document.cookie") == ""  # nor can a script read what stands for it
        page.open()  # and the cookie lasts
        stranger = window(server)
        refused = stranger.page.goto(stranger.address)
        assert refused is not None
        assert refused.status == 401
    finally:
        server.stop()


def test_a_page_of_another_origin_can_neither_open_the_websocket_nor_frame_the_page(
    server: viser.ViserServer, window: Window
) -> None:
    other = start_server("127.0.0.1", 0, None)
    try:
        page = window(other)
        page.open()
        assert page.page.evaluate(OPEN_WEBSOCKET, [other.get_port(), viser.__version__]) == "was told the scene"
        assert page.page.evaluate(OPEN_WEBSOCKET, [server.get_port(), viser.__version__]) == "refused"
        page.page.evaluate(
            """address => new Promise(resolve => {
              const frame = document.createElement("iframe");
              frame.onload = resolve;
              frame.src = address;
              document.body.append(frame);
            })""",
            f"http://127.0.0.1:{server.get_port()}/",
        )
        assert [frame.url for frame in page.page.frames][1:] == ["chrome-error://chromewebdata/"]
        assert server.get_clients() == {}
    finally:
        other.stop()


def test_the_share_tunnel_stays_shut_when_a_page_asks_for_it(
    server: viser.ViserServer, window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[object] = []
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *args: opened.append(args))
    asked: SimpleQueue[object] = SimpleQueue()
    answer = server.request_share_url

    def request_share_url() -> None:
        asked.put(answer())

    monkeypatch.setattr(server, "request_share_url", request_share_url)
    page = window(server)
    page.open()
    page.page.evaluate("window.__viserMutable.sendMessage({type: 'ShareUrlRequest'})")
    # The seam refuses it: the server itself is not even asked, however long one waits.
    page.page.wait_for_timeout(2000.0)
    assert asked.empty()
    assert opened == []
