"""Two layouts beside each other: every figure in its column and unit."""

from __future__ import annotations

import math
import re
from dataclasses import replace

from commission.app.base.before_after import ComparedLine, before_after
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
        ["All there [mm]", "8.0", "<i class='c-worse'>12.0</i>"],
        ["All there [°]", "0.80", "<i class='c-worse'>1.20</i>"],
        ["Any one failing [mm]", "16.0", "<i class='c-worse'>24.0</i>"],
        ["Any one failing [°]", "1.60", "<i class='c-worse'>2.40</i>"],
        ["Fewest in sight", "4", "<i class='c-worse'>3</i>"],
        ["Dock: 2σ, at most 10 mm"],
        ["All there [mm]", "4.0", "<i class='c-worse'>6.0</i>"],
        ["Any one failing [mm]", "6.0", "<i class='c-worse'>9.0</i>"],
        ["All routes, all places"],
        ["Vital reflectors", "4", "<i class='c-better'>3</i>"],
        ["Ambiguous places, of 2", "1", "1"],
    ]


def test_what_is_written_alike_is_no_difference_and_places_that_are_not_there_are_not_told() -> None:
    one, other = figures(5, 0.00801, 4), replace(figures(5, 0.00802, 4), places=0)
    html = before_after(one, other, ("a", "b"), (ComparedLine("More", "1", "2", gain=math.nan),))
    assert "c-worse" not in html
    html = before_after(replace(one, places=0), other)
    assert "Ambiguous" not in html
