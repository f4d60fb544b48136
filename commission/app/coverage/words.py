"""Numbers of the step Plan as a person reads them."""

from __future__ import annotations

import math

from commission.app.coverage.scale import QUANTITIES, is_fix, unit_of
from commission.app.plan.settings import Figure
from commission.planning.dependence import Failure
from commission.planning.dilution import Heading, Measurement

FIGURE_NAMES: dict[Figure, str] = {Figure.NONE: "Off"} | {figure: each.label for figure, each in QUANTITIES.items()}
HEADING_NAMES: dict[Heading, str] = {
    Heading.ALL_ROUND: "all round",
    Heading.WORST: "worst heading",
    Heading.BEST: "best heading",
    Heading.GIVEN: "given heading",
}
MEASUREMENT_NAMES: dict[Measurement, str] = {
    Measurement.RANGE_BEARING: "ranges, bearings",
    Measurement.BEARING_ONLY: "bearings only",
    Measurement.RANGE_BEARING_PRIOR: "with odometry",
}
FAILURE_NAMES: dict[Failure, str] = {
    Failure.BLOCKED: "blocked",
    Failure.DIRTY: "dirty",
    Failure.MOVED: "moved by 5 cm",
}


def number_text(value: float) -> str:
    """Return a number with three digits, without an exponent where a person would write none."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def value_text(figure: Figure, value: float, measurement: Measurement) -> str:
    """Return a value of a figure (SI) in the page's unit, which may depend on what is measured."""
    if not is_fix(figure, value):
        return "none visible" if figure is Figure.VISIBLE else "no fix"
    quantity = QUANTITIES[figure]
    shown = value * quantity.factor
    if quantity.unit == "%":
        # 100 % would be a promise: what is shown is never rounded up to it.
        text = f"{math.floor(shown * 10.0) / 10.0:.1f}"
    else:
        text = number_text(shown)
    return f"{text} {unit_of(figure, measurement)}".rstrip()


def metres_text(metres: list[int]) -> str:
    """Return numbers of metres as the ranges of the way that they make up."""
    ranges: list[list[int]] = []
    for metre in metres:
        if ranges and metre == ranges[-1][1]:
            ranges[-1][1] = metre + 1
        else:
            ranges.append([metre, metre + 1])
    return ", ".join(f"{number_text(a)} to {number_text(b)} m" for a, b in ranges) or "nothing fails"
