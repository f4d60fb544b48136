"""The newest cycle in numbers: where the vehicle is, how well that is known, what was seen."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.base.inputs import show
from commission.app.base.panel import BasePanel, table
from commission.app.base.view import PageView
from commission.app.editing.editor import editor_of
from commission.app.run.view import RunView
from commission.localization.estimate import Mode, Status
from commission.site.quantity import DEGREES, MILLIMETRES
from commission.site.truth import truth_told
from commission.studies.run import RunResult
from commission.studies.scanner_figures import residuals_told

MODES = {
    Mode.OPERATIONAL: "operational",
    Mode.FAIL: "fail: too uncertain, output withheld",
    Mode.LOST: "lost: rejects what it sees, output withheld",
}
"""What the page says of each."""


def rows(run: RunView) -> list[tuple[str, str]]:
    """Return what the panel shows, line by line."""
    x, y, heading = run.pose
    shown = [
        ("Mode", MODES[run.mode]),
        ("Fail episodes so far", str(len(run.lived_episodes))),
        ("Position x, y", f"{x:.3f}, {y:.3f} m"),
        ("Heading", DEGREES.text(heading, ".2f")),
    ]
    if run.estimate is None:
        return shown
    result, newest = run.result, run.newest
    limits = run.segment.setup.parameters.supervisor
    sigma_x, sigma_y, sigma_heading = result.two_sigma[newest]
    largest = result.position_two_sigma[newest]
    estimate = run.estimate
    nis = f"{result.nis[newest]:.2f}" if math.isfinite(result.nis[newest]) else "none seen"
    error = result.position_errors[newest]
    shown += [
        ("2σ position / limit", MILLIMETRES.against(largest, limits.position_limit)),
        ("2σ along x, along y", f"{MILLIMETRES.number(sigma_x, '.1f')}, {MILLIMETRES.text(sigma_y, '.1f')}"),
        ("2σ heading / limit", DEGREES.against(sigma_heading, limits.heading_limit, (".2f", ".1f"))),
        ("Inliers", str(estimate.count(Status.INLIER))),
        (
            "Outliers by beams, gate",
            f"{estimate.count(Status.OUTLIER_DETECTOR)}, {estimate.count(Status.OUTLIER_ASSOCIATION)}",
        ),
        ("Largest NIS / gate", f"{nis} / {estimate.gate:.2f}"),
        *_of_scanners(result),
        ("Cycle time", f"{result.microseconds_per_cycle:.1f} µs, mean of the drive"),
        ("Position error", MILLIMETRES.text(error, ".1f") if math.isfinite(error) else "no reference"),
    ]
    truth = result.inputs.log.truth
    return shown if truth is None else [*shown, *((f"True {what}", text) for what, text in truth_told(truth))]


def _of_scanners(result: RunResult) -> list[tuple[str, str]]:
    """Figures of each of several scanners over the drive: what it contributed, and how far off it is."""
    shown: list[tuple[str, str]] = []
    for each in result.scanners if len(result.scanners) > 1 else ():
        shown.append((f"{each.name}, accepted", f"{each.accepted} of {each.seen}"))
        known = residuals_told(each)
        if known is not None:
            shown.append((f"{each.name}, to {known[0]}", known[1]))
    return shown


class NowPanel(BasePanel):
    """Numbers of the newest cycle, as long as a browser has nothing selected whose values take the room."""

    def __init__(self, gui: GuiApi, browser: int) -> None:
        self._browser = browser
        self._html = gui.add_html("<div class='c-note'>Numbers appear with the first scan.</div>")

    def draw_slowly(self, view: PageView) -> None:
        """Show the numbers."""
        is_shown = not editor_of(view.state, self._browser).has_selection
        show(self._html, visible=is_shown)
        run = view.part(RunView)
        if run is not None and is_shown:
            shown = table(rows(run))
            self._html.content = f"<div class='c-now' style='padding:2px 14px 2px 6px'>{shown}</div>"
