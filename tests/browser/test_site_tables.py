"""The tables of the site in a real browser: heads that sort, rows that select on the floor, cells that are edited."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
from playwright.sync_api import Locator

from commission.app.base import state as page_state
from commission.app.editing.editor import PosedKind
from commission.site.reflectors import Reflector, ReflectorKind
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import Zone
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served

ROWS = ".c-data tbody tr:not(.c-refusal)"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    square = ((1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0))
    project = replace(
        room(),
        stations=(
            Station(name="Dock", x=3.0, y=5.0, required_accuracy=0.01),
            Station(name="Gate", x=4.0, y=2.0, required_accuracy=0.02),
        ),
        tags=(Tag(id="T1", x=4.0, y=5.0),),
        zones=(Zone(name="Racks", outline=square),),
    )
    opened = Served(project)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def opened(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    page = lasting_window(served.server)
    page.open(nodes=["/reflectors/marks"])
    return page


@pytest.fixture(autouse=True)
def each_entry_is_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Edits that follow each other at once are steps of their own: no second entry hides in the first."""
    monkeypatch.setattr(page_state, "MERGE_WITHIN_S", -1.0)


@pytest.fixture
def page(opened: OpenPage, served: Served) -> OpenPage:
    """The window with its table of reflectors, nothing selected."""
    opened.forget_refusals()
    opened.open_tab("Reflectors")
    for _ in range(3):
        opened.page.keyboard.press("Escape")
    served.until(lambda: selected(served) == (), 10.0)
    return opened


def selected(served: Served) -> tuple[str, ...]:
    return served.editor(next(iter(served.state.browsers))).selected


def _posed(served: Served) -> tuple[PosedKind, str] | None:
    key = served.editor(next(iter(served.state.browsers))).posed
    return None if key is None else (key.kind, key.name)


def reflector(served: Served, name: str) -> Reflector:
    return next(each for each in served.state.project.reflectors.reflectors if each.id == name)


def listed(page: OpenPage, head: str, rows: str = ROWS) -> list[str]:
    """What a column shows from top to bottom."""
    heads = [each.strip(" ▴▾") for each in page.page.locator(".c-data:visible th").all_inner_texts()]
    return page.page.locator(f"{rows}:visible td:nth-child({heads.index(head) + 1})").all_inner_texts()


def cell(page: OpenPage, name: str, head: str) -> Locator:
    table = page.page.locator(".c-data:visible table", has=page.page.locator(f"tr[data-key='{name}']"))
    table.locator("th", has_text=head).wait_for()
    heads = [each.strip(" ▴▾") for each in table.locator("th").all_inner_texts()]
    return table.locator(f"tr[data-key='{name}'] td").nth(heads.index(head))


def typed_into(page: OpenPage, name: str, head: str, text: str) -> None:
    """Double click on a cell and type over what stands in it, key by key."""
    cell(page, name, head).dblclick()
    page.page.wait_for_function("() => document.activeElement.className === 'c-cell'")
    page.page.keyboard.press("Control+A")
    page.page.keyboard.type(text, delay=20)


def row(page: OpenPage, name: str) -> Locator:
    return page.page.locator(f".c-data:visible tr[data-key='{name}'] td:first-child")


def is_drawn_selected(page: OpenPage, name: str) -> None:
    """Wait until a row is seen to be selected: what is clicked before is not that row yet, or lies elsewhere."""
    page.page.locator(f".c-data:visible tr[data-key='{name}'][aria-selected=true]").wait_for()


def test_heads_name_the_units_and_sort_both_ways(page: OpenPage, served: Served) -> None:
    heads = page.page.locator(".c-data:visible th").all_inner_texts()
    assert [each.strip(" ▴▾") for each in heads[:4]] == ["Name", "x [m]", "y [m]", "Radius [mm]"]
    places = {each.id: each.x for each in served.state.project.reflectors.reflectors}
    for isdown in (False, True):
        page.page.locator(".c-data:visible th button", has_text="x [m]").click()
        page.page.locator(f".c-data:visible th[aria-sort={'descending' if isdown else 'ascending'}]").wait_for()
        names = listed(page, "Name")
        assert [places[name] for name in names] == sorted(places.values(), reverse=isdown)
        assert [float(text) for text in listed(page, "x [m]")] == pytest.approx([places[name] for name in names])
    assert len({len(text.partition(".")[2]) for text in listed(page, "x [m]")}) == 1, "as many decimals"
    page.page.locator(".c-data:visible th button", has_text="Name").click()


