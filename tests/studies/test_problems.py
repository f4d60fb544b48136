from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.route_check import MOST_ROOM, FloorDistances, room_along, smallest_radius, way_of
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import ContourParameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle
from commission.site.zones import ObservationKind, Zone
from commission.studies.problems import (
    MOST_OF_A_KIND,
    ProblemsInput,
    ProblemsResult,
    Severity,
    Subject,
    problems,
    separation_needed,
)

CELL = 0.05
BOX = DifferentialVehicle(outline=((0.5, 0.3), (-0.5, 0.3), (-0.5, -0.3), (0.5, -0.3)))


def hall() -> FloorMap:
    """12 x 8 m with a wall of 0.3 m around it and a wall at x = 6 m up to y = 4 m."""
    cells = np.full((160, 240), FREE, np.int8)
    cells[:6], cells[-6:], cells[:, :6], cells[:, -6:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[:80, 120:124] = OCCUPIED
    return FloorMap(cells, CELL)


FLOOR = FloorDistances(hall())
REFLECTORS = ReflectorMap(
    tuple(Reflector(id=n, x=x, y=y, radius=0.12) for n, x, y in (("A", 1, 7.6), ("B", 4, 7.6), ("C", 11, 7.6)))
)
EDGE = Scanner(mounting=[0.5, 0.0, 0.0], field_of_view_deg=(-90.0, 90.0))
SITE = Project(floor_map=FLOOR.floor_map, reflectors=REFLECTORS, vehicle=BOX, scanners=(EDGE,))


def line(*points: tuple[float, float], name: str = "r", direction: Direction = Direction.FORWARD) -> Route:
    return Route(name, (Segment(control_points=np.array(points, float), direction=direction, degree=1),))


def checked(project: Project, before: ProblemsResult | None = None) -> ProblemsResult:
    return problems(ProblemsInput.of(project), before=before)


def texts(project: Project) -> list[str]:
    return [problem.text for problem in checked(project).problems]


def test_a_sound_site_has_no_problems():
    assert texts(replace(SITE, routes=(line((1.5, 6.0), (10.5, 6.0)),))) == []


def test_a_route_through_a_wall_says_where_and_over_what_length():
    findings = checked(replace(SITE, routes=(line((2.0, 2.0), (10.0, 2.0)),)))
    (error,) = [p for p in findings.problems if p.severity is Severity.ERROR]
    # From where the front (0.5 m ahead) meets the wall to where the rear leaves it: 1 m of vehicle, 0.2 m of wall.
    assert error.text.startswith("Route 'r': the vehicle's outline cuts a wall over ")
    # Poses are 0.05 m apart: the first and the last one that touch may lie a pose inside.
    assert 1.1 <= float(error.text.split()[-2]) <= 1.25
    assert (error.subject, error.ids) == (Subject.ROUTE, ("r",))
    assert error.place == pytest.approx((6.1, 2.0), abs=0.06)


def test_room_is_the_distance_between_outline_and_wall():
    for y in (1.0, 2.0, 0.75):
        way = way_of(line((2.0, y), (4.0, y)))
        room = room_along(way, BOX.outline, FLOOR)
        # The wall ends at y = 0.3 m, the vehicle 0.3 m below its middle; distances are good to a cell.
        np.testing.assert_allclose(room, min(y - 0.6, MOST_ROOM), atol=CELL)


def test_little_room_is_a_warning_with_millimetres():
    (text,) = texts(replace(SITE, routes=(line((1.5, 0.68), (4.5, 0.68)),)))
    assert text.endswith("mm between the vehicle's outline and a wall; expected 100 mm or more")


def test_a_reverse_segment_is_checked_with_the_vehicle_turned_round():
    long = replace(BOX, outline=((0.2, 0.3), (-1.5, 0.3), (-1.5, -0.3), (0.2, -0.3)))
    forward = checked(replace(SITE, vehicle=long, routes=(line((3, 2), (5, 2)),))).problems
    reverse = line((3, 2), (5, 2), direction=Direction.REVERSE)
    backward = checked(replace(SITE, vehicle=long, routes=(reverse,))).problems
    assert not [p for p in forward if p.subject is Subject.ROUTE]
    assert next(p.severity for p in backward if p.subject is Subject.ROUTE) is Severity.ERROR


@pytest.mark.parametrize(("steering", "radius"), [(45.0, 1.2), (75.0, 0.3215), (90.0, 0.0)])
def test_a_tricycle_can_drive_its_wheelbase_over_the_tangent_of_its_steering(steering, radius):
    assert smallest_radius(TricycleVehicle(1.2, steering)) == pytest.approx(radius, abs=1e-4)


def test_a_curve_tighter_than_the_vehicle_can_drive_is_an_error_with_both_radii():
    weight = math.cos(math.pi / 4.0)
    corner = [[9.0, 5.0], [10.0, 5.0], [10.0, 6.0]]
    quarter = Segment(control_points=np.array(corner), degree=2, weights=np.array([1.0, weight, 1.0]))
    route = Route("bend", (quarter,))
    small = TricycleVehicle(1.2, 45.0, outline=((0.1, 0.1), (-0.1, 0.1), (0.0, -0.1)))
    site = replace(SITE, routes=(route,), vehicle=small, scanners=(Scanner(mounting=[0.0, 0.0, 0.0]),))
    (text,) = [t for t in texts(site) if "Route" in t]
    assert "a curve of 1.00 m radius over 1.5" in text
    assert "expected 1.20 m or more" in text
    assert not [t for t in texts(replace(site, vehicle=replace(small, wheelbase=0.99))) if "Route" in t]


def test_a_corner_is_an_error_a_warning_or_fine_depending_on_the_vehicle():
    corner = line((2.0, 6.0), (4.0, 6.0), (4.0, 3.0))
    two = Route("r", (line((2, 6), (4, 6)).segments[0], line((4, 6), (4, 3)).segments[0]))
    small = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
    tricycle, wheels = TricycleVehicle(outline=small), DifferentialVehicle(outline=small)
    omni, scanner = OmnidirectionalVehicle(outline=small), Scanner(mounting=[0.1, 0, 0], field_of_view_deg=(-90, 90))

    def found(vehicle, route):
        site = replace(SITE, vehicle=vehicle, routes=(route,), scanners=(scanner,))
        return [(p.severity, "90 deg on the spot" in p.text) for p in checked(site).problems]

    assert found(tricycle, corner) == found(tricycle, two) == [(Severity.ERROR, True)]
    assert found(wheels, corner) == [(Severity.WARNING, True)]
    assert found(wheels, two) == found(omni, corner) == []


def test_close_reflectors_are_told_by_what_cannot_tell_them_apart():
    apart, gap = separation_needed(SITE)
    needed = max(apart, gap + 0.08)

    def pair(distance):
        both = ReflectorMap((Reflector(id="A", x=3.0, y=7.0), Reflector(id="B", x=3.0 + distance, y=7.0)))
        found = checked(replace(SITE, reflectors=both)).problems
        # Posts of 80 mm are hardly resolved at the far end of the hall: a problem of the scanner.
        return [(p.severity, p.text) for p in found if p.subject is Subject.REFLECTOR]

    assert pair(needed + 0.01) == []
    assert pair(0.0) == [(Severity.ERROR, "Reflectors 'A' and 'B' are at the same place; expected one of them")]
    assert pair(0.05)[0][0] is Severity.ERROR
    assert "50 mm apart and overlap" in pair(0.05)[0][1]
    ((severity, text),) = pair(0.2)
    assert severity is Severity.WARNING
    assert text.endswith(f"are 200 mm apart; expected {needed:.2f} m or more to tell them apart at any range")


def test_many_close_reflectors_are_counted_instead_of_listed():
    crowd = ReflectorMap(tuple(Reflector(id=str(i), x=1.0 + 0.1 * i, y=7.0) for i in range(90)))
    given = checked(replace(SITE, reflectors=crowd)).problems
    found = [problem.text for problem in given if problem.subject is Subject.REFLECTOR]
    assert len(found) == MOST_OF_A_KIND + 1
    assert "more like" in found[-1]


def test_reflectors_that_no_ray_reaches_are_inside_a_wall():
    plate = Reflector(id="P", x=0.3, y=4.0, kind=ReflectorKind.FLAT, heading=math.pi)
    some = (
        Reflector(id="in", x=0.12, y=2.0),
        Reflector(id="on", x=0.34, y=2.0),
        plate,
        replace(plate, id="Q", y=6, heading=0.0),
    )
    site = replace(SITE, reflectors=ReflectorMap((*some, Reflector(id="far", x=20.0, y=20.0))))
    found = checked(site).problems
    assert [p.ids for p in found if "inside a wall" in p.text] == [("in",), ("P",)]
    assert [p.ids for p in found if "outside of the floor map" in p.text] == [("far",)]


def test_a_station_without_room_is_an_error():
    site = replace(SITE, stations=(Station(name="Dock", x=0.6, y=4.0), Station(name="Gate", x=3.0, y=4.0)))
    assert [p.ids for p in checked(site).problems if p.severity is Severity.ERROR] == [("Dock",)]


def test_a_station_that_no_route_passes_is_told_since_nobody_would_check_its_accuracy():
    there, back = line((1.5, 6.0), (10.5, 6.0), name="a"), line((1.5, 5.0), (10.5, 5.0), direction=Direction.REVERSE)
    stations = (
        Station(name="on", x=3.0, y=6.1),
        Station(name="beside", x=3.0, y=6.3),
        Station(name="against", x=3.0, y=6.0, heading=math.pi),
        # A vehicle that reverses to the east looks to the west.
        Station(name="reverse", x=3.0, y=5.0, heading=math.pi),
        Station(name="across", x=3.0, y=5.0, heading=0.0),
    )
    site = replace(SITE, routes=(there, back), stations=stations)
    first = checked(site)
    assert [p.ids[0] for p in first.problems if "no route passes it" in p.text] == ["beside", "against", "across"]
    again = checked(replace(site, name="x"), first)
    assert again.passed is first.passed
    assert checked(replace(site, routes=(back,)), first).passed.names == {"reverse"}


def test_beams_into_the_vehicle_are_counted_with_their_bearings():
    wide = replace(SITE, scanners=(Scanner(mounting=[0.5, 0.0, 0.0], field_of_view_deg=(-135.0, 135.0)),))
    (text,) = texts(wide)
    # From the middle of the front edge everything behind +-90 deg is vehicle: 45 deg on both sides.
    assert "blocks 180 of 541 beams, between -135.0 and 135.0 deg" in text
    (note,) = checked(replace(SITE, scanners=(Scanner(),))).problems
    assert (note.severity, note.subject) == (Severity.NOTE, Subject.SCANNER)
    assert note.text.startswith("The scanner is 300 mm inside the vehicle's outline")


def test_a_missing_map_is_said():
    assert "No floor map" in checked(replace(SITE, floor_map=None)).problems[0].text
    assert "No reflectors" in checked(replace(SITE, reflectors=ReflectorMap())).problems[0].text


def test_only_what_changed_is_checked_again_with_the_same_result(monkeypatch):
    routes = (line((2, 2), (10, 2), name="a"), line((1.5, 0.7), (4.5, 0.7), name="b"))
    before = checked(replace(SITE, routes=routes))
    moved = replace(SITE, routes=(routes[0], line((1.5, 6), (4.5, 6), name="b")))
    again = checked(moved, before)
    assert again.problems == checked(moved).problems
    monkeypatch.setattr("commission.studies.problems.check_route", None)
    assert checked(replace(moved, name="x"), again).problems == again.problems
    with pytest.raises(TypeError):
        checked(replace(moved, vehicle=TricycleVehicle()), again)


def test_each_of_several_scanners_is_looked_at_and_named():
    rear = replace(EDGE, name="rear", mounting=[-0.5, 0.0, math.pi])
    assert texts(replace(SITE, scanners=(replace(EDGE, name="front"), rear))) == []
    wide, inside = replace(rear, field_of_view_deg=(-135.0, 135.0)), Scanner(name="top")
    found = texts(replace(SITE, scanners=(replace(EDGE, name="front"), wide, inside)))
    assert [text.split(" between ")[0] for text in found[:1]] == [
        "The vehicle's own outline blocks 180 of 541 beams of the scanner 'rear',"
    ]
    assert found[1].startswith("The scanner 'top' is 300 mm inside the vehicle's outline")
    assert len(found) == 2


def test_reflectors_must_be_told_apart_by_the_coarsest_scanner():
    fine, coarse = replace(EDGE, name="fine", resolution_deg=0.1), replace(EDGE, name="coarse", resolution_deg=1.0)
    gaps = {
        names: separation_needed(replace(SITE, scanners=scanners))[1]
        for names, scanners in (("fine", (fine,)), ("coarse", (coarse,)), ("both", (fine, coarse)))
    }
    # Two bridged beams and the width of one, at the 20 m up to which reflectors are told.
    assert gaps["coarse"] == pytest.approx(20.0 * math.radians(2.0 * 1.0 + 0.25), rel=1e-12)
    assert gaps["both"] == gaps["coarse"] > gaps["fine"]


def test_plates_without_direction_and_reflectors_without_radius_are_told_with_their_number_and_names():
    mixed = (
        *(Reflector(id=f"P{k}", x=1.0 + k, y=7.0, radius=0.12, kind=ReflectorKind.FLAT) for k in range(3)),
        Reflector(id="K", x=5.0, y=7.0, radius=0.12, kind=ReflectorKind.FLAT, heading=-1.5),
        Reflector(id="S", x=8.0, y=7.0, radius=None),
        Reflector(id="C", x=10.0, y=7.0, radius=0.12),
    )
    found = checked(replace(SITE, reflectors=ReflectorMap(mixed))).problems
    undirected, sizeless = (
        [each for each in found if word in each.text] for word in ("unknown direction", "unknown radius")
    )
    assert [each.ids for each in undirected] == [("P0", "P1", "P2")]
    assert undirected[0].text.startswith("3 of 6 reflectors are plates of unknown direction")
    assert "(P0, P1, P2)" in undirected[0].text
    assert [each.ids for each in sizeless] == [("S",)]
    assert "1 of 6" in sizeless[0].text
    # pi / 4 of 20 mm.
    assert "20 to 80 mm" in sizeless[0].text
    assert "16 mm" in sizeless[0].text
    assert {each.severity for each in (*undirected, *sizeless)} == {Severity.WARNING}


def test_a_plate_of_unknown_direction_is_not_taken_for_one_inside_a_wall():
    on_wall = Reflector(id="P", x=3.0, y=0.31, radius=0.12, kind=ReflectorKind.FLAT)
    buried = replace(on_wall, id="B", y=0.14, radius=0.05)
    found = texts(replace(SITE, reflectors=ReflectorMap((on_wall, buried))))
    assert [text for text in found if "inside a wall" in text] == [
        "Reflector 'B' is inside a wall; expected where a ray can reach it"
    ]


@pytest.mark.parametrize(
    ("sectors", "severities"),
    [(((-90.0, 90.0),), [Severity.ERROR]), (((-90.0, 0.0), (0.0, 89.0)), [])],
    ids=["all of it", "all but a degree"],
)
def test_a_scanner_that_is_wholly_blind_is_an_error(
    sectors: tuple[tuple[float, float], ...], severities: list[Severity]
) -> None:
    scanner = Scanner(mounting=np.array([0.5, 0.0, 0.0]), field_of_view_deg=(-90.0, 90.0), blind_sectors_deg=sectors)
    found = checked(replace(SITE, scanners=(scanner,))).problems
    assert [each.severity for each in found if "wholly blind" in each.text] == severities


def test_an_outline_that_blocks_all_beams_is_an_error_and_one_that_blocks_some_a_warning() -> None:
    for heading, severity in ((math.pi, Severity.ERROR), (0.5 * math.pi, Severity.WARNING)):
        mounting = np.array([0.55, 0.0, heading])
        scanner = Scanner(mounting=mounting, field_of_view_deg=(-60.0, 60.0))
        found = checked(replace(SITE, scanners=(scanner,))).problems
        assert [each.severity for each in found if "own outline blocks" in each.text] == [severity], heading


def test_a_zone_in_which_nothing_corrects_the_pose_is_an_error_that_says_why() -> None:
    outline = ((1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0))
    kinds = ObservationKind.CONTOURS, ObservationKind.TAGS
    site = replace(SITE, zones=(Zone(name="Hall", outline=outline, kinds=kinds), Zone(name="All", outline=outline)))
    (found,) = [each for each in checked(site).problems if each.subject is Subject.ZONE]
    assert (found.severity, found.ids, found.place) == (Severity.ERROR, ("Hall",), (2.0, 1.5))
    why = "contours are switched off (contour.enabled), there are no tags"
    assert found.text.startswith(f"Zone 'Hall' leaves a vehicle to its odometry: {why}; expected")
    on = replace(site, parameters=replace(site.parameters, contour=ContourParameters(enabled=True)))
    for served in (on, replace(site, tags=(Tag(id="7", x=1.0, y=1.0),))):
        assert not [each for each in checked(served).problems if each.subject is Subject.ZONE]
