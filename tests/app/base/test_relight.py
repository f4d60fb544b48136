"""The light theme: what a browser gets that asks for it, and that nobody else notices."""

from __future__ import annotations

import html
import io
from collections.abc import Callable

import numpy as np
import pytest
import viser
from PIL import Image

from commission.app.base import theme
from commission.app.base.paints import PAINTS, Floor, Run
from commission.app.base.ramp import colors
from commission.app.base.relight import light_array, light_color, light_message, light_picture, light_text, wants_light
from commission.app.base.server import PageServer, start_server
from tests.app.base.test_theme import contrast, luminance
from tests.app.raw_client import RawClient


def test_every_paint_gets_its_light_color_wherever_it_is_written() -> None:
    for paint in PAINTS.values():
        assert light_color(paint.dark) == paint.light
        assert light_array(np.array([paint.dark], np.uint8)).tolist() == [list(paint.light)]
        assert light_text(f"a{{color:{theme.css(paint.dark)}}}") == f"a{{color:{theme.css(paint.light)}}}"
    assert light_text("rgba(16,18,21,.8)") == "rgba({},{},{},.8)".format(*Floor.BACKGROUND.light)


def test_words_that_look_like_a_color_stay_as_they_are() -> None:
    from commission.app.base.panel import escaped

    name = f'{theme.css(Floor.REFLECTOR.dark)} <O\'Neill> & "co"'
    said = light_text(f"<b>{escaped(name)}</b>")
    assert said == f"<b>{escaped(name)}</b>"
    assert html.unescape(escaped(name)) == name
    assert not set(escaped(name)) & set("<>'\"")


@pytest.mark.parametrize("count", [6, 9, 16])
def test_a_ramp_keeps_its_order_and_is_seen_on_white(count: int) -> None:
    ramp = [light_color((int(r), int(g), int(b))) for r, g, b in colors(count)]
    brightness = [luminance(color) for color in ramp]
    assert brightness == sorted(brightness)
    assert contrast(ramp[-1], (255, 255, 255)) > 2.0


def test_a_picture_is_repainted_pixel_by_pixel_and_stays_as_opaque_as_it_was() -> None:
    pixels = np.array(
        [[(*Floor.FREE.dark, 255), (*Floor.WALL.dark, 255), (*Run.INLIER.dark, 90), (0, 0, 0, 0)]], np.uint8
    )
    encoded = io.BytesIO()
    Image.fromarray(pixels).save(encoded, "PNG")
    light = np.array(Image.open(io.BytesIO(light_picture(encoded.getvalue()))))
    assert [tuple(pixel[:3]) for pixel in light[0, :3]] == [Floor.FREE.light, Floor.WALL.light, Run.INLIER.light]
    assert light[0, :, 3].tolist() == [255, 255, 90, 0]


def test_a_message_is_copied_where_it_has_colors_and_is_itself_where_it_has_none() -> None:
    update = viser._messages.SceneNodeUpdateMessage
    message = update("/a", {"colors": np.array([Run.INLIER.dark], np.uint8), "thickness": 2.0})
    light = light_message(message)
    assert light.updates["colors"].tolist() == [list(Run.INLIER.light)]
    assert light.updates["thickness"] == 2.0
    assert message.updates["colors"].tolist() == [list(Run.INLIER.dark)]
    plain = update("/a", {"thickness": 2.0})
    assert light_message(plain) is plain


@pytest.mark.parametrize(
    ("cookies", "is_light"),
    [
        (None, False),
        ("", False),
        ("commission_theme=light", True),
        ("commission_8080=x; commission_theme=light", True),
        ("commission_theme=dark", False),
        ("commission_theme=lighter", False),
        ("other_commission_theme=light", False),
    ],
)
def test_the_cookie_says_which_theme_a_browser_has(cookies: str | None, is_light: bool) -> None:
    assert wants_light(cookies) is is_light


@pytest.fixture
def server() -> PageServer:
    return start_server(port=0)


def heard(client: RawClient, is_there: Callable[[str], bool]) -> str:
    """Everything that a browser was sent, until something is in it."""
    text = ""
    while not is_there(text):
        client.hear(timeout=20.0)
        text = str(client.heard)
    return text


def test_one_browser_is_light_while_another_stays_dark(server: PageServer) -> None:
    server.gui.configure_theme(dark_mode=True)
    server.gui.add_html(f"<i style='color:{theme.css(theme.REFLECTOR)}'>reflector</i>")
    server.scene.add_line_segments("/a", np.zeros((1, 2, 3)), colors=theme.GATE)
    server.gui.add_html("the end")
    try:
        for cookies, shown in (({"Cookie": "commission_theme=light"}, "light"), ({}, "dark"), ({}, "dark")):
            client = RawClient(server, headers=cookies)
            text = heard(client, lambda text: "the end" in text)
            client.close()
            assert f"color:{theme.css(getattr(Floor.REFLECTOR, shown))}" in text
            assert f"'dark_mode': {shown == 'dark'}" in text
    finally:
        server.stop()
