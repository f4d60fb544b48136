"""Looking for files on the server: what is listed, and that nobody sees what is not shared."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from commission.app.base.actions import PROGRAM, Sender
from commission.app.base.reach import EVERYWHERE, Reach
from commission.app.base.state import AppState
from commission.app.project.browse_panel import asked, told
from commission.app.project.browse_service import looked
from commission.app.project.browsing import Browse, Browsed, Browsing
from commission.io import folder_listing
from commission.site.project import Project
from tests.app.asking import ME, OTHER, after, joined

GUEST = Sender(3)


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """A shared folder with a link out of it, beside a secret."""
    folder = tmp_path / "hall"
    (folder / "drives" / "first").mkdir(parents=True)
    (folder / "Map.yaml").write_text("resolution: 0.05")
    (folder / "b.csv").write_text("x" * 1234)
    (folder / ".hidden").write_text("")
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "passwd").write_text("root")
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "gone").symlink_to(tmp_path / "nowhere")
    return folder


def names(found: Browsed) -> list[str]:
    assert found.listing is not None, found.problem
    return [entry.name for entry in found.listing.entries]


def test_folders_come_first_and_files_say_their_size(hall: Path) -> None:
    found = looked(Browse(str(hall)), EVERYWHERE, None, GUEST)
    assert names(found) == ["drives", "link", "b.csv", "Map.yaml"]
    assert found.above == hall.parent
    message: Any = told(found)
    assert [entry["size"] for entry in message["entries"]] == [0, 0, 1234, 16]
    assert message["entries"][2]["path"] == str(hall / "b.csv")
    json.dumps(message)


def test_a_guest_sees_what_is_shared_and_neither_what_is_above_nor_where_links_lead(hall: Path) -> None:
    shared = Reach.within([hall])
    found = looked(Browse(""), shared, None, GUEST)
    assert found.listing is not None
    assert found.listing.folder == hall.resolve()
    assert names(found) == ["drives", "b.csv", "Map.yaml"]
    assert found.above is None
    assert looked(Browse(str(hall / "drives")), shared, None, GUEST).above == hall


@pytest.mark.parametrize("path", ["..", "../secret", "link", "link/passwd", "/", "/etc/passwd", "~", "drives/../.."])
def test_a_guest_is_told_the_same_of_what_is_out_of_reach_whether_it_is_there_or_not(hall: Path, path: str) -> None:
    shared = Reach.within([hall])
    found = looked(Browse(path, recent=(str(hall.parent / "secret" / "passwd"),)), shared, None, GUEST)
    assert found.listing is None
    assert "out of reach" in found.problem
    assert found.recent == ()
    nowhere = looked(Browse("/no/such/place"), shared, None, GUEST)
    assert found.problem.removeprefix(path) == nowhere.problem.removeprefix("/no/such/place")


def test_half_a_path_leads_to_the_nearest_folder_and_a_file_to_the_one_it_is_in(hall: Path) -> None:
    for path in ("drives/fir", "drives", str(hall / "drives" / "no" / "such")):
        found = looked(Browse(path), EVERYWHERE, hall, PROGRAM)
        assert found.listing is not None
        assert found.listing.folder == hall / "drives"
    of_file = looked(Browse(str(hall / "b.csv")), EVERYWHERE, None, GUEST)
    assert of_file.listing is not None
    assert of_file.listing.folder == hall


def test_of_the_recent_files_those_are_offered_that_are_still_there(hall: Path) -> None:
    found = looked(Browse(str(hall), (str(hall / "b.csv"), str(hall / "removed.csv"))), EVERYWHERE, None, GUEST)
    assert found.recent == (str(hall / "b.csv"),)


def test_of_a_huge_folder_the_first_are_listed_and_the_rest_counted(
    hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder_listing, "MOST_LISTED", 2)
    found = looked(Browse(str(hall)), Reach.within([hall]), None, GUEST)
    assert names(found) == ["drives", "b.csv"]
    assert told(found)["leftOut"] == 1


@pytest.mark.parametrize("text", ["", "[]", '{"n": 1}', '{"n": 1, "path": 3}', '{"n": 1, "path": "a", "do": 1}'])
def test_what_no_script_of_the_page_says_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="asks for the folder"):
        asked(text)
    assert asked('{"n": 1, "path": "a", "recent": ["b"]}') == Browse("a", ("b",))


def test_what_was_found_is_shown_to_who_asked_alone(project: Project) -> None:
    found = Browsed(None, problem="none")
    shown = after(joined(AppState(project=project, saved=project)), found).state
    assert shown.of_browser(ME, Browsing).found == found
    assert shown.of_browser(OTHER, Browsing).found is None
