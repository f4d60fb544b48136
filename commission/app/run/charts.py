"""What the plots show: their curves and thresholds, each as a function of the run. Nothing is drawn here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from commission.app.base import theme
from commission.app.base.plot_style import INK, LIMIT, ORANGE, THIRD, TURQUOISE
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import chi_square_gate
from commission.localization.estimate import Status
from commission.site.parameters import Parameters
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT
from commission.studies.run import RunResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One curve of a plot; its unit is in the plot's title."""

    label: str
    """Its name."""
    column: str
    """Its name in a file, with its unit where that is none of SI."""
    color: str
    """CSS color: # and six digits."""
    part: Callable[[RunResult, slice], FloatArray]
    """From a run and some of its cycles to one value for each, in the plot's unit; NaN where it is unknown."""
    of_detections: bool = False
    """Whether it is of detections and not of cycles: a cycle may have several or none."""
    of_scans: bool = False
    """Whether a frame of a camera or a reflex of a goniometer has none: the curve goes on to the next scan."""
    by_level: bool = False
    """Whether it is there only where the supervisor goes by protection levels."""

    def values(self, run: RunResult, rows: slice = slice(None)) -> FloatArray:
        """Return the values of a run, or of some rows of it; in the plot's unit."""
        values, is_scan = self.part(run, rows), run.columns.detected.is_scan if self.of_scans else None
        return values if is_scan is None else np.where(is_scan[rows], values, math.nan)

    def last_scan(self, run: RunResult, cycle: int) -> int:
        """Return the cycle whose value holds at a cycle, for a curve of scans the last scan; -1 where there is none."""
        is_scan = run.columns.detected.is_scan if self.of_scans else None
        if is_scan is None:
            return cycle
        back = is_scan[cycle::-1]
        return cycle - int(np.argmax(back)) if back.any() else -1


@dataclass(frozen=True, slots=True)
class Limit:
    """A threshold of a plot, drawn dashed; it changes where another segment of the run begins."""

    label: str
    """Its name."""
    value: Callable[[Parameters], float]
    """From the parameters of a segment to the threshold, in the plot's unit."""
    color: str = LIMIT
    """CSS color."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """One plot."""

    title: str
    """Title with the unit."""
    lines: tuple[Line, ...]
    """Its curves."""
    limits: tuple[Limit, ...] = ()
    """Its thresholds."""
    span: Callable[[Parameters], tuple[float, float]] | None = None
    """Smallest value shown, and the largest where no curve goes beyond, in the plot's unit; none: from 0."""
    least: float = 1.0
    """Where it is from 0, the largest value shown is at least that: a curve of zeros lies at the bottom."""
    is_logarithmic: bool = False
    """Whether the vertical axis is logarithmic: a good run lies far below its limits."""
    is_shown: bool = True
    """Whether it is shown before somebody chooses."""

    def lines_of(self, run: RunResult) -> tuple[Line, ...]:
        """Its curves of a run: those that there are."""
        return tuple(line for line in self.lines if len(run.columns.levels) or not line.by_level)

    @property
    def compared(self) -> Line:
        """The curve of it that variants are compared by: the first of cycles."""
        return next(line for line in self.lines if not line.of_detections)


def _gate(parameters: Parameters) -> float:
    return chi_square_gate(parameters.association.gate_probability, 2)


def _decade_below(value: float) -> float:
    """The power of ten below: where a logarithmic axis has a label anyway."""
    return 10.0 ** math.floor(math.log10(value))


def _levels(run: RunResult, at: slice) -> FloatArray:
    """(K, 2) protection levels [m, rad] that the supervisor went by; NaN where there is none."""
    every = run.columns.levels
    levels = every[at] if len(every) else np.full((len(run.two_sigma[at]), 2), math.nan)
    return np.where(np.isfinite(levels), levels, math.nan)


def _heading_errors(run: RunResult, at: slice) -> FloatArray:
    """(K,) amount of the heading error [deg]; NaN where it is unknown."""
    return DEGREES.of(np.abs(run.errors[at, 2]))


def _nis_of_detections(run: RunResult, at: slice) -> FloatArray:
    """(n,) squared Mahalanobis distance of detections near a reflector, accepted or not; NaN of the others."""
    return np.where(run.columns.status[at] != Status.OUTLIER_DETECTOR, run.columns.d2[at], math.nan)


