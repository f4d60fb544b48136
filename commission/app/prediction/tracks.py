"""Drawings over the metres of a route: bars in the colors of the ribbon, a run over them, marks. Only svg in here.

Drawings and no plots of viser's: its curves have one color each, and here the color is the message.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.app.base import theme
from commission.app.base.paints import Run, Surface
from commission.app.base.panel import escaped
from commission.geometry.arrays import FloatArray
from commission.site.quantity import number_text

WIDTH, LEFT = 270, 30
BELOW, ABOVE = 100.0, 2.0
"""How far a logarithmic axis reaches below and above the limit, as factors: a good drive lies far below it."""
INK, GRID = theme.css(Surface.AXIS.dark), theme.css(Surface.AXIS_TICK.dark)
TALL, LOW = 60.0, 34.0
"""Height of the bars of a track, and of one that matters less [pixels]."""
LABELS_PX = 12


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TrackAxis:
    """The horizontal axis: metres of the route, and what happens at some of them."""

    length: float
    """Length of the route [m]."""
    metres: FloatArray
    """(B,) where each bar begins [m]."""
    fills: tuple[str, ...]
    """CSS color of each bar."""
    stops: FloatArray
    """Where the supervisor stops the vehicle [m]."""
    recoveries: FloatArray
    """Where it may drive again [m]."""

    def x(self, metre: FloatArray) -> FloatArray:
        """Pixels from the left of the drawing."""
        return LEFT + (WIDTH - LEFT) * np.asarray(metre) / max(self.length, 1e-9)

    def bounds(self) -> FloatArray:
        """(B + 1,) left bound of each bar, and the right one of the last."""
        return self.x(np.append(self.metres, self.length))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Limited:
    """A quantity with a limit, on a logarithmic axis."""

    title: str
    """Name and unit."""
    levels: FloatArray
    """(B,) the worst of each stretch, in the page's unit."""
    limit: float
    """The limit, in the page's unit."""
    errors: FloatArray | None = None
    """(B,) the same of the error to be expected, where that is known."""
    driven: tuple[FloatArray, FloatArray] | None = None
    """(N,) metres of a run and (N,) the same quantity of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Plain:
    """A quantity without a limit, on an axis from zero."""

    title: str
    """Name and unit."""
    levels: FloatArray
    """(B,) the worst of each stretch, in the page's unit."""
    ticks: tuple[float, ...]
    """Levels that are written beside the axis; the largest ends it."""


def limited(track: Limited, axis: TrackAxis) -> str:
    """Draw bars up to a logarithmic level, the limit, the error to be expected, and a run."""
    low, high = math.log10(track.limit / BELOW), math.log10(track.limit * ABOVE)

    def y(values: FloatArray) -> FloatArray:
        share = (np.log10(np.maximum(values, 1e-12)) - low) / (high - low)
        return TALL * (1.0 - np.clip(share, 0.0, 1.0))

    ticks = [10.0**power for power in range(math.ceil(low), math.floor(high) + 1)]
    parts = [part for level in ticks for part in tick(float(y(np.array(level))), f"{level:g}")]
    parts += _bars(axis, y(track.levels), TALL)
    parts.append(line(float(y(np.array(track.limit))), theme.css(theme.OVER_LIMIT), "5 4"))
    if track.errors is not None:
        parts.append(_steps(axis, y(track.errors), theme.css(theme.REFERENCE)))
    if track.driven is not None:
        metres, values = track.driven
        points = " ".join(f"{px:.1f},{py:.1f}" for px, py in zip(axis.x(metres), y(values), strict=True))
        parts.append(
            f"<polyline points='{points}' fill='none' stroke='{theme.css(Run.WHOLE_CURVE.dark)}' stroke-width='1.2'/>"
        )
    return svg(track.title, TALL, axis, parts)


def plain(track: Plain, axis: TrackAxis) -> str:
    """Draw bars from zero."""
    most = max(*track.ticks, 1e-9)
    parts = [part for level in track.ticks for part in tick(LOW * (1.0 - level / most), number_text(level))]
    parts += _bars(axis, LOW * (1.0 - np.clip(track.levels / most, 0.0, 1.0)), LOW)
    return svg(track.title, LOW, axis, parts)


