"""Plots over the drive: uncertainty against its limits, gate, counts, time, error; fail episodes as red areas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from viser import GuiApi, GuiUplotHandle, uplot

from commission.app import theme
from commission.app.panels.base import BasePanel
from commission.app.view import PageView, Series
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import chi_square_gate
from commission.localization.estimate import Status
from commission.site.parameters import Parameters

BINS = 400
HEIGHT_PX = 150
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
    top: Callable[[Parameters], float] | None = None
    """Largest value shown, in the plot's unit; none: as the curves need."""


def _gate(parameters: Parameters) -> float:
    return chi_square_gate(parameters.association.gate_probability, 2)


def _constant(series: Series, value: float) -> FloatArray:
    return np.full(len(series), value)


CHARTS = (
    Chart(
        "2σ of x, y [mm]",
        (
            Line("x [mm]", TURQUOISE, lambda s, _p: s.two_sigma[:, 0] * 1000.0),
            Line("y [mm]", ORANGE, lambda s, _p: s.two_sigma[:, 1] * 1000.0),
            Line("limit", LIMIT, lambda s, p: _constant(s, p.supervisor.position_limit * 1000.0), is_limit=True),
        ),
        lambda p: 1500.0 * p.supervisor.position_limit,
    ),
    Chart(
        "2σ of heading [°]",
        (
            Line("heading [°]", TURQUOISE, lambda s, _p: np.degrees(s.two_sigma[:, 2])),
            Line("limit", LIMIT, lambda s, p: _constant(s, math.degrees(p.supervisor.heading_limit)), is_limit=True),
        ),
        lambda p: 1.5 * math.degrees(p.supervisor.heading_limit),
    ),
    Chart(
        "NIS against gate",
        (
            Line("largest NIS of a scan's inliers", TURQUOISE, lambda s, _p: s.nis),
            Line("gate", LIMIT, lambda s, p: _constant(s, _gate(p)), is_limit=True),
        ),
        lambda p: 1.4 * _gate(p),
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
        ),
    ),
    Chart("Cycle time [µs]", (Line("cycle time [µs]", TURQUOISE, lambda s, _p: s.microseconds),)),
    Chart(
        "Position error [mm]",
        (Line("error against reference [mm]", theme.css(theme.REFERENCE), lambda s, _p: s.error * 1000.0),),
    ),
)


def binned(times: FloatArray, values: NDArray[np.float64], duration: float) -> FloatArray:
    """Return the largest value in each of `BINS` equal stretches of the drive.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    values : (K,) array; NaN where unknown.
    duration : length of the drive [s].

    Returns
    -------
    peaks : (BINS,) array; NaN where nothing is known. A peak is never lost, however long the drive.
    """
    peaks = np.full(BINS, -np.inf)
    bins = np.minimum((times * (BINS / max(duration, 1e-9))).astype(np.int64), BINS - 1)
    known = np.isfinite(values)
    np.maximum.at(peaks, bins[known], values[known])
    peaks[np.isneginf(peaks)] = np.nan
    return peaks


def filled(peaks: FloatArray, now: float, duration: float) -> FloatArray:
    """Carry the last value over empty stretches up to now; zero ahead: uPlot knows no gaps.

    A drive with fewer scans than stretches has empty ones between them.
    """
    reached = min(BINS, int(now * (BINS / max(duration, 1e-9))) + 1)
    known = np.isfinite(peaks)
    latest = np.maximum.accumulate(np.where(known, np.arange(BINS), -1))
    carried = np.where(latest >= 0, peaks[np.maximum(latest, 0)], 0.0)
    carried[reached:] = 0.0
    return carried


class Plots(BasePanel):
    """Six plots side by side."""

    def __init__(self, gui: GuiApi) -> None:
        self._gui = gui
        self._plots: list[GuiUplotHandle] = []
        self._duration = 0.0
        self._tops: tuple[float | None, ...] = ()
        self._axis = np.linspace(0.0, 1.0, BINS)
        for chart in CHARTS:
            empty = tuple(np.zeros(2) for _ in range(len(chart.lines) + 3))
            self._plots.append(
                gui.add_uplot(
                    (np.array([0.0, 1.0]), *empty[1:]),
                    _series(chart),
                    title=chart.title,
                    scales=_scales(1.0, None),
                    axes=(_axis(20), _axis(36)),
                    legend={"show": False},
                    cursor={"sync": {"key": "run"}, "drag": {"x": True, "y": False}},
                    height=HEIGHT_PX,
                    padding=(2, 8, 0, 0),
                )
            )

    def draw_slowly(self, view: PageView) -> None:
        """Draw the drive so far."""
        run = view.run
        if run is None or run.duration <= 0.0:
            return
        parameters = view.state.project.parameters
        tops = tuple(None if chart.top is None else chart.top(parameters) for chart in CHARTS)
        if run.duration != self._duration or tops != self._tops:
            # A new scale rebuilds the chart and forgets the zoom: only when it must.
            self._duration, self._tops = run.duration, tops
            self._axis = np.linspace(0.0, run.duration, BINS)
            for plot, top in zip(self._plots, tops, strict=True):
                plot.scales = _scales(run.duration, top)
        failing = np.zeros(BINS)
        for start, end in run.episodes:
            failing[(self._axis >= start) & (self._axis <= max(end, start + run.duration / BINS))] = 1.0
        now = np.where(np.abs(self._axis - run.time) <= 0.5 * run.duration / BINS, 1.0, 0.0)
        for chart, plot, top in zip(CHARTS, self._plots, tops, strict=True):
            plot.data = (self._axis, *self._curves(chart, view, top), failing, now)

    def _curves(self, chart: Chart, view: PageView, top: float | None) -> list[FloatArray]:
        """One array per line of a chart."""
        run = view.run
        if run is None:
            return []
        parameters = view.state.project.parameters
        curves: list[FloatArray] = []
        for line in chart.lines:
            if line.is_limit:
                level = line.values(run.series, parameters)[:1]
                curves.append(np.full(BINS, level[0] if len(level) else 0.0))
                continue
            peaks = binned(run.series.times, line.values(run.series, parameters), run.duration)
            curve = filled(peaks, run.time, run.duration)
            curves.append(curve if top is None else np.minimum(curve, top))
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
    )


def _scales(duration: float, top: float | None) -> dict[str, uplot.Scale]:
    value: uplot.Scale = {} if top is None else {"range": (0.0, top)}
    # The flags' scale starts above zero: their zero line stays outside of the plot.
    return {
        "x": {"time": False, "range": (0.0, duration)},
        "y": value,
        "flag": {"range": (0.01, 1.0)},
    }


def _axis(size: int) -> uplot.Axis:
    return {
        "size": size,
        "font": "10px sans-serif",
        "stroke": "#9aa0a8",
        "grid": {"stroke": "#2f3237", "width": 1},
        "ticks": {"stroke": "#3a3d43", "width": 1, "size": 4},
    }
