"""Which hypotheses of a search are shown, and the table that lists them. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from commission.app.run.view import RunView
from commission.localization.estimate import Mode
from commission.localization.hypotheses import Hypothesis
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT

MOST_SHOWN = 8
LEAST_SHOWN = 0.001
"""Probability from which on a place is shown."""
LOOKING = (Mode.INITIALIZING, Mode.LOST)
HEADS = ("", "%", "x, y [m]", "heading [°]", "2σ [mm]", "fits")


def shown_hypotheses(found: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Return those that are drawn and listed, the likeliest first."""
    return tuple(each for each in found[:MOST_SHOWN] if each.probability >= LEAST_SHOWN)


def hypotheses_html(run: RunView | None) -> str:
    """Return what is said of the places where the vehicle may be; empty where it does not look.

    Parameters
    ----------
    run : at the cursor.
    """
    if run is None or run.estimate is None or run.mode not in LOOKING:
        return ""
    shown = shown_hypotheses(run.hypotheses)
    head = "<b>Where it may be</b>"
    if not shown:
        note = "No place in the map fits what it sees yet."
        return f"<div class='c-hypotheses'>{head}<div class='c-note'>{note}</div></div>"
    rest = max(0.0, 1.0 - sum(each.probability for each in shown))
    cells = "".join(f"<th>{each}</th>" for each in HEADS)
    lines = "".join(_line(rank, each) for rank, each in enumerate(shown, start=1))
    note = f"{PERCENT.text(rest, '.1f')}: at none of them. {_verdict(shown)}"
    return (
        f"<div class='c-hypotheses'>{head}<table><tr>{cells}</tr>{lines}</table><div class='c-note'>{note}</div></div>"
    )


def _line(rank: int, found: Hypothesis) -> str:
    """Return one row of the table."""
    x, y, heading = found.pose.tolist()
    position = 2.0 * float(np.sqrt(np.linalg.eigvalsh(found.covariance[:2, :2])[-1]))
    cells = (
        str(rank),
        PERCENT.number(found.probability, ".1f"),
        f"{x:.2f}, {y:.2f}",
        DEGREES.number(heading, ".1f"),
        MILLIMETRES.number(position, ".0f"),
        f"{found.fits} %" if found.by_contours else str(found.fits),
    )
    return "<tr>" + "".join(f"<td>{each}</td>" for each in cells) + "</tr>"


def _verdict(shown: Sequence[Hypothesis]) -> str:
    """Say what it still waits for."""
    if len(shown) > 1:
        return f"Ambiguous: {len(shown)} places fit; driving tells them apart."
    if shown[0].agreed:
        return "One place is left; it is believed when further scans agree."
    return "One place fits, too little is seen to believe it; driving helps."