def test_rows_select_on_the_floor_one_several_and_all_between(page: OpenPage, served: Served) -> None:
    row(page, "R1").click()
    served.until(lambda: selected(served) == ("R1",))
    is_drawn_selected(page, "R1")
    row(page, "R4").click(modifiers=["Control"])
    served.until(lambda: selected(served) == ("R1", "R4"))
    is_drawn_selected(page, "R4")
    page.wait_for_text("2 selected")
    row(page, "R1").click(modifiers=["Control"])
    served.until(lambda: selected(served) == ("R4",))
    is_drawn_selected(page, "R4")
    row(page, "R2").click()
    served.until(lambda: selected(served) == ("R2",))
    is_drawn_selected(page, "R2")
    row(page, "R4").click(modifiers=["Shift"])
    served.until(lambda: selected(served) == ("R2", "R3", "R4"))
    marked = f"{ROWS}[aria-selected=true]"
    page.page.wait_for_function("rows => document.querySelectorAll(rows).length === 3", arg=marked)
    assert listed(page, "Name", marked) == ["R2", "R3", "R4"]
    # What is selected on the floor is marked in the table; and several are deleted in one step.
    page.press("Fit")
    page.wait_until_still()
    one = reflector(served, "R1")
    page.click_at((one.x, one.y))
    page.page.wait_for_function("rows => document.querySelector(rows)?.dataset.key === 'R1'", arg=marked)
    row(page, "R2").click(modifiers=["Control"])
    served.until(lambda: selected(served) == ("R1", "R2"))
    steps, count = len(served.state.undo), len(served.state.project.reflectors)
    page.page.keyboard.press("Delete")
    served.until(lambda: len(served.state.project.reflectors) == count - 2)
    assert len(served.state.undo) == steps + 1
    page.page.keyboard.press("Control+z")
    served.until(lambda: len(served.state.project.reflectors) == count)
    assert page.errors == []


@pytest.mark.parametrize("how", ["Enter", "Tab", "click"])
def test_a_cell_is_a_draft_until_it_is_finished_and_then_one_undo_step(
    page: OpenPage, served: Served, how: str
) -> None:
    before, steps = reflector(served, "R3"), len(served.state.undo)
    typed_into(page, "R3", "Radius [mm]", "52.5")
    page.page.wait_for_timeout(200)
    assert reflector(served, "R3") == before, "nothing is entered while it is typed"
    assert cell(page, "R3", "Radius [mm]").get_attribute("data-draft") == ""
    if how == "click":
        page.page.get_by_role("tab", name="Reflectors", exact=True).click()
    else:
        page.page.keyboard.press(how)
    served.until(lambda: reflector(served, "R3").radius == pytest.approx(0.0525))
    if how == "Tab":
        page.page.wait_for_function("() => document.activeElement.ariaLabel === 'Kind of R3'")
        page.page.keyboard.press("Escape")
    page.page.wait_for_timeout(150)
    assert len(served.state.undo) == steps + 1
    assert reflector(served, "R3") == replace(before, radius=0.0525)
    page.page.wait_for_function(
        "() => document.querySelector(\".c-data tr[data-key='R3']\").innerText.includes('52.5')"
    )
    page.page.keyboard.press("Control+z")
    served.until(lambda: reflector(served, "R3") == before)
    assert page.errors == []


def test_escape_takes_the_entry_back_and_nothing_else(page: OpenPage, served: Served) -> None:
    row(page, "R3").click()
    is_drawn_selected(page, "R3")
    project, steps = served.state.project, len(served.state.undo)
    for text in ("9.9", ""):
        cell(page, "R3", "x [m]").click()  # a click in a row that is selected edits
        page.page.wait_for_function("() => document.activeElement.className === 'c-cell'")
        if text:
            page.page.keyboard.type(text)
        page.page.keyboard.press("Escape")
        page.page.wait_for_function("() => document.querySelector('.c-cell') === null")
        page.page.wait_for_timeout(150)
        assert served.state.project is project
        assert selected(served) == ("R3",)
        assert float(cell(page, "R3", "x [m]").inner_text()) == reflector(served, "R3").x
    assert len(served.state.undo) == steps


