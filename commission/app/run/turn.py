"""The newest turn of a goniometer as the page draws it: a line for each bearing, and what became of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.localization.bearings import NIS, REFLECTOR, USE, BearingUse
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup

LONGEST_LINE = 8.0
"""Length of the line of a bearing that no reflector ends [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """Bearings of the time of one turn before the cursor."""

    lines: FloatArray
    """(n, 2, 2) from the goniometer, where the filter had it then, along each bearing [m], map frame."""
    uses: NDArray[np.int64]
    """(n,) a `BearingUse` each."""
    nis: FloatArray
    """(n,) NIS of each, 1 degree of freedom; NaN where it was held against no reflector."""
    gate: float
    """Largest NIS of an accepted one."""

    def count(self, use: BearingUse) -> int:
        """Return the number of bearings of one use."""
        return int(np.count_nonzero(self.uses == use))


def turn_at(columns: RunColumns, lived: int, at_ns: int, setup: LocalizerSetup) -> Turn | None:
    """Return the newest turn; None where the drive has no bearings, or they are not looked at.

    Parameters
    ----------
    columns : the run.
    lived : cycles up to the cursor.
    at_ns : the cursor [ns].
    setup : of the newest cycle.
    """
    met, model = columns.detected.bearings, setup.bearing_model
    scanner = next((each for each in setup.scanners if each.is_goniometer), None)
    if met is None or model is None or scanner is None or not len(columns.bearings):
        return None
    begin = int(np.searchsorted(columns.stamps_ns, at_ns - scanner.period_ns, side="right"))
    cycles = begin + np.flatnonzero(met.is_reflex[begin:lived])
    rows = met.numbers[cycles] - met.first
    some = np.isfinite(met.bearings[rows])
    cycles, rows = cycles[some], rows[some]
    figures = columns.bearings[rows]
    T_map_scanner = se2.compose(columns.means[cycles], scanner.mounting)
    angles = T_map_scanner[:, 2] + scanner.upright(met.bearings[rows])
    lengths = np.full(len(rows), LONGEST_LINE)
    known = figures[:, USE] == BearingUse.ACCEPTED
    places = setup.reflectors.centers[figures[known, REFLECTOR].astype(np.int64)]
    lengths[known] = np.hypot(*(places - T_map_scanner[known, :2]).T)
    ends = T_map_scanner[:, :2] + lengths[:, np.newaxis] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    lines = np.stack((T_map_scanner[:, :2], ends), axis=1)
    return Turn(lines, figures[:, USE].astype(np.int64), figures[:, NIS], model.gate)


def turn_told(turn: Turn | None) -> list[tuple[str, str]]:
    """Say what became of the bearings of a turn, line by line; nothing where there is no goniometer."""
    if turn is None:
        return []
    accepted, rejected = turn.count(BearingUse.ACCEPTED), turn.count(BearingUse.REJECTED)
    unused = len(turn.uses) - accepted - rejected
    known = turn.nis[np.isfinite(turn.nis)]
    largest = f"{known.max():.2f}" if len(known) else "none met"
    gate = f"{turn.gate:.2f}" if math.isfinite(turn.gate) else "none"
    return [
        ("Bearings of a turn", f"{accepted} accepted, {rejected} rejected, {unused} unused"),
        ("Bearings, largest NIS / gate", f"{largest} / {gate}"),
    ]
