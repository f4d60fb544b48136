"""Plots over the whole drive: uncertainty against its limits, gate, counts, errors; fail episodes as red areas.

What is lived is drawn solid, what is computed behind the cursor pale.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from viser import GuiApi, GuiUplotHandle, uplot

from commission.app.base.panel import BasePanel
from commission.app.base.plot_style import HIDDEN, plot_style, waking_series
from commission.app.base.view import PageView
from commission.app.run.charts import CHARTS, Chart, ceiling
from commission.app.run.curves import BINS, PlotCurve
from commission.app.run.view import RunView, Stretch
from commission.geometry.arrays import FloatArray
from commission.site.parameters import Parameters
from commission.studies.run import RunResult

EDIT = "#c08bff"
"""Where an edit acts from, or reflectors are covered."""
PALE = "59"
"""Opacity of what lies behind the cursor, as the last two digits of a CSS color: a third."""


class Plots(BasePanel):
    """Six plots side by side."""

    def __init__(self, gui: GuiApi) -> None:
        self._gui = gui
        self._plots: list[GuiUplotHandle] = []
        self._duration = 0.0
        self._turn = 1
        self._spans: tuple[tuple[float, float], ...] = ()
        self._axis = np.linspace(0.0, 1.0, BINS)
        self._result: RunResult | None = None
        self._curves: list[list[PlotCurve]] = []
        self._limits: list[list[FloatArray]] = []
        for chart in CHARTS:
            series = _series(chart)
            empty = tuple(np.full(2, np.nan) for _ in series[1:])
            self._plots.append(
                gui.add_uplot(
                    (np.array([0.0, 1.0]), *empty),
                    series,
                    title=chart.title,
                    scales=_scales(1.0, (0.1, 1.0), chart),
                    **plot_style("run"),
                )
            )

    def draw_slowly(self, view: PageView) -> None:
        """Draw the whole drive, cut at the cursor."""
        run = view.part(RunView)
        if run is None or run.duration <= 0.0:
            return
        if run.result is not self._result:
            self._take(run.result)
        spans = tuple(map(_span, CHARTS, self._curves, itertools.repeat(run.segment.setup.parameters)))
        if run.duration != self._duration or spans != self._spans:
            # A new scale rebuilds the chart and forgets the zoom: only when it must.
            self._duration, self._spans = run.duration, spans
            self._axis = np.linspace(0.0, run.duration, BINS)
            for plot, span, chart in zip(self._plots, spans, CHARTS, strict=True):
                plot.scales = _scales(run.duration, span, chart)
        self._turn = -self._turn
        marks = (
            self._areas(run.lived_episodes),
            self._areas(run.coming_episodes),
            self._lines((run.time,)),
            self._lines(run.edits),
            np.full(BINS, 2.0 + self._turn),
        )
        for plot, span, curves, limits in zip(self._plots, spans, self._curves, self._limits, strict=True):
            parts = [part for curve in curves for part in curve.cut(run.time, run.lived)] + limits
            plot.data = (self._axis, *(np.clip(part, *span) for part in parts), *marks)

    def _take(self, result: RunResult) -> None:
        """Prepare the curves of another run."""
        self._result = result
        columns = result.columns
        times = np.linspace(0.0, result.duration, BINS)
        cycles = np.maximum(np.searchsorted(result.times, times, side="right") - 1, 0)
        segments = np.searchsorted(columns.firsts, cycles, side="right") - 1
        parameters = [segment.setup.parameters for segment in columns.segments]
        self._curves = [
            [PlotCurve(result.times, line.values(result), result.duration) for line in chart.lines] for chart in CHARTS
        ]
        self._limits = [
            [np.array([limit.value(each) for each in parameters])[segments] for limit in chart.limits]
            for chart in CHARTS
        ]

    def _areas(self, stretches: tuple[Stretch, ...]) -> FloatArray:
        """(BINS,) 1 in each stretch, at least one of the axis's points wide, 0 elsewhere."""
        areas = np.zeros(BINS)
        for start, end in stretches:
            areas[(self._axis >= start) & (self._axis <= max(end, start + self._duration / BINS))] = 1.0
        return areas

    def _lines(self, times: tuple[float, ...]) -> FloatArray:
        """(BINS,) 1 at the axis's point nearest to each time, 0 elsewhere."""
        lines = np.zeros(BINS)
        for time in times:
            lines[int(np.argmin(np.abs(self._axis - time)))] = 1.0
        return lines


def _span(chart: Chart, curves: Sequence[PlotCurve], parameters: Parameters) -> tuple[float, float]:
    """Smallest and largest value shown."""
    if chart.span is not None:
        return chart.span(parameters)
    return 0.0, ceiling(max([chart.least, *(curve.largest for curve in curves if math.isfinite(curve.largest))]))


def _series(chart: Chart) -> tuple[uplot.Series, ...]:
    lines: list[uplot.Series] = []
    for line in chart.lines:
        draw = _dots if line.has_gaps else _line
        lines += [
            draw(line.label, line.color, 1.5),
            draw(f"{line.label}, behind the cursor", line.color + PALE, 1.0),
        ]
    limits = [
        uplot.Series(label=limit.label, stroke=limit.color, width=1, points=HIDDEN, dash=(5, 4))
        for limit in chart.limits
    ]
    return (
        uplot.Series(label="time [s]"),
        *lines,
        *limits,
        uplot.Series(label="fail", scale="flag", fill="rgba(220,40,40,.28)", points=HIDDEN),
        uplot.Series(label="fail behind the cursor", scale="flag", fill="rgba(220,40,40,.10)", points=HIDDEN),
        uplot.Series(label="now", scale="flag", stroke="#e8eaee", width=1, points=HIDDEN),
        uplot.Series(label="edited from here on", scale="flag", stroke=EDIT, width=1, dash=(2, 2), points=HIDDEN),
        waking_series(),
    )


def _line(label: str, color: str, width: float) -> uplot.Series:
    return uplot.Series(label=label, stroke=color, width=width, points=HIDDEN)


def _dots(label: str, color: str, width: float) -> uplot.Series:
    """One dot per known value: uPlot takes NaN for a point, so that its line would go straight across a gap."""
    return uplot.Series(label=label, width=0, points={"show": True, "size": 2.0 * width, "width": 0, "fill": color})


def _scales(duration: float, span: tuple[float, float], chart: Chart) -> dict[str, uplot.Scale]:
    value: uplot.Scale = {"range": span}
    if chart.is_logarithmic:
        value["distr"] = 3
    # The flags' scale starts above zero: their zero line stays outside of the plot.
    return {"x": {"time": False, "range": (0.0, duration)}, "y": value, "flag": {"range": (0.01, 1.0)}}
