"""The curves of a run as the page's script draws them: one message per run, span of time and choice of plots.

Binned by the study `curves`; numbers travel as 32-bit floats, times after the begin of the span. No viser in here.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from commission.app.run.charts import Chart, Limit, Line, ceiling, color_of
from commission.app.run.view import KeptRun
from commission.geometry.arrays import FloatArray
from commission.site.parameters import Parameters
from commission.studies.curves import Bins, bins_of, extremes, longest_regular
from commission.studies.run import RunResult

Span: TypeAlias = tuple[float, float]
"""Begin and end of a stretch of time [s]."""


def drawn(run: RunResult, charts: Sequence[Chart], span: Span, kept: Sequence[KeptRun] = ()) -> dict[str, Any]:
    """Return what the script needs to draw some plots over a span of time.

    Parameters
    ----------
    run : the whole drive.
    charts : which plots.
    span : what of the drive.
    kept : its variants; of each the first curve of a plot is laid over it.

    Returns
    -------
    message : ready for JSON; lists of numbers are base64 of 32-bit floats in little-endian order. A gap is a point
        whose values are NaN.
    """
    bins = bins_of(run.times, span, longest_regular(run.times))
    return {
        "duration": run.duration,
        "span": list(span),
        "times": packed(with_gaps(bins.times - span[0], bins)),
        "charts": [_chart(run, chart, bins, kept) for chart in charts],
    }


def values_at(
    run: RunResult, charts: Iterable[Chart], cycle: int, kept: Sequence[KeptRun] = ()
) -> list[list[list[float] | None]]:
    """Return lowest and highest value of each curve of each plot at a cycle; None where it is unknown.

    Parameters
    ----------
    run : the whole drive.
    charts : which plots.
    cycle : index of the cycle; -1 before the first: nothing is known.
    kept : variants of the drive; their values follow those of a plot's own curves.
    """
    return [
        [
            *(_at(run, line, cycle) for line in chart.lines_of(run)),
            *(_at(each.run, chart.compared, cycle) for each in kept),
        ]
        for chart in charts
    ]


def binned(run: RunResult, line: Line, bins: Bins) -> tuple[FloatArray, FloatArray]:
    """Return (B,) lowest and highest value of a curve in each stretch, in its plot's unit; NaN where none is known.

    Parameters
    ----------
    run : the whole drive.
    line : the curve.
    bins : the stretches.
    """
    firsts, afters = bins.firsts, bins.afters
    if line.of_detections:
        firsts, afters = run.columns.offsets[firsts], run.columns.offsets[afters]
    if not len(bins):
        return np.empty(0), np.empty(0)
    begin = int(firsts[0])
    values = line.values(run, slice(begin, int(afters[-1])))
    if line.of_scans:
        before = line.last_scan(run, begin)
        values = _going_on(values, math.nan if before < 0 else float(line.values(run, slice(before, before + 1))[0]))
    return extremes(values, firsts - begin, afters - begin)


def _going_on(values: FloatArray, before: float) -> FloatArray:
    """Return (n,) values, each that is NaN replaced by the last known one; by `before` where none is known yet."""
    known = np.isfinite(values)
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    return np.where(last < 0, before, values[last])


def axis_of(chart: Chart, parameters: Iterable[Parameters], largest: float) -> Span:
    """Return smallest and largest value of a plot's vertical axis.

    Parameters
    ----------
    chart : the plot.
    parameters : of the segments of the run: every threshold is seen.
    largest : value of its curves; NaN where none is known.
    """
    highest = chart.least if math.isnan(largest) else max(largest, chart.least)
    if chart.span is None:
        return 0.0, ceiling(highest)
    spans = [chart.span(each) for each in parameters]
    low, high = min(low for low, _ in spans), max(high for _, high in spans)
    return low, high if not largest > high else ceiling(largest)


def packed(values: FloatArray) -> str:
    """Return numbers as text: base64 of 32-bit floats."""
    return base64.b64encode(values.astype("<f4").tobytes()).decode()


def with_gaps(values: FloatArray, bins: Bins) -> FloatArray:
    """Return values of each stretch with a NaN before each that follows a gap."""
    return np.insert(values, np.flatnonzero(bins.follows_gap), math.nan)


def _chart(run: RunResult, chart: Chart, bins: Bins, kept: Sequence[KeptRun]) -> dict[str, Any]:
    every = [(run, line) for line in chart.lines_of(run)]
    every += [(each.run, replace(chart.compared, label=each.letter, color=color_of(each.letter))) for each in kept]
    lines = [binned(of, line, bins) for of, line in every]
    largest = float(np.fmax.reduce(np.concatenate([highs for _, highs in lines]), initial=math.nan))
    parameters = [segment.setup.parameters for segment in run.columns.segments]
    return {
        "title": chart.title,
        "axis": axis_of(chart, parameters, largest),
        "log": chart.is_logarithmic,
        "lines": [
            _line(line, bins, *values) | ({} if of is run else {"variant": True})
            for (of, line), values in zip(every, lines, strict=True)
        ],
        "limits": [_limit(run, limit) for limit in chart.limits],
    }


def _line(line: Line, bins: Bins, lows: FloatArray, highs: FloatArray) -> dict[str, Any]:
    is_thin = np.array_equal(lows, highs, equal_nan=True)
    return {
        "label": line.label,
        "color": line.color,
        "bars": line.of_detections,
        "low": packed(with_gaps(lows, bins)),
        "high": "" if is_thin else packed(with_gaps(highs, bins)),
    }


def _limit(run: RunResult, limit: Limit) -> dict[str, Any]:
    """A threshold as steps: from when on it has which value."""
    steps = [
        [0.0 if segment.first == 0 else float(run.times[segment.first]), limit.value(segment.setup.parameters)]
        for segment in run.columns.segments
    ]
    return {"label": limit.label, "color": limit.color, "steps": steps}


def _at(run: RunResult, line: Line, cycle: int) -> list[float] | None:
    if cycle >= 0:
        cycle = line.last_scan(run, cycle)
    if cycle < 0:
        return None
    rows = slice(cycle, cycle + 1)
    if line.of_detections:
        rows = slice(int(run.columns.offsets[cycle]), int(run.columns.offsets[cycle + 1]))
    values = line.values(run, rows)
    values = values[np.isfinite(values)]
    return [float(values.min()), float(values.max())] if len(values) else None
