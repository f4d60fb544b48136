"""The figures by which variants of a drive are compared: what each is, its unit, what is better, and cycle by cycle.

A list of values; who differs from whom, `variants` says.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.localization.estimate import Mode, Status
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT, Shown
from commission.studies.consistency import has_distance
from commission.studies.metrics import nees
from commission.studies.run import RunResult, covariances_of_errors, limits_along

PLAIN, SECONDS, MICROSECONDS = Shown("", 1.0), Shown("s", 1.0), Shown("us", 1.0)
Rows: TypeAlias = tuple[FloatArray, FloatArray]
"""Numerator and denominator of each of K cycles: the figure, or its square, is the ratio of their sums."""


class Aim(Enum):
    """What is better."""

    LOW = auto()
    HIGH = auto()
    EXPECTED = auto()
    """To be near to what a consistent filter shows."""
    NONE = auto()
    """Neither is better by itself: a filter that is lost can show a fine NIS of what it still accepts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VariantFigure:
    """One figure of a run."""

    key: str
    """Its name in files; that of `summary.json` where it is there."""
    label: str
    """Its name on the page."""
    shown: Shown = PLAIN
    """Unit in which people read it."""
    form: str = ".2f"
    """How the number is written in that unit."""
    aim: Aim = Aim.LOW
    """What is better."""
    value: Callable[[RunResult], float]
    """From a run to the figure in SI units; NaN where it is undefined."""
    rows: Callable[[RunResult], Rows] | None = None
    """From a run to what each cycle contributes; none: a single event, which has no spread."""
    expected: Callable[[RunResult], float] | None = None
    """What a consistent filter shows."""
    of_errors: bool = False
    """Whether it needs a reference."""

    def text(self, value: float) -> str:
        """Return a value as it is written, with its unit; a dash where it is undefined."""
        if math.isnan(value):
            return "–"
        return self.shown.text(value, self.form)


def _every(run: RunResult, chosen: FloatArray | BoolArray) -> Rows:
    """What is counted or averaged over all cycles."""
    return np.asarray(chosen, dtype=np.float64), np.ones(run.cycles)


def _of_detections(run: RunResult, values: FloatArray, counted: FloatArray) -> Rows:
    """Sums over the detections of each cycle."""
    offsets = run.columns.offsets
    totals = [np.concatenate(([0.0], np.cumsum(each, dtype=np.float64))) for each in (values, counted)]
    above, below = (total[offsets[1:]] - total[offsets[:-1]] for total in totals)
    return above, below


def _nis(run: RunResult, chosen: BoolArray) -> Rows:
    return _of_detections(run, np.where(chosen, run.columns.d2, 0.0), chosen.astype(np.float64))


def _known(values: FloatArray) -> Rows:
    """What is averaged over the cycles that have it."""
    known = np.isfinite(values)
    return np.where(known, values, 0.0), known.astype(np.float64)


def _begins(run: RunResult) -> FloatArray:
    """(K,) whether a fail episode begins in each cycle."""
    stopped = run.columns.modes != Mode.OPERATIONAL
    return np.asarray(stopped & ~np.concatenate(([False], stopped[:-1])), dtype=np.float64)


def _wrong(run: RunResult) -> FloatArray:
    """(K,) 1 where the vehicle may drive and is farther off than the alarm limit, NaN without a reference."""
    operational = run.columns.modes == Mode.OPERATIONAL
    wrong = (operational & (run.position_errors > limits_along(run.columns)[:, 0])).astype(np.float64)
    return np.where(np.isfinite(run.position_errors), wrong, math.nan)


def longest_episode(run: RunResult) -> float:
    """Longest time in which the vehicle may not drive [s]; 0 without any.

    Parameters
    ----------
    run : the drive, localized and judged.
    """
    return max(((each.end_ns - each.start_ns) * 1e-9 for each in run.episodes), default=0.0)


def largest_correction(run: RunResult) -> float:
    """Longest way that one scan moves the estimate [m].

    Parameters
    ----------
    run : the drive, localized and judged.
    """
    first, largest = 0, 0.0
    for rows in run.columns.priors.blocks():
        after = first + len(rows.means)
        moved = run.columns.means[first:after, :2] - rows.means[:, :2]
        largest = max(largest, float(np.hypot(*moved.T).max(initial=0.0)))
        first = after
    return largest


def _of_errors(name: str) -> Callable[[RunResult], float]:
    """A figure of the errors by its name; NaN without a reference."""
    return lambda run: math.nan if run.statistics is None else float(getattr(run.statistics, name))


def _accepted(run: RunResult) -> Rows:
    """Accepted, and all detections of each cycle."""
    return run.counts[:, Status.INLIER].astype(np.float64), run.counts.sum(axis=1).astype(np.float64)


