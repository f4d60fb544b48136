"""Reflectors in sight along routes and at stations: both sides of two and of three, with their place."""

from dataclasses import replace

import numpy as np
import pytest

from commission.site.layout_brief import CandidateOptions, Demands, LayoutBrief
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


def along_walls(pitch: float) -> list[tuple[float, float]]:
    """Reflectors at both walls of the hall, those of the other wall a little off, so that few distances are alike."""
    return [(x, y) for x in np.arange(1.0, 40.0, pitch).tolist() for y in (0.5, 7.5)]


def asked(demands: Demands, *, ignored: tuple[str, ...] = (), places: list[tuple[float, float]]) -> list[str]:
    layout = LayoutBrief(demands, CandidateOptions(spacing=2.0), ignored_routes=ignored)
    problems = found(places, routes=(ROUTE,), scanners=(replace(SCANNER, reflector_range=8.0),), layout=layout)
    demanded = [each for each in problems if each.text.endswith("as demanded")]
    assert all(each.severity is Severity.NOTE and each.place is not None for each in demanded)
    return [each.text for each in demanded]


def test_what_a_preset_demands_is_told_where_fewer_are_in_sight_of_routes_that_count() -> None:
    """Of pairs every 5 m at least two pairs are seen: enough for 3 when one fails, and too few for 5."""
    places = along_walls(5.0)
    assert asked(Demands(), places=places) == []
    assert asked(Demands().preset("NAV350"), places=places) == []
    (told,) = asked(Demands(visible=5), places=places)
    assert told.startswith("Route 'Through': fewer than 6 reflectors in sight on ")
    assert told.endswith("expected 6 or more, so that 5 are left when one fails, as demanded")
    assert asked(Demands(visible=5), places=places, ignored=("Through",)) == []


def test_pairs_of_nearly_the_same_distance_are_told_by_name_where_they_must_differ() -> None:
    places = [(14.0, 0.5), (18.0, 7.5), (22.02, 0.5)]
    unlike = [(14.0, 0.5), (18.0, 7.5), (22.9, 0.5)]
    near = (*along_walls(5.0)[:2], *along_walls(5.0)[-2:])
    told = asked(Demands(pairs_differ=0.3), places=[*places, *near])
    assert any("R0 to R1 8.06 m, R1 to R2 8.07 m" in each and "more than 0.3 m between them" in each for each in told)
    told = asked(Demands(pairs_differ=0.3), places=[*unlike, *near])
    assert not any("R0 to R1" in each and "R1 to R2" in each for each in told)


def test_walls_far_from_any_reflector_are_told_where_reflectors_must_spread() -> None:
    assert asked(Demands(wall_reach=6.0), places=along_walls(5.0)) == []
    (told,) = asked(Demands(wall_reach=1.0), places=along_walls(5.0))
    assert told.startswith("Walls: ")
    assert told.endswith("expected one within 1 m, as demanded")
