"""The follower keeps to the route; the reported motion has the noise of the filter's model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.errors import ProjectError
from commission.geometry.angles import difference
from commission.geometry.se2 import exp, log, relative
from commission.simulation.drive import DriveOptions, TrueMotion, drive, measure
from commission.site.disturbances import WheelNoise
from commission.site.path import KINK, MotionLimits, legs_of
from commission.site.routes import Direction, Route, Segment
from commission.site.truth import TrueWheels
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle
from tests.simulation.halls import out_and_back

VEHICLES = (DifferentialVehicle(), TricycleVehicle(), TricycleVehicle(wheelbase=-1.0), OmnidirectionalVehicle())
EXACT_START = DriveOptions(start_sigma=(0.0, 0.0, 0.0))
NOISELESS = WheelNoise(
    forward_per_sqrt_m=0.0,
    lateral_per_sqrt_m=0.0,
    heading_per_sqrt_m=0.0,
    heading_per_sqrt_rad=0.0,
    forward_per_sqrt_s=0.0,
    heading_per_sqrt_s=0.0,
)
STRAIGHT = Route("Straight", (Segment(control_points=np.array([[0.0, 0.0], [10.0, 0.0]]), degree=1),), 1.0)


def driven(vehicle: Vehicle, route: Route, options: DriveOptions = EXACT_START) -> TrueMotion:
    return drive(route, vehicle, np.random.default_rng(0), options)


def distances_to(route: Route, vehicle: Vehicle, motion: TrueMotion) -> np.ndarray:
    way = np.concatenate([leg.points for leg in legs_of(route, vehicle, MotionLimits())])
    return np.array([np.min(np.hypot(*(way - pose[:2]).T)) for pose in motion.poses])


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.kind)
def test_vehicle_stays_within_one_centimetre_of_the_route_forward_and_in_reverse(vehicle: Vehicle) -> None:
    motion = driven(vehicle, out_and_back())
    # Half the distance between samples (2.5 mm) belongs to the yardstick.
    assert distances_to(out_and_back(), vehicle, motion).max() < 0.010


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.kind)
def test_vehicle_recovers_from_a_start_beside_the_route(vehicle: Vehicle) -> None:
    options = DriveOptions(start_sigma=(0.05, 0.05, 0.05))
    motion = drive(out_and_back(), vehicle, np.random.default_rng(3), options)
    beside = distances_to(out_and_back(), vehicle, motion)
    assert beside.max() < 0.15
    assert beside[len(beside) // 3 :].max() < 0.010


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.kind)
def test_vehicle_ends_at_rest_at_the_end_of_the_route(vehicle: Vehicle) -> None:
    motion = driven(vehicle, out_and_back())
    assert np.hypot(*(motion.poses[-1, :2] - [9.0, 5.0])) < 0.005
    assert not motion.twists[-20:].any()
    assert not motion.twists[:20].any()


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.kind)
def test_vehicle_faces_along_the_way_and_backs_up_on_reverse_segments(vehicle: Vehicle) -> None:
    motion = driven(vehicle, out_and_back())
    forward = motion.twists[:, 0]
    assert forward.max() == pytest.approx(0.5, abs=0.02)
    assert forward.min() == pytest.approx(-0.5, abs=0.02)
    # Two cusps: the speed changes its sign twice.
    signs = np.sign(forward[np.abs(forward) > 0.05])
    assert np.count_nonzero(np.diff(signs)) == 2


def test_speed_and_acceleration_keep_their_limits() -> None:
    motion = driven(DifferentialVehicle(), STRAIGHT)
    period = 1e-9 * motion.period_ns
    acceleration = np.diff(motion.twists[:, 0]) / period
    assert motion.twists[:, 0].max() == pytest.approx(1.0, abs=1e-9)
    assert acceleration.max() <= 0.4 + 1e-9
    # Braking is looked up at the place reached, one step late; the last creep ends at once.
    moving = motion.twists[1:, 0] > 0.05
    assert acceleration[moving].min() > -0.6


def test_vehicle_slows_down_in_tight_curves() -> None:
    bend = Route("Bend", (Segment(control_points=np.array([[0, 0], [2, 0], [2.2, 0], [2.2, 0.2], [2.2, 2.2]])),), 1.5)
    (leg,) = legs_of(bend, DifferentialVehicle(), MotionLimits())
    tightest = np.argmax(np.abs(leg.curvatures))
    assert leg.speeds[tightest] ** 2 * abs(leg.curvatures[tightest]) <= 0.4 + 1e-9
    assert leg.speeds[tightest] < 0.7 * leg.speeds.max()


def test_route_is_cut_at_cusps_and_kinks_only() -> None:
    smooth = Route(
        "Smooth",
        (
            Segment(control_points=np.array([[0, 0], [1, 0]]), degree=1),
            Segment(control_points=np.array([[1, 0], [3, 0]]), degree=1),
        ),
    )
    kinked = Route(
        "Kinked",
        (
            Segment(control_points=np.array([[0, 0], [1, 0]]), degree=1),
            Segment(control_points=np.array([[1, 0], [1, 2]]), degree=1),
        ),
    )
    assert len(legs_of(smooth, DifferentialVehicle(), MotionLimits())) == 1
    assert len(legs_of(kinked, DifferentialVehicle(), MotionLimits())) == 2
    assert len(legs_of(out_and_back(), DifferentialVehicle(), MotionLimits())) == 3
    assert KINK < 0.1


def test_differential_vehicle_turns_on_the_spot_at_a_kink() -> None:
    kinked = Route(
        "Kinked",
        (
            Segment(control_points=np.array([[0, 0], [1, 0]]), degree=1),
            Segment(control_points=np.array([[1, 0], [1, 2]]), degree=1),
        ),
    )
    motion = driven(DifferentialVehicle(), kinked)
    assert distances_to(kinked, DifferentialVehicle(), motion).max() < 0.02
    assert motion.poses[-1] == pytest.approx([1.0, 2.0, np.pi / 2], abs=0.02)


def test_tricycle_that_cannot_steer_a_route_says_so() -> None:
    tight = Route("Tight", (Segment(control_points=np.array([[0, 0], [1, 0], [1, 0.3], [0, 0.3]])),))
    vehicle = TricycleVehicle(wheelbase=2.0, max_steering_deg=10.0)
    try:
        motion = driven(vehicle, tight)
    except ProjectError as error:
        assert "Tight" in str(error)
    else:
        assert distances_to(tight, vehicle, motion).max() > 0.2


def test_tricycle_steers_within_its_limits() -> None:
    vehicle = TricycleVehicle(wheelbase=1.2, max_steering_deg=40.0)
    motion = driven(vehicle, out_and_back())
    moving = np.abs(motion.twists[:, 0]) > 0.02
    steering = np.arctan(vehicle.wheelbase * motion.twists[moving, 2] / motion.twists[moving, 0])
    assert np.abs(steering).max() <= np.radians(40.0) + 1e-9


def test_poses_between_stamps_follow_the_same_arcs() -> None:
    motion = driven(DifferentialVehicle(), out_and_back())
    assert np.array_equal(motion.poses_at(motion.stamps_ns), motion.poses)
    k = 300
    half = motion.poses_at(np.array([motion.stamps_ns[k] + motion.period_ns // 2]))[0]
    expected = exp(0.5 * log(relative(motion.poses[k], motion.poses[k + 1])))
    assert relative(motion.poses[k], half) == pytest.approx(expected, abs=1e-12)


def test_odometry_without_noise_is_the_true_motion() -> None:
    motion = driven(OmnidirectionalVehicle(), out_and_back())
    reported = measure(motion, OmnidirectionalVehicle(), TrueWheels(noise=NOISELESS), 0.0, np.random.default_rng(0))
    assert not reported[0].any()
    # Poses carry the rounding of a few metres.
    assert reported[1:] == pytest.approx(relative(motion.poses[:-1], motion.poses[1:]), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "sigmas"),
    [
        ("forward_per_sqrt_m", (0.02 * np.sqrt(10.0), 0.0, 0.0)),
        ("lateral_per_sqrt_m", (0.0, 0.02 * np.sqrt(10.0), 0.0)),
        ("heading_per_sqrt_m", (0.0, None, 0.02 * np.sqrt(10.0))),
        ("forward_per_sqrt_s", (0.02 * np.sqrt(14.5), 0.0, 0.0)),
        ("heading_per_sqrt_s", (0.0, None, 0.02 * np.sqrt(14.5))),
    ],
)
def test_reported_motion_spreads_as_the_parameter_says(name: str, sigmas: tuple[float | None, ...]) -> None:
    motion = driven(DifferentialVehicle(), STRAIGHT)
    seconds = 1e-9 * motion.duration_ns
    rng = np.random.default_rng(1)
    noise = replace(NOISELESS, **{name: 0.02})
    errors = []
    for _ in range(400):
        reported = measure(motion, DifferentialVehicle(), TrueWheels(noise=noise), 0.0, rng)
        twists = log(reported) - log(measure(motion, DifferentialVehicle(), TrueWheels(noise=NOISELESS), 0.0, rng))
        errors.append(twists.sum(axis=0))
    spread = np.std(errors, axis=0)
    for axis, sigma in enumerate(sigmas):
        if sigma is not None:
            expected = sigma if "sqrt_m" in name else 0.02 * np.sqrt(seconds) * (sigma > 0.0)
            # 400 draws: 1-sigma of a standard deviation is 3.5 %; five of them.
            assert spread[axis] == pytest.approx(expected, rel=0.18, abs=1e-9)


@pytest.mark.parametrize(("name", "along"), [("forward_per_sqrt_m", True), ("lateral_per_sqrt_m", False)])
def test_noise_of_a_motion_askew_lies_along_it_or_across_it(name: str, along: bool) -> None:
    # 200 steps of 25 mm, 30 degrees to the left of the vehicle's axis.
    askew = np.array([np.cos(np.radians(30.0)), np.sin(np.radians(30.0))])
    twists = np.zeros((201, 3))
    twists[1:, :2] = 1.25 * askew
    poses = np.concatenate((np.zeros((1, 3)), np.cumsum(twists[1:], axis=0) * 0.02))
    motion = TrueMotion(np.arange(201) * 20_000_000, poses, twists)
    vehicle, noise = OmnidirectionalVehicle(), replace(NOISELESS, **{name: 0.02})
    errors = measure(motion, vehicle, TrueWheels(noise=noise), 0.0, np.random.default_rng(1))[1:, :2] - 0.025 * askew
    parts = errors @ askew, errors @ [-askew[1], askew[0]]
    spread, nothing = parts if along else parts[::-1]
    np.testing.assert_allclose(nothing, 0.0, atol=1e-12)
    # 200 draws: 1-sigma of a standard deviation is 5 %; four of them.
    assert np.std(spread) == pytest.approx(0.02 * np.sqrt(0.025), rel=0.2)


def test_reported_heading_spreads_with_the_angle_turned() -> None:
    motion = driven(DifferentialVehicle(), out_and_back())
    turned = np.sum(np.abs(motion.twists[:, 2])) * 1e-9 * motion.period_ns
    noise = replace(NOISELESS, heading_per_sqrt_rad=0.02)
    rng = np.random.default_rng(1)
    errors = [
        np.sum(
            difference(
                measure(motion, DifferentialVehicle(), TrueWheels(noise=noise), 0.0, rng)[1:, 2],
                np.diff(motion.poses[:, 2]),
            )
        )
        for _ in range(300)
    ]
    assert np.std(errors) == pytest.approx(0.02 * np.sqrt(turned), rel=0.2)


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.kind)
def test_slips_report_motion_that_did_not_happen(vehicle: Vehicle) -> None:
    motion = driven(vehicle, out_and_back())
    true = measure(motion, vehicle, TrueWheels(noise=NOISELESS), 0.0, np.random.default_rng(0))
    reported = measure(motion, vehicle, TrueWheels(noise=NOISELESS), 40.0, np.random.default_rng(0))
    slipping = np.abs(reported - true).max(axis=1) > 1e-9
    assert 0 < np.count_nonzero(slipping) < 0.3 * len(slipping)
    # A wheel spins: it never reports less than it should.
    assert np.hypot(*reported[:, :2].T).sum() > np.hypot(*true[:, :2].T).sum()


def test_reverse_segment_is_driven_rear_first() -> None:
    back = Route("Back", (Segment(control_points=np.array([[0, 0], [-3, 0]]), direction=Direction.REVERSE, degree=1),))
    motion = driven(DifferentialVehicle(), back)
    assert motion.poses[-1] == pytest.approx([-3.0, 0.0, 0.0], abs=0.002)
