"""Files that come into the page and go out of it in a real browser; what strangers wrote in them stays text."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from commission.io.imports import SIZE_LIMIT, read_import
from commission.io.project_file import load_project, save_project
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served

NODES = ("/floor/map", "/reflectors/marks", "/editing/handle")
IMAGE, SCRIPT = "<img src=x onerror='window.__pwned=1'>", "<script>window.__pwned=2</script>"
TABLE = f"id;x;y;radius;layer;note\nR1;0,25;2,1;0,04;;{SCRIPT}\n{IMAGE};6;4;0,04;{SCRIPT};{IMAGE}\n"
LAYOUT: dict[str, Any] = {
    "metaInformation": {},
    "layouts": [
        {
            "layoutId": SCRIPT,
            "nodes": [{"nodeId": f"{IMAGE}{i}", "nodePosition": {"x": 2.0 + 3.0 * i, "y": 5.0}} for i in range(2)],
            "edges": [
                {
                    "edgeId": f"{IMAGE}edge",
                    "startNodeId": f"{IMAGE}0",
                    "endNodeId": f"{IMAGE}1",
                    "vehicleTypeEdgeProperties": [{"vehicleTypeId": kind, "maxSpeed": SCRIPT} for kind in (IMAGE, "V")],
                }
            ],
            "stations": [{"stationId": f"{SCRIPT}dock", "interactionNodeIds": [f"{IMAGE}1", f"{SCRIPT}absent"]}],
        }
    ],
}


class OpenSite(Served):
    """A served project in a folder; nothing drives."""

    def __init__(self, folder: Path) -> None:
        save_project(room(), folder)
        super().__init__(load_project(folder), folder)

    @property
    def ids(self) -> list[str]:
        return [r.id for r in self.state.project.reflectors.reflectors]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OpenSite]:
    opened = OpenSite(tmp_path_factory.mktemp("site"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def page(site: OpenSite, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests, which leave the site as it was."""
    opened = lasting_window(site.server)
    opened.open(nodes=NODES)
    return opened


@pytest.fixture
def exchange(page: OpenPage) -> OpenPage:
    """The window with the folder in which files come and go."""
    page.open_tab("Site")
    page.unfold("Exchange", "At most 32 MB")
    return page


def upload(page: OpenPage, name: str, content: bytes) -> None:
    page.page.locator("input[type=file][accept*='.csv']").set_input_files(
        files=[{"name": name, "mimeType": "text/plain", "buffer": content}]
    )


def assert_harmless(page: OpenPage) -> None:
    """Nothing of what the files hold has become an element, a script that ran, or an error."""
    assert page.page.evaluate("window.__pwned") is None
    assert page.page.locator("img[src='x'], [onerror]").count() == 0
    scripts = page.page.evaluate("[...document.scripts].filter(s => s.textContent.includes('__pwned')).length")
    assert scripts == 0
    assert page.errors == []


def test_names_of_strangers_are_shown_as_text_wherever_they_appear(site: OpenSite, exchange: OpenPage) -> None:
    page, (client,) = exchange, site.server.get_clients()
    dialogs: list[str] = []
    page.page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    before = site.state.project
    upload(page, f"{IMAGE}.csv", TABLE.encode())
    page.wait_for_text("Nothing has changed yet")
    page.wait_for_text("1 added, 1 changed, 3 not in the file, 0 as before")
    page.wait_for_text(f"note (none) → {SCRIPT}")
    assert_harmless(page)
    assert site.state.project is before
    page.press("Accept")
    site.until(lambda: IMAGE in site.ids)
    assert site.state.project.reflectors.reflectors[-1].note == IMAGE
    page.open_tab("Reflectors")
    page.page.locator(".c-data:visible tr", has_text=IMAGE).first.click()
    site.until(lambda: site.editor(client).selected == (IMAGE,))
    page.open_tab("Selection")
    page.wait_for_text(f"Reflector {IMAGE}")
    assert page.value_of("Note") == IMAGE
    upload(page, "layout.lif", json.dumps(LAYOUT).encode())
    page.wait_for_text("Routes: 1 added")
    page.wait_for_text("Stations: 1 added")
    page.wait_for_text(f"{IMAGE}edge")
    assert_harmless(page)
    page.press("Accept")
    site.until(lambda: len(site.state.project.routes) == 2)
    assert site.state.project.routes[-1].name == f"{IMAGE}edge"
    page.open_tab("Problems")
    page.wait_for_text(f"{IMAGE}edge")
    assert_harmless(page)
    page.press("Undo import layout.lif")
    site.until(lambda: len(site.state.project.routes) == 1)
    page.page.keyboard.press("Control+z")
    site.until(lambda: site.state.project is before)
    assert_harmless(page)
    assert dialogs == []


def test_upload_over_the_limit_is_refused_with_its_size_and_the_page_lives_on(
    site: OpenSite, exchange: OpenPage, tmp_path: Path
) -> None:
    page, done = exchange, site.state.undo
    large = tmp_path / "large.csv"
    with large.open("wb") as file:
        file.truncate(SIZE_LIMIT + 1_000_000)
    page.page.locator("input[type=file][accept*='.csv']").set_input_files(large)
    page.wait_for_text("the file has 33 MB (33,000,000 bytes); expected at most 32 MB")
    upload(page, "hall.csv", b"id,x,y,radius\nN,6,4,0.04\n")
    page.wait_for_text("1 added, 0 changed, 4 not in the file")
    page.tick("Remove others")
    page.wait_for_text("4 removed")
    page.press("Cancel")
    page.page.get_by_role("button", name="Accept", exact=True).wait_for(state="detached")
    assert site.state.undo == done
    assert page.errors == []


def test_pasted_cells_and_downloaded_files_make_the_round_trip(site: OpenSite, exchange: OpenPage) -> None:
    page, done = exchange, len(site.state.undo)
    page.row("Paste a table").locator("textarea").fill("Nr\tX [mm]\tY [mm]\nR1\t250,0\t2100\nN\t6000\t4000")
    page.press("Read pasted")
    page.wait_for_text("R1: y 2.000 → 2.100 m, moves 100 mm")
    page.press("Accept")
    site.until(lambda: site.ids[-1] == "N")
    page.page.get_by_role("button", name="Accept", exact=True).wait_for(state="detached")
    for button, name in ((".imk", "Room.imk"), ("CSV", "Room_reflectors.csv"), ("LIF", "Room.lif")):
        with page.page.expect_download() as download:
            page.press(button)
            page.wait_for_text(name)  # was sent, or does not hold all
        assert download.value.suggested_filename == name
        content = Path(download.value.path()).read_bytes()
        assert read_import(name, content) is not None
        if name.endswith(".csv"):
            upload(page, name, content)
            page.wait_for_text("0 added, 0 changed, 0 not in the file, 5 as before")
            page.press("Accept")
            page.page.get_by_role("button", name="Accept", exact=True).wait_for(state="detached")
    page.wait_for_text("Room.lif does not hold all:")
    page.wait_for_text("5 reflectors are not carried: LIF knows no localization")
    assert len(site.state.undo) == done + 1
    assert page.errors == []
