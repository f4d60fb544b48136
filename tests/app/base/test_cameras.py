"""The plan that a browser opens with: the whole site, however late its panels come and however busy its computer is."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator

import pytest
import viser

from commission.app.base import cameras
from commission.app.base.cameras import PLAN_FOV, Cameras
from commission.app.base.extent import Extent
from commission.app.base.map_scene import SceneOrigin
from commission.app.base.server import start_server
from tests.app.raw_client import CAMERA, RawClient

EXTENT = Extent((0.0, 0.0), (24.0, 13.0))
WIDE, FLAT, FINAL = (1600, 900), (956, 363), (956, 608)
"""Shapes of the floor while the panels come, as a browser reported them [pixels]."""


class Window:
    """What a browser does with its camera: it shows what it has been told so far, and reports that."""

    def __init__(self, server: viser.ViserServer, begins_at: tuple[float, float, float], views: Cameras) -> None:
        self.views = views
        self.at = begins_at
        self._taken = 0
        self.raw = RawClient(server, is_silent=True)

    def report(self, shape: tuple[int, int]) -> None:
        """Say where the camera is, on a floor of this shape."""
        below = (*self.at[:2], 0.0)
        width, height = shape
        facing = {"position": self.at, "look_at": below, "wxyz": tuple(map(float, cameras.STRAIGHT_DOWN))}
        size = {"image_width": width, "image_height": height, "fov": PLAN_FOV}
        self.raw.send(type="ViewerCameraMessage", **{**CAMERA, **facing, **size})

    def apply(self, seconds: float = 0.15) -> None:
        """Take every camera that has been sent since."""
        self.raw.hear_all(seconds)
        for message in self.raw.heard[self._taken :]:
            if message["type"] == "SetCameraPositionMessage" and not message.get("initial"):
                self.at = tuple(message["position"])
        self._taken = len(self.raw.heard)

    def show(self, shape: tuple[int, int]) -> None:
        """Report and take what comes, until nothing comes any more."""
        for _ in range(3):
            self.report(shape)
            self.apply()

    def sees_all(self, shape: tuple[int, int]) -> bool:
        """Whether the whole site is in view, and fills it."""
        height = self.at[2] * PLAN_FOV
        seen = min(height / 13.0, height * shape[0] / shape[1] / 24.0)
        return self.at[:2] == (12.0, 6.5) and 1.0 <= seen < 1.1


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


@pytest.fixture
def window(server: viser.ViserServer) -> Iterator[Window]:
    views = Cameras(server, (), EXTENT, SceneOrigin())
    server.on_client_connect(views.connected)
    opened = Window(server, (3.0, 2.0, 400.0), views)
    yield opened
    opened.raw.close()


def test_what_comes_last_for_a_shape_that_is_gone_does_not_stay(window: Window) -> None:
    window.show(FINAL)
    assert window.sees_all(FINAL)
    window.report(FLAT)  # the panel of the plots is higher for a moment
    window.raw.hear_until(lambda message: message["type"] == "SetCameraPositionMessage")
    window.report(FINAL)  # and the camera for that shape has not been taken yet
    window.apply()
    assert not window.sees_all(FINAL)
    window.show(FINAL)
    assert window.sees_all(FINAL)


def test_a_report_that_comes_while_the_plan_is_fitted_does_not_leave_it_in_another_shape(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[bool] = []
    height = cameras._visible_height

    def slowly(extent: Extent, aspect: float) -> float:
        if not heard:
            heard.append(True)
            window.report(FINAL)  # the owner thread of a busy computer is interrupted here
            time.sleep(0.3)
        return height(extent, aspect)

    monkeypatch.setattr(cameras, "_visible_height", slowly)
    window.report(WIDE)
    window.apply(0.6)
    window.show(FINAL)
    assert window.sees_all(FINAL)


def test_a_browser_that_goes_back_to_the_camera_that_it_began_with_sees_the_whole_site(window: Window) -> None:
    first = window.at
    window.show(WIDE)
    assert window.sees_all(WIDE)
    for seconds in (5.0, 20.0):
        for own in window.views._views.values():
            own.came_at = time.monotonic() - seconds
        window.at = first
        window.show(FINAL)
        assert window.sees_all(FINAL), f"{seconds} s after it came"


def test_a_map_that_is_taken_back_and_loaded_again_moves_no_camera(window: Window) -> None:
    window.show(FINAL)
    window.views.refurnish(frozenset(), Extent((0.0, 0.0), (5.0, 5.0)), frozenset())
    window.show(FINAL)
    window.views.refurnish(frozenset(), EXTENT, frozenset())
    window.apply()
    assert window.sees_all(FINAL)


def test_who_moves_the_floor_of_a_page_that_builds_up_keeps_what_was_moved_to(window: Window) -> None:
    window.show(FINAL)
    told = next(m["source"] for m in window.raw.heard if "commissionMoved = " in m.get("source", ""))
    window.raw.send(type="GuiUpdateMessage", uuid=re.findall(r'Moved = "([^"]+)"', told)[0], updates={"value": True})
    window.raw.hear_until(lambda message: "commissionStands = true" in message.get("source", ""))
    window.at = (5.0, 5.0, 300.0)
    window.show(FINAL)
    assert window.at == (5.0, 5.0, 300.0)
    said = [m["source"] for m in window.raw.heard if "commissionWhole = " in m.get("source", "")]
    assert [each.rpartition(" ")[2] for each in said] == ["false", "true", "false"], "a reload brings back this place"


def test_a_plan_that_stands_keeps_the_whole_site_in_view_when_its_shape_changes_and_what_was_zoomed_to(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    window.show(WIDE)
    monkeypatch.setattr(cameras, "BUILDS_UP", 0.0)
    window.show(FINAL)
    assert window.sees_all(FINAL)
    window.at = (5.0, 5.0, 300.0)
    window.show(WIDE)
    assert window.at == (5.0, 5.0, 300.0)
