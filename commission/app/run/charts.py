"""What the plots show: their curves and thresholds, each as a function of the run. Nothing is drawn here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from commission.app.base import theme
from commission.app.base.plot_style import INK, LIMIT, ORANGE, TURQUOISE
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import chi_square_gate
from commission.localization.estimate import Status
from commission.site.parameters import Parameters
from commission.site.quantity import DEGREES, MILLIMETRES
from commission.studies.run import RunResult


@dataclass(frozen=True, slots=True)
class Line:
    """One curve of a plot."""

    label: str
    """Its name and unit."""
    color: str
    """CSS color: # and six digits."""
    values: Callable[[RunResult], FloatArray]
    """From a run to one value per cycle, in the plot's unit; NaN where it is unknown."""
    has_gaps: bool = False
    """Whether it may be unknown in between: then it is drawn as dots, for a line would go on across the gap."""


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
    """Smallest and largest value shown, in the plot's unit; none: from 0 as far as the curves need."""
    least: float = 1.0
    """Where that is at least, so that a curve of zeros lies at the bottom."""
    is_logarithmic: bool = False
    """Whether the vertical axis is logarithmic: a good run lies far below its limits."""


def _gate(parameters: Parameters) -> float:
    return chi_square_gate(parameters.association.gate_probability, 2)


def _decade_below(value: float) -> float:
    """The power of ten below: where a logarithmic axis has a label anyway."""
    return 10.0 ** math.floor(math.log10(value))


def _heading_errors(run: RunResult) -> FloatArray:
    """(K,) amount of the heading error [deg]; NaN where it is unknown."""
    return DEGREES.of(np.abs(run.errors[:, 2]))


CHARTS = (
    Chart(
        title="2σ of position [mm]",
        lines=(
            Line("against the limit [mm]", INK, lambda run: MILLIMETRES.of(run.position_two_sigma)),
            Line("x [mm]", TURQUOISE, lambda run: MILLIMETRES.of(run.two_sigma[:, 0])),
            Line("y [mm]", ORANGE, lambda run: MILLIMETRES.of(run.two_sigma[:, 1])),
        ),
        limits=(Limit("limit", lambda p: MILLIMETRES.of(p.supervisor.position_limit)),),
        span=lambda p: (
            MILLIMETRES.of(0.005 * p.supervisor.position_limit),
            MILLIMETRES.of(3.0 * p.supervisor.position_limit),
        ),
        is_logarithmic=True,
    ),
    Chart(
        title="2σ of heading [°]",
        lines=(Line("heading [°]", TURQUOISE, lambda run: DEGREES.of(run.two_sigma[:, 2])),),
        limits=(Limit("limit", lambda p: DEGREES.of(p.supervisor.heading_limit)),),
        span=lambda p: (
            _decade_below(DEGREES.of(0.005 * p.supervisor.heading_limit)),
            DEGREES.of(3.0 * p.supervisor.heading_limit),
        ),
        is_logarithmic=True,
    ),
    Chart(
        title="NIS against gate",
        lines=(
            Line("largest NIS of a scan's inliers", TURQUOISE, lambda run: run.nis, has_gaps=True),
            Line("mean of all detections in 1 s", ORANGE, lambda run: run.recent.nis, has_gaps=True),
        ),
        limits=(Limit("gate", _gate), Limit("consistent mean of all", lambda _: 2.0, color=ORANGE)),
        span=lambda p: (0.0, 1.4 * _gate(p)),
    ),
    Chart(
        title="Inliers, outliers per scan",
        lines=(
            Line("inliers", theme.css(theme.INLIER), lambda run: run.counts[:, Status.INLIER].astype(float)),
            Line(
                "outliers",
                theme.css(theme.OUTLIER_ASSOCIATION),
                lambda run: run.counts[:, Status.OUTLIER_DETECTOR :].sum(axis=1).astype(float),
            ),
        ),
        least=4.0,
    ),
    Chart(
        title="Position error [mm]",
        lines=(
            Line(
                "error against reference [mm]",
                theme.css(theme.REFERENCE),
                lambda run: MILLIMETRES.of(run.position_errors),
                has_gaps=True,
            ),
        ),
    ),
    Chart(
        title="Heading error [°]",
        lines=(Line("error against reference [°]", theme.css(theme.REFERENCE), _heading_errors, has_gaps=True),),
        least=0.01,
    ),
)


def ceiling(value: float) -> float:
    """Return the next of 1, 2, 5, 10, 20, ... : an axis that ends there stays while its curves change a little."""
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= value * (1.0 - 1e-12))
