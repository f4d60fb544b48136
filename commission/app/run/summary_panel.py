"""The drive as a whole: what looks wrong, and how well its detections fit, of all of it and between stations."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.inputs import Text
from commission.app.base.panel import BasePanel, escaped, table
from commission.app.base.view import PageView
from commission.app.run.found_table import Found
from commission.app.run.view import RunView
from commission.site.quantity import PERCENT
from commission.site.stations import Station
from commission.studies.bearing_figures import bearing_figures, bearing_findings
from commission.studies.consistency import Consistency
from commission.studies.consistency_findings import consistency_findings
from commission.studies.plausibility import Finding
from commission.studies.run import RunResult
from commission.studies.sections import Section, sections

FINDING_STYLE = "font-size:12px;line-height:1.35;padding:3px 6px;margin:2px 0"


class SummaryPanel(BasePanel):
    """Findings and figures of the whole drive, behind the cursor included."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = Text(gui)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the run and the stations."""
        run = view.part(RunView)
        if run is None:
            self._html.write((None,), str)
            return
        stations, misplaced = view.state.project.stations, misplaced_of(view.part(Found), run.result)
        self._html.write((id(run.result), stations, misplaced), lambda: summary(run.result, stations, misplaced))


def misplaced_of(found: Found | None, result: RunResult) -> tuple[Finding, ...]:
    """Return what is known of where reflectors stand to each other, once it is found on this run and no earlier one."""
    return found.misplaced if found is not None and found.events.inputs.run is result else ()


def summary(result: RunResult, stations: tuple[Station, ...], misplaced: tuple[Finding, ...] = ()) -> str:
    """Return what looks wrong, and the figures of the drive and of its sections.

    Parameters
    ----------
    result : the whole drive.
    stations : between which sections lie.
    misplaced : what was found in the background of where reflectors stand to each other.
    """
    findings = (*consistency_findings(result.columns), *misplaced, *bearing_findings(result.columns))
    background = theme.css(theme.WARNING_LINE)
    lines = "".join(
        f"<div class='c-finding' style='background:{background};{FINDING_STYLE}'>"
        f"<b>{escaped(each.found)}</b>: {escaped(each.probably)}</div>"
        for each in findings
    )
    if not findings:
        lines = "<div class='c-note'>Nothing looks wrong about what is accepted and rejected.</div>"
    cut = sections(result.columns, stations)
    scans = rows(result.consistency) if result.columns.has_scans else []
    return (
        f"<div class='c-summary' style='padding:2px 6px'>{lines}<div style='padding-top:4px'><b>Whole drive</b></div>"
        f"{table([*_of_bearings(result), *scans])}{_sections(cut) if len(cut) > 1 else ''}</div>"
    )


def rows(figures: Consistency) -> list[tuple[str, str]]:
    """Figures of the drive, line by line: none of what is accepted without what is not."""
    return [
        ("NIS of the accepted / expected", f"{known(figures.nis_mean)} / {figures.nis_expected:.2f}"),
        ("NIS of all near a reflector / expected", f"{known(figures.nis_before_gate_mean)} / 2"),
        ("Rejected", share(figures.rejected_fraction)),
        ("Cycles without an accepted one", share(figures.unseen_fraction)),
        ("Longest without", f"{figures.longest_unseen:.1f} s"),
    ]


def _of_bearings(result: RunResult) -> list[tuple[str, str]]:
    """Figures of the bearings of a goniometer; none where the drive has none."""
    told = bearing_figures(result.columns)
    if not told:
        return []
    nis = told["bearing_nis_before_gate_mean"]
    return [
        ("Bearings accepted / rejected", f"{told['bearing_accepted']} / {told['bearing_rejected']}"),
        ("NIS of both / expected", f"{known(math.nan if nis is None else nis)} / 1"),
    ]


def _sections(cut: tuple[Section, ...]) -> str:
    """A row for each section between stations."""
    head = "".join(
        f"<th style='text-align:{'right' if number else 'left'};font-weight:400;opacity:.75'>{each}</th>"
        for number, each in enumerate(("Section", "NIS of all", "rejected", "unseen", "longest"))
    )
    body = "".join(
        "<tr>"
        + "".join(
            f"<td style='text-align:{'right' if number else 'left'}'>{cell}</td>"
            for number, cell in enumerate(
                (
                    f"{escaped(each.begin)} – {escaped(each.end)}",
                    known(each.figures.nis_before_gate_mean),
                    share(each.figures.rejected_fraction),
                    share(each.figures.unseen_fraction),
                    f"{each.figures.longest_unseen:.1f} s",
                )
            )
        )
        + "</tr>"
        for each in cut
    )
    return f"<table class='c-sections' style='width:100%;font-size:11px;margin-top:6px'><tr>{head}</tr>{body}</table>"


def known(figure: float) -> str:
    """A figure of detections, of which there may be none."""
    return "–" if math.isnan(figure) else f"{figure:.2f}"


def share(figure: float) -> str:
    """A share of detections, of which there may be none."""
    return "–" if math.isnan(figure) else PERCENT.text(figure, ".1f")
