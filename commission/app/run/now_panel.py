"""The newest cycle in numbers: where the vehicle is, how well that is known, what was seen."""

from __future__ import annotations

import math

import numpy as np
from viser import GuiApi

from commission.app.base.panel import BasePanel, escaped, table
from commission.app.base.view import PageView
from commission.app.run.found_table import Found
from commission.app.run.sightings import sightings_told
from commission.app.run.summary_panel import known, share
from commission.app.run.turn import turn_told
from commission.app.run.view import RunView
from commission.app.run.wall_points import walls_told
from commission.localization.detector import passing_widths
from commission.localization.estimate import Estimate, Mode, Status
from commission.site.quantity import DEGREES, MILLIMETRES, counted_text
from commission.site.truth import truth_told
from commission.studies.run import TWO_SIGMA, RunResult
from commission.studies.scanner_figures import residuals_told

MODES = {
    Mode.OPERATIONAL: "operational",
    Mode.FAIL: "<span title='The pose is too uncertain.'>fail: no output</span>",
    Mode.LOST: "<span title='Rejects what it sees.'>lost: no output</span>",
    Mode.INITIALIZING: "<span title='Looks where it is; no output.'>initializing</span>",
}
"""What the page says of each, in one line; why, where it is pointed at."""
MOST_REJECTED = 4
"""Rejected clusters of a scan that are explained."""


def rows(run: RunView, found: Found | None = None) -> list[tuple[str, str]]:
    """Return what the panel shows, line by line; protection levels as soon as they are known of this run."""
    x, y, heading = run.pose
    shown = [
        ("Mode", MODES[run.mode]),
        ("Position x, y", f"{x:.3f}, {y:.3f} m"),
        ("Heading", DEGREES.text(heading, ".2f")),
    ]
    episodes = ("Fail episodes so far", str(len(run.lived_episodes)))
    if run.estimate is None:
        return [*shown, episodes]
    result, newest = run.result, run.newest
    limits = run.segment.setup.parameters.supervisor
    sigma_x, sigma_y, sigma_heading = result.two_sigma[newest]
    largest = result.position_two_sigma[newest]
    estimate = run.estimate
    error = result.position_errors[newest]
    shown += [
        ("2σ position / limit", MILLIMETRES.against(largest, limits.position_limit)),
        ("2σ along x, along y", f"{MILLIMETRES.number(sigma_x, '.1f')}, {MILLIMETRES.text(sigma_y, '.1f')}"),
        ("2σ heading / limit", DEGREES.against(sigma_heading, limits.heading_limit, (".2f", ".1f"))),
        *turn_told(run.turn),
        *sightings_told(run.sightings),
        *walls_told(run.walls),
        *(_counts(estimate) if estimate.bearing is None else ()),
        *_protection(run, found),
        *(_fits(run, estimate) if estimate.bearing is None else ()),
        *_of_scanners(result),
        episodes,
        ("Cycle time", f"{result.microseconds_per_cycle:.1f} µs, mean of the drive"),
        ("Position error", MILLIMETRES.text(error, ".1f") if math.isfinite(error) else "no reference"),
    ]
    truth = result.inputs.log.truth
    return shown if truth is None else [*shown, *((f"True {what}", text) for what, text in truth_told(truth))]


def _counts(estimate: Estimate) -> list[tuple[str, str]]:
    """How many detections of the newest scan are used."""
    beams, gate = estimate.count(Status.OUTLIER_DETECTOR), estimate.count(Status.OUTLIER_ASSOCIATION)
    return [("Inliers", str(estimate.count(Status.INLIER))), ("Outliers: beams, gate", f"{beams}, {gate}")]


def _fits(run: RunView, estimate: Estimate) -> list[tuple[str, str]]:
    """How well detections fit, of the newest scan and of late."""
    result, newest, worst = run.result, run.newest, run.result.nis[run.seen]
    nis = f"{worst:.2f}" if math.isfinite(worst) else "none seen"
    return [
        ("Largest NIS / gate", f"{nis} / {estimate.gate:.2f}"),
        ("NIS of all / expected, 1 s", f"{known(result.recent.nis[newest])} / 2"),
        ("Rejected, 1 s", share(result.recent.rejected[newest])),
    ]


def _protection(run: RunView, found: Found | None) -> list[tuple[str, str]]:
    """How large the error can be at most, and which reflector's failure would make it so."""
    limits, held = run.segment.setup.parameters.supervisor, run.result.held(run.newest)
    decided: list[tuple[str, str]] = []
    if found is not None and found.levels is not None and found.events.inputs.run is run.result:
        levels, worst = found.levels, int(found.levels.worst[run.newest])
        position, heading = levels.position[run.newest], levels.heading[run.newest]
        decided = [
            ("Decided by", "noise alone" if worst < 0 else f"{escaped(levels.reflector[worst])}, if it misleads")
        ]
    elif held.name != TWO_SIGMA:
        position, heading = held.position, held.heading
    else:
        return []
    if not math.isfinite(position):
        return [("Protection level", "none: not located")]
    return [
        ("Protection level / limit", MILLIMETRES.against(position, limits.position_limit)),
        ("Protection, heading / limit", DEGREES.against(heading, limits.heading_limit, (".2f", ".1f"))),
        *decided,
    ]


def rejected_by_beams(run: RunView) -> list[tuple[str, str]]:
    """Say why each cluster was rejected that failed the detector filter, the nearest first: beams against expected."""
    estimate = run.estimate
    if estimate is None:
        return []
    found = np.flatnonzero((estimate.status == Status.OUTLIER_DETECTOR) & (estimate.beams > 0))
    nearest = found[np.argsort(estimate.measured[found, 0], kind="stable")]
    shown = [_rejection(run, estimate, int(row)) for row in nearest[:MOST_REJECTED]]
    left = len(nearest) - MOST_REJECTED
    return shown if left <= 0 else [*shown, ("Rejected by beams", f"and {left} more")]


def _rejection(run: RunView, estimate: Estimate, row: int) -> tuple[str, str]:
    """Where a rejected cluster is, and its beams against those with which it would pass."""
    setup = run.segment.setup
    model, step = setup.detectors[estimate.scanner], setup.scanners[estimate.scanner].angle_increment
    distance, bearing = (float(value) for value in estimate.measured[row])
    beams = int(estimate.beams[row])
    passing = sorted({passing_widths(distance, step, kind, model) for kind in range(len(model.radii))})
    if not passing:
        expected = "no reflector is in the map"
    elif any(low <= beams <= high for low, high in passing):
        # A plate, as its ranges say that it stands.
        expected = f"expected about {estimate.expected_beams[row]:.1f} for how its ranges lie"
    else:
        expected = "expected " + " or ".join(f"{low} to {high}" for low, high in passing)
    where = f"{distance:.2f} m, {DEGREES.text(bearing)}"
    return f"Cluster at {where}", f"{counted_text(beams, 'beam')}, {expected}: rejected"


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
    """Numbers of the newest cycle, always there, above the properties of whatever is selected."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html(_framed("<div class='c-note'>Numbers appear with the first scan.</div>"))

    def draw_slowly(self, view: PageView) -> None:
        """Show the numbers."""
        run = view.part(RunView)
        if run is not None:
            self._html.content = _framed(table([*rows(run, view.part(Found)), *rejected_by_beams(run)]))


def _framed(content: str) -> str:
    return f"<div class='c-now'>{content}</div>"
