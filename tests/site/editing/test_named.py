"""What a site has by name, put, renamed and removed: routes, stations, tags and zones alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from commission.errors import UsageError
from commission.site.editing.named import ROUTES, STATIONS, TAGS, ZONES, Named
from commission.site.routes import Route, Segment
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import Zone

WAY = (Segment(control_points=np.array([[0.0, 0.0], [5.0, 0.0]]), degree=1),)
CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))
CASES: tuple[tuple[Named[Any], Any, str], ...] = (
    (ROUTES, Route("Dock", WAY), "Route 1"),
    (STATIONS, Station(name="Dock", x=1.0, y=2.0), "Station 1"),
    (TAGS, Tag(id="Dock", x=1.0, y=2.0), "T1"),
    (ZONES, Zone(name="Dock", outline=CORNERS), "Zone 1"),
)


@pytest.fixture(params=CASES, ids=lambda case: case[0].kind)
def case(request: pytest.FixtureRequest) -> tuple[Named[Any], Any, str]:
    return request.param


def test_removing_what_was_added_gives_back_what_was(case: tuple[Named[Any], Any, str]) -> None:
    named, dock, first = case
    gate = replace(dock, **{named.key: "Gate"})
    assert named.remove(named.put((dock,), gate), "Gate") == (dock,)
    assert named.fresh(()) == named.fresh((dock, gate)) == first
    assert named.fresh((replace(dock, **{named.key: first}),)) == f"{first[:-1]}2"


def test_it_keeps_its_place_when_it_is_renamed(case: tuple[Named[Any], Any, str]) -> None:
    named, dock, _ = case
    gate, pier = (replace(dock, **{named.key: name}) for name in ("Gate", "Pier"))
    assert named.put((dock, gate), pier, "Dock") == (pier, gate)


def test_two_never_get_one_name(case: tuple[Named[Any], Any, str]) -> None:
    named, dock, _ = case
    gate = replace(dock, **{named.key: "Gate"})
    for name in ("Dock", None):
        with pytest.raises(
            UsageError, match=f"{named.kind} {named.key} 'Gate' is used already; expected another {named.key}"
        ):
            named.put((dock, gate), gate, name)


def test_an_unknown_one_is_answered_with_the_names_there_are(case: tuple[Named[Any], Any, str]) -> None:
    named, dock, _ = case
    with pytest.raises(UsageError, match=f"no {named.kind} is called 'X'; the project has: 'Dock'"):
        named.remove((dock,), "X")
    with pytest.raises(UsageError, match=f"no {named.kind} is called 'X'; the project has: none"):
        named.put((), dock, "X")
