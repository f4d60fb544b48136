"""The selected route over its metres: curvature against what the vehicle can drive, heading, speed; violations marked.

Each browser has its own, since each selects its own route.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from viser import GuiApi, GuiUplotHandle, uplot

from commission.app.base import theme
from commission.app.base.panel import BasePanel, clock, escaped
from commission.app.base.plot_style import HIDDEN, LIMIT, TURQUOISE, plot_style, waking_series
from commission.app.base.view import PageView
from commission.app.editing.editor import Editor
from commission.app.editing.route_gestures import route_of
from commission.app.problems.view import inspection_of
from commission.geometry.arrays import FloatArray
from commission.planning.route_profile import RouteProfile
from commission.site.quantity import DEGREES, counted_text
from commission.studies.violations import Violation, ViolationKind

NOTHING = "Select a route on the floor: its curvature, heading and speed are drawn here over its metres."
FATAL_FILL, LITTLE_FILL = "rgba(255,59,48,.35)", "rgba(240,132,52,.30)"
ROOM_ABOVE = 1.12
"""How much farther than its curve a plot reaches, as a factor."""
LIMIT_SHOWN = 4.0
"""Limits farther away than this many times the largest curvature are only told: the curve would be flat."""

WORDS = {
    ViolationKind.CURVE: "too tight",
    ViolationKind.CORNER: "corners",
    ViolationKind.WALL: "cuts walls",
    ViolationKind.ROOM: "little room",
}


@dataclass(frozen=True, slots=True)
class RouteChart:
    """One plot."""

    title: str
    """Title with the unit."""
    values: Callable[[RouteProfile], FloatArray]
    """From a profile to the plot's unit."""
    from_zero: bool = False
    """Whether the vertical axis begins at zero."""


CURVATURE = RouteChart("Curvature [1/m] over metres, to the left positive", lambda profile: profile.curvatures)
CHARTS = (
    CURVATURE,
    RouteChart("Heading of the vehicle [°] over metres", lambda profile: DEGREES.of(profile.headings)),
    RouteChart("Planned speed [m/s] over metres", lambda profile: profile.speeds, from_zero=True),
)


def summary(name: str, profile: RouteProfile, violations: Sequence[Violation]) -> str:
    """Return the route in one line of html.

    Parameters
    ----------
    name : of the route, as typed.
    profile : curvature, heading and speed along it.
    violations : of this route.
    """
    tightest = float(np.abs(profile.curvatures).max())
    parts = [
        f"{profile.length:.1f} m",
        f"{clock(profile.seconds)} min" + (f" and {counted_text(profile.stops, 'stop')}" if profile.stops else ""),
        "straight" if tightest < 1e-6 else f"tightest curve {1.0 / tightest:.2f} m radius",
    ]
    if math.isfinite(profile.largest_curvature):
        parts[-1] += f" (vehicle: {1.0 / profile.largest_curvature:.2f} m)"
    parts.append(f"fastest {float(profile.speeds.max()):.2f} m/s")
    counts = Counter(violation.kind for violation in violations)
    bad = ", ".join(f"{text}: {counts[kind]}" for kind, text in WORDS.items() if counts[kind])
    color = theme.css(theme.OVER_LIMIT if any(v.is_fatal for v in violations) else theme.TOO_LITTLE)
    parts.append(f"<span style='color:{color}'>{bad}</span>" if bad else "nothing violated")
    return f"<b>{escaped(name)}</b><span>&ensp;{'&ensp;·&ensp;'.join(parts)}</span>"


def flags(profile: RouteProfile, violations: Sequence[Violation]) -> FloatArray:
    """Return (K,) 1 at the rows of violated stretches, however short they are, else 0."""
    # A row stands for the way up to the next one.
    step = profile.length / max(1, len(profile.metres) - 1)
    marked = np.zeros(len(profile.metres))
    for violation in violations:
        begin, end = violation.where.metres
        marked[(profile.metres >= begin - step) & (profile.metres <= end + step)] = 1.0
    return marked