def _rejected(run: RunResult) -> Rows:
    """Those that the gate rejected, and those that it judged, of each cycle."""
    rejected = run.counts[:, Status.OUTLIER_ASSOCIATION].astype(np.float64)
    return rejected, rejected + run.counts[:, Status.INLIER]


def _ratio(rows: Rows) -> float:
    above, below = (float(each.sum()) for each in rows)
    return above / below if below else math.nan


FIGURES = (
    VariantFigure(
        key="operational_fraction",
        label="Operational",
        shown=PERCENT,
        aim=Aim.HIGH,
        value=lambda run: run.operational_fraction,
        rows=lambda run: _every(run, run.columns.modes == Mode.OPERATIONAL),
    ),
    VariantFigure(
        key="fail_episodes",
        label="Fail episodes",
        form=".0f",
        value=lambda run: float(len(run.episodes)),
        rows=lambda run: _every(run, _begins(run)),
    ),
    VariantFigure(key="longest_fail_s", label="Longest fail episode", shown=SECONDS, form=".1f", value=longest_episode),
    VariantFigure(
        key="lost_fraction",
        label="Lost",
        shown=PERCENT,
        value=lambda run: run.lost_fraction,
        rows=lambda run: _every(run, run.columns.modes == Mode.LOST),
    ),
    VariantFigure(
        key="accepted_fraction",
        label="Accepted, of all detections",
        shown=PERCENT,
        aim=Aim.NONE,
        value=lambda run: _ratio(_accepted(run)),
        rows=_accepted,
    ),
    VariantFigure(
        key="rejected_fraction",
        label="Rejected by the gate",
        shown=PERCENT,
        aim=Aim.NONE,
        value=lambda run: run.consistency.rejected_fraction,
        rows=_rejected,
    ),
    VariantFigure(
        key="unseen_fraction",
        label="Cycles without an accepted one",
        shown=PERCENT,
        value=lambda run: run.consistency.unseen_fraction,
        rows=lambda run: _every(run, run.counts[:, Status.INLIER] == 0),
    ),
    VariantFigure(
        key="nis_mean",
        label="NIS of the accepted",
        aim=Aim.NONE,
        value=lambda run: run.consistency.nis_mean,
        rows=lambda run: _nis(run, run.columns.status == Status.INLIER),
        expected=lambda run: run.consistency.nis_expected,
    ),
    VariantFigure(
        key="nis_before_gate_mean",
        label="NIS of all near a reflector",
        aim=Aim.NONE,
        value=lambda run: run.consistency.nis_before_gate_mean,
        rows=lambda run: _nis(run, has_distance(run.columns)),
        expected=lambda _: 2.0,
    ),
    VariantFigure(
        key="largest_jump_m", label="Largest jump by a scan", shown=MILLIMETRES, form=".0f", value=largest_correction
    ),
    VariantFigure(
        key="position_rmse_m",
        label="Position error, RMS",
        shown=MILLIMETRES,
        form=".1f",
        value=_of_errors("position_rmse"),
        rows=lambda run: _known(run.position_errors**2),
        of_errors=True,
    ),
    VariantFigure(
        key="position_p95_m",
        label="Position error at 95 %",
        shown=MILLIMETRES,
        form=".1f",
        value=_of_errors("position_p95"),
        of_errors=True,
    ),
    VariantFigure(
        key="position_max_m",
        label="Largest position error",
        shown=MILLIMETRES,
        form=".0f",
        value=_of_errors("position_max"),
        of_errors=True,
    ),
    VariantFigure(
        key="heading_rmse_rad",
        label="Heading error, RMS",
        shown=DEGREES,
        form=".3f",
        value=_of_errors("heading_rmse"),
        rows=lambda run: _known(run.errors[:, 2] ** 2),
        of_errors=True,
    ),
    VariantFigure(
        key="anees_position",
        label="ANEES of the position",
        aim=Aim.EXPECTED,
        value=_of_errors("anees_position"),
        rows=lambda run: _known(nees(run.errors[:, :2], covariances_of_errors(run)[:, :2, :2]) / 2.0),
        expected=lambda _: 1.0,
        of_errors=True,
    ),
    VariantFigure(
        key="wrong_while_operational",
        label="Cycles wrong while operational",
        form=".0f",
        value=_of_errors("wrong_while_operational"),
        rows=lambda run: _known(_wrong(run)),
        of_errors=True,
    ),
    VariantFigure(
        key="microseconds_per_cycle",
        label="Time per cycle",
        shown=MICROSECONDS,
        form=".2f",
        value=lambda run: run.microseconds_per_cycle,
    ),
)
BY_KEY = {figure.key: figure for figure in FIGURES}
"""The figures by their keys."""
