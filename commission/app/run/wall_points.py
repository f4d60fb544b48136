"""The newest scan as the match of contours saw it: which beams lie on walls of the map, what it cost, what it told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization.contour import COST, DEPTH, MATCHED, NIS, POINTS, ROWS, THRESHOLD, USE, ContourUse
from commission.localization.contour_tables import distances_at
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.quantity import MILLIMETRES, PERCENT

FARTHEST_BACK = 500
"""Cycles before the cursor among which a matched scan is looked for: reflexes and frames lie between."""
SAID = {
    ContourUse.ACCEPTED: "accepted",
    ContourUse.REJECTED: "rejected: outside of the gate",
    ContourUse.UNMATCHED: "unused: too few beams on walls",
    ContourUse.CONTRADICTED: "contradicted: beams go through walls",
}
"""What became of a match, in words."""


@dataclass(frozen=True, slots=True, eq=False)
class WallPoints:
    """A match of contours, and the points of the scan."""

    matched: FloatArray
    """(n, 2) ends of beams that lie on walls [m], map frame, from the estimated pose."""
    unmatched: FloatArray
    """(m, 2) those that do not: people, boxes, what the map lacks."""
    figures: FloatArray
    """(COLUMNS,) see `contour`."""


def wall_points(columns: RunColumns, lived: int, points: FloatArray, setup: LocalizerSetup) -> WallPoints | None:
    """Return the newest match; None where contours are not looked at, or nothing was matched yet.

    Parameters
    ----------
    columns : the run.
    lived : cycles up to the cursor.
    points : (B, 2) ends of the beams of the newest scans [m], map frame.
    setup : of the newest cycle.
    """
    if setup.contour is None or not len(columns.contours):
        return None
    begin = max(lived - FARTHEST_BACK, 0)
    some = np.flatnonzero(columns.contours[begin:lived, USE] != ContourUse.NONE)
    if not len(some):
        return None
    figures = columns.contours[begin + int(some[-1])]
    with np.errstate(invalid="ignore"):
        near = np.abs(distances_at(setup.contour.tables, points) + figures[DEPTH]) <= figures[THRESHOLD]
    return WallPoints(points[near], points[~near], figures)


def walls_told(walls: WallPoints | None) -> list[tuple[str, str]]:
    """Say what a match told, line by line; nothing where there is none.

    Parameters
    ----------
    walls : the match.
    """
    if walls is None:
        return []
    figures = walls.figures
    beams, matched = figures[POINTS], figures[MATCHED]
    share = PERCENT.text(matched / beams) if beams else "none"
    nis = f", NIS {figures[NIS]:.2f} of {figures[ROWS]:.0f}" if np.isfinite(figures[NIS]) and figures[ROWS] else ""
    return [
        ("Contours", SAID[ContourUse(int(figures[USE]))] + nis),
        ("Beams on walls", f"{matched:.0f} of {beams:.0f} ({share}), within {MILLIMETRES.text(figures[THRESHOLD])}"),
        ("Cost of each beam", f"{figures[COST]:.3f} (0 on a wall, 1 far off)"),
        ("Beams end", f"{MILLIMETRES.text(figures[DEPTH])} behind the drawn walls"),
    ]
