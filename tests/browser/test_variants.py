"""Variants as a person uses them: keep one, move the gate, see both and their figures, take the move back."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from commission.app.run.charts import color_of
from commission.app.run.service import RunService
from commission.app.tune.calibration_service import CalibrationService
from commission.app.tune.map_check import CorrectMap
from commission.studies.map_findings import MapFault, MapFinding
from commission.studies.variants import VariantsResult
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served, standing_drive

FIGURES = ".c-variants table:not(.c-moments) tbody tr"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room(), at=10.0) as opened:
        yield opened


def compared(served: Served) -> VariantsResult | None:
    parts = served.runtime.service(RunService).parts(slowly=True)
    return next((part for part in parts if isinstance(part, VariantsResult)), None)


def figures(page: OpenPage) -> dict[str, list[str]]:
    rows = page.page.locator(FIGURES).all()
    cells = [[cell.inner_text() for cell in row.locator("td").all()] for row in rows]
    return {name: values for name, *values in cells}


def test_a_kept_variant_stays_beside_a_moved_gate_and_undo_brings_it_back(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server)
    page.open(nodes=["/run/trail", "/run/variant/A"])
    page.open_tab("Tune")
    page.page.locator(".c-views button", has_text="Variants").click()
    page.wait_for_text("Keep the run as it is now")
    page.page.locator(".c-keep").click()
    page.page.locator(FIGURES).first.wait_for()
    before = figures(page)
    assert before["Rejected by the gate"][0] == before["Rejected by the gate"][1]

    page.fill("Gate", "50")
    page.page.wait_for_function(
        "() => document.querySelector('.c-setting')?.innerText.replace(/\\s+/g, ' ') === 'Gate 50 % 95 %'"
    )
    served.until(lambda: (found := compared(served)) is not None and found.figures[5].values[0] > 0.02)
    page.page.wait_for_function(
        "() => { const row = [...document.querySelectorAll('.c-variants tr')]"
        ".find(each => each.innerText.startsWith('Rejected by the gate'));"
        " return row && parseFloat(row.children[1].innerText) > 2; }"
    )
    shown = figures(page)
    now, kept = shown["Rejected by the gate"]
    assert kept == before["Rejected by the gate"][1]
    found = compared(served)
    assert found is not None
    assert now == f"{100.0 * found.figures[5].values[0]:.2f} %"
    assert shown["Position error, RMS"][0] != shown["Position error, RMS"][1]

    # Both on the floor and in the plots, each where its numbers are.
    view = served.view
    assert view is not None
    (variant,) = view.kept
    assert variant.letter == "A"
    assert not np.array_equal(variant.run.columns.means, view.result.columns.means)
    page.page.locator(".c-views button", has_text="Plots").click()
    legend = page.page.evaluate(
        "window.commissionPlots.drawnLines().filter(line => line.variant).map(line => [line.label, line.color])"
    )
    assert legend
    assert set(map(tuple, legend)) == {("A", color_of("A"))}

    # A moment at which they differ is gone to.
    page.page.locator(".c-views button", has_text="Variants").click()
    moment = found.moments[0]
    page.page.locator(".c-moments tbody tr").first.click()
    served.until(lambda: served.view is not None and abs(served.view.time - moment.time) < 1e-3, 10.0)

    page.page.get_by_role("button", name="Undo").first.click()
    page.page.wait_for_function("() => !document.querySelector('.c-setting')")
    page.page.wait_for_function(
        "() => { const row = [...document.querySelectorAll('.c-variants tr')]"
        ".find(each => each.innerText.startsWith('Rejected by the gate'));"
        " return row && row.children[1].innerText === row.children[2].innerText; }"
    )
    assert figures(page)["Rejected by the gate"] == before["Rejected by the gate"]

    # Its parameters are taken back by its own button, too; then it is forgotten.
    page.fill("Gate", "60")
    page.page.get_by_label("Use A").click()
    served.until(lambda: served.state.project.parameters.association.gate_probability == 0.95, 10.0)

    calibrated(served, page)
    map_corrected(served, page)

    page.page.get_by_label("Forget A").click()
    page.wait_for_text("Keep the run as it is now")
    served.until(lambda: served.view is not None and served.view.kept == (), 10.0)
    assert page.errors == []


def calibrated(served: Served, page: OpenPage) -> None:
    """Calibrate by the drive, accept both figures that it proposes beside the variant, and take them back."""
    page.fold("Calibration")
    page.press("Calibrate by this drive")
    page.wait_for_text("2 figures proposed, 0 accepted.")
    assert "mounting x needs turning on the spot" in page.text()
    before = served.state.project
    variant = figures(page)["NIS of all near a reflector"][1]
    page.press("Accept Range 1σ")
    page.wait_for_text("2 figures proposed, 1 accepted.")
    page.press("Accept Bearing 1σ")
    page.wait_for_text("2 figures proposed, 2 accepted.")
    page.wait_for_text("Bearing 1σ accepted")

    view = served.runtime.service(CalibrationService).view
    assert view is not None
    proposed = {each.key: each.proposed for each in view.calibration.proposed}
    observation = served.state.project.parameters.observation
    assert observation.range_sigma == proposed["observation.range_sigma"]
    assert observation.bearing_sigma == proposed["observation.bearing_sigma"]
    assert served.state.project.parameters.odometry == before.parameters.odometry
    served.until(lambda: (run := served.view) is not None and run.result.consistency.nis_before_gate_mean > 1.0, 10.0)
    assert served.view is not None
    now = f"{served.view.result.consistency.nis_before_gate_mean:.2f}"
    page.page.wait_for_function(
        "text => [...document.querySelectorAll('.c-variants tr')]"
        ".some(row => row.innerText.startsWith('NIS of all') && row.children[1].innerText.startsWith(text))",
        arg=now,
    )
    assert figures(page)["NIS of all near a reflector"][1] == variant

    for left in (1, 0):
        page.page.get_by_role("button", name="Undo").first.click()
        page.wait_for_text(f"2 figures proposed, {left} accepted.")
    assert served.state.project is before


def map_corrected(served: Served, page: OpenPage) -> None:
    """Let the map have a reflector elsewhere than the drive, and correct it by the drive; then take it all back."""
    first = served.state.project.reflectors.reflectors[0]
    wrong = MapFinding(
        fault=MapFault.MOVED,
        id=first.id,
        before=(first.x, first.y),
        after=(first.x, first.y + 0.08),
        sigma=0.0,
        since="",
        evidence=(),
        text="",
    )
    served.runtime.post(CorrectMap((wrong,)))
    served.until(lambda: served.state.project.reflectors.reflectors[0].y == first.y + 0.08, 10.0)
    surveyed = served.state.project
    page.fold("Map against the drive")
    page.press("Check the map by this drive")
    page.wait_for_text("R1 has moved by")
    page.wait_for_text("0.250, 2.080")
    tick = page.page.get_by_role("checkbox", name="R1: moved")
    assert tick.is_checked()
    tick.click()
    page.wait_for_text("Correct the map (0)")
    assert page.page.get_by_role("button", name="Correct the map (0)").is_disabled()
    tick.click()
    page.press("Correct the map (1)")
    served.until(lambda: abs(served.state.project.reflectors.reflectors[0].y - first.y) < 0.02, 10.0)
    page.wait_for_text("The map has it there by now")
    page.page.get_by_role("button", name="Undo").first.click()
    served.until(lambda: served.state.project == surveyed, 10.0)
    page.page.get_by_role("button", name="Undo").first.click()
    served.until(lambda: served.state.project.reflectors.reflectors[0] == first, 10.0)
