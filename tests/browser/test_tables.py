"""Events and reflectors of a drive in a real browser: what is listed, sorted, clicked, and seen on the floor."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commission.app.base.panel import clock
from commission.app.editing.editor import editors_of
from commission.app.run.actions import Cover, Seek
from commission.app.run.found_table import BY_KEY, Found, classes_of, palette
from commission.app.run.service import RunService
from commission.app.run.state import RunState
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

EVENTS, REFLECTORS = ".c-events tbody tr", ".c-reflectors tbody tr"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    """A drive in which nothing is seen from 4 s on."""
    with standing_drive(room(), at=4.0) as opened:
        opened.runtime.post(Cover(covered=True))
        opened.until(lambda: any(event.kind.value == "blind" for event in found_in(opened).events.events))
        yield opened


def found_in(served: Served) -> Found:
    found = next(
        (part for part in served.runtime.service(RunService).parts(slowly=True) if isinstance(part, Found)), None
    )
    if found is None:
        served.until(lambda: any(isinstance(p, Found) for p in served.runtime.service(RunService).parts(slowly=True)))
        return found_in(served)
    return found


@pytest.fixture(scope="module")
def page(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests: opening one is what takes longest."""
    opened = lasting_window(served.server, sharp=True)
    opened.open(nodes=["/vehicle"])
    opened.page.wait_for_function("() => /Events [1-9]/.test(document.querySelector('.c-views').innerText)")
    return opened


def view(page: OpenPage, name: str) -> None:
    page.page.locator(".c-views button", has_text=name).click()


def cells(page: OpenPage, rows: str, column: int) -> list[str]:
    return page.page.locator(f"{rows} td:nth-child({column})").all_inner_texts()


def test_a_click_on_an_event_goes_to_its_moment(served: Served, page: OpenPage) -> None:
    view(page, "Events")
    listed = found_in(served).events.events
    assert cells(page, EVENTS, 1) == [f"{event.time:.2f}" for event in listed]
    assert cells(page, EVENTS, 2) == [event.kind.value for event in listed]
    served.runtime.post(Seek(0.0))
    index = next(index for index, event in enumerate(listed) if event.kind.value == "blind")
    page.page.locator(EVENTS).nth(index).click()
    served.until(lambda: served.view is not None and served.view.time == pytest.approx(listed[index].time, abs=1e-3))
    page.page.wait_for_function(
        "text => document.querySelector('.c-clock b').innerText === text", arg=clock(listed[index].time)
    )
    assert page.errors == []


def test_events_of_a_kind_can_be_left_out(served: Served, page: OpenPage) -> None:
    view(page, "Events")
    every = len(cells(page, EVENTS, 1))
    blind = sum(event.kind.value == "blind" for event in found_in(served).events.events)
    page.press(f"blind {blind}")
    assert len(cells(page, EVENTS, 1)) == every - blind
    assert "blind" not in cells(page, EVENTS, 2)
    page.press(f"blind {blind}")
    assert len(cells(page, EVENTS, 1)) == every


def test_heads_sort_both_ways_and_what_is_unknown_comes_last(served: Served, page: OpenPage) -> None:
    view(page, "Reflectors")
    figures = found_in(served).figures
    assert cells(page, REFLECTORS, 1) == sorted(figures.names)
    page.page.locator(".c-reflectors th button", has_text="NIS").first.click()
    known = [float(text) for text in cells(page, REFLECTORS, 11) if text != "–"]
    assert known == sorted(known, reverse=True)
    page.page.locator(".c-reflectors th button", has_text="NIS").first.click()
    shown = cells(page, REFLECTORS, 11)
    known = [float(text) for text in shown if text != "–"]
    assert known == sorted(known)
    assert "–" not in shown[: len(known)]
    nis = figures.nis[figures.names.index(cells(page, REFLECTORS, 1)[0])]
    assert shown[0] == f"{nis:.2f}"
    hint = page.page.locator(".c-reflectors th button", has_text="expected").first.get_attribute("title")
    assert hint is not None
    assert hint.startswith("By the floor map")


def test_a_click_on_a_reflector_selects_it_and_flies_there(served: Served, page: OpenPage) -> None:
    view(page, "Reflectors")
    page.page.locator(REFLECTORS, has_text="R3").click()
    served.until(lambda: any(editor.selected == ("R3",) for editor in editors_of(served.state)))
    middle = "(() => { const c = window.__viserMutable.camera.position; return [c.x, c.y, c.z] })()"
    page.wait_until_drawn()
    page.wait_until_still()
    x, y = page.pixel_of((11.75, 1.5))
    box = page.page.evaluate(
        "(b => [b.left, b.top, b.width, b.height])(window.__viserMutable.canvas.getBoundingClientRect())"
    )
    assert page.page.evaluate(middle)
    assert abs(x - box[0] - box[2] / 2) < 0.1 * box[2]
    assert abs(y - box[1] - box[3] / 2) < 0.1 * box[3]


def test_the_dot_of_a_column_colors_the_floor_by_it(served: Served, page: OpenPage) -> None:
    view(page, "Reflectors")
    page.page.get_by_label("Color by NIS").click()
    served.until(lambda: served.state.part(RunState).figure == "nis")
    figures = found_in(served).figures
    page.page.locator(".c-floor-scale", has_text="NIS").wait_for()
    page.press("Fit")
    page.wait_until_still()
    page.wait_until_drawn()
    classes = classes_of(BY_KEY["nis"].values(figures))

    def colored(place: Sequence[float], index: int) -> bool:
        x, y = page.pixel_of(place)
        size = page.page.viewport_size
        if size is None or not (9 <= x <= size["width"] - 9 and 9 <= y <= size["height"] - 9):
            return False  # the floor has not come to where "Fit" sends it
        shot = page.page.screenshot(clip={"x": x - 9, "y": y - 9, "width": 18, "height": 18})
        picture = np.asarray(Image.open(BytesIO(shot)).convert("RGB"), dtype=np.int64)
        near = np.abs(picture - np.array(palette()[index])).sum(axis=2) < 40
        return bool(near.sum() > 25)

    places = list(zip(figures.places.tolist(), classes.tolist(), strict=True))
    # The scale may be written before the scene has its colors, and before the floor begins to move.
    served.until(lambda: all(colored(*each) for each in places))
    page.page.get_by_label("Color by NIS").click()
    served.until(lambda: served.state.part(RunState).figure == "")


def test_the_table_is_saved_as_it_is_listed(page: OpenPage, tmp_path: Path) -> None:
    view(page, "Reflectors")
    page.page.locator(".c-reflectors th button", has_text="accepted").first.click()
    with page.page.expect_download() as download:
        page.press("CSV")
    download.value.save_as(tmp_path / "reflectors.csv")
    with (tmp_path / "reflectors.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["reflector"] for row in rows] == cells(page, REFLECTORS, 1)
    assert list(rows[0]) == ["reflector", *BY_KEY]
