"""Nothing is cut off from small windows to large ones, and what is selected on the floor is found in its table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.tags import Tag
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

SIZES = ((1024, 700), (1280, 720), (1600, 900), (1920, 1080), (2560, 1440))
CUT_OFF = """() => {
  const found = [], shown = (each) => each.checkVisibility({ opacityProperty: true, visibilityProperty: true });
  const say = (each, why) => found.push(`${why}: ${(each.ariaLabel || each.textContent).trim()}`);
  const [strip, top] = ['.c-bottom', '.c-top'].map((name) => document.querySelector(name)
    .closest('[data-floating-window]'));
  for (const each of [...strip.querySelectorAll('button, .c-clock'), ...top.querySelectorAll('button')]) {
    const box = each.getBoundingClientRect();
    if (!shown(each) || !box.width) continue;
    if (box.left < -1 || box.right > innerWidth + 1 || box.bottom > innerHeight + 1) say(each, 'beyond the window');
    if (each.scrollWidth > each.clientWidth + 2 && !each.closest('.c-top')) say(each, 'text is cut');
    const chips = each.closest('.c-chips')?.getBoundingClientRect();
    if (chips && box.right > chips.right + 1) say(each, 'chip is cut');
  }
  const names = ['Reverse', 'Back', 'Pause', 'Step', 'Play'];
  const play = [...strip.querySelectorAll('button')].filter((each) => names.includes(each.textContent));
  const lines = new Set(play.map((each) => Math.round(each.getBoundingClientRect().top)));
  if (play.length !== 5 || lines.size !== 1) found.push(`${play.length} buttons in ${lines.size} lines`);
  // Letters that hang below the line, as in "Tag", are there whole.
  for (const each of document.querySelectorAll('.mantine-Button-label, [role=tab], label, td, th, .c-note')) {
    if (each.children.length || !shown(each) || !each.textContent.trim()) continue;
    const hides = getComputedStyle(each).overflowY !== 'visible';
    if (hides && each.scrollHeight > each.clientHeight + 1) say(each, 'letters are cut');
  }
  const floor = document.querySelector('canvas[data-engine]').getBoundingClientRect();
  const tools = [...document.querySelectorAll('div:has(>.c-rail)+div button')];
  if (tools.length !== 10) found.push(`${tools.length} tools`);
  const now = document.querySelector('.c-now'), end = now.getBoundingClientRect();
  const rows = [...now.querySelectorAll('tr')].map((each) => each.getBoundingClientRect());
  if (rows[0].top < end.top + 4) found.push('the first number of now is scrolled out');
  const at = (end.bottom - 1 - rows[0].top) / now.querySelector('tr:nth-child(2)').clientHeight;
  if (Math.abs(at - Math.round(at)) > 0.02 || at < 6) found.push(`${at} lines of the numbers of now are seen`);
  let above = floor.top;
  for (const each of tools) {
    const box = each.getBoundingClientRect();
    if (box.right > floor.left + 1 || box.left < floor.left - 50) say(each, 'not at the edge of the floor');
    if (box.top < above - 1 || box.bottom > floor.bottom + 1) say(each, 'over another tool, or beyond the floor');
    if (!each.contains(document.elementFromPoint(box.left + 20, box.top + 9))) say(each, 'covered');
    const label = each.querySelector('.mantine-Button-label');
    if (label.scrollWidth > each.clientWidth + 1) say(each, 'name is cut');
    above = box.bottom;
  }
  return found;
}"""
LINES_OF_LABELS = """() => [...document.querySelectorAll('[data-dock-region=left] label')].filter(
  (each) => each.checkVisibility() && each.textContent).map((each) => {
  const words = document.createRange();
  words.selectNodeContents(each);
  return [each.textContent, new Set([...words.getClientRects()].map((box) => Math.round(box.top))).size];
})"""
"""Each label of the steps, and in how many lines it stands."""
GAPS_OF_BOXES = """() => [...document.querySelectorAll('[data-dock-region=left] input[type=checkbox]')].filter(
  (each) => each.checkVisibility()).map((each) => {
  const name = each.closest('.mantine-Flex-root:has(label[for])').querySelector('label[for]');
  const [words, box] = [name.getBoundingClientRect(), each.getBoundingClientRect()];
  return [name.textContent, words.left - box.right, (words.top + words.bottom - box.top - box.bottom) / 2];
})"""
"""Each check box of the steps, how far it stands from its name and how much higher than that [pixels]."""
ROOM_ON_THE_RIGHT = """() => {
  const seen = (name) => [...document.querySelectorAll(name)].find((each) => each.checkVisibility());
  const viewOf = (each) => each.closest('.mantine-ScrollArea-viewport').getBoundingClientRect();
  const picture = seen('.c-a-picture'), box = picture.getBoundingClientRect();
  return { selection: viewOf(seen('[data-dock-region=right] .c-nothing')).height, picture: box.height,
           cut: box.bottom - viewOf(picture).bottom };
}"""
"""Heights of the selection's view and of the association's picture, and how much of that is cut off [pixels]."""
CLOSED = """() => [...document.querySelectorAll('[data-dock-region=left] .mantine-Paper-root[data-with-border]')]
  .filter((each) => each.offsetParent && each.innerText && !each.innerText.includes('\\n'))
  .map((each) => each.innerText)"""
"""Names of the folders of the step that are closed."""
TOOL = """(name) => [...document.querySelectorAll('div:has(>.c-rail)+div button')]
  .find((each) => each.textContent === name)"""
LIT = """() => [...document.querySelectorAll('div:has(>.c-rail)+div button')]
  .filter((each) => getComputedStyle(each).backgroundColor !== 'rgba(0, 0, 0, 0)').map((each) => each.textContent)"""
"""Names of the tools that are lit."""


def wall_of(count: int) -> Project:
    """A room with so many reflectors along its walls that their table has several pages."""
    project = room()
    places = [(x, y) for y in (0.2, 7.8) for x in np.linspace(0.3, 11.7, count // 2)]
    more = tuple(Reflector(id=f"W{index + 1}", x=float(x), y=y) for index, (x, y) in enumerate(places))
    tags = (Tag(id="T1", x=6.0, y=0.2),)  # with one there is a camera to enter
    return replace(project, reflectors=ReflectorMap((*project.reflectors.reflectors, *more)), tags=tags)


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(wall_of(60), at=5.0) as opened:
        yield opened


def test_no_button_or_name_is_cut_off_at_any_size(served: Served, window: Callable[..., OpenPage]) -> None:
    page = window(served.server, SIZES[0])
    page.open(nodes=["/vehicle"])
    page.page.wait_for_function("() => document.querySelectorAll('.c-chips button').length > 5")
    found: dict[Any, list[str]] = {}
    for width, height in (*SIZES, SIZES[0]):  # made larger, and small again
        page.page.set_viewport_size({"width": width, "height": height})
        page.page.wait_for_timeout(400)
        found[width, height] = page.page.evaluate(CUT_OFF)
        # Each curve has its name beside its value, at every width.
        names = page.page.evaluate("() => window.commissionPlots.namesShown")
        assert {"x", "y", "largest", "inliers", "outliers"} <= {name.split(" ")[0] for name in names}, (width, names)
    assert found == {size: [] for size in SIZES}
    # In the lowest window a table has rows, and a list of corners is seen to its end.
    page.page.set_viewport_size({"width": SIZES[0][0], "height": SIZES[0][1]})
    page.open_tab("Reflectors")
    page.open_tab("Site")
    page.fold("Vehicle")
    page.page.wait_for_function(
        "() => [...document.querySelectorAll('.c-data tbody tr')].filter((each) => {"
        " const box = each.getBoundingClientRect();"
        " return each.contains(document.elementFromPoint(box.left + 20, box.bottom - 2)); }).length >= 4"
    )
    outline = page.row("Outline").locator("input")
    assert len(outline.input_value().split(",")) == 4
    assert outline.evaluate("e => e.scrollWidth <= e.clientWidth")
    # In each step, with everything open that it holds, each label stands in one line, and a check box beside its name.
    for tab in ("Site", "Plan", "Run", "Tune"):
        page.open_tab(tab)
        for _ in range(3):  # a folder may hold others
            for name in page.page.evaluate(CLOSED):
                page.fold(name)
        page.page.wait_for_function(f"() => ({LINES_OF_LABELS})().length > 20")
        assert [name for name, lines in page.page.evaluate(LINES_OF_LABELS) if lines > 1] == []
        gaps = page.page.evaluate(GAPS_OF_BOXES)
        assert [each for each in gaps if not 2.0 <= each[1] <= 14.0 or abs(each[2]) > 2.0] == []
    # The rail shows which tool is in use, whether a key or the rail has chosen it.
    page.page.mouse.move(600, 300)
    for choose, lit in (
        (lambda: page.page.keyboard.press("m"), "Measure"),
        (lambda: page.page.evaluate(f"({TOOL})('Wall').click()"), "Wall"),
        (lambda: page.page.keyboard.press("g"), "Align"),
        (lambda: page.page.keyboard.press("Escape"), "Select"),
    ):
        choose()
        page.page.mouse.move(600, 300)
        page.page.wait_for_function(f"name => String(({LIT})()) === name", arg=lit)


def test_the_selection_keeps_room_beside_the_association(served: Served, window: Callable[..., OpenPage]) -> None:
    page = window(served.server, SIZES[0])
    page.open(nodes=["/vehicle"])
    page.open_tab("Association")
    for width, height in SIZES[:4]:
        page.page.set_viewport_size({"width": width, "height": height})
        page.page.wait_for_timeout(400)
        found = page.page.evaluate(ROOM_ON_THE_RIGHT)
        # A title and two fields at least; the picture is there whole.
        assert found["selection"] >= 90.0, (width, height)
        assert found["picture"] >= 120.0, (width, height)
        assert found["cut"] <= 0.0, (width, height)


@pytest.mark.with_all_seeds
def test_what_is_selected_on_the_floor_is_scrolled_to_in_its_table_on_whichever_page_it_is(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server, (1280, 720))
    page.open(nodes=["/reflectors/marks"])
    page.open_tab("Reflectors")
    page.wait_for_text("64 of 64 reflectors, page 1 of 2")
    for name in ("W50", "W20"):
        reflector = next(each for each in served.state.project.reflectors.reflectors if each.id == name)
        page.click_at((reflector.x, reflector.y))
        page.page.wait_for_function(
            "name => { const row = document.querySelector(`.c-data tr[data-key='${name}'][aria-selected=true]`);"
            " if (!row) return false; const box = row.getBoundingClientRect();"
            " const at = document.elementFromPoint(box.left + 20, box.top + box.height / 2);"
            " return row.contains(at); }",
            arg=name,
        )
    assert page.errors == []
