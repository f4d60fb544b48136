"""Plots of the residuals of a drive as SVG, and a page of them that needs no program. Text from values.

Colors of text and axes are those of what is around them; ranges are blue, bearings orange.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.site.quantity import PERCENT, number_text
from commission.studies.residual_study import EDGES, Relation, ResidualStudy
from commission.studies.residual_words import KINDS

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 260.0, 132.0, 40.0, 6.0, 18.0, 28.0
COLORS = ("#3fa7e0", "#f0953a")
"""Of range and bearing."""
GREY = "#8a93a0"
Scale: TypeAlias = Callable[[float], float]


def charts(study: ResidualStudy) -> Iterator[str]:
    """Each plot as SVG.

    Parameters
    ----------
    study : of a drive.
    """
    if not study.total:
        return
    yield _histogram(study)
    if len(study.lags):
        yield _in_time(study)
    for relation in study.relations:
        for axis in (0, 1):
            yield _relation(relation, axis)
    if study.beams is not None:
        one = [(study.beams.beams, COLORS[0], False), (study.beams.expected, GREY, True)]
        yield _lines("Beams of a cluster (dashed: expected)", "distance [m]", study.beams.places, one)
    yield from _rates(study)


def page_of(study: ResidualStudy, lines: Sequence[str], origin: Sequence[str]) -> str:
    """Return a whole HTML page: what stands out, then the plots.

    Parameters
    ----------
    study : of a drive.
    lines : what stands out, in words.
    origin : what it is of, a line each.
    """
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    of = "".join(f"<div>{html.escape(line)}</div>" for line in origin)
    style = (
        ":root{color-scheme:light dark}body{font:14px sans-serif;margin:16px}.o{font-size:11px;opacity:.7}"
        "svg{width:390px;margin:6px}"
    )
    return (
        f"<!DOCTYPE html><html lang='en'><meta charset='utf-8'><title>Residuals</title><style>{style}</style>"
        f"<h1>Residuals of the drive</h1><ul>{items}</ul>{''.join(charts(study))}<div class='o'>{of}</div></html>\n"
    )


def _histogram(study: ResidualStudy) -> str:
    top = float(max(study.counts.max(initial=0), study.expected.max(initial=0.0), 1.0))
    x, y = _scales((0.0, float(EDGES[-1])), (0.0, top))
    bars = "".join(
        f"<rect x='{x(low):.1f}' y='{y(count):.1f}' width='{max(x(high) - x(low) - 1.0, 0.5):.1f}' "
        f"height='{max(y(0.0) - y(count), 0.0):.1f}' fill='{COLORS[0]}'/>"
        for low, high, count in zip(EDGES[:-1].tolist(), EDGES[1:].tolist(), study.counts.tolist(), strict=True)
    )
    middles = 0.5 * (EDGES[1:] + EDGES[:-1])
    line = _path(middles, study.expected, x, y, GREY, dashed=False)
    title, below = "Squared distances d² (line: chi-square)", "d², 2 degrees of freedom"
    return _framed(title, below, (0.0, float(EDGES[-1])), (0.0, top), bars + line)


def _in_time(study: ResidualStudy) -> str:
    one: list[tuple[FloatArray, str, bool]] = [(study.correlations[:, axis], COLORS[axis], False) for axis in (0, 1)]
    one.append((study.chance, GREY, True))
    return _lines("Likeness in time (blue range, orange bearing)", "seconds apart [s]", study.lags, one, (-0.2, 1.0))


def _relation(relation: Relation, axis: int) -> str:
    name, shown = KINDS[axis]
    means, spreads = shown.of(relation.means[:, axis]), shown.of(relation.spreads[:, axis])
    places = relation.shown.of(relation.places)
    low, high = float((means - spreads).min()), float((means + spreads).max())
    ends = (float(places[0]), float(places[-1]))
    x, y = _scales(ends, (low, high))
    bars = "".join(
        f"<path d='M{x(at):.1f} {y(mean - spread):.1f}V{y(mean + spread):.1f}' stroke='{COLORS[axis]}' opacity='.45'/>"
        for at, mean, spread in zip(places.tolist(), means.tolist(), spreads.tolist(), strict=True)
    )
    zero = f"<path d='M{x(ends[0]):.1f} {y(0.0):.1f}H{x(ends[1]):.1f}' stroke='{GREY}' opacity='.6'/>"
    line = _path(places, means, x, y, COLORS[axis], dashed=False)
    title = f"{name.capitalize()} residual [{shown.unit}], mean and 1σ"
    return _framed(title, f"{relation.name} [{relation.shown.unit}]", ends, (low, high), zero + bars + line)


def _rates(study: ResidualStudy) -> Iterator[str]:
    for name in dict.fromkeys(rate.scanner for rate in study.rates):
        rates = [rate for rate in study.rates if rate.scanner == name]
        if len(rates) > 1:
            shares = np.array([PERCENT.of(rate.share) for rate in rates])
            at = np.array([rate.distance for rate in rates])
            title = f"Seen of those in sight [%], {html.escape(name)}"
            yield _lines(title, "distance [m]", at, [(shares, COLORS[0], False)], (0.0, 100.0))


def _lines(
    title: str,
    below: str,
    places: FloatArray,
    lines: Sequence[tuple[FloatArray, str, bool]],
    heights: tuple[float, float] | None = None,
) -> str:
    """A plot of some lines: each its values, color, and whether it is dashed."""
    ends = (float(places[0]), float(places[-1]))
    every = np.concatenate([values for values, _, _ in lines])
    span = heights or (0.0, float(np.nanmax(every)))
    x, y = _scales(ends, span)
    return _framed(title, below, ends, span, "".join(_path(places, v, x, y, color, dashed=d) for v, color, d in lines))


def _scales(across: tuple[float, float], up: tuple[float, float]) -> tuple[Scale, Scale]:
    """From values to the picture."""

    def x(value: float) -> float:
        return LEFT + (value - across[0]) / max(across[1] - across[0], 1e-12) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        share = (value - up[0]) / max(up[1] - up[0], 1e-12)
        return HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)

    return x, y


def _path(places: FloatArray, values: FloatArray, x: Scale, y: Scale, color: str, *, dashed: bool) -> str:
    known = [(at, value) for at, value in zip(places.tolist(), values.tolist(), strict=True) if math.isfinite(value)]
    if not known:
        return ""
    way = "L".join(f"{x(at):.1f} {y(value):.1f}" for at, value in known)
    dash = " stroke-dasharray='4 3'" if dashed else ""
    return f"<path d='M{way}' fill='none' stroke='{color}' stroke-width='1.6'{dash}/>"


def _framed(title: str, below: str, across: tuple[float, float], up: tuple[float, float], inside: str) -> str:
    """A plot with its title, its axes and their ends."""
    bottom = HEIGHT - BOTTOM

    def text(at: tuple[float, float], anchor: str, words: str) -> str:
        return f"<text x='{at[0]:.0f}' y='{at[1]:.0f}' text-anchor='{anchor}'>{words}</text>"

    labels = (
        text((4.0, 12.0), "start", title)
        + text((LEFT, HEIGHT - 15.0), "start", number_text(across[0]))
        + text((WIDTH - RIGHT, HEIGHT - 15.0), "end", number_text(across[1]))
        + text((0.5 * (LEFT + WIDTH), HEIGHT - 3.0), "middle", below)
        + text((LEFT - 4.0, bottom), "end", number_text(up[0]))
        + text((LEFT - 4.0, TOP + 8.0), "end", number_text(up[1]))
    )
    axes = f"<path d='M{LEFT} {TOP}V{bottom}H{WIDTH - RIGHT}' fill='none' stroke='currentColor' opacity='.5'/>"
    return (
        f"<svg viewBox='0 0 {WIDTH:.0f} {HEIGHT:.0f}' role='img' fill='currentColor' font-size='10.5' "
        f"style='display:inline-block;max-width:100%'>{axes}{inside}{labels}</svg>"
    )