CHARTS = (
    Chart(
        title="2σ of position [mm]",
        lines=(
            Line(
                label="largest",
                column="position_two_sigma_mm",
                color=INK,
                part=lambda run, at: MILLIMETRES.of(run.position_two_sigma[at]),
            ),
            Line(
                label="x",
                column="x_two_sigma_mm",
                color=TURQUOISE,
                part=lambda run, at: MILLIMETRES.of(run.two_sigma[at, 0]),
            ),
            Line(
                label="y",
                column="y_two_sigma_mm",
                color=ORANGE,
                part=lambda run, at: MILLIMETRES.of(run.two_sigma[at, 1]),
            ),
            Line(
                label="protection level",
                column="protection_position_mm",
                color=THIRD,
                part=lambda run, at: MILLIMETRES.of(_levels(run, at)[:, 0]),
                by_level=True,
            ),
        ),
        limits=(Limit("limit", lambda p: MILLIMETRES.of(p.supervisor.position_limit)),),
        span=lambda p: (
            _decade_below(MILLIMETRES.of(0.02 * p.supervisor.position_limit)),
            MILLIMETRES.of(3.0 * p.supervisor.position_limit),
        ),
        is_logarithmic=True,
    ),
    Chart(
        title="2σ of heading [°]",
        lines=(
            Line(
                label="heading",
                column="heading_two_sigma_deg",
                color=TURQUOISE,
                part=lambda run, at: DEGREES.of(run.two_sigma[at, 2]),
            ),
            Line(
                label="protection level",
                column="protection_heading_deg",
                color=THIRD,
                part=lambda run, at: DEGREES.of(_levels(run, at)[:, 1]),
                by_level=True,
            ),
        ),
        limits=(Limit("limit", lambda p: DEGREES.of(p.supervisor.heading_limit)),),
        span=lambda p: (
            _decade_below(DEGREES.of(0.02 * p.supervisor.heading_limit)),
            DEGREES.of(3.0 * p.supervisor.heading_limit),
        ),
        is_logarithmic=True,
    ),
    Chart(
        title="NIS of all detections",
        lines=(
            Line(label="each", column="nis", color=TURQUOISE, part=_nis_of_detections, of_detections=True),
            Line(label="mean of 1 s", column="nis_mean_of_1_s", color=ORANGE, part=lambda run, at: run.recent.nis[at]),
        ),
        limits=(Limit("gate", _gate), Limit("expected", lambda _: 2.0, color=ORANGE)),
        span=lambda p: (0.01, 10.0 * _gate(p)),
        is_logarithmic=True,
    ),
    Chart(
        title="Inliers, outliers per scan",
        lines=(
            Line(
                label="inliers",
                column="inliers",
                color=theme.css(theme.INLIER),
                part=lambda run, at: run.counts[at, Status.INLIER].astype(float),
                of_scans=True,
            ),
            Line(
                label="outliers",
                column="outliers",
                color=theme.css(theme.OUTLIER_ASSOCIATION),
                part=lambda run, at: run.counts[at, Status.OUTLIER_DETECTOR :].sum(axis=1).astype(float),
                of_scans=True,
            ),
        ),
        least=4.0,
    ),
    Chart(
        title="Rejected by the gate [%]",
        lines=(
            Line(
                label="share of 1 s",
                column="rejected_of_1_s_percent",
                color=theme.css(theme.OUTLIER_ASSOCIATION),
                part=lambda run, at: PERCENT.of(run.recent.rejected[at]),
            ),
        ),
        limits=(Limit("lost beyond", lambda p: PERCENT.of(p.supervisor.rejection_limit)),),
        span=lambda _: (0.0, 100.0),
        is_shown=False,
    ),
    Chart(
        title="Position error [mm]",
        lines=(
            Line(
                label="to reference",
                column="position_error_mm",
                color=theme.css(theme.REFERENCE),
                part=lambda run, at: MILLIMETRES.of(run.position_errors[at]),
            ),
        ),
    ),
    Chart(
        title="Heading error [°]",
        lines=(
            Line(
                label="to reference", column="heading_error_deg", color=theme.css(theme.REFERENCE), part=_heading_errors
            ),
        ),
        least=0.01,
    ),
)
BY_TITLE = {chart.title: chart for chart in CHARTS}
SHOWN_FIRST = tuple(chart.title for chart in CHARTS if chart.is_shown)


def ceiling(value: float) -> float:
    """Return the next of 1, 2, 5, 10, 20, ... : an axis that ends there stays while its curves change a little."""
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= value * (1.0 - 1e-12))


def color_of(letter: str) -> str:
    """Return the CSS color of a variant."""
    return theme.css(theme.VARIANTS["ABC".index(letter)])
