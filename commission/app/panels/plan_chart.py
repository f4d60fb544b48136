"""The chart of a route prediction over metres, as a drawing in the colors of the ribbon on the floor.

A drawing and not a plot of viser's: its curves have one color each, and here the color is the message.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.app import theme
from commission.app.panels.base import escaped, table
from commission.app.plan.loads import load_classes, palette
from commission.app.plan.overlay import Driven
from commission.app.plan.view import RouteView
from commission.app.plan.words import number_text
from commission.geometry.arrays import FloatArray

WIDTH, LEFT = 270, 30
MOST_BARS = 120
BELOW, ABOVE = 100.0, 2.0
"""How far the vertical axis reaches below and above the limit, as factors: a good drive lies far below it."""
INK, GRID = "#9aa0a8", "#3a3d43"
MOST_STOPS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One quantity over the metres of the route."""

    title: str
    """Name and unit."""
    levels: FloatArray
    """(B,) the worst of each stretch, in the page's unit."""
    limit: float
    """The supervisor's, in the page's unit."""
    driven: FloatArray | None
    """(N,) the same of a run."""


def chart(route: RouteView, run: Driven | None) -> str:
    """Return what is expected along a route: in numbers, then over its metres.

    Parameters
    ----------
    route : the prediction.
    run : a run to lay over it; none where there is none.
    """
    limits, metres = route.prediction.limits, route.metres
    starts = np.arange(0, len(metres.metre), max(1, -(-len(metres.metre) // MOST_BARS)))
    worst = np.maximum.reduceat(metres.two_sigma, starts, axis=0)
    shades = [theme.css(color) for color in palette()]
    fills = [shades[index] for index in load_classes(np.maximum.reduceat(route.loads, starts))]
    tracks = (
        Track(
            "2σ of position [mm]",
            1000.0 * worst[:, :2].max(axis=1),
            1000.0 * limits.position_limit,
            None if run is None else 1000.0 * run.two_sigma[:, :2].max(axis=1),
        ),
        Track(
            "2σ of heading [°]",
            np.degrees(worst[:, 2]),
            math.degrees(limits.heading_limit),
            None if run is None else np.degrees(run.two_sigma[:, 2]),
        ),
    )
    length = route.prediction.drive.length
    axis = _Axis(length, metres.metre[starts].astype(float))
    drawn = "".join(_track(track, axis, fills, None if run is None else run.metres) for track in tracks)
    seen = _counts(np.minimum.reduceat(metres.seen, starts), axis, fills)
    note = "white line: the run that is loaded" if run is not None else "a run along this route is laid over it"
    note = "predicting anew …" if route.outdated else note
    return (
        f"<div class='c-prediction' style='padding:2px 6px'>{table(_numbers(route))}{drawn}{seen}"
        f"<div class='c-note'>color: share of the limit; {note}</div></div>"
    )


def _numbers(route: RouteView) -> list[tuple[str, str]]:
    """What matters most, in numbers."""
    prediction, metres, limits = route.prediction, route.metres, route.prediction.limits
    largest = metres.two_sigma.max(axis=0)
    stops = [f"{stop:.0f}" for stop in prediction.trips()]
    shown = ", ".join(stops[:MOST_STOPS]) + (" …" if len(stops) > MOST_STOPS else "")
    return [
        ("Length", f"{prediction.drive.length:.1f} m"),
        (
            "Largest 2σ x, y / limit",
            f"{1000 * largest[:2].max():.1f} / {1000 * limits.position_limit:.0f} mm",
        ),
        (
            "Largest 2σ heading / limit",
            f"{math.degrees(largest[2]):.2f} / {math.degrees(limits.heading_limit):.1f} °",
        ),
        ("Fewest reflectors seen", str(int(metres.seen.min()))),
        ("Longest on odometry", f"{metres.on_odometry.max():.1f} m"),
        ("Supervisor stops", escaped(f"at {shown} m" if stops else "nowhere")),
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """The horizontal axis: metres of the route."""

    length: float
    metres: FloatArray

    def x(self, metre: FloatArray) -> FloatArray:
        """Pixels from the left of the drawing."""
        return LEFT + (WIDTH - LEFT) * np.asarray(metre) / max(self.length, 1e-9)

    def edges(self) -> FloatArray:
        """(B + 1,) left edge of each bar, and the right one of the last."""
        return self.x(np.append(self.metres, self.length))


def _svg(title: str, height: int, content: str) -> str:
    return (
        f"<div style='font-size:11px;opacity:.75;padding-top:5px'>{escaped(title)}</div>"
        f"<svg viewBox='0 0 {WIDTH} {height}' width='100%' style='display:block;font:9px sans-serif'>{content}</svg>"
    )


def _text(x: float, y: float, text: str, anchor: str = "end") -> str:
    return f"<text x='{x:.1f}' y='{y:.1f}' fill='{INK}' text-anchor='{anchor}'>{text}</text>"


def _line(y: float, color: str, dash: str = "none") -> str:
    return f"<line x1='{LEFT}' x2='{WIDTH}' y1='{y:.1f}' y2='{y:.1f}' stroke='{color}' stroke-dasharray='{dash}'/>"


def _track(track: Track, axis: _Axis, fills: list[str], metres: FloatArray | None) -> str:
    """Draw bars on a logarithmic axis, the limit, and a run."""
    height, bottom = 84, 72.0
    low, high = math.log10(track.limit / BELOW), math.log10(track.limit * ABOVE)

    def y(values: FloatArray) -> FloatArray:
        share = (np.log10(np.maximum(values, 1e-12)) - low) / (high - low)
        return bottom * (1.0 - np.clip(share, 0.0, 1.0))

    ticks = [10.0**power for power in range(math.ceil(low), math.floor(high) + 1)]
    parts = [_line(float(y(np.array(tick))), GRID) for tick in ticks]
    parts += [_text(LEFT - 4, float(y(np.array(tick))) + 3, f"{tick:g}") for tick in ticks]
    parts += _bars(axis.edges(), y(track.levels), bottom, fills)
    parts.append(_line(float(y(np.array(track.limit))), theme.css(theme.POSE), "5 4"))
    if track.driven is not None and metres is not None:
        pairs = zip(axis.x(metres), y(track.driven), strict=True)
        points = " ".join(f"{px:.1f},{py:.1f}" for px, py in pairs)
        parts.append(f"<polyline points='{points}' fill='none' stroke='#fff' stroke-width='1.2'/>")
    parts += _metre_labels(axis, height)
    return _svg(track.title, height, "".join(parts))


def _counts(seen: np.ndarray, axis: _Axis, fills: list[str]) -> str:
    """Draw the fewest reflectors seen in each stretch."""
    height, bottom = 48, 36.0
    most = max(4, int(seen.max()))
    tops = bottom * (1.0 - seen / most)
    parts = [_line(bottom * (1.0 - level / most), GRID) for level in (most, 2)]
    parts += [_text(LEFT - 4, bottom * (1.0 - level / most) + 6, str(level)) for level in (most, 2)]
    parts += _bars(axis.edges(), tops, bottom, fills)
    parts += _metre_labels(axis, height)
    return _svg("Fewest reflectors seen", height, "".join(parts))


def _bars(edges: FloatArray, tops: FloatArray, bottom: float, fills: list[str]) -> list[str]:
    return [
        f"<rect x='{left:.1f}' y='{min(top, bottom - 1.0):.1f}' width='{right - left + 0.3:.1f}' "
        f"height='{max(bottom - top, 1.0):.1f}' fill='{fill}'/>"
        for left, right, top, fill in zip(edges[:-1], edges[1:], tops, fills, strict=True)
    ]


def _metre_labels(axis: _Axis, height: int) -> list[str]:
    """Write the metres at the ends and in the middle."""
    places = ((0.0, "start"), (0.5 * axis.length, "middle"), (axis.length, "end"))
    return [
        _text(float(axis.x(np.array(metre))), height - 2, f"{number_text(metre)} m", anchor) for metre, anchor in places
    ]