def test_what_is_typed_into_a_cell_is_seen_whole(page: OpenPage, served: Served) -> None:
    project = served.state.project
    typed_into(page, "R3", "x [m]", "-123.4567")
    assert page.page.evaluate("() => document.activeElement.scrollWidth <= document.activeElement.clientWidth")
    page.page.keyboard.press("Escape")
    page.page.locator("input.c-cell").wait_for(state="detached")
    assert served.state.project is project


@pytest.mark.parametrize(
    ("head", "text", "told"),
    [
        ("Radius [mm]", "0", "Radius is 0 mm; expected more than 0 and at most 1000 mm"),
        ("x [m]", "1e-", 'found "1e-"; expected a number'),
        ("Name", "R1", "'R1' is used twice"),
    ],
)
def test_what_is_refused_is_said_in_the_table_and_what_held_stands_there(
    page: OpenPage, served: Served, head: str, text: str, told: str
) -> None:
    project, before = served.state.project, cell(page, "R3", head).inner_text()
    typed_into(page, "R3", head, text)
    page.page.keyboard.press("Enter")
    page.page.locator(".c-refusal", has_text=told).wait_for(state="visible")
    page.page.wait_for_function("() => document.querySelector('.c-cell') === null")
    assert cell(page, "R3", head).inner_text() == before
    assert served.state.project is project
    typed_into(page, "R3", head, before)
    page.page.keyboard.press("Enter")
    page.page.wait_for_function("() => document.querySelector('.c-refusal') === null")
    assert served.state.project is project


def test_words_choices_and_switches_are_edited_in_their_cells(page: OpenPage, served: Served) -> None:
    before, steps = reflector(served, "R2"), len(served.state.undo)
    typed_into(page, "R2", "Note", "by the <b>gate</b>")
    page.page.keyboard.press("Enter")
    served.until(lambda: reflector(served, "R2").note == "by the <b>gate</b>")
    cell(page, "R2", "Kind").dblclick()
    page.page.locator("select.c-cell").select_option("flat")
    served.until(lambda: reflector(served, "R2").kind is ReflectorKind.FLAT)
    cell(page, "R2", "Locked").locator("input").click()
    served.until(lambda: reflector(served, "R2").locked)
    # One that is locked stays as it is, and its cell says so again.
    typed_into(page, "R2", "x [m]", "5")
    page.page.keyboard.press("Enter")
    page.wait_until_told("locked and left as they are: R2")
    page.page.wait_for_function(
        "x => parseFloat(document.querySelector(\".c-data tr[data-key='R2'] td:nth-child(2)\").innerText) === x",
        arg=before.x,
    )
    assert len(served.state.undo) == steps + 3
    for _ in range(3):
        page.page.keyboard.press("Control+z")
        page.page.wait_for_timeout(50)
    served.until(lambda: reflector(served, "R2") == before)


def test_routes_stations_tags_and_zones_are_edited_and_selected_in_tables_of_the_same_kind(
    page: OpenPage, served: Served
) -> None:
    page.open_tab("Routes")
    page.wait_for_text("1 route, 2 stations, 1 tag, 1 zone")
    project, name = served.state.project, served.state.project.routes[0].name
    browser = next(iter(served.state.browsers))
    for key, head, text, reached in (
        (name, "Speed [m/s]", "0.7", lambda: served.state.project.routes[0].speed == 0.7),
        ("Dock", "Within [mm]", "12.5", lambda: served.state.project.stations[0].required_accuracy == 0.0125),
        ("T1", "x [m]", "4.25", lambda: served.state.project.tags[0].x == 4.25),
        ("Racks", "Name", "Shelves", lambda: served.state.project.zones[0].name == "Shelves"),
    ):
        steps = len(served.state.undo)
        typed_into(page, key, head, text)
        page.page.keyboard.press("Enter")
        served.until(reached)
        assert len(served.state.undo) == steps + 1
        # A key goes to the entry while it is there.
        page.page.locator("input.c-cell").wait_for(state="detached")
        page.page.keyboard.press("Control+z")
        served.until(lambda: served.state.project == project)
    for key, is_there in (
        ("Dock", lambda: _posed(served) == (PosedKind.STATION, "Dock")),
        ("T1", lambda: _posed(served) == (PosedKind.TAG, "T1")),
        (name, lambda: served.editor(browser).point is not None),
    ):
        row(page, key).click()
        served.until(is_there)
        # The next click is for rows as they then lie: the selected one scrolls into view.
        is_drawn_selected(page, key)
    assert page.errors == []


