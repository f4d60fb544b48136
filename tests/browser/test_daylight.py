"""The light theme as a person switches it: everything is light, it stays so, and nobody else is disturbed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commission.app.base.paints import Color, Floor
from tests.app.base.test_theme import contrast
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room()) as opened:
        yield opened


def share_of(picture: Path, color: Color) -> float:
    """Share of the pixels of a picture that have a color."""
    pixels = np.asarray(Image.open(picture).convert("RGB"), np.int64)
    return float((np.abs(pixels - np.array(color)).max(axis=2) <= 3).mean())


COLORS = """(button) => {
  const numbers = (color) => color.match(/[\\d.]+/g).map(Number);
  let ground = button;
  while (numbers(getComputedStyle(ground).backgroundColor)[3] === 0) ground = ground.parentElement;
  return [button, ground].map((each, index) =>
    numbers(getComputedStyle(each)[index ? 'backgroundColor' : 'color']).slice(0, 3));
}"""
"""Colors of a button's words and of what is behind them, as they are drawn."""


def switch(page: OpenPage, label: str) -> None:
    """Press the switch, and wait for the page to come back."""
    before = set(page.server.get_clients())
    page.page.get_by_label(label, exact=True).click()
    page.wait_for_client(before)
    page.wait_until_drawn(("/floor/map", "/vehicle/outline"))


def test_the_light_theme_is_light_all_over_and_stays_with_the_browser_that_chose_it(
    served: Served, window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    page, other = window(served.server, sharp=True), window(served.server)
    for each in (page, other):
        each.open(nodes=("/floor/map", "/vehicle/outline"))
    page.open_tab("Layers")
    switch(page, "Light theme")
    for visit in range(2):
        shot = tmp_path / f"light_{visit}.png"
        page.screenshot(shot)
        pixels = np.asarray(Image.open(shot).convert("L"), np.float64)
        assert np.median(pixels) > 225
        assert (pixels < 90).mean() < 0.12, "no panel, list or plot stays dark"
        for paint in (Floor.FREE, Floor.WALL, Floor.REFLECTOR):
            assert share_of(shot, paint.light) > 0.0, paint.meaning
        assert share_of(shot, Floor.FREE.dark) < 0.001
        assert page.page.get_by_role("tab", name="Layers").get_attribute("aria-selected") == "true"
        if visit == 0:
            before = set(served.server.get_clients())
            page.page.reload()
            page.wait_for_client(before)
            page.wait_until_drawn(("/floor/map", "/vehicle/outline"))
    page.open_tab("Run")
    for name in ("Step", "Fit", "Drive"):
        words, ground = page.page.get_by_role("button", name=name, exact=True).first.evaluate(COLORS)
        assert contrast(words, ground) >= 4.5, name
    other.screenshot(tmp_path / "other.png")
    assert share_of(tmp_path / "other.png", Floor.FREE.dark) > 0.05
    switch(page, "Dark theme")
    page.screenshot(tmp_path / "dark.png")
    assert share_of(tmp_path / "dark.png", Floor.FREE.dark) > 0.05
    assert page.errors == []
    assert other.errors == []
