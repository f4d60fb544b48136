"""The page of a project in a real browser: what the issue promises a person who opens it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from commission.app.base.paints import Floor, Paint, Run
from commission.app.base.panel import clock
from commission.app.run.actions import Play, Restart, Seek, SetSpeed, VirtualDrive
from commission.app.run.state import RunState
from commission.app.run.view import RunView
from commission.app.tune.actions import ResetParameters
from commission.site.fields import with_field
from commission.site.project import Project
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served

NODES = ("/floor/map", "/vehicle/outline", "/run/gates", "/run/scan", "/reflectors/marks", "/routes")


class OpenRun(Served):
    """A served project whose virtual vehicle drives."""

    def __init__(self, project: Project) -> None:
        super().__init__(project, source=VirtualDrive(project.routes[0].name))
        self.until(lambda: super(OpenRun, self).view is not None)

    @property
    def view(self) -> RunView:
        view = super().view
        assert view is not None
        return view


@pytest.fixture(scope="module")
def run() -> Iterator[OpenRun]:
    project = room()
    # Tight enough that half a minute without reflectors is too long.
    opened = OpenRun(replace(project, parameters=with_field(project.parameters, "supervisor.position_limit", 0.03)))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def page(run: OpenRun, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One small window for all tests: where the processor draws, opening one is what takes longest."""
    opened = lasting_window(run.server, SMALL, sharp=True)
    opened.page.set_default_timeout(60_000)
    opened.open(nodes=NODES)
    return opened


@pytest.fixture(autouse=True)
def from_the_start(run: OpenRun, page: OpenPage) -> None:
    """Each test finds the drive playing from its start with the saved parameters."""
    run.runtime.post(ResetParameters())
    run.runtime.post(Restart())
    run.runtime.post(SetSpeed(1.0))
    run.runtime.post(Play(playing=True))


def wait_for_badge(page: OpenPage, word: str) -> None:
    page.page.wait_for_function("word => document.querySelector('.c-badge').innerText.includes(word)", arg=word)


def settled_clock(run: OpenRun) -> str:
    """Time that every browser shows once the run is paused."""
    run.until(lambda: not run.runtime.state.part(RunState).playing)
    return clock(run.view.time)


def vehicle_in(page: OpenPage) -> np.ndarray:
    """Where the browser has the vehicle."""
    place = "(() => { const p = window.__viserMutable.nodeRefFromName['/vehicle'].position; return [p.x, p.y] })()"
    return np.array(page.page.evaluate(place))


def test_the_page_shows_a_driving_vehicle_its_badge_and_every_panel(run: OpenRun, page: OpenPage) -> None:
    wait_for_badge(page, "OPERATIONAL")
    before = vehicle_in(page)
    run.until(lambda: float(np.hypot(*(vehicle_in(page) - before))) > 0.1)
    for text in ("Largest NIS / gate", "validation area", "Position error", "Floor map"):
        page.wait_for_text(text)
    page.page.wait_for_function("() => window.commissionPlots?.shown.titles.length === 6")
    assert page.errors == []
    assert run.runtime.state.faults == ()


def test_the_badge_turns_red_when_reflectors_are_covered_and_back(run: OpenRun, page: OpenPage) -> None:
    wait_for_badge(page, "OPERATIONAL")
    page.open_tab("Run")
    page.tick("Cover reflectors")
    wait_for_badge(page, "FAIL")
    red = "rgb({}, {}, {})".format(*Run.FAIL.dark)
    assert red in page.page.evaluate("getComputedStyle(document.querySelector('.c-badge')).background")
    page.tick("Cover reflectors")
    wait_for_badge(page, "OPERATIONAL")