def test_one_entry_sets_all_stations_that_are_selected(page: OpenPage, served: Served) -> None:
    page.open_tab("Routes")
    before, steps = served.state.project, len(served.state.undo)
    row(page, "Dock").click()
    is_drawn_selected(page, "Dock")
    row(page, "Gate").click(modifiers=["Control"])
    is_drawn_selected(page, "Gate")
    page.page.locator(".c-selected", has_text="2 stations").wait_for(state="attached")
    every = cell(page, "", "Within [mm]")
    assert every.inner_text() == "", "they differ"
    assert cell(page, "", "Name").inner_text() == "All 2"
    # It lies below the heads and above the rows.
    heads, first = (
        page.page.locator("tr.c-every").locator("xpath=ancestor::table").locator("th").first,
        row(page, "Dock"),
    )
    tops = [each.bounding_box() for each in (heads, every, first)]
    assert all(box is not None for box in tops)
    assert [box["y"] for box in tops if box] == sorted(box["y"] for box in tops if box)
    every.click()
    page.page.wait_for_function("() => document.activeElement.className === 'c-cell'")
    page.page.keyboard.type("7.5", delay=20)
    page.page.wait_for_timeout(150)
    assert served.state.project == before, "nothing is entered while it is typed"
    page.page.keyboard.press("Enter")
    served.until(lambda: [each.required_accuracy for each in served.state.project.stations] == [0.0075, 0.0075])
    assert len(served.state.undo) == steps + 1
    page.page.wait_for_function("() => document.querySelector('.c-every').innerText.includes('7.5')")
    # What is refused is said below it, once.
    cell(page, "", "Within [mm]").click()
    page.page.wait_for_function("() => document.activeElement.className === 'c-cell'")
    page.page.keyboard.type("-1")
    page.page.keyboard.press("Enter")
    page.page.locator(".c-refusal", has_text="expected").wait_for(state="visible")
    page.page.locator("input.c-cell").wait_for(state="detached")
    page.page.keyboard.press("Control+z")
    served.until(lambda: served.state.project == before)
    page.page.keyboard.press("Delete")
    served.until(lambda: served.state.project.stations == ())
    page.page.keyboard.press("Control+z")
    served.until(lambda: served.state.project == before)
    assert page.errors == []


def test_what_counts_in_a_zone_and_figures_of_a_scanner_are_entered_in_their_rows(
    page: OpenPage, served: Served
) -> None:
    page.open_tab("Routes")
    before = served.state.project
    cell(page, "Racks", "By tags").locator("input").click()
    served.until(lambda: "tags" not in served.state.project.zones[0].kinds)
    typed_into(page, "Racks", "Corners [m]", "1 1, 3 1, 3 4, 1 4")
    page.page.keyboard.press("Enter")
    served.until(lambda: served.state.project.zones[0].outline[2] == (3.0, 4.0))
    page.page.locator("input.c-cell").wait_for(state="detached")
    typed_into(page, "scanner", "Scans per s", "12.5")
    page.page.keyboard.press("Enter")
    served.until(lambda: served.state.project.scanners[0].rate == 12.5)
    page.page.locator("input.c-cell").wait_for(state="detached")
    for _ in range(3):
        page.page.keyboard.press("Control+z")
        page.page.wait_for_timeout(100)
    served.until(lambda: served.state.project == before)
    assert page.errors == []
