"""The Stanford diagram of the supervisor: true error against what the filter claims, counted by region.

It judges runs whose truth is known. What an error does to the vehicle is not known here.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.estimate import Mode
from commission.studies.run import RunResult, limits_along

CELLS = 40
"""Cells of the diagram along each axis; one more counts what lies beyond."""
CELLS_PER_LIMIT = 20
"""Cells up to the alarm limit: the diagram reaches to twice of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StanfordRegions:
    """Cycles in each region of the diagram, by error E, protection level L and alarm limit A: every one is in one."""

    nominal: int = 0
    """E <= L <= A: the claim holds, and the vehicle may drive."""
    unavailable: int = 0
    """E <= L, L > A: the claim holds, and is too wide to drive on: a false alarm wherever E <= A."""
    misleading: int = 0
    """L < E <= A: the error is larger than claimed, and still harmless."""
    unavailable_misleading: int = 0
    """A < L < E: the error is larger than claimed, but there is an alarm."""
    hazardous: int = 0
    """L <= A < E: hazardously misleading: the error is beyond the alarm limit, and the claim is not."""

    @property
    def total(self) -> int:
        """All cycles."""
        return self.nominal + self.unavailable + self.misleading + self.unavailable_misleading + self.hazardous


@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisorVerdicts:
    """The same cycles by what the supervisor tells the vehicle, which has more grounds than the protection level."""

    nominal: int = 0
    """Operational, and the error is within claim and limit."""
    misleading: int = 0
    """Operational, and the error is larger than claimed, within the limit."""
    hazardous: int = 0
    """Operational, and the error is beyond the limit: `wrong_while_operational`."""
    false_alarm: int = 0
    """Not operational, although the error is within the limit."""
    true_alarm: int = 0
    """Not operational, and the error is beyond the limit."""

    @property
    def total(self) -> int:
        """All cycles."""
        return self.nominal + self.misleading + self.hazardous + self.false_alarm + self.true_alarm


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StanfordDiagram:
    """Cycles with a reference, counted."""

    limit: float
    """Alarm limit of the position [m]; of a run whose limit changes, the first one."""
    regions: StanfordRegions
    """By error, protection level and limit alone: the definition of the field."""
    verdicts: SupervisorVerdicts
    """By what the supervisor said."""
    counts: IntArray
    """(41, 41) cycles by error, then by protection level, in steps of 1/20 of the limit; the last: beyond."""


def stanford(result: RunResult, levels: FloatArray | None = None) -> StanfordDiagram | None:
    """Count the cycles of a run by region.

    Parameters
    ----------
    result : a run; only its cycles that have a reference are counted.
    levels : (K,) protection levels of the position [m]; None: the 2-sigma that the supervisor holds against its limit.

    Returns
    -------
    diagram : None where no cycle has a reference.

    Notes
    -----
    Walter, Hansen and Enge 1999 (the Stanford chart of WAAS); the regions are those of Tossaint et al. 2007, The
    Stanford-ESA integrity diagram, Navigation 54(2), section 2, for one quantity: the horizontal error. The 2-sigma
    that the supervisor holds against its limit is no bound of 1e-7 (`integrity` has one): along the longer
    axis alone a consistent filter exceeds it in 4.6 % of the cycles, and with an ellipse that is a circle, of which the
    distance is taken, in exp(-2) = 13.5 %. Misleading cycles are therefore expected, hazardous ones are not.
    """
    known = np.isfinite(result.position_errors)
    if not known.any():
        return None
    limits = limits_along(result.columns)[known, 0]
    operational = (result.columns.modes == Mode.OPERATIONAL)[known]
    levels = result.position_two_sigma if levels is None else levels
    return counted(result.position_errors[known], levels[known], limits, operational)


def counted(errors: FloatArray, levels: FloatArray, limits: FloatArray, operational: BoolArray) -> StanfordDiagram:
    """Count cycles by region.

    Parameters
    ----------
    errors, levels, limits : (K,) true error, protection level and alarm limit [m]; K is 1 at least, errors are finite.
    operational : (K,) whether the vehicle may drive.
    """
    # A claim that is no number claims nothing.
    levels = np.where(np.isnan(levels), np.inf, levels)
    holds, alarm, beyond = errors <= levels, levels > limits, errors > limits
    regions = StanfordRegions(
        nominal=_number(holds & ~alarm),
        unavailable=_number(holds & alarm),
        misleading=_number(~holds & ~beyond),
        unavailable_misleading=_number(~holds & alarm),
        hazardous=_number(beyond & ~alarm),
    )
    verdicts = SupervisorVerdicts(
        nominal=_number(operational & holds & ~beyond),
        misleading=_number(operational & ~holds & ~beyond),
        hazardous=_number(operational & beyond),
        false_alarm=_number(~operational & ~beyond),
        true_alarm=_number(~operational & beyond),
    )
    counts = np.zeros((CELLS + 1, CELLS + 1), dtype=np.int64)
    np.add.at(counts, (_cells(errors / limits), _cells(levels / limits)), 1)
    return StanfordDiagram(limit=float(limits[0]), regions=regions, verdicts=verdicts, counts=read_only(counts))


def merged(diagrams: Iterable[StanfordDiagram]) -> StanfordDiagram | None:
    """Add up the diagrams of several runs; None of none.

    Parameters
    ----------
    diagrams : one for each run.
    """
    every = tuple(diagrams)
    return functools.reduce(_added, every) if every else None


def _added(one: StanfordDiagram, other: StanfordDiagram) -> StanfordDiagram:
    return StanfordDiagram(
        limit=one.limit,
        regions=StanfordRegions(
            **{name: getattr(one.regions, name) + getattr(other.regions, name) for name in REGION_NAMES}
        ),
        verdicts=SupervisorVerdicts(
            **{name: getattr(one.verdicts, name) + getattr(other.verdicts, name) for name in VERDICT_NAMES}
        ),
        counts=read_only(one.counts + other.counts),
    )


REGION_NAMES = ("nominal", "unavailable", "misleading", "unavailable_misleading", "hazardous")
"""Fields of `StanfordRegions`."""
VERDICT_NAMES = ("nominal", "misleading", "hazardous", "false_alarm", "true_alarm")
"""Fields of `SupervisorVerdicts`."""


def _number(those: BoolArray) -> int:
    return int(np.count_nonzero(those))


def _cells(shares: FloatArray) -> IntArray:
    """Cell of each share of the limit; a value on an edge belongs to the cell below: the limit itself is no alarm."""
    return np.clip(np.ceil(np.minimum(shares, 1e6) * CELLS_PER_LIMIT).astype(np.int64) - 1, 0, CELLS)
