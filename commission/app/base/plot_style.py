"""How plots over metres or seconds look: colors, room for numbers, axes. What they show, their panels know."""

from __future__ import annotations

from typing import TypedDict

from viser import uplot

from commission.app.base import theme
from commission.app.base.paints import Run, Surface

TURQUOISE, ORANGE = theme.css(Run.FIRST_CURVE.dark), theme.css(Run.SECOND_CURVE.dark)
THIRD = theme.css(Run.THIRD_CURVE.dark)
INK = theme.css(Run.WHOLE_CURVE.dark)
LIMIT = theme.css(theme.OVER_LIMIT)
HEIGHT_PX = 150
ROOM_PX = 44
"""Room for the numbers beside a vertical axis: five figures and a comma."""
BELOW_PX = 20
"""Room for the numbers below a horizontal axis."""
HIDDEN: uplot.Series_Points = {"show": False}


class PlotStyle(TypedDict):
    """What all plots of the page have in common, as keyword arguments of viser's `add_uplot`."""

    axes: tuple[uplot.Axis, uplot.Axis]
    legend: uplot.Legend
    cursor: uplot.Cursor
    height: int
    padding: tuple[int, int, int, int]


def plot_style(group: str) -> PlotStyle:
    """Return the style of a plot that shares its cursor with those of its group."""
    return {
        "axes": (_axis(BELOW_PX), _axis(ROOM_PX)),
        "legend": {"show": False},
        "cursor": {"sync": {"key": group}, "drag": {"x": True, "y": False}},
        "height": HEIGHT_PX,
        "padding": (8, 8, 0, 0),
    }


def waking_series() -> uplot.Series:
    """Return a series that is never seen and changes its scale each time.

    uPlot lays out its axes only when a scale changes: a plot made before the browser knew its width would stay
    without labels.
    """
    return uplot.Series(label="", scale="waking", points=HIDDEN)


def _axis(size: int) -> uplot.Axis:
    """How an axis is drawn; `size` is the room for its numbers [pixels]."""
    return {
        "size": size,
        "font": "10px sans-serif",
        "stroke": theme.css(Surface.AXIS.dark),
        "grid": {"stroke": theme.css(Surface.AXIS_GRID.dark), "width": 1},
        "ticks": {"stroke": theme.css(Surface.AXIS_TICK.dark), "width": 1, "size": 4},
    }