def test_the_gate_slider_widens_the_validation_areas(run: OpenRun, page: OpenPage) -> None:
    run.runtime.post(Play(playing=False))
    # Some way from the start, where the initial uncertainty no longer shrinks from scan to scan.
    run.runtime.post(Seek(2.0))
    run.until(lambda: run.view.time == pytest.approx(2.0))
    before, at = np.ptp(run.view.gates, axis=1).mean(), run.view.lived
    page.open_tab("Tune")
    page.fill("Gate [%]", "99.99")
    run.until(lambda: run.runtime.state.project.parameters.association.gate_probability == pytest.approx(0.9999))
    # Nothing has to be played again: the whole drive is there with the new gate, and the cursor is where it was.
    run.until(lambda: np.ptp(run.view.gates, axis=1).mean() > 1.5 * before)
    assert run.view.lived == at
    page.press("Undo set gate probability")
    run.until(lambda: run.runtime.state.project.parameters.association.gate_probability == 0.95)
    page.page.wait_for_function("() => [...document.querySelectorAll('input')].some(i => i.value === '95')")


def test_the_time_line_seeks_and_play_and_pause_obey(run: OpenRun, page: OpenPage) -> None:
    page.press("Pause")
    run.until(lambda: not run.runtime.state.part(RunState).playing)
    track = page.page.locator("div:has(> div > .c-bottom) .mantine-Slider-track").first.bounding_box()
    assert track is not None
    page.page.mouse.click(track["x"] + 0.5 * track["width"], track["y"] + 0.5 * track["height"])
    half = 0.5 * run.view.duration
    run.until(lambda: abs(run.view.time - half) < 0.05 * half)
    page.press("Play")
    run.until(lambda: run.view.time > 1.1 * half)
    page.press("Reverse")
    run.until(lambda: run.view.time < half)
    page.press("Pause")
    run.until(lambda: not run.runtime.state.part(RunState).playing)
    at = run.view.lived
    page.press("Back")
    run.until(lambda: run.view.lived == at - 1)
    page.press("Step")
    run.until(lambda: run.view.lived == at)


def test_edits_from_here_on_leave_what_was_lived_and_are_marked(run: OpenRun, page: OpenPage) -> None:
    run.runtime.post(Play(playing=False))
    run.runtime.post(Seek(2.0))
    run.until(lambda: run.view.time == pytest.approx(2.0))
    at, before = run.view.lived, run.view.result
    page.open_tab("Tune")
    # The step Run has the same switch; the hidden one has no role.
    switch = page.page.get_by_role("checkbox", name="Edits from here on")
    switch.click()
    page.fill("Gate [%]", "60")
    run.until(lambda: run.view.result is not before)
    assert [segment.first for segment in run.view.result.columns.segments] == [0, at]
    np.testing.assert_array_equal(run.view.result.columns.means[:at], before.columns.means[:at])
    page.page.wait_for_function("() => document.querySelector('.c-strip').dataset.edits === '1'")
    said = page.page.locator(".c-note:visible")
    said.filter(has_text="Changed on the way at 00:02").wait_for()
    switch.click()
    said.filter(has_text="Acts on the whole drive").wait_for()


@pytest.mark.with_all_seeds
def test_two_browsers_see_the_same_run_each_in_its_own_view(
    run: OpenRun, page: OpenPage, window: Callable[..., OpenPage]
) -> None:
    one, other = page, window(run.server, SMALL)
    other.page.set_default_timeout(60_000)
    other.open(nodes=NODES)
    other.press("3D")
    other.wait_until_drawn(("/floor/walls", "/vehicle/body", "/reflectors/bodies/cylinder"))
    assert not one.page.evaluate("'/floor/walls' in window.__viserMutable.nodeRefFromName")
    one.press("Pause")
    run.until(lambda: not run.runtime.state.part(RunState).playing)
    other.page.wait_for_function(
        "text => document.querySelector('.c-clock b').innerText === text", arg=settled_clock(run)
    )
    run.until(lambda: np.allclose(vehicle_in(one), vehicle_in(other), atol=1e-4))
    assert one.page.locator(".c-clock b").inner_text() == other.page.locator(".c-clock b").inner_text()


