from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.app.exchange.preview import compare
from commission.app.exchange.words import (
    LIST_LIMIT,
    counts,
    details,
    reflector_changes,
    route_changes,
    station_changes,
)
from commission.io.imk import ReflectorImport
from commission.site.reflector_diff import ReflectorChange
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.stations import Station
from tests.app.sites import room

HOSTILE = "<img src=x onerror=alert(1)>"


def html_of(*reflectors: Reflector, remove: bool = False) -> str:
    imported = ReflectorImport(ReflectorMap(reflectors), (), ("id", "x", "y", "radius", "note"))
    found = compare(room(), imported)
    return counts(found, remove=remove) + details(found, remove=remove)


def test_changed_values_are_said_from_to_in_the_units_that_people_read() -> None:
    before = Reflector(id="R1", x=1.25, y=2.0, heading=0.0)
    after = replace(before, x=1.275, radius=0.05, heading=math.pi / 2, note="pillar", locked=True)
    assert reflector_changes(ReflectorChange(before, after)) == (
        "R1: x 1.250 → 1.275 m, radius 40.0 → 50.0 mm, heading 0.00 → 90.00°, note (none) → pillar, "
        "locked no → yes, moves 25 mm"
    )


def test_counts_and_lists_say_what_would_happen() -> None:
    text = html_of(Reflector(id="R1", x=0.25, y=2.1), Reflector(id="N", x=6.0, y=7.8))
    assert "<b>Reflectors</b>: 1 added, 1 changed, 3 not in the file, 0 as before" in text
    assert "<li>N: 6.000, 7.800 m, r 40 mm</li>" in text
    assert "<li>R1: y 2.000 → 2.100 m, moves 100 mm</li>" in text
    assert "Not in the file, kept" in text
    assert "3 removed" in html_of(Reflector(id="R1", x=0.25, y=2.1), remove=True)


def test_names_of_strangers_are_text() -> None:
    text = html_of(Reflector(id=HOSTILE, x=6.0, y=7.8), Reflector(id="R1", x=0.25, y=2.0, note="<script>x</script>"))
    assert "<img" not in text
    assert "<script" not in text
    assert "&lt;img src=x onerror=alert(1)&gt;: 6.000" in text


def test_long_lists_and_long_lines_are_cut_and_counted() -> None:
    text = html_of(*(Reflector(id=f"{i}" + "x" * 500, x=0.01 * i, y=5.0) for i in range(1000)))
    assert f"and {1000 - LIST_LIMIT} more" in text
    assert len(text) < 6000


def test_changes_of_a_route_are_said() -> None:
    line = Segment(control_points=np.array([[0.0, 0.0], [4.0, 0.0]]), degree=1)
    before = Route("Loop", (line,), 0.5)
    aside = replace(line, control_points=np.array([[0.0, 0.3], [4.0, 0.3]]), direction=Direction.REVERSE)
    moved = route_changes(before, Route("Loop", (aside,), 0.8))
    assert moved == (
        "Loop: course moves by up to 300 mm, 1 segment changes between forward and reverse, speed 0.5 → 0.8 m/s"
    )
    same = Route("Loop", (replace(line, weights=np.ones(2)),), 0.5)
    assert route_changes(before, same) == "Loop: written otherwise, driven the same"


def test_changes_of_a_station_are_said() -> None:
    before = Station(name="Dock", x=1.0, y=2.0)
    assert station_changes(before, replace(before, x=1.5, heading=math.pi / 2)) == (
        "Dock: x 1.000 → 1.500 m, heading 0.00 → 90.00°"
    )
