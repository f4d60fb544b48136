"""The tour of the README names what is there: each word that it sets apart can be read on the page."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest

from commission.app.run.actions import VirtualDrive
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from tests.browser.page import OpenPage
from tests.browser.serving import Served
from tests.conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
TOUR = README[README.index("## Ten minutes with the page") : README.index("### Show it to others")]
WORDS = sorted({" ".join(word.split()) for word in re.findall(r"\*{1,2}([^*]+?)\*{1,2}", TOUR)})
TOLD_LATER = {
    "FAIL": "the badge of a drive that fails",
    "Switch to layout 1": "once a layout is kept",
    "plots": "the page's style writes it",
    "use": "once a variant is kept",
}
"""Words that the page shows only after something else; tests of those name them."""
ALL_WORDS = """() => {
  const found = new Set();
  const add = (text) => { const word = (text ?? '').trim().replace(/\\s+/g, ' '); if (word) found.add(word); };
  for (const each of document.querySelectorAll('body *')) {
    if (each.closest('style, script')) continue;
    add(each.ariaLabel); add(each.title);
    if (each.children.length < 4) add(each.textContent);
  }
  return [...found];
}"""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    project = load_project(bundled_folder("maps") / "laboratory")
    opened = Served(project, source=VirtualDrive(project.routes[0].name))
    opened.until(lambda: opened.view is not None)
    yield opened
    opened.close()


def test_each_name_in_the_tour_is_on_the_page(served: Served, window: Callable[..., OpenPage]) -> None:
    page = window(served.server)
    page.open(nodes=["/vehicle"])
    page.page.wait_for_function("() => document.querySelectorAll('.c-chips button').length > 5")
    read = set[str]()
    for tab in ("Site", "Plan", "Run", "Tune", "Selection", "Reflectors", "Routes", "Layers", "Problems"):
        page.open_tab(tab)
        page.page.wait_for_timeout(250)
        read |= set(page.page.evaluate(ALL_WORDS))
    # The row *All* is there while several are selected.
    page.open_tab("Reflectors")
    rows = page.page.locator(".c-data:visible tbody tr")
    rows.nth(0).locator("td").first.click()
    page.page.locator(".c-data:visible tr[aria-selected=true]").wait_for()
    rows.nth(1).locator("td").first.click(modifiers=["Control"])
    page.page.locator("tr.c-every").wait_for()
    read |= set(page.page.evaluate(ALL_WORDS))
    shown = {re.sub(r"( \[.*\]| \d+| ▾)$", "", word) for word in read}
    missing = [word for word in WORDS if word not in shown and word not in TOLD_LATER]
    assert missing == []
    assert set(TOLD_LATER) <= set(WORDS)
    assert page.errors == []
