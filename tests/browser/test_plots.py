"""The plots as instruments, in a real browser: what is clicked, dragged, chosen and saved, and what can be seen."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commission.app.base import theme
from commission.app.base.panel import clock
from commission.app.run.actions import Seek
from commission.app.run.service import RunService
from commission.app.run.view import RunView
from commission.geometry.arrays import read_only
from commission.localization.estimate import Status
from commission.studies.run import RunResult
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served, standing_drive

COUNTS, NIS, POSITION = "Inliers, outliers per scan", "NIS of all detections", "2σ of position [mm]"
SHOWN = "window.commissionPlots.shown"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room(rate=100.0)) as opened:
        yield opened


def at_one_second(served: Served, opened: OpenPage) -> OpenPage:
    opened.page.wait_for_function(f"() => {SHOWN}.titles.length === 6")
    served.seek(1.0)
    opened.page.wait_for_function(f"() => {SHOWN}.cursor.time === 1")
    return opened


@pytest.fixture(scope="module")
def shared(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    opened = lasting_window(served.server)
    opened.open(nodes=["/vehicle"])
    return opened


@pytest.fixture
def page(served: Served, shared: OpenPage) -> OpenPage:
    """The window of all tests that leave it as they found it: opening one is what takes longest."""
    return at_one_second(served, shared)


@pytest.fixture
def own(served: Served, window: Callable[..., OpenPage]) -> OpenPage:
    """A window for a test that chooses its plots."""
    opened = window(served.server)
    opened.open(nodes=["/vehicle"])
    return at_one_second(served, opened)


def run_of(served: Served) -> RunView:
    assert served.view is not None
    return served.view


def pixel_of(page: OpenPage, title: str, time: float, value: float) -> tuple[float, float]:
    x, y = page.page.evaluate("([a, b, c]) => window.commissionPlots.pixelOf(a, b, c)", [title, time, value])
    return float(x), float(y)


def span_of(page: OpenPage) -> list[float]:
    return page.page.evaluate(f"{SHOWN}.view")


def dragged(page: OpenPage, title: str, begin: float, end: float, value: float) -> None:
    page.page.mouse.move(*pixel_of(page, title, begin, value))
    page.page.mouse.down()
    page.page.mouse.move(*pixel_of(page, title, end, value), steps=8)
    page.page.mouse.up()


def with_result(served: Served, change: Callable[[RunResult], RunResult]) -> RunResult:
    """Let the page show a run made by hand; returns the one before."""
    playback = served.runtime.service(RunService).playback
    assert playback is not None
    before = playback.result
    playback.replace(change(before))
    served.runtime.post(Seek(2.0))
    return before


def test_a_click_seeks_and_the_clock_says_the_time(served: Served, page: OpenPage) -> None:
    page.page.mouse.click(*pixel_of(page, NIS, 12.0, 1.0))
    served.until(lambda: run_of(served).time == pytest.approx(12.0, abs=0.1))
    page.page.wait_for_function(
        "text => document.querySelector('.c-clock b').innerText === text", arg=clock(run_of(served).time)
    )
    # All plots have one cursor, where the click was.
    page.page.wait_for_function(f"() => Math.abs({SHOWN}.cursor.time - 12) < 0.1")
    assert page.errors == []


def test_the_values_at_the_cursor_are_those_of_its_cycle(served: Served, page: OpenPage) -> None:
    run = run_of(served)
    values = page.page.evaluate(f"{SHOWN}.cursor.values")
    assert values[3][0] == [run.result.counts[run.newest, Status.INLIER]] * 2
    assert values[0][0][0] == pytest.approx(1000.0 * run.result.position_two_sigma[run.newest], rel=1e-9)


def test_a_drag_zooms_all_plots_and_a_double_click_shows_the_whole_run_again(served: Served, page: OpenPage) -> None:
    whole = span_of(page)
    assert whole == [0, pytest.approx(run_of(served).duration)]
    dragged(page, COUNTS, 4.0, 9.0, 2.0)
    page.page.wait_for_function(f"() => Math.abs({SHOWN}.view[1] - {SHOWN}.view[0] - 5) < 0.2")
    assert span_of(page) == pytest.approx([4.0, 9.0], abs=0.1)
    assert run_of(served).time == pytest.approx(1.0)  # a drag is no click
    # Finer curves have come: a cycle each.
    page.page.wait_for_function("() => !document.querySelector('.c-whole').disabled")
    page.page.mouse.dblclick(*pixel_of(page, POSITION, 6.0, 10.0))
    page.page.wait_for_function(f"end => {SHOWN}.view[0] === 0 && {SHOWN}.view[1] > end - 0.01", arg=whole[1])
    served.until(lambda: run_of(served).time == pytest.approx(1.0))
    dragged(page, NIS, 2.0, 3.0, 1.0)
    page.page.wait_for_function(f"() => {SHOWN}.view[0] > 1")
    page.page.wait_for_function("() => !document.querySelector('.c-whole').disabled")
    page.press("Whole run")
    page.page.wait_for_function(f"() => {SHOWN}.view[0] === 0")


@pytest.mark.with_all_seeds
def test_plots_are_chosen_by_each_browser_alone(served: Served, own: OpenPage, window: Callable[..., OpenPage]) -> None:
    other = window(served.server, SMALL)
    other.open(nodes=["/vehicle"])
    other.page.wait_for_function(f"() => {SHOWN}.titles.length === 6")
    own.press("2σ of heading")
    own.page.wait_for_function(f"() => {SHOWN}.titles.length === 5")
    own.press("Rejected by the gate")
    own.page.wait_for_function(f"() => {SHOWN}.titles.includes('Rejected by the gate [%]')")
    other.page.wait_for_timeout(500)
    assert len(other.page.evaluate(f"{SHOWN}.titles")) == 6
    assert "2σ of heading [°]" in other.page.evaluate(f"{SHOWN}.titles")


def test_two_plots_that_are_pressed_at_once_are_both_taken(own: OpenPage) -> None:
    before = own.page.evaluate(f"{SHOWN}.titles.length")
    pressed = ("2σ of heading", "Position error")
    own.page.evaluate(
        "names => names.forEach(name => [...document.querySelectorAll('.c-chips button')]"
        ".find(each => each.textContent === name).click())",
        pressed,
    )
    on = "[...document.querySelectorAll('.c-chips button[aria-pressed=true]')].map(each => each.textContent)"
    shown = set(own.page.evaluate(on))
    own.page.wait_for_timeout(500)
    assert {title.partition(" [")[0] for title in own.page.evaluate(f"{SHOWN}.titles")} == shown
    own.page.evaluate(
        "names => names.forEach(name => [...document.querySelectorAll('.c-chips button')]"
        ".find(each => each.textContent === name).click())",
        pressed,
    )
    own.page.wait_for_function(f"count => {SHOWN}.titles.length === count", arg=before)


def test_the_table_has_the_rows_and_plots_that_are_shown(served: Served, own: OpenPage, tmp_path: Path) -> None:
    for name in ("2σ of heading", "Position error", "Heading error", "2σ of position"):
        own.press(name)
    own.page.wait_for_function(f"() => {SHOWN}.titles.length === 2")
    dragged(own, COUNTS, 4.0, 5.0, 2.0)
    own.page.wait_for_function("() => !document.querySelector('.c-whole').disabled")
    begin, end = span_of(own)
    with own.page.expect_download() as download:
        own.press("CSV")
    download.value.save_as(tmp_path / "curves.csv")
    with (tmp_path / "curves.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    run = run_of(served).result
    shown = (run.times >= begin) & (run.times <= end)
    assert [int(row["stamp_ns"]) for row in rows] == run.columns.stamps_ns[shown].tolist()
    assert [int(row["inliers"]) for row in rows] == run.counts[shown, Status.INLIER].tolist()
    assert "nis_highest" in rows[0]
    assert "position_error_mm" not in rows[0]


def test_the_picture_is_what_is_shown(page: OpenPage, tmp_path: Path) -> None:
    with page.page.expect_download() as download:
        page.press("PNG")
    download.value.save_as(tmp_path / "curves.png")
    picture = np.asarray(Image.open(tmp_path / "curves.png").convert("RGB"), dtype=np.int64)
    box = page.page.evaluate(
        "(b => [b.width, b.height])(document.querySelector('.c-plots canvas').getBoundingClientRect())"
    )
    assert picture.shape[1::-1] == tuple(map(round, box))
    assert (np.abs(picture - np.array(theme.INLIER)).sum(axis=2) < 60).any()


def columns_with(page: OpenPage, title: str, value: float, span: tuple[float, float], color: theme.Color) -> np.ndarray:
    """Whether each pixel column of a stretch of time has a color within two pixels of a value."""
    (left, y), (right, _) = (pixel_of(page, title, time, value) for time in span)
    shot = page.page.screenshot(clip={"x": left, "y": y - 2, "width": right - left, "height": 5})
    picture = np.asarray(Image.open(BytesIO(shot)).convert("RGB"), dtype=np.int64)
    return (np.abs(picture - np.array(color)).sum(axis=2) < 150).any(axis=0)


def test_thirty_blind_scans_in_thirty_one_are_seen(served: Served, page: OpenPage) -> None:
    def blinded(run: RunResult) -> RunResult:
        counts = np.zeros_like(run.counts)
        seeing = np.arange(run.cycles) % 31 == 0
        # From 6 to 12 s thirty in thirty-one are blind, before and after none.
        seeing |= (run.times < 6.0) | (run.times > 12.0)
        counts[seeing, Status.INLIER] = 4
        return replace(run, counts=read_only(counts))

    before = with_result(served, blinded)
    try:
        served.runtime.post(Seek(run_of(served).duration))
        page.page.wait_for_function(f"end => {SHOWN}.cursor.time > end - 0.1", arg=run_of(served).duration)
        page.page.wait_for_timeout(600)
        page.page.mouse.move(400, 300)
        page.page.wait_for_timeout(200)
        assert columns_with(page, COUNTS, 0.0, (6.2, 11.8), theme.INLIER).mean() > 0.9
        # 560 scans, each 31st of which sees something: 18 spikes.
        seen = columns_with(page, COUNTS, 4.0, (6.2, 11.8), theme.INLIER)
        assert 16 <= np.count_nonzero(np.diff(seen.astype(int)) == 1) <= 20
        assert columns_with(page, COUNTS, 0.0, (2.0, 5.8), theme.INLIER).mean() < 0.1
        assert columns_with(page, COUNTS, 4.0, (2.0, 5.8), theme.INLIER).mean() > 0.9
    finally:
        with_result(served, lambda _: before)


def test_a_time_without_scans_is_a_gap_in_the_curve_and_no_line_across(served: Served, page: OpenPage) -> None:
    def paused(run: RunResult) -> RunResult:
        unknown = (run.times > 6.0) & (run.times < 10.0)
        return replace(run, position_errors=read_only(np.where(unknown, np.nan, 0.004)))

    before = with_result(served, paused)
    title = "Position error [mm]"
    try:
        served.runtime.post(Seek(run_of(served).duration))
        page.page.wait_for_function(f"end => {SHOWN}.cursor.time > end - 0.1", arg=run_of(served).duration)
        page.page.wait_for_timeout(800)
        assert columns_with(page, title, 4.0, (2.0, 5.8), theme.REFERENCE).mean() > 0.95
        assert columns_with(page, title, 4.0, (6.3, 9.7), theme.REFERENCE).mean() == 0.0
    finally:
        with_result(served, lambda _: before)


def test_plots_are_there_again_after_another_tab_and_can_have_more_room(page: OpenPage) -> None:
    page.open_tab("Route")
    page.page.wait_for_function("() => !document.querySelector('.c-plots')?.offsetParent")
    page.open_tab("Time")
    page.page.wait_for_function("() => document.querySelector('.c-plots canvas')?.offsetParent")
    height = "document.querySelector('.c-plots canvas').getBoundingClientRect().height"
    low = page.page.evaluate(height)
    page.press("Taller")
    page.page.wait_for_function(f"low => {height} > low + 200", arg=low)
    page.press("Lower")
    page.page.wait_for_function(f"low => {height} === low", arg=low)
    assert page.errors == []
