"""Plots over the drive: uncertainty against its limits, gate, counts, time, error; fail episodes as red areas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from viser import GuiApi, GuiUplotHandle, uplot

from commission.app.base import theme
from commission.app.base.panel import BasePanel
from commission.app.base.view import PageView
from commission.app.run.view import RunView, Series
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import chi_square_gate
from commission.localization.estimate import Status
from commission.site.parameters import Parameters

BINS = 400
HEIGHT_PX = 150
ROOM_PX = 44
"""Room for the numbers beside a vertical axis: five figures and a comma."""
TURQUOISE, ORANGE = "#4dc4ff", "#ffb454"
LIMIT = theme.css(theme.POSE)


@dataclass(frozen=True, slots=True)
class Line:
    """One curve of a plot."""

    label: str
    """Its name and unit."""
    color: str
    """CSS color."""
    values: Callable[[Series, Parameters], FloatArray]
    """From the run so far to one value per cycle, in the plot's unit."""
    is_limit: bool = False
    """Whether it is a threshold, drawn dashed."""


@dataclass(frozen=True, slots=True)
class Chart:
    """One plot."""

    title: str
    """Title with the unit."""
    lines: tuple[Line, ...]
    """Its curves."""
    span: Callable[[Parameters], tuple[float, float]] | None = None
    """Smallest and largest value shown, in the plot's unit; none: as the curves need."""
    is_logarithmic: bool = False
    """Whether the vertical axis is logarithmic: a good run lies far below its limits."""
    is_typical: bool = False
    """Whether a curve shows the median of each stretch of the drive and not its largest value."""


def _gate(parameters: Parameters) -> float:
    return chi_square_gate(parameters.association.gate_probability, 2)


def _constant(series: Series, value: float) -> FloatArray:
    return np.full(len(series), value)


def _decade_below(value: float) -> float:
    """The power of ten below: where a logarithmic axis has a label anyway."""
    return 10.0 ** math.floor(math.log10(value))


CHARTS = (
    Chart(
        "2σ of x, y [mm]",
        (
            Line("x [mm]", TURQUOISE, lambda s, _p: s.two_sigma[:, 0] * 1000.0),
            Line("y [mm]", ORANGE, lambda s, _p: s.two_sigma[:, 1] * 1000.0),
            Line("limit", LIMIT, lambda s, p: _constant(s, p.supervisor.position_limit * 1000.0), is_limit=True),
        ),
        lambda p: (5.0 * p.supervisor.position_limit, 3000.0 * p.supervisor.position_limit),
        is_logarithmic=True,
    ),
    Chart(
        "2σ of heading [°]",
        (
            Line("heading [°]", TURQUOISE, lambda s, _p: np.degrees(s.two_sigma[:, 2])),
            Line("limit", LIMIT, lambda s, p: _constant(s, math.degrees(p.supervisor.heading_limit)), is_limit=True),
        ),
        lambda p: (
            _decade_below(0.005 * math.degrees(p.supervisor.heading_limit)),
            3.0 * math.degrees(p.supervisor.heading_limit),
        ),
        is_logarithmic=True,
    ),
    Chart(
        "NIS against gate",
        (
            Line("largest NIS of a scan's inliers", TURQUOISE, lambda s, _p: s.nis),
            Line("gate", LIMIT, lambda s, p: _constant(s, _gate(p)), is_limit=True),
        ),
        lambda p: (0.0, 1.4 * _gate(p)),
    ),
    Chart(
        "Inliers, outliers per scan",
        (
            Line("inliers", theme.css(theme.INLIER), lambda s, _p: s.counts[:, Status.INLIER].astype(float)),
            Line(
                "outliers",
                theme.css(theme.OUTLIER_ASSOCIATION),
                lambda s, _p: s.counts[:, Status.OUTLIER_DETECTOR :].sum(axis=1).astype(float),
            ),
            # The axis reaches up to this at least: uPlot would give curves of zeros one up to 100.
            Line("", "transparent", lambda s, _p: _constant(s, 4.0), is_limit=True),
        ),
    ),
    Chart(
        "Cycle time [µs]", (Line("median cycle time [µs]", TURQUOISE, lambda s, _p: s.microseconds),), is_typical=True
    ),
    Chart(
        "Position error [mm]",
        (Line("error against reference [mm]", theme.css(theme.REFERENCE), lambda s, _p: s.error * 1000.0),),
    ),
)


