"""Names and values of the heatmap as a person reads them."""

from __future__ import annotations

import math

from commission.app.coverage.scale import QUANTITIES, is_fix, unit_of
from commission.app.coverage.settings import BY_CONTOURS, BY_TAGS, COUNTED, Figure
from commission.planning.dilution import Heading, Measurement
from commission.site.quantity import PERCENT, joined, number_text

FIGURE_NAMES: dict[Figure, str] = {Figure.NONE: "Off"} | {figure: each.label for figure, each in QUANTITIES.items()}
HEADING_NAMES: dict[Heading, str] = {
    Heading.BY_SCANNER: "by scanner",
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


def none_text(figure: Figure) -> str:
    """Say what there is not where a figure has no value."""
    if figure in COUNTED:
        return "none visible"
    if figure in BY_TAGS:
        return "no tag in sight"
    return "not the whole pose" if figure in BY_CONTOURS else "no fix"


def value_text(figure: Figure, value: float, measurement: Measurement) -> str:
    """Return a value of a figure (SI) in the page's unit, which may depend on what is measured.

    Parameters
    ----------
    figure : what it is a value of.
    value : in SI units; 0 reflectors, or a figure that is not finite, is no fix.
    measurement : what is measured of each reflector.
    """
    if not is_fix(figure, value):
        return none_text(figure)
    quantity = QUANTITIES[figure]
    shown = quantity.shown.of(value)
    if quantity.shown is PERCENT:
        # 100 % would be a promise: what is shown is never rounded up to it.
        text = f"{math.floor(shown * 10.0) / 10.0:.1f}"
    else:
        text = number_text(shown)
    return joined(text, unit_of(figure, measurement))