def test_a_layer_switched_off_disappears_and_the_legend_explains_the_rest(run: OpenRun, page: OpenPage) -> None:
    for entry in ("inlier", "outlier: outside every gate", "outlier: too few or many beams", "reference (truth)"):
        page.wait_for_text(entry)
    page.open_tab("Layers")
    page.page.locator("[data-layer=Routes] > span").click()
    page.page.wait_for_function("() => !window.__viserMutable.nodeRefFromName['/routes'].visible")
    strength = "names => names.map(n => getComputedStyle(document.querySelector(`[data-layer=${n}] span`)).opacity)"
    assert page.page.evaluate(strength, ["Routes", "Grid"]) == ["0.5", "1"], "which one is off can be read"
    page.page.get_by_label("Show Routes").click()
    page.page.wait_for_function("() => window.__viserMutable.nodeRefFromName['/routes'].visible")
    groups = page.page.locator(".c-layers h4").all_inner_texts()
    assert groups == ["Map", "Site", "Run", "Plan"]


@pytest.mark.with_all_seeds
def test_the_opacity_of_a_layer_makes_its_marks_fainter_for_points_and_for_lines(
    run: OpenRun, page: OpenPage, tmp_path: Path
) -> None:
    page.open_tab("Layers")
    run.runtime.post(Play(playing=False))
    shown = "text => document.querySelector('.c-clock b').innerText === text"
    page.page.wait_for_function(shown, arg=settled_clock(run))
    page.page.wait_for_timeout(500)

    def amount(layer: str, percent: int, paint: Paint) -> int:
        slider = page.page.get_by_label(f"Opacity of {layer} [%]")
        slider.evaluate("(e, v) => { e.value = v; e.dispatchEvent(new Event('input', { bubbles: true })); }", percent)
        page.page.wait_for_timeout(600)
        page.wait_until_drawn()
        page.screenshot(shot := tmp_path / f"{layer}{percent}.png")
        pixels = np.asarray(Image.open(shot).convert("RGB"), np.int64)[60:400, 360:980]
        return int((np.abs(pixels - np.array(paint.dark)).max(axis=2) < 24).sum())

    for layer, paint in (("Scan", Run.SCAN), ("Vehicle", Floor.VEHICLE)):
        whole = amount(layer, 100, paint)
        assert whole > 20, layer
        assert amount(layer, 20, paint) < 0.6 * whole, layer  # plates of names are as bright as the vehicle
        assert amount(layer, 100, paint) == pytest.approx(whole, rel=0.1), "and back"


def test_a_recording_that_is_none_gives_one_clear_line_on_the_page(run: OpenRun, page: OpenPage) -> None:
    page.open_tab("Run")
    page.fill("Folder", "/no/such <b>recording</b>")
    page.press("Open")
    # The browser that asked is told the path; the list that all browsers see says only that something failed.
    page.page.get_by_text("/no/such <b>recording</b>").first.wait_for(state="attached")
    run.until(lambda: bool(run.runtime.state.faults))
    page.open_tab("Problems")
    page.wait_for_text(run.runtime.state.faults[-1])
    assert "\n" not in run.runtime.state.faults[-1]
    page.press("Clear")
    run.until(lambda: not run.runtime.state.faults)


def test_folded_plots_leave_their_room_to_the_floor_which_is_fitted_anew(run: OpenRun, page: OpenPage) -> None:
    page.press("Fit")
    page.wait_until_drawn()
    height = "window.__viserMutable.canvas.getBoundingClientRect().height"
    unfolded = page.page.evaluate(height)
    corners = ((0.0, 0.0), (12.0, 8.0))
    page.page.locator(".c-fold").click()
    page.page.wait_for_function(f"before => {height} > before + 150", arg=unfolded)
    page.wait_until_drawn()
    (left, bottom), (right, top) = (page.pixel_of(corner) for corner in corners)
    box = page.page.evaluate("(b => [b.left, b.right])(window.__viserMutable.canvas.getBoundingClientRect())")
    # The room is wider than the floor's window is high: after the fold its width decides.
    assert box[0] < left < box[0] + 0.1 * (box[1] - box[0])
    assert bottom - top > 0.9 * (right - left) * 8.0 / 12.0
    page.page.locator(".c-fold").click()
    page.page.wait_for_function(f"before => {height} === before", arg=unfolded)
