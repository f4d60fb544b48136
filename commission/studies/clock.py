"""What the clock of each scanner shows more than the vehicle's, by how both saw the vehicle move.

A whole drive is fitted at once (`calibration_fit`), for a filter hides a wrong clock in its poses. Hardly anything is
believed of the clock before, and nothing is said of the other constants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from commission.geometry import se2
from commission.progress import Progress, part, silent
from commission.site.quantity import MILLISECONDS
from commission.site.record_log import RecordLog
from commission.studies.calibration import estimate
from commission.studies.calibration_constants import NEEDS, calibrated_constants
from commission.studies.calibration_drive import first_run, problem_of
from commission.studies.calibration_values import CalibrationInput

PRIOR = 0.1
"""1-sigma that is believed of a clock before: nothing that a drive could not overrule [s]."""
SURE = 0.001
"""1-sigma up to which an offset is found: it is then right to twice of it [s]."""
VAGUE = 0.01
"""1-sigma from which on a drive says nothing of a clock that is of use [s]."""
AGREES = 2.0
"""1-sigmas up to which an offset agrees with what is allowed for."""
MOST_TIMES = 20
"""Drives longer by more than this factor are not advised."""


class ClockVerdict(StrEnum):
    """What a drive says of a clock."""

    FOUND = "found"
    ROUGHLY = "roughly"
    NOT_SHOWN = "not shown by this drive"


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockOffset:
    """The clock of one scanner."""

    scanner: str
    """Name of the scanner."""
    before: float
    """What the project says that it shows more than the vehicle's [s]."""
    offset: float
    """What the drive says [s]."""
    sigma: float
    """1-sigma of that [s]; residuals that are correlated in time are allowed for."""
    verdict: ClockVerdict
    """What that is good for."""
    reason: str
    """Why, and what would show it better."""

    def differs_from(self, allowed: float) -> bool:
        """Whether the drive says of a clock [s] that it is another one: by more than 2-sigma, and shown at all."""
        return self.verdict is not ClockVerdict.NOT_SHOWN and abs(self.offset - allowed) > AGREES * self.sigma


def clock_offsets(inputs: CalibrationInput, progress: Progress = silent) -> tuple[ClockOffset, ...]:
    """Estimate the offset of each scanner's clock against the vehicle's from a drive.

    Parameters
    ----------
    inputs : recording, start and project.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    UsageError
        the vehicle is lost in the drive, so that nothing can be said.
    """
    wide = replace(inputs, uncertainty=replace(inputs.uncertainty, clock=max(PRIOR, inputs.uncertainty.clock)))
    progress(0.0, "first run")
    problem = problem_of(wide.log, wide.setup, first_run(wide.log, wide.setup, wide.start.belief))
    whole, _ = estimate(problem, part(progress, 0.05, 1.0))
    listed = {each.key: each for each in calibrated_constants(wide, problem, whole)}
    found: list[ClockOffset] = []
    for scanner in inputs.scanners:
        each = listed[f"scanners.{scanner.name}.clock_offset"]
        verdict, reason = _verdict(each.sigma)
        found.append(
            ClockOffset(
                scanner=scanner.name,
                before=each.before,
                offset=each.before + each.shift,
                sigma=each.sigma,
                verdict=verdict,
                reason="; ".join(filter(None, (each.remark, reason))),
            )
        )
    progress(1.0, "")
    return tuple(found)


def _verdict(sigma: float) -> tuple[ClockVerdict, str]:
    """Say what a 1-sigma [s] is good for, and what would be better."""
    if not sigma < VAGUE:
        return ClockVerdict.NOT_SHOWN, NEEDS["clock_offset"]
    if sigma <= SURE:
        return ClockVerdict.FOUND, ""
    times = math.ceil((sigma / SURE) ** 2)
    more = (
        f"a drive with {times} times as many turns and changes of speed would"
        if times <= MOST_TIMES
        else "sharper turns and changes of speed would"
    )
    to = MILLISECONDS.text(2.0 * sigma, ".1f")
    return ClockVerdict.ROUGHLY, f"this drive shows it to ±{to} only; {more} show it to ±2 ms"


def displacement(offset: float, speed: float) -> float:
    """How far off a clock puts what is seen [m].

    Parameters
    ----------
    offset : of the clock [s].
    speed : of the scanner over the floor [m/s].
    """
    return abs(offset) * abs(speed)


def speed_at(log: RecordLog, stamp_ns: int, over_ns: int = 200_000_000) -> float:
    """Speed of base by the odometry about a time [m/s]; 0 where there is none.

    Parameters
    ----------
    log : the records.
    stamp_ns : the time [ns].
    over_ns : half the time over which it is averaged [ns].
    """
    stamps = log.odometry_stamps_ns
    first, last = np.searchsorted(stamps, (stamp_ns - over_ns, stamp_ns + over_ns), side="right").tolist()
    first = max(first, 1)
    if last <= first:
        return 0.0
    way = float(np.hypot(*se2.log(log.displacements[first:last])[:, :2].T).sum())
    return way / (float(stamps[last - 1] - stamps[first - 1]) * 1e-9)
