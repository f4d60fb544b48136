"""Names on the floor: each beside its reflector, and no two on top of each other where there is room."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from commission.app.base.extent import Extent, extent_of
from commission.app.editing.name_places import (
    AROUND_PX,
    HIGH_PX,
    LETTER_PX,
    NamePlace,
    name_places,
    pixels_per_metre,
    reflector_names,
    station_names,
    station_text,
)
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.site.stations import Station

NOTHING = np.empty((0, 4))
SITE = Extent((0.0, 0.0), (20.0, 12.0))


def rectangle(place: NamePlace, text: str, scale: float) -> tuple[float, float, float, float]:
    """Left, lower, right and upper edge of a name [pixels], from what its anchor is called."""
    width, (x, y) = len(text) * LETTER_PX + AROUND_PX, (place.at[0] * scale, place.at[1] * scale)
    left = x if place.anchor.endswith("left") else x - width if place.anchor.endswith("right") else x - width / 2
    lower = (
        y if place.anchor.startswith("bottom") else y - HIGH_PX if place.anchor.startswith("top") else y - HIGH_PX / 2
    )
    return left, lower, left + width, lower + HIGH_PX


def shared(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    width, height = (min(one[k + 2], other[k + 2]) - max(one[k], other[k]) for k in (0, 1))
    return max(width, 0.0) * max(height, 0.0)


def test_a_name_alone_stands_above_to_the_right() -> None:
    (place,) = name_places(np.array([(5.0, 5.0)]), ["R1"], SITE, NOTHING)
    assert place.anchor == "bottom-left"
    assert min(place.at) > 5.0


def test_two_names_that_would_cover_each_other_stand_on_different_sides() -> None:
    points, names = np.array([(5.0, 5.0), (5.3, 5.0)]), ["North gate", "South gate"]
    places = name_places(points, names, SITE, NOTHING)
    first, second = (rectangle(p, n, pixels_per_metre(SITE)) for p, n in zip(places, names, strict=True))
    assert shared(first, second) == 0.0


def test_a_name_at_the_right_edge_stays_within_the_site() -> None:
    (place,) = name_places(np.array([(19.9, 11.9)]), ["A long name"], SITE, NOTHING)
    assert rectangle(place, "A long name", pixels_per_metre(SITE))[2] <= 20.0 * pixels_per_metre(SITE)


@pytest.mark.parametrize("site", ["shop_floor", "laboratory", "loading_bay"])
def test_on_bundled_sites_no_name_covers_another_one(site: str) -> None:
    project = load_project(bundled_folder("maps") / site)
    first = project.reflectors.reflectors[0]
    project = replace(project, stations=(Station(name="Dock", x=first.x, y=first.y + 0.3, heading=0.0),))
    scale, shown = pixels_per_metre(extent_of(project)), project.reflectors.reflectors
    places = reflector_names(project, shown)
    boxes = {each.id: rectangle(place, each.id, scale) for each, place in zip(shown, places, strict=True)}
    (dock,) = station_names(project)
    boxes["the station"] = rectangle(dock, station_text(project.stations[0]), scale)
    assert {(a, b) for a, b in combinations(boxes, 2) if shared(boxes[a], boxes[b]) > 1.0} == set()


def test_a_station_alone_has_its_name_below_and_its_neighbors_names_do_not_cover_it() -> None:
    project = load_project(bundled_folder("maps") / "shop_floor")
    alone = replace(project, stations=(Station(name="Press line 1", x=12.0, y=7.0, heading=0.0),))
    (place,) = station_names(alone)
    assert place.anchor == "top-center"
    assert place.at == pytest.approx((12.0, 7.0 - 3.2 * extent_of(project).mark_size()))
    # Three docks side by side, closer than their names are wide.
    beside = (0.0, 0.6, 1.2)
    docks = tuple(Station(name=f"Press line {n}", x=12.0 + dx, y=7.0, heading=0.0) for n, dx in enumerate(beside, 1))
    site, scale = replace(project, stations=docks), pixels_per_metre(extent_of(project))
    boxes = [rectangle(p, station_text(d), scale) for p, d in zip(station_names(site), docks, strict=True)]
    assert [shared(one, other) for one, other in combinations(boxes, 2)] == [0.0, 0.0, 0.0]
