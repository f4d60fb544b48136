"""Files as a person finds them: a look into the server's folders, what was opened of late, a file that is dropped."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from commission.app.run.state import RunState
from commission.io.project_file import load_project, save_project
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

TABLE = "id;x;y;radius\nNew;2.5;2.5;0.04\n"
DROP = """([name, text]) => {
  const dropped = new DataTransfer();
  dropped.items.add(new File([text], name));
  for (const kind of ["dragover", "drop"])
    window.dispatchEvent(new DragEvent(kind, { dataTransfer: dropped, bubbles: true, cancelable: true }));
}"""


def drop(page: OpenPage, *paths: str) -> None:
    """Drop files and folders of the disk onto the floor, as a file manager does."""
    browser = page.page.context.new_cdp_session(page.page)
    for kind in ("dragEnter", "dragOver", "drop"):
        dragged = {"items": [], "files": list(paths), "dragOperationsMask": 1}
        browser.send("Input.dispatchDragEvent", {"type": kind, "x": 600, "y": 300, "data": dragged})
    browser.detach()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("served") / "hall"
    save_project(room(), folder)
    (folder / "drives" / "empty").mkdir(parents=True)
    (folder / "list.csv").write_text(TABLE)
    with standing_drive(load_project(folder), folder) as opened:
        yield opened


def test_files_are_found_by_looking_and_a_failed_open_changes_nothing(  # noqa: PLR0915 - one window for all
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server)
    page.open()
    page.open_tab("Run")
    source = served.state.part(RunState).source
    assert source is not None
    files = page.page.get_by_role("dialog", name="Files on the server")

    page.page.get_by_label("Browse for Folder").click()
    files.get_by_role("button", name="drives").click()
    files.get_by_role("button", name="empty").click()
    files.get_by_text("nothing in this folder").wait_for()
    files.get_by_role("button", name="Choose this folder").click()
    files.wait_for(state="hidden")
    chosen = str(served.state.folder / "drives" / "empty") if served.state.folder else ""
    assert page.value_of("Folder") == chosen
    page.press("Open")
    page.wait_until_told("empty")
    assert served.state.part(RunState).source == source
    assert f"route {source.route}" in page.text().replace("\n", " ")  # type: ignore[union-attr]

    before = set(served.server.get_clients())
    page.page.reload()
    page.wait_for_client(before)
    page.wait_until_drawn()
    page.page.get_by_label("Browse for Folder").click()
    files.get_by_text("Recent").wait_for()
    files.get_by_role("button", name=chosen).wait_for()
    page.page.keyboard.press("Escape")
    files.wait_for(state="hidden")

    project = served.state.project
    page.page.evaluate(DROP, ["dropped.csv", TABLE])
    page.wait_for_text("Nothing has changed yet")
    assert served.state.project is project, "shown before, not after"
    page.press("Cancel")
    # Until the button is back, another file is still being looked at.
    page.page.get_by_role("button", name="Upload a file").click(trial=True)
    # Folders and empty files hold nothing up; of two tables the second waits to be dropped again.
    folder = served.state.folder
    assert folder is not None
    (folder / "folder.csv").mkdir()
    (folder / "nothing.csv").touch()
    (folder / "more.csv").write_text(TABLE)
    drop(page, *(str(folder / name) for name in ("folder.csv", "nothing.csv", "list.csv", "more.csv")))
    page.wait_for_text("folder.csv is a folder: drop the files that are in it; nothing.csv is empty: 0 bytes")
    page.wait_for_text("more.csv was not taken: list.csv is being looked at")
    page.wait_for_text("Nothing has changed yet")
    page.press("Cancel")
    page.page.evaluate(DROP, ["odd.csv", "no table at all"])
    page.wait_until_told("odd.csv: ")
    page.page.evaluate(DROP, ["drive.mcap", "x"])
    page.wait_for_text("drive.mcap is a recording")
    page.page.evaluate(DROP, ["letter.docx", "x"])
    page.wait_for_text("letter.docx is neither a floor map")
    # A map goes before the image that it names, however they are dropped; another image is told.
    (folder / "floor.yaml").write_text("image: floor.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\n")
    (folder / "floor.pgm").write_bytes(b"P5\n40 30\n255\n" + bytes([254] * 1200))
    assert served.state.project is project
    (folder / "other.png").write_bytes(b"no image")
    drop(page, *(str(folder / name) for name in ("other.png", "floor.pgm", "floor.yaml")))
    page.wait_for_text("other.png was not taken: floor.yaml needs floor.pgm")
    page.wait_for_text("floor.yaml: 2.0 x 1.5 m, cells of 50 mm")
    assert served.state.project.floor_map is not None
    assert served.state.project.floor_map.cells.shape == (30, 40)
    assert page.errors == []
