"""The site edited as an engineer does it: with the mouse on the floor, keys and buttons, in a real browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from commission.app.editing.site_tools import MeasureTool, PlaceTool
from commission.app.editing.tool import Tool
from commission.io.project_file import load_project, save_project
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served

NODES = ("/floor/map", "/reflectors/marks", "/editing/handle")
WALL, RADIUS = 0.15, 0.04


class OpenSite(Served):
    """A served project in a folder; nothing drives."""

    def __init__(self, folder: Path) -> None:
        save_project(room(), folder)
        self.folder = folder
        super().__init__(load_project(folder), folder)

    @property
    def centers(self) -> np.ndarray:
        return self.state.project.reflectors.centers


@pytest.fixture
def site(tmp_path: Path) -> Iterator[OpenSite]:
    opened = OpenSite(tmp_path)
    yield opened
    opened.close()


def choose(site: OpenSite, page: OpenPage, client: int, tool: Tool | None) -> None:
    page.press("Select" if tool is None else tool.name)
    site.until(lambda: site.editor(client).tool == tool)


def test_reflectors_are_placed_dragged_undone_redone_and_saved(
    site: OpenSite, window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    page = window(site.server)
    client = page.open(nodes=NODES).client_id
    choose(site, page, client, PlaceTool())
    page.click_until((4.0, 0.3), lambda: len(site.centers) == 5)
    page.click_until((8.0, 7.6), lambda: len(site.centers) == 6)
    # Both touch the wall that they were clicked near to; a click is good for a pixel or two.
    np.testing.assert_allclose(site.centers[4:, 1], [WALL + RADIUS, 8.0 - WALL - RADIUS], atol=1e-9)
    np.testing.assert_allclose(site.centers[4:, 0], [4.0, 8.0], atol=0.05)
    choose(site, page, client, None)
    placed = site.state.project
    page.drag(site.centers[5], (6.0, 5.0))
    site.until(lambda: site.state.project is not placed)
    np.testing.assert_allclose(site.centers[5], (6.0, 5.0), atol=0.06)
    moved = site.state.project
    page.wait_for_text("Undo move R6")
    page.press("Undo move R6")
    site.until(lambda: site.state.project is placed)
    page.press("Redo move R6")
    site.until(lambda: site.state.project is moved)
    page.page.keyboard.press("Control+z")
    site.until(lambda: site.state.project is placed)
    page.page.keyboard.press("Control+Shift+z")
    site.until(lambda: site.state.project is moved)
    page.wait_for_text("unsaved")
    page.press("Save")
    # The page says "unsaved" until then.
    site.until(lambda: site.state.saved is site.state.project)
    page.wait_for_text("saved ")
    # Files hold tenths of a millimetre: what is saved again from them is the same to the last digit.
    save_project(moved, tmp_path / "again")
    assert load_project(site.folder) == load_project(tmp_path / "again")
    assert page.errors == []
    assert site.state.faults == ()


@pytest.mark.with_all_seeds
def test_typed_values_change_a_reflector_and_another_browser_sees_it(
    site: OpenSite, window: Callable[..., OpenPage]
) -> None:
    page, other = window(site.server), window(site.server)
    client = page.open(nodes=NODES).client_id
    theirs = other.open(nodes=NODES).client_id
    page.click_at(site.centers[0])
    site.until(lambda: site.editor(client).selected == ("R1",))
    assert site.editor(theirs).selected == ()
    page.fill("Radius [mm]", "35")
    site.until(lambda: site.state.project.reflectors.radii[0] == 0.035)
    other.wait_for_text("Undo set radius of R1")
    page.click_at((6.0, 6.5))
    site.until(lambda: site.editor(client).selected == ())
    choose(site, page, client, MeasureTool())
    page.page.keyboard.press("Escape")
    site.until(lambda: site.editor(client).tool is None)
