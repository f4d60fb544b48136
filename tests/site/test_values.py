"""Values of a site refuse what cannot be, in words that say what was found and what is expected."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.errors import ProjectError, UsageError
from commission.io.project_file import apply_settings
from commission.site.disturbances import Disturbances, ShinyObject, TiltedStretch
from commission.site.fields import field_hints
from commission.site.floor_map import OCCUPIED, FloorMap
from commission.site.parameters import Parameters, TemporaryParameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle

STRAIGHT = Segment(control_points=[[0, 0], [1, 0], [2, 0], [3, 0]])


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Scanner(field_of_view_deg=(90, -90)), r"field_of_view_deg is \[90, -90\]; expected first < last"),
        (lambda: Scanner(range=(5.0, 5.0)), "expected smallest < largest range"),
        (lambda: Scanner(mounting=[0.0, math.nan, 0.0]), r"scanner.mounting\[1\] is nan; expected finite"),
        (lambda: Scanner(rate=0.0), "scanner.rate is 0; expected 0.1 to 1000"),
        (lambda: Reflector(id="a", x=0.0, y=0.0, radius=0.0), "radius is 0; expected more than 0"),
        (lambda: Reflector(id="", x=0.0, y=0.0), "id is empty"),
        (lambda: DifferentialVehicle(wheel_separation=-0.4), "wheel_separation is -0.4; expected more than 0 m"),
        (lambda: TricycleVehicle(wheelbase=0.0), "wheelbase"),
        (lambda: OmnidirectionalVehicle(wheel_angles_deg=(0.0, 360.0, 90.0)), "expected 3 or more different angles"),
        (lambda: FloorMap(np.zeros((2, 2), np.int8), 0.0), "resolution is 0; expected metres per cell > 0"),
        (lambda: FloorMap(np.zeros((0, 2), np.int8), 0.05), "expected rows x columns"),
        (lambda: Route("r", ()), "has no segments"),
        (lambda: Segment(control_points=[[0, 0], [1, 0]], degree=3), "control points"),
        (lambda: Disturbances(dropped_scans=1.5), "dropped_scans is 1.5; expected 0 to 1"),
        (lambda: Station(name="", x=0.0, y=0.0), "a station's name is empty"),
        (lambda: Station(name="Dock", x=0.0, y=math.nan), "y is nan; expected"),
        (
            lambda: Station(name="Dock", x=0.0, y=0.0, heading=0.0, required_accuracy=0.0),
            "required_accuracy is 0; expected 0.001 to 10 m",
        ),
        (lambda: ShinyObject(math.inf, 0.0), "shiny object's x is inf; expected -1e\\+07 to 1e\\+07 m"),
        (lambda: TiltedStretch(0.0, 0.0, -1.0), "radius is -1; expected 0 m or more"),
    ],
)
def test_impossible_values_are_refused_with_what_was_found_and_expected(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_two_reflectors_with_one_id_are_refused():
    with pytest.raises(ProjectError, match="'a' is used twice"):
        ReflectorMap((Reflector(id="a", x=0, y=0), Reflector(id="a", x=1, y=0)))


def test_two_stations_of_one_name_are_refused():
    with pytest.raises(ProjectError, match="station name 'Dock' is used twice"):
        Project(stations=(Station(name="Dock", x=0.0, y=0.0), Station(name="Dock", x=1.0, y=0.0)))


def test_a_route_whose_segments_do_not_meet_is_refused_with_the_gap_in_millimetres():
    with pytest.raises(ProjectError, match="segment 2 starts 500 mm from the end of segment 1"):
        Route("r", (STRAIGHT, Segment(control_points=[[3.5, 0], [4, 0], [5, 0], [6, 0]])))


def test_an_unknown_route_is_answered_with_the_names_there_are():
    with pytest.raises(UsageError, match="no route is called 'x'; the project has: 'Loop'"):
        Project(routes=(Route("Loop", (STRAIGHT,)),)).route("x")


def test_a_full_turn_does_not_repeat_its_first_beam():
    assert Scanner(field_of_view_deg=(-180, 180), resolution_deg=0.5).beam_count == 720
    assert Scanner(field_of_view_deg=(-180, 180), resolution_deg=0.5).is_full_turn
    assert Scanner(field_of_view_deg=(-135, 135), resolution_deg=0.25).beam_count == 1081
    assert not Scanner(field_of_view_deg=(-135, 135), resolution_deg=0.25).is_full_turn


def test_arrays_inside_values_are_read_only_copies():
    source = np.zeros(3)
    scanner = Scanner(mounting=source)
    source[0] = 1.0
    assert scanner.mounting[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        scanner.mounting[0] = 1.0


def test_only_occupied_cells_stop_the_laser():
    cells = np.array([[OCCUPIED, 0], [-1, 0]], np.int8)
    assert FloorMap(cells, 0.5).occupancy().occupied.tolist() == [[True, False], [False, False]]


def test_every_parameter_has_a_hint_that_users_read():
    for group in dataclasses.fields(Parameters):
        cls = type(getattr(Parameters(), group.name))
        assert set(field_hints(cls)) == {field.name for field in dataclasses.fields(cls)}


@pytest.mark.parametrize("gate", [0.0, 1.0, -0.5, math.nan])
def test_a_gate_probability_outside_zero_to_one_is_refused(gate):
    association = Parameters().association
    with pytest.raises(ValueError, match=r"association\.gate_probability is"):
        dataclasses.replace(association, gate_probability=gate)


def test_values_that_hold_arrays_compare_by_their_content():
    assert Scanner(mounting=[0.1, 0, 0]) == Scanner(mounting=[0.1, 0, 0])
    assert Scanner(mounting=[0.1, 0, 0]) != Scanner(mounting=[0.2, 0, 0])
    assert Segment(control_points=[[0, 0], [1, 0], [2, 0], [3, 0]]) == STRAIGHT
    assert Project(routes=(Route("Loop", (STRAIGHT,)),)) == Project(routes=(Route("Loop", (STRAIGHT,)),))
    assert FloorMap(np.zeros((2, 2), np.int8), 0.05) == FloorMap(np.zeros((2, 2), np.int8), 0.05)


@pytest.mark.parametrize("what", ["radius", "arc", "side"])
def test_swapped_limits_of_goods_are_refused_and_both_can_be_raised_past_each_other(what: str) -> None:
    least, largest = f"least_{what}", f"largest_{what}"
    with pytest.raises(ValueError, match=rf"temporary.{least} is 4 .* temporary.{largest} 4 .*the smaller one first"):
        TemporaryParameters(**{least: 4.0, largest: 4.0})
    for order in (1, -1):
        settings = [f"temporary.{least}=4", f"temporary.{largest}=5"][::order]
        raised = apply_settings(Parameters(), settings).temporary
        assert (getattr(raised, least), getattr(raised, largest)) == (4.0, 5.0)
    with pytest.raises(UsageError, match="the smaller one first"):
        apply_settings(Parameters(), [f"temporary.{least}=6"])
