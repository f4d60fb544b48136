"""Reflectors in sight along routes and at stations: both sides of two and of three, with their place."""

from dataclasses import replace

import numpy as np
import pytest

from commission.site.project import Project
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.studies.problems import Problem, Severity, Subject
from commission.studies.sight import SightInput, sight
from tests.planning.sites import reflectors_at, room

SCANNER = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=5.0)
ROUTE = Route("Through", (Segment(control_points=np.array([[2.0, 4.0], [38.0, 4.0]]), degree=1),), 1.0)


def found(places: list[tuple[float, float]], **changes: object) -> tuple[Problem, ...]:
    given = {"floor_map": room(40.0, 8.0), "scanners": (SCANNER,), "reflectors": reflectors_at(places), **changes}
    return sight(SightInput.of(Project(**given))).problems  # pyright: ignore[reportArgumentType]


def around(x: float, count: int) -> list[tuple[float, float]]:
    return [(x, 1.0), (x, 7.0), (x + 0.8, 1.0)][:count]


@pytest.mark.parametrize(("count", "severity"), [(1, Severity.WARNING), (2, Severity.NOTE), (3, None)])
def test_a_station_needs_two_in_sight_and_three_so_that_one_may_fail(count: int, severity: Severity | None) -> None:
    problems = found(around(10.0, count), stations=(Station(name="Dock", x=10.0, y=4.0),))
    if severity is None:
        assert problems == ()
        return
    (problem,) = problems
    assert (problem.severity, problem.subject, problem.ids) == (severity, Subject.STATION, ("Dock",))
    assert problem.place == (10.0, 4.0)
    assert f"{count} reflector{'s' * (count > 1)} in sight; expected 3 or more" in problem.text


def test_a_stretch_of_a_route_with_too_few_is_told_with_its_metres_and_where_it_is_worst() -> None:
    """Pairs of reflectors 3 m off the way are seen from 4 m before them to 4 m after; between 16 and 24 m are none."""
    places = [(x, y) for x in (2.0, 4.0, 8.0, 12.0, 28.0, 32.0, 36.0, 38.0) for y in (1.0, 7.0)]
    problems = found(places, routes=(ROUTE,))
    warnings = [each for each in problems if each.severity is Severity.WARNING]
    assert [(each.subject, each.ids) for each in warnings] == [(Subject.ROUTE, ("Through",))]
    assert "no reflectors in sight at worst from 14.2 to 21.8 m; expected 3 or more" in warnings[0].text
    assert warnings[0].place is not None
    assert 16.0 <= warnings[0].place[0] <= 24.0
    assert warnings[0].place[1] == pytest.approx(4.0)


def test_what_is_seen_by_two_everywhere_is_one_note_with_its_length() -> None:
    places = [(x, y) for x in np.arange(2.0, 40.0, 9.0) for y in (1.0, 7.0)]
    wide = replace(SCANNER, reflector_range=12.0)
    every = found(places, routes=(ROUTE,), scanners=(wide,))
    assert [each.severity for each in every] in ([], [Severity.NOTE])
    narrow = replace(SCANNER, reflector_range=6.0)
    (note,) = found(places, routes=(ROUTE,), scanners=(narrow,))
    assert note.severity is Severity.NOTE
    assert "2 reflectors in sight on " in note.text
    assert "so that one may fail" in note.text


def test_walls_hide_reflectors_and_a_site_without_any_is_not_told_of_for_each_route() -> None:
    assert found([], routes=(ROUTE,), stations=(Station(name="Dock", x=10.0, y=4.0),)) == ()
    # Behind the wall of the hall.
    hidden = found([(10.0, -1.0), (11.0, 9.0), (9.0, 9.0)], stations=(Station(name="Dock", x=10.0, y=4.0),))
    assert "no reflectors in sight" in hidden[0].text


def test_two_scanners_together_see_what_neither_sees_alone() -> None:
    station = Station(name="Dock", x=10.0, y=4.0)
    places = [(7.0, 2.0), (13.0, 2.0), (13.0, 6.0)]
    ahead = Scanner(name="front", field_of_view_deg=(-90.0, 90.0), reflector_range=6.0)
    behind = replace(ahead, name="rear", mounting=np.array([0.0, 0.0, np.pi]))
    assert found(places, stations=(station,), scanners=(ahead,))[0].severity is Severity.NOTE
    assert found(places, stations=(station,), scanners=(ahead, behind)) == ()
