"""What an error comes from over the metres of a route: one bar for each stretch, its sources one above the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from commission.app.base import theme
from commission.app.base.panel import escaped
from commission.app.prediction.tracks import TALL, WIDTH, TrackAxis, line, round_up, svg, tick, write
from commission.geometry.arrays import FloatArray
from commission.site.quantity import number_text

COLORS = (theme.FROM_NOISE, theme.FROM_MAP, theme.FROM_MOUNTING, theme.FROM_RANGE, theme.FROM_CLOCK)
"""Color of each of `CONTRIBUTIONS`, from the bottom of a bar to its top."""
FAR_LIMIT = 2.5
"""A limit farther above the bars than that many times is told and not drawn: the bars would lie at the bottom."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Stacked:
    """A 2-sigma and the shares of its square, on an axis from zero."""

    title: str
    """Name and unit."""
    levels: FloatArray
    """(B,) the worst of each stretch, in the page's unit."""
    shares: FloatArray
    """(B, P) share of each source in the square of the level [0..1]; the bar is divided by them."""
    limit: float
    """The limit, in the page's unit."""
    limit_text: str
    """The limit as a person reads it."""


def stacked(track: Stacked, axis: TrackAxis) -> str:
    """Draw bars whose sources lie one above the other, and the limit."""
    largest = max(float(track.levels.max(initial=0.0)), 1e-9)
    is_near = track.limit <= FAR_LIMIT * largest
    top = max(1.3 * largest, 1.05 * track.limit if is_near else 0.0)
    step = round_up(0.5 * largest)
    levels = [level for level in (0.0, step, 2.0 * step) if level <= top]
    parts = [each for level in levels for each in tick(TALL * (1.0 - level / top), number_text(level))]
    parts += _bars(axis, track, TALL / top)
    red = theme.css(theme.OVER_LIMIT)
    if is_near:
        parts.append(line(TALL * (1.0 - track.limit / top), red, "5 4"))
    else:
        parts.append(write(WIDTH - 2.0, 8.0, f"↑ limit {escaped(track.limit_text)}", fill=red))
    return svg(track.title, TALL, axis, parts)


def stack_legend(names: Sequence[str]) -> str:
    """Return the colors of the sources, in the order in which they lie one above the other."""
    entries = "".join(
        f"<span style='white-space:nowrap'><span style='display:inline-block;width:9px;height:9px;margin-right:3px;"
        f"background:{theme.css(color)}'></span>{escaped(name)}</span> "
        for name, color in zip(names, COLORS, strict=True)
    )
    return f"<div class='c-sources' style='font-size:11px;display:flex;flex-wrap:wrap;gap:2px 9px'>{entries}</div>"


def _bars(axis: TrackAxis, track: Stacked, scale: float) -> list[str]:
    """A rectangle for each source of each stretch; those lower than a fifth of a pixel are left out."""
    bounds = axis.bounds()
    tops = np.cumsum(track.shares, axis=1) * (scale * track.levels)[:, np.newaxis]
    lows = np.column_stack((np.zeros(len(tops)), tops[:, :-1]))
    return [
        f"<rect class='c-source-{source}' x='{left:.1f}' y='{TALL - high:.2f}' width='{right - left + 0.3:.1f}' "
        f"height='{high - low:.2f}' fill='{theme.css(COLORS[source])}'/>"
        for left, right, ends in zip(bounds[:-1], bounds[1:], np.stack((lows, tops), axis=2), strict=True)
        for source, (low, high) in enumerate(ends.tolist())
        if high - low > 0.2
    ]
