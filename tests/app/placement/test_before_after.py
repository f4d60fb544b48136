"""Before and after of a suggested layout: every figure in its column and unit."""

from __future__ import annotations

import math
import re

from commission.app.placement.before_after import before_after
from commission.planning.layout_figures import LayoutFigures, RouteFigures, StationFigures, Worst


def figures(count: int, worst: float, visible: int) -> LayoutFigures:
    intact = Worst(position=worst, heading=math.radians(100.0 * worst))
    failing = Worst(position=2.0 * worst, heading=math.radians(200.0 * worst))
    return LayoutFigures(
        reflectors=count,
        routes=(RouteFigures(name="A <b>", intact=intact, failing=failing, visible=visible),),
        stations=(StationFigures(name="Dock", required=0.01, intact=0.5 * worst, failing=0.75 * worst),),
        stopping=visible,
        ambiguous=1,
        places=2,
    )


def test_every_figure_of_both_layouts_stands_in_its_column_with_its_unit() -> None:
    html = before_after(figures(25, 0.008, 4), figures(11, 0.012, 3))
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", html)]
    assert rows == [
        ["", "now", "suggested"],
        ["Reflectors", "25", "11"],
        ["A &lt;b&gt;: worst 2σ"],
        ["All there [mm, °]", "8.0, 0.80", "12.0, 1.20"],
        ["Any one failing [mm, °]", "16.0, 1.60", "24.0, 2.40"],
        ["Fewest in sight", "4", "3"],
        ["Dock: 2σ, at most 10 mm"],
        ["All there [mm]", "4.0", "6.0"],
        ["Any one failing [mm]", "6.0", "9.0"],
        ["All routes, all places"],
        ["Stop if one fails", "4", "3"],
        ["Ambiguous, of 2", "1", "1"],
    ]
