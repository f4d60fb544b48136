"""What the page says and offers about the files of a project: who edits them, what lies where, what of the journal."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from commission.app.base.theme import TOP_BAR_PX
from commission.io.project_file import load_project, save_project
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served

JOURNAL = ".commission.journal"

Open = Callable[[], tuple[Served, OpenPage]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    save_project(room(), tmp_path / "hall")
    return tmp_path / "hall"


@pytest.fixture
def open_hall(folder: Path, window: Callable[..., OpenPage]) -> Iterator[Open]:
    """Opens the project by a program of its own, with a window on it."""
    running: list[Served] = []

    def opened() -> tuple[Served, OpenPage]:
        running.append(Served(load_project(folder), folder))
        page = window(running[-1].server, SMALL)
        page.open()
        return running[-1], page

    yield opened
    for each in running:
        each.close()


def rename(served: Served, page: OpenPage, name: str) -> None:
    """Rename the project as a person does; its folder of fields is open."""
    page.fill("Name", name)
    served.until(lambda: served.state.project.name == name, 20.0)


def assert_bar_is_whole(page: OpenPage, *names: str) -> None:
    """The buttons of the bar stand beside each other, in it, however long the words before them are."""
    right = 0.0
    for name in names:
        box = page.page.get_by_role("button", name=name, exact=True).bounding_box()
        assert box is not None, name
        assert box["x"] >= right, name
        assert box["y"] >= 0.0, name
        assert box["y"] + box["height"] <= TOP_BAR_PX, name
        right = box["x"] + box["width"]
    assert right < SMALL[0] - 120.0, "they cover the sign of the connection"


def test_a_project_that_is_edited_elsewhere_is_shown_read_only_and_taken_over_by_a_button(open_hall: Open) -> None:
    first, here = open_hall()
    here.fold("Project")
    rename(first, here, "Edited")
    second, there = open_hall()
    there.wait_for_text("read-only: edited by process")
    there.wait_until_told("opened read-only: it is edited by process")
    there.fold("Project")
    there.fill("Name", "Mine")
    there.wait_until_told("this page shows the project read-only: it is edited by process")
    assert second.state.project.name != "Mine"
    assert here.page.get_by_role("button", name="Take over").count() == 0

    assert_bar_is_whole(there, "Take over", "2D", "3D", "Fit", "Follow")

    there.press("Take over")
    second.until(lambda: second.state.read_only == "" and second.state.project.name == "Edited", 30.0)
    there.page.get_by_role("button", name="Take over").wait_for(state="hidden")
    here.wait_for_text("read-only: edited by process")
    here.wait_until_told("taken over by process")
    here.page.get_by_role("button", name="Take over").wait_for(state="visible")
    rename(second, there, "Mine")
    assert first.state.project.name == "Edited"

    here.press("Take over")
    first.until(lambda: first.state.read_only == "" and first.state.project.name == "Mine", 30.0)
    there.wait_for_text("read-only: edited by process")
    assert here.errors == there.errors == []


def test_a_copy_onto_another_project_is_asked_about_in_the_browser_that_saves_it_alone(
    open_hall: Open, window: Callable[..., OpenPage], tmp_path: Path
) -> None:
    other = tmp_path / "other"
    theirs = replace(room(), name="Theirs <img src=x>")
    save_project(theirs, other)
    served, page = open_hall()
    colleague = window(served.server)
    colleague.open()
    question = "holds the project 'Theirs <img src=x>'. Replace it?"

    def save_copy() -> None:
        page.fill("Copy into", str(other))
        page.press("Save a copy")
        page.wait_for_text(question)

    page.fold("Project")
    rename(served, page, "Ours")
    save_copy()
    assert "Theirs" not in colleague.text()
    assert colleague.page.get_by_role("button", name="Replace it").count() == 0
    page.press("Keep it")
    page.page.get_by_text(question).wait_for(state="hidden")
    assert load_project(other) == theirs

    save_copy()
    page.press("Replace it")
    served.until(lambda: served.state.folder == other, 20.0)
    assert load_project(other).name == "Ours"
    page.page.get_by_text(question).wait_for(state="hidden")
    page.wait_for_text("saved ")
    colleague.wait_until_told(f"saved in {other}")
    assert page.page.locator("img[src=x]").count() == 0
    assert page.errors == colleague.errors == []


@pytest.mark.with_all_seeds
def test_what_became_of_the_journal_is_told_on_the_page(open_hall: Open, folder: Path) -> None:
    served, page = open_hall()
    page.fold("Project")
    rename(served, page, "One")
    (folder / JOURNAL).unlink()
    page.wait_until_told(
        "the journal of unsaved edits was deleted by somebody else; it was begun anew with the whole project"
    )
    served.until((folder / JOURNAL).exists, 10.0)
    shutil.rmtree(folder)
    page.wait_until_told(f"the project's folder {folder} was deleted or moved; all edits are kept in")
    page.wait_for_text("its folder is gone; edits are kept in")
    rename(served, page, "Two")
    assert_bar_is_whole(page, "Overwrite", "Read again", "2D", "3D", "Fit", "Follow")
    page.press("Overwrite")
    page.wait_for_text("saved ")
    assert load_project(folder).name == "Two"
    assert page.errors == []


def test_what_a_killed_program_left_is_restored_and_a_damaged_journal_is_told(open_hall: Open, folder: Path) -> None:
    served, page = open_hall()
    page.fold("Project")
    for name in ("One", "Two", "Three"):
        rename(served, page, name)
    journal = (folder / JOURNAL).read_bytes()
    page.press("Save")
    page.wait_for_text("saved ")
    served.close()
    page.close()
    # As it lay there when the program was killed, but for one byte of the second edit.
    save_project(room(), folder)
    damaged = bytearray(journal)
    damaged[journal.index(b"Two")] ^= 1
    (folder / JOURNAL).write_bytes(damaged)

    again, page = open_hall()
    page.wait_until_told("Restored 2 edits up to")
    assert "the journal as it was found is kept as" in again.state.greeting
    assert again.state.project.name == "Three"
    (kept,) = folder.glob(f"{JOURNAL}.damaged-*")
    assert kept.read_bytes() == damaged
    page.wait_for_text("unsaved")
    page.page.get_by_role("button", name="Undo restore unsaved").wait_for(state="visible")
    assert page.errors == []