def span(chart: RouteChart, profile: RouteProfile) -> tuple[float, float]:
    """Return smallest and largest value that a plot shows, in its unit."""
    values = chart.values(profile)
    low, high = float(values.min()), float(values.max())
    if chart is CURVATURE:
        largest = max(abs(low), abs(high), 1e-3)
        limit = profile.largest_curvature
        if limit <= LIMIT_SHOWN * largest:
            # A cusp may be as tight as one likes; what is far beyond the limit needs no height of its own.
            largest = max(limit, min(largest, LIMIT_SHOWN * limit))
        return -ROOM_ABOVE * largest, ROOM_ABOVE * largest
    if chart.from_zero:
        return 0.0, ROOM_ABOVE * high
    margin = max((ROOM_ABOVE - 1.0) * (high - low), 5.0)
    return low - margin, high + margin


class RoutePlots(BasePanel):
    """One line of facts and three plots; nothing but a hint while no route is selected.

    Parameters
    ----------
    gui : the browser's own.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, browser: int) -> None:
        self._browser = browser
        self._head = gui.add_html(_head(NOTHING))
        self._plots = [_plot(gui, chart) for chart in CHARTS]
        self._drawn: tuple[object, ...] = ()
        self._spans: tuple[object, ...] = ()
        self._turn = 1.0

    def draw_slowly(self, view: PageView) -> None:
        """Draw the selected route where something about it has changed."""
        route = route_of(view.state.project, view.state.of_browser(self._browser, Editor))
        profile = None if route is None else inspection_of(view).profiles.get(route.name)
        name = "" if route is None else route.name
        drawn = (name, profile, inspection_of(view).violations)
        if len(self._drawn) == 3 and all(a is b for a, b in zip(drawn, self._drawn, strict=True)):
            return
        self._drawn = drawn
        if profile is None:
            self._head.content = _head(f"Looking along {escaped(name)} …" if name else NOTHING)
            for plot in self._plots:
                plot.visible = False
            return
        violations = [violation for violation in inspection_of(view).violations if violation.route == name]
        self._head.content = _head(summary(name, profile, violations))
        self._draw(profile, violations)

    def _draw(self, profile: RouteProfile, violations: Sequence[Violation]) -> None:
        """Fill the plots."""
        fatal = flags(profile, [v for v in violations if v.is_fatal])
        little = flags(profile, [v for v in violations if not v.is_fatal])
        spans = tuple(span(chart, profile) for chart in CHARTS)
        self._turn = -self._turn
        waking = np.full(len(profile.metres), 2.0 + self._turn)
        limit = np.full(len(profile.metres), profile.largest_curvature)
        for chart, plot, shown in zip(CHARTS, self._plots, spans, strict=True):
            if (profile.length, spans) != self._spans:
                plot.scales = _scales(profile.length, shown)
            curve = np.clip(chart.values(profile), *shown)
            limits = [np.where(np.abs(side) <= shown[1], side, np.nan) for side in (limit, -limit)]
            blank = np.full(len(curve), np.nan)
            plot.data = (
                profile.metres,
                curve,
                *(limits if chart is CURVATURE else (blank, blank)),
                fatal,
                little,
                waking,
            )
            plot.visible = True
        self._spans = (profile.length, spans)


def _plot(gui: GuiApi, chart: RouteChart) -> GuiUplotHandle:
    empty = np.full(2, np.nan)
    return gui.add_uplot(
        (np.array([0.0, 1.0]), *(empty for _ in range(6))),
        _series(chart),
        title=chart.title,
        scales=_scales(1.0, (0.0, 1.0)),
        visible=False,
        **plot_style("route"),
    )


def _series(chart: RouteChart) -> tuple[uplot.Series, ...]:
    limits = [uplot.Series(label="limit", stroke=LIMIT, width=1, dash=(5, 4), points=HIDDEN) for _ in range(2)]
    return (
        uplot.Series(label="way [m]"),
        uplot.Series(label=chart.title, stroke=TURQUOISE, width=1.5, points=HIDDEN),
        *limits,
        uplot.Series(label="cannot be driven", scale="flag", fill=FATAL_FILL, points=HIDDEN),
        uplot.Series(label="too little room", scale="flag", fill=LITTLE_FILL, points=HIDDEN),
        waking_series(),
    )


def _scales(length: float, shown: tuple[float, float]) -> dict[str, uplot.Scale]:
    # The flags' scale starts above zero: their zero line stays outside of the plot.
    return {"x": {"time": False, "range": (0.0, length)}, "y": {"range": shown}, "flag": {"range": (0.01, 1.0)}}


def _head(text: str) -> str:
    return f"<div class='c-route'>{text}</div>"
