"""The curves of a run as a table: what the plots show, cycle by cycle, in their units. It opens no file."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence

import numpy as np

from commission.app.run.charts import Chart, Line
from commission.geometry.arrays import FloatArray
from commission.progress import Progress, silent
from commission.studies.curves import extremes
from commission.studies.run import RunResult

AT_ONCE = 10_000
"""Rows that are written between two words about how far it is."""


def curve_table(
    run: RunResult, charts: Sequence[Chart], span: tuple[float, float], progress: Progress = silent
) -> bytes:
    """Return a CSV file: stamp, time, and each curve; of detections the lowest and the highest of the cycle.

    Parameters
    ----------
    run : the whole drive.
    charts : which plots.
    span : begin and end, both included [s].
    progress : told how far it is; may raise to cancel.
    """
    first = int(np.searchsorted(run.times, span[0], side="left"))
    after = int(np.searchsorted(run.times, span[1], side="right"))
    names = ["stamp_ns", "time"]
    columns: list[FloatArray] = []
    for line in (line for chart in charts for line in chart.lines_of(run)):
        names += [f"{line.column}_lowest", f"{line.column}_highest"] if line.of_detections else [line.column]
        columns += _columns(run, line, first, after)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for begin in range(0, after - first, AT_ONCE):
        rows = slice(begin, min(begin + AT_ONCE, after - first))
        progress(begin / max(after - first, 1), "writing the curves")
        stamps = run.columns.stamps_ns[first:after][rows].tolist()
        times = run.times[first:after][rows].tolist()
        parts = [column[rows].tolist() for column in columns]
        for stamp, time, *values in zip(stamps, times, *parts, strict=True):
            writer.writerow((stamp, f"{time:.6f}", *("" if math.isnan(value) else f"{value:.6g}" for value in values)))
    return text.getvalue().encode()


def _columns(run: RunResult, line: Line, first: int, after: int) -> list[FloatArray]:
    """One column of a curve of cycles, two of one of detections."""
    if not line.of_detections:
        return [line.values(run, slice(first, after))]
    offsets = run.columns.offsets[first : after + 1]
    begin, end = int(offsets[0]), int(offsets[-1])
    return list(extremes(line.values(run, slice(begin, end)), offsets[:-1] - begin, offsets[1:] - begin))