def binned(times: FloatArray, values: FloatArray, duration: float, *, typical: bool = False) -> FloatArray:
    """Return the largest value (or the median) in each of `BINS` equal stretches of the drive.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    values : (K,) array; NaN where unknown.
    duration : length of the drive [s].
    typical : median instead of the largest value.

    Returns
    -------
    levels : (BINS,) array; NaN where nothing is known. However long the drive, no peak is lost.
    """
    levels = np.full(BINS, np.nan)
    known = np.isfinite(values)
    bins = np.minimum((times[known] * (BINS / max(duration, 1e-9))).astype(np.int64), BINS - 1)
    order = np.lexsort((values[known], bins))
    bins, ranked = bins[order], values[known][order]
    filled_bins, first, count = np.unique(bins, return_index=True, return_counts=True)
    levels[filled_bins] = ranked[first + (count // 2 if typical else count - 1)]
    return levels


def carried(levels: FloatArray, now: float, duration: float) -> FloatArray:
    """Carry the last value over empty stretches up to now; NaN ahead, where uPlot draws nothing.

    A drive with fewer scans than stretches has empty ones between them, over which uPlot would draw a slope.
    """
    reached = min(BINS, int(now * (BINS / max(duration, 1e-9))) + 1)
    latest = np.maximum.accumulate(np.where(np.isfinite(levels), np.arange(BINS), -1))
    curve = np.where(latest >= 0, levels[np.maximum(latest, 0)], np.nan)
    curve[reached:] = np.nan
    return curve


class Plots(BasePanel):
    """Six plots side by side."""

    def __init__(self, gui: GuiApi) -> None:
        self._gui = gui
        self._plots: list[GuiUplotHandle] = []
        self._duration = 0.0
        self._turn = 1
        self._spans: tuple[tuple[float, float] | None, ...] = ()
        self._axis = np.linspace(0.0, 1.0, BINS)
        for chart in CHARTS:
            empty = tuple(np.full(2, np.nan) for _ in range(len(chart.lines) + 4))
            self._plots.append(
                gui.add_uplot(
                    (np.array([0.0, 1.0]), *empty[1:]),
                    _series(chart),
                    title=chart.title,
                    scales=_scales(1.0, None, chart),
                    axes=(axis_style(20), axis_style(ROOM_PX)),
                    legend={"show": False},
                    cursor={"sync": {"key": "run"}, "drag": {"x": True, "y": False}},
                    height=HEIGHT_PX,
                    padding=(8, 8, 0, 0),
                )
            )

    def draw_slowly(self, view: PageView) -> None:
        """Draw the drive so far."""
        run = view.part(RunView)
        if run is None or run.duration <= 0.0:
            return
        parameters = view.state.project.parameters
        spans = tuple(None if chart.span is None else chart.span(parameters) for chart in CHARTS)
        if run.duration != self._duration or spans != self._spans:
            # A new scale rebuilds the chart and forgets the zoom: only when it must.
            self._duration, self._spans = run.duration, spans
            self._axis = np.linspace(0.0, run.duration, BINS)
            for plot, span, chart in zip(self._plots, spans, CHARTS, strict=True):
                plot.scales = _scales(run.duration, span, chart)
        failing = np.zeros(BINS)
        for start, end in run.episodes:
            failing[(self._axis >= start) & (self._axis <= max(end, start + run.duration / BINS))] = 1.0
        now = np.where(np.abs(self._axis - run.time) <= 0.5 * run.duration / BINS, 1.0, 0.0)
        self._turn = -self._turn
        waking = np.full(BINS, 2.0 + self._turn)
        for chart, plot, span in zip(CHARTS, self._plots, spans, strict=True):
            curves = _curves(chart, run, parameters)
            if span is not None:
                curves = [np.clip(curve, *span) for curve in curves]
            plot.data = (self._axis, *curves, failing, now, waking)


def _curves(chart: Chart, run: RunView, parameters: Parameters) -> list[FloatArray]:
    """One array per line of a chart."""
    curves: list[FloatArray] = []
    for line in chart.lines:
        values = line.values(run.series, parameters)
        if line.is_limit:
            curves.append(np.full(BINS, values[0] if len(values) else np.nan))
        else:
            levels = binned(run.series.times, values, run.duration, typical=chart.is_typical)
            curves.append(carried(levels, run.time, run.duration))
    return curves


def _series(chart: Chart) -> tuple[uplot.Series, ...]:
    lines = [
        uplot.Series(label=line.label, stroke=line.color, width=1, points={"show": False}, dash=(5, 4))
        if line.is_limit
        else uplot.Series(label=line.label, stroke=line.color, width=1, points={"show": False})
        for line in chart.lines
    ]
    return (
        uplot.Series(label="time [s]"),
        *lines,
        uplot.Series(label="fail", scale="flag", fill="rgba(220,40,40,.28)", points={"show": False}),
        uplot.Series(label="now", scale="flag", stroke="#e8eaee", width=1, points={"show": False}),
        # uPlot lays out its axes only when a scale changes: a chart that was made before the browser knew its width
        # would stay without labels. This series is never seen, and changes its scale each time.
        uplot.Series(label="", scale="waking", points={"show": False}),
    )


def _scales(duration: float, span: tuple[float, float] | None, chart: Chart) -> dict[str, uplot.Scale]:
    value: uplot.Scale = {} if span is None else {"range": span}
    if chart.is_logarithmic:
        value["distr"] = 3
    # The flags' scale starts above zero: their zero line stays outside of the plot.
    return {"x": {"time": False, "range": (0.0, duration)}, "y": value, "flag": {"range": (0.01, 1.0)}}


def axis_style(size: int) -> uplot.Axis:
    """Return how an axis is drawn; `size` is the room for its numbers [pixels]."""
    return {
        "size": size,
        "font": "10px sans-serif",
        "stroke": "#9aa0a8",
        "grid": {"stroke": "#2f3237", "width": 1},
        "ticks": {"stroke": "#3a3d43", "width": 1, "size": 4},
    }
