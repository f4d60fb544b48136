"""What the comparison of layouts is called on the page, and the lines of its table. Pure."""

from __future__ import annotations

import math

from commission.app.base.before_after import ComparedLine, before_after
from commission.app.layouts.state import ShownDifference
from commission.app.layouts.view import LayoutsView
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.studies.coverage import summary
from commission.studies.layouts import LayoutResult

FIGURE_NAMES: dict[str, str] = {
    ShownDifference.NONE: "no difference",
    ShownDifference.POSITION_SIGMA: "position error, 1σ [mm]",
    ShownDifference.HEADING_SIGMA: "heading error, 1σ [°]",
    ShownDifference.VISIBLE: "visible reflectors",
}
NOTHING_KEPT = (
    "Keep the layout, change it, and see here what that does to each route and station, to failures, to the start of a "
    "vehicle and to the floor. Kept layouts are forgotten when the program ends."
)


def comparison_table(before: LayoutResult, after: LayoutResult, number: int) -> str:
    """Return the table of two layouts: what it is, the kept one, now.

    Parameters
    ----------
    before, after : the kept layout, and the one of now.
    number : of the kept one.
    """
    return before_after(before.figures, after.figures, (f"layout {number}", "now"), _of_floor(before, after))


def _of_floor(before: LayoutResult, after: LayoutResult) -> tuple[ComparedLine, ...]:
    """Lines of the whole floor: ambiguous area, where there is a fix and how good it is."""
    (one, other) = (summary(each.floor, each.inputs.parameters.supervisor) for each in (before, after))

    def line(what: str, key: str, *, percent: bool) -> ComparedLine:
        shown, form = (PERCENT, ".1f") if percent else (MILLIMETRES, ".1f")
        values = [math.nan if (value := each[key]) is None else float(value) for each in (one, other)]
        texts = ["none" if math.isnan(value) else shown.number(value, form) for value in values]
        return ComparedLine(what, *texts, gain=(values[1] - values[0]) * (1.0 if percent else -1.0))

    lines = [
        ComparedLine("The floor"),
        line("With a fix [%]", "share_with_fix", percent=True),
        line("2σ within the limits [%]", "share_within_limits", percent=True),
        line("Median position, 1σ [mm]", "position_sigma_median_m", percent=False),
    ]
    if not math.isnan(before.ambiguous_area + after.ambiguous_area):
        areas = before.ambiguous_area, after.ambiguous_area
        lines.append(ComparedLine("Ambiguous start [m²]", *(f"{area:.1f}" for area in areas), gain=areas[0] - areas[1]))
    return tuple(lines)


def told(found: LayoutsView) -> tuple[str, ...]:
    """Return notes on what is shown, one line each."""
    notes: list[str] = []
    if found.is_same:
        notes.append(f"Reflectors stand as in layout {found.kept.number}: move one, and the difference is shown here.")
    if found.outdated:
        notes.append("Computing …")
    if found.after is not None and not found.after.inputs.routes:
        notes.append("Without a route that counts nothing is known of accuracy and failures along the way.")
    if found.no_floor:
        notes.append(f"No difference over the floor: {found.no_floor}.")
    return tuple(notes)
