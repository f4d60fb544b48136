from __future__ import annotations

import math

import numpy as np
import pytest

from commission.planning.nominal_drive import DrivePlan, nominal_drive
from commission.planning.route_profile import MOST_ROWS, route_profile
from commission.site.path import MotionLimits
from commission.site.routes import Direction, Route, Segment
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle, TricycleVehicle

HALF = math.sqrt(0.5)
QUARTER = Segment(
    control_points=np.array([[0, 0], [2, 0], [2, 2]], float), degree=2, weights=np.array([1.0, HALF, 1.0])
)
"""A quarter of a circle of 2 m radius, to the left."""


def line(start: tuple[float, float], end: tuple[float, float], direction: Direction = Direction.FORWARD) -> Segment:
    return Segment(control_points=np.array([start, end], float), direction=direction, degree=1)


def test_a_quarter_circle_has_its_curvature_length_and_turn():
    profile = route_profile(Route("r", (QUARTER,), speed=0.5), DifferentialVehicle())
    np.testing.assert_allclose(profile.curvatures, 0.5, rtol=1e-6)
    assert profile.length == pytest.approx(math.pi, abs=1e-6)
    assert profile.headings[-1] - profile.headings[0] == pytest.approx(math.pi / 2, abs=1e-6)


def test_speed_ramps_up_from_rest_and_down_to_it_and_is_limited_in_curves():
    limits = MotionLimits(acceleration=0.4, lateral_acceleration=0.4)
    straight = route_profile(Route("r", (line((0, 0), (10, 0)),), speed=1.0), DifferentialVehicle(), limits)
    # From rest within 0.4 m/s^2: v^2 = 2 a s, rows are the lowest speed of their stretch.
    ramp = np.sqrt(2.0 * 0.4 * straight.metres)
    rising = straight.metres < 1.0
    assert np.all(straight.speeds[rising] <= ramp[rising] + 1e-9)
    np.testing.assert_allclose(straight.speeds[rising], ramp[rising], atol=0.01)
    assert straight.speeds.max() == pytest.approx(1.0)
    assert straight.speeds[-1] == 0.0
    bend = route_profile(Route("r", (QUARTER,), speed=2.0), DifferentialVehicle(), limits)
    assert bend.speeds.max() <= math.sqrt(0.4 * 2.0) + 1e-9


def test_it_is_the_motion_that_is_planned_and_takes_its_time():
    route = Route("r", (line((0, 0), (4, 0)), line((4, 0), (1, 0), Direction.REVERSE)), speed=0.6)
    vehicle, plan = DifferentialVehicle(), DrivePlan()
    profile = route_profile(route, vehicle, plan.limits)
    drive = nominal_drive(route, vehicle, (Scanner(rate=100.0),), plan)
    rests = 2.0 * plan.rest + plan.pause
    assert profile.stops == 1
    assert profile.seconds + rests == pytest.approx(drive.stamps_ns[-1] * 1e-9, abs=0.02)
    speeds = np.diff(drive.metres) * 100.0
    expected = np.interp(0.5 * (drive.metres[1:] + drive.metres[:-1]), profile.metres, profile.speeds)
    # A row is the lowest speed of 15 mm: at 0.3 m/s and 0.4 m/s^2 speed changes by 20 mm/s over these.
    moving = speeds > 0.3
    np.testing.assert_allclose(expected[moving], speeds[moving], atol=0.03)


def test_in_reverse_the_vehicle_looks_back_and_does_not_turn_at_the_cusp():
    route = Route("r", (line((0, 0), (2, 0)), line((2, 0), (1, 0), Direction.REVERSE)))
    profile = route_profile(route, DifferentialVehicle())
    np.testing.assert_allclose(profile.headings, 0.0, atol=1e-9)
    assert np.all(np.diff(profile.metres) >= 0.0)


def test_headings_count_on_over_a_half_turn_and_jump_only_where_the_vehicle_turns_on_the_spot():
    # Twice around: four quarters on each other's ends, each the one before turned by a right angle.
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    points, quarters = QUARTER.control_points, [QUARTER]
    for _ in range(7):
        points = points[-1] + (points - points[0]) @ turn
        quarters.append(Segment(control_points=points, degree=2, weights=QUARTER.weights))
    around = route_profile(Route("r", tuple(quarters)), DifferentialVehicle()).headings
    assert around[-1] - around[0] == pytest.approx(4.0 * math.pi, abs=1e-6)
    assert np.abs(np.diff(around)).max() < 0.1
    corner = Route("r", (line((0, 0), (2, 0)), line((2, 0), (2, 2))))
    profile = route_profile(corner, DifferentialVehicle())
    jumps = np.diff(profile.headings)
    assert np.count_nonzero(np.abs(jumps) > 0.1) == 1
    assert jumps.max() == pytest.approx(math.pi / 2)


def test_the_limit_is_that_of_the_steering_and_a_long_route_is_thinned_without_losing_its_tightest_curve():
    waves = np.column_stack((np.arange(200.0), np.where(np.arange(200) == 100, 3.0, 0.0)))
    route = Route("r", (Segment(control_points=waves),))
    tricycle = TricycleVehicle(1.2, 45.0)
    profile = route_profile(route, tricycle)
    assert profile.largest_curvature == pytest.approx(1.0 / 1.2)
    assert math.isinf(route_profile(route, DifferentialVehicle()).largest_curvature)
    assert len(profile.metres) <= MOST_ROWS + 1
    spline = route.segments[0].spline()
    dense = np.abs(spline.curvature(np.linspace(*spline.domain, 200_001)))
    assert np.abs(profile.curvatures).max() == pytest.approx(dense.max(), rel=1e-3)
