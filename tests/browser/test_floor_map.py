"""A floor map loaded, drawn on, placed and aligned as an engineer does it, from an empty folder, in a real browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commission.app.editing.tool import Tool
from commission.app.floor_map.align_tool import AlignTool, NamedPoint
from commission.app.floor_map.draft import MapLoading
from commission.app.floor_map.tools import WallTool
from commission.io.map_server import read_floor_map, write_floor_map
from commission.io.project_file import load_project, open_project
from commission.site.floor_map import OCCUPIED, FloorMap
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served

FLOOR = ("/floor/map",)


class NewSite(Served):
    """The page on a folder that does not exist yet."""

    def __init__(self, folder: Path) -> None:
        opened = open_project(folder)
        self.folder = folder
        super().__init__(opened.project, folder, is_new=opened.is_new)

    @property
    def floor_map(self) -> FloorMap:
        assert self.state.project.floor_map is not None
        return self.state.project.floor_map


@pytest.fixture
def site(tmp_path: Path) -> Iterator[NewSite]:
    opened = NewSite(tmp_path / "hall")
    yield opened
    opened.close()


def choose(site: NewSite, page: OpenPage, client: int, tool: Tool) -> None:
    page.press(tool.name)
    site.until(lambda: site.editor(client).tool == tool)


def known(site: NewSite, client: int) -> tuple[NamedPoint, ...]:
    """Return the points to align by."""
    tool = site.editor(client).tool
    return tool.known if isinstance(tool, AlignTool) else ()


def click(site: NewSite, page: OpenPage, client: int, place: tuple[float, float], points: Callable[[], int]) -> None:
    """Click and wait until one point more has arrived: clicks in quick succession would be a double click."""
    before = points()
    page.click_until(place, lambda: points() > before)


def upload(page: OpenPage, *paths: Path) -> None:
    """Choose files for the upload button, one after the other."""
    for path in paths:
        with page.page.expect_file_chooser() as chooser:
            page.press("Upload a map")
        chooser.value.set_files(path)


def test_a_real_map_is_loaded_into_an_empty_folder_drawn_on_saved_and_read_again(
    site: NewSite, window: Callable[..., OpenPage], shared_data: Path
) -> None:
    page = window(site.server)
    client = page.open().client_id
    source = shared_data / "maps" / "utexas_gdc_3" / "3.yaml"
    page.fill("Map file", str(source))
    page.press("Open")
    site.until(lambda: site.state.project.floor_map is not None)
    loaded = site.state.project
    assert loaded.floor_map == read_floor_map(source)
    page.wait_until_drawn(FLOOR)
    # All of it is in view: 93 x 63 m from (-60.45, -23.4) on.
    x, y = page.pixel_of((-60.45, 39.35))
    assert 290 < x < 1320 and 44 < y < 660
    page.press("Undo load floor map 3.yaml")
    site.until(lambda: site.state.project.floor_map is None)
    page.press("Redo load floor map 3.yaml")
    site.until(lambda: site.state.project is loaded)
    page.wait_until_drawn(FLOOR)
    choose(site, page, client, WallTool())
    for place in ((-10.0, 10.0), (0.0, 15.0), (6.0, 15.0)):
        click(site, page, client, place, lambda: len(site.editor(client).points))
    page.page.keyboard.press("Enter")
    site.until(lambda: site.state.undo[-1].name == "draw wall")
    assert site.floor_map.occupancy().is_occupied([(-5.0, 12.5), (3.0, 15.0)]).all()
    page.press("Save")
    # The page says "unsaved" until then.
    site.until(lambda: site.state.saved is site.state.project)
    page.wait_for_text("saved ")
    assert load_project(site.folder) == site.state.project
    assert page.errors == []
    assert site.state.faults == ()


def test_a_map_and_its_image_are_uploaded_and_hostile_files_are_one_line(
    site: NewSite, window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    page = window(site.server)
    page.open()
    floor_map = room().floor_map
    assert floor_map is not None
    write_floor_map(floor_map, tmp_path / "room.yaml")
    upload(page, tmp_path / "room.yaml")
    page.wait_for_text("needs its image: upload")
    upload(page, tmp_path / "room.png")
    site.until(lambda: site.state.project.floor_map == floor_map)
    loaded = site.state.project
    (tmp_path / "plan.dxf").write_text(
        "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n<img src=x onerror=document.title='read'>\n10\n0\n20\n0\n11\n9\n21\n5\n"
        "0\nENDSEC\n0\nEOF\n"
    )
    upload(page, tmp_path / "plan.dxf")
    page.wait_for_text("<img src=x onerror=docume")
    page.press("Discard")
    (tmp_path / "hall.stl").write_bytes(b"solid")
    upload(page, tmp_path / "hall.stl")
    page.wait_for_text("hall.stl: ")
    assert page.page.title() != "read"
    assert page.page.locator("img[src=x]").count() == 0
    assert site.state.project is loaded
    assert page.errors == []


def test_an_image_is_placed_by_clicks_and_the_map_moved_onto_the_plants_coordinates(
    site: NewSite, window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    pixels = np.full((300, 400), 255, np.uint8)
    pixels[:4], pixels[-4:], pixels[:, :4], pixels[:, -4:] = 0, 0, 0, 0
    Image.fromarray(pixels).save(tmp_path / "plan.png")
    page = window(site.server)
    client = page.open().client_id
    upload(page, tmp_path / "plan.png")
    site.until(lambda: site.state.part(MapLoading).draft is not None)
    page.wait_until_drawn(("/draft/image",))
    draft = site.state.part(MapLoading).draft
    assert draft is not None

    def clicked() -> int:
        return 0 if site.state.part(MapLoading).draft is None else len(site.state.part(MapLoading).draft.pixels)

    for pixel in ((50.0, 150.0), (350.0, 150.0)):
        click(site, page, client, draft.stage.place_of(pixel), clicked)
    page.fill("A to B [m]", "30")
    site.until(
        lambda: (
            site.state.part(MapLoading).draft is not None and site.state.part(MapLoading).draft.options.distance == 30.0
        )
    )
    page.press("Load as the floor map")
    site.until(lambda: site.state.project.floor_map is not None)
    # A click is good for a pixel or two of the screen, which shows 400 pixels of the image on 900 of its own.
    assert site.floor_map.resolution == pytest.approx(0.1, rel=0.01)
    assert (site.floor_map.cells == OCCUPIED).sum() == (pixels == 0).sum()
    page.wait_until_drawn(FLOOR)
    choose(site, page, client, AlignTool())
    for place in ((0.0, 0.0), (20.0, 0.0)):
        click(site, page, client, place, lambda: len(known(site, client)))
    points = known(site, client)
    origin = site.floor_map.origin
    distance = points[1].at[0] - points[0].at[0]
    for label, place in (("A x, y [m]", (100.0, 50.0)), ("B x, y [m]", (100.0, 50.0 + distance))):
        for field, value in zip(page.row(label).locator("input").all(), place, strict=True):
            field.fill(f"{value:.3f}")
            field.press("Tab")
    plants = ((100.0, 50.0), (100.0, round(50.0 + distance, 3)))
    site.until(lambda: tuple(p.plant for p in known(site, client)) == plants)
    page.press("Move and turn")
    site.until(lambda: site.state.undo[-1].name == "align to A and B")
    (x, y), (dx, dy) = points[0].at, (origin[0] - points[0].at[0], origin[1] - points[0].at[1])
    # A quarter turn about A, but for what the two clicks differ in y.
    tilt = np.arctan2(points[1].at[1] - y, points[1].at[0] - x)
    turn = np.pi / 2 - tilt
    expected = (100.0 + np.cos(turn) * dx - np.sin(turn) * dy, 50.0 + np.sin(turn) * dx + np.cos(turn) * dy)
    np.testing.assert_allclose(site.floor_map.origin[:2], expected, atol=0.01)
    page.wait_until_drawn(FLOOR)
    assert page.errors == []
    assert site.state.faults == ()