def round_up(value: float) -> float:
    """Return the smallest of 1, 2 and 5 times a power of ten that is no less than a value greater than 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(nice * power for nice in (1.0, 2.0, 5.0, 10.0) if nice * power >= value * (1.0 - 1e-9))


def svg(title: str, bottom: float, axis: TrackAxis, parts: list[str]) -> str:
    """Put parts of a drawing below a title, with the events of the route and its metres.

    Parameters
    ----------
    title : name and unit; plain text.
    bottom : height of the bars [pixels].
    axis : metres and events of the route.
    parts : svg elements.
    """
    height = bottom + LABELS_PX
    content = "".join([*parts, *_events(axis, bottom), *_metre_labels(axis, height)])
    head = f"<div style='font-size:11px;opacity:.75;padding-top:5px'>{escaped(title)}</div>"
    box = f"viewBox='0 0 {WIDTH} {height:.0f}' width='100%' style='display:block;font:9px sans-serif'"
    return f"{head}<svg {box}>{content}</svg>"


def tick(y: float, text: str) -> list[str]:
    """Draw a level line and what it means."""
    return [line(y, GRID), write(LEFT - 4, min(max(y + 3.0, 7.0), 1e3), text)]


def write(x: float, y: float, text: str, anchor: str = "end", *, fill: str = INK) -> str:
    """Write a text.

    Parameters
    ----------
    x, y : where it is anchored, from the upper left corner [pixels].
    text : escaped already.
    anchor : svg's: start, middle or end.
    fill : CSS color.
    """
    return f"<text x='{x:.1f}' y='{y:.1f}' fill='{fill}' text-anchor='{anchor}'>{text}</text>"


def line(y: float, color: str, dash: str = "none") -> str:
    """Draw a level line.

    Parameters
    ----------
    y : from the upper edge [pixels].
    color : CSS color.
    dash : svg's pattern of dashes.
    """
    return f"<line x1='{LEFT}' x2='{WIDTH}' y1='{y:.1f}' y2='{y:.1f}' stroke='{color}' stroke-dasharray='{dash}'/>"


def _bars(axis: TrackAxis, tops: FloatArray, bottom: float) -> list[str]:
    bounds = axis.bounds()
    return [
        f"<rect x='{left:.1f}' y='{min(top, bottom - 1.0):.1f}' width='{right - left + 0.3:.1f}' "
        f"height='{max(bottom - top, 1.0):.1f}' fill='{fill}'/>"
        for left, right, top, fill in zip(bounds[:-1], bounds[1:], tops, axis.fills, strict=True)
    ]


def _steps(axis: TrackAxis, tops: FloatArray, color: str) -> str:
    """Draw a line that is level over each bar."""
    places = np.column_stack((np.repeat(axis.bounds(), 2)[1:-1], np.repeat(tops, 2)))
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in places.tolist())
    return f"<polyline class='c-error' points='{points}' fill='none' stroke='{color}' stroke-width='1.2'/>"


def _events(axis: TrackAxis, bottom: float) -> list[str]:
    """Draw an upright line where the supervisor stops the vehicle, and one where it lets it go on."""
    kinds = ((axis.stops, theme.OVER_LIMIT, "c-stop"), (axis.recoveries, theme.RECOVERY, "c-recovery"))
    return [
        f"<line class='{name}' x1='{x:.1f}' x2='{x:.1f}' y1='0' y2='{bottom:.0f}' stroke='{theme.css(color)}' "
        "stroke-width='1.5'/>"
        for metres, color, name in kinds
        for x in axis.x(metres)
    ]


def _metre_labels(axis: TrackAxis, height: float) -> list[str]:
    """Write the metres at the ends and in the middle."""
    places = ((0.0, "start"), (0.5 * axis.length, "middle"), (axis.length, "end"))
    return [
        write(float(axis.x(np.array(metre))), height - 2, f"{number_text(metre)} m", anchor) for metre, anchor in places
    ]
