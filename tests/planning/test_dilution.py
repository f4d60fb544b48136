"""Dilution: closed forms, a Fisher information by finite differences, the goniometer's laboratory, invariances."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry.angles import difference
from commission.geometry.se2 import compose, transform_points
from commission.planning.dilution import (
    FixOptions,
    Heading,
    Measurement,
    fix_options,
    odometry_prior,
)
from commission.planning.vehicle_fixes import fix_covariances, fixes
from commission.planning.vehicle_visibility import VehicleVisibility, vehicle_visibility
from commission.site.parameters import ObservationParameters, OdometryParameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

FULL_TURN = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.02, range=(0.05, 100.0), reflector_range=100.0)


def open_field(centers: np.ndarray, scanner: Scanner = FULL_TURN, sigma: float = 0.0) -> VehicleVisibility:
    """Reflectors without walls."""
    reflectors = tuple(Reflector(id=str(i), x=float(x), y=float(y), sigma=sigma) for i, (x, y) in enumerate(centers))
    return vehicle_visibility(Project(reflectors=ReflectorMap(reflectors), scanners=(scanner,)))


def on_circle(n: int, radius: float) -> np.ndarray:
    """N reflectors evenly on a circle around the origin."""
    angles = np.arange(n) * 2.0 * math.pi / n + 0.3
    return radius * np.stack((np.cos(angles), np.sin(angles)), axis=-1)


@pytest.mark.parametrize("n", [3, 4, 7])
def test_center_of_a_circle_of_reflectors_has_the_closed_form(n):
    # By symmetry position and heading separate: information n/2 (1/s_r^2 + 1/(s_b r)^2) per axis, n/s_b^2 on heading.
    radius, options = 6.0, FixOptions(range_sigma=0.02, bearing_sigma=0.004)
    found = fixes(open_field(on_circle(n, radius)), [[0.0, 0.0]], options)
    sigma = math.sqrt(2.0 / n / (0.02**-2 + (0.004 * radius) ** -2))
    assert found.visible[0] == n
    assert found.position_sigma[0] == pytest.approx(sigma, rel=1e-12)
    assert found.heading_sigma[0] == pytest.approx(0.004 / math.sqrt(n), rel=1e-12)
    assert found.position_dop[0] == pytest.approx(math.sqrt(2.0) * sigma / 0.02, rel=1e-12)
    assert found.heading_dop[0] == pytest.approx(1.0 / math.sqrt(n), rel=1e-12)


@pytest.mark.parametrize("n", [3, 5])
def test_triangulation_from_the_center_of_a_circle_has_the_closed_form(n):
    options = FixOptions(measurement=Measurement.BEARING_ONLY, bearing_sigma=1e-3)
    found = fixes(open_field(on_circle(n, 6.0)), [[0.0, 0.0]], options)
    assert found.position_sigma[0] == pytest.approx(6.0 * 1e-3 * math.sqrt(2.0 / n), rel=1e-12)
    assert found.position_dop[0] == pytest.approx(6.0 * math.sqrt(4.0 / n), rel=1e-12)


def test_prior_from_odometry_adds_its_information():
    options = FixOptions(
        measurement=Measurement.RANGE_BEARING_PRIOR, prior_position_sigma=0.03, prior_heading_sigma=0.01
    )
    model = open_field(on_circle(4, 6.0))
    found = fixes(model, [[0.0, 0.0], [1000.0, 0.0]], options)
    scan = 2.0 * (0.02**-2 + (0.004 * 6.0) ** -2)
    assert found.position_sigma == pytest.approx([(scan + 0.03**-2) ** -0.5, 0.03], rel=1e-12)
    assert found.heading_sigma == pytest.approx([(4 * 0.004**-2 + 0.01**-2) ** -0.5, 0.01], rel=1e-12)


def measured(T_map_base: np.ndarray, mounting: np.ndarray, centers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ranges and bearings of reflectors, written without any of the code under test but the pose arithmetic."""
    scanner = compose(T_map_base, mounting)
    to_center = centers - scanner[:2]
    return np.hypot(*to_center.T), np.arctan2(to_center[:, 1], to_center[:, 0]) - scanner[2]


@pytest.mark.parametrize("measurement", list(Measurement))
@pytest.mark.parametrize("seed", range(5))
def test_covariance_is_the_inverse_of_a_finite_difference_fisher_information(seed, measurement):
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-8.0, 8.0, (6, 2))
    pose = np.array([*rng.uniform(-3.0, 3.0, 2), rng.uniform(-3.0, 3.0)])
    mounting = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0)])
    options = FixOptions(measurement=measurement, range_sigma=0.03, bearing_sigma=0.002)
    survey = 0.01
    model = open_field(centers, replace(FULL_TURN, mounting=mounting), sigma=survey)
    step, rows = 1e-5, []
    for axis in range(3):
        shift = np.zeros(3)
        shift[axis] = step
        ahead, behind = measured(pose + shift, mounting, centers), measured(pose - shift, mounting, centers)
        rows.append(np.concatenate((ahead[0] - behind[0], difference(ahead[1], behind[1]))) / (2.0 * step))
    jacobian = np.array(rows).T
    ranges = measured(pose, mounting, centers)[0]
    range_weights = 1.0 / (0.03**2 + survey**2) if measurement is not Measurement.BEARING_ONLY else 0.0
    weights = np.concatenate((np.full(6, range_weights), 1.0 / (0.002**2 + (survey / ranges) ** 2)))
    information = jacobian.T @ (weights[:, np.newaxis] * jacobian)
    if measurement is Measurement.RANGE_BEARING_PRIOR:
        information += np.diag([0.05**-2, 0.05**-2, math.radians(1.0) ** -2])
    expected = np.linalg.inv(information)
    # Central differences of step 1e-5 m are good to 1e-9; the inverse loses a few digits of it.
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(fix_covariances(model, pose, options)[0] / scale, expected / scale, atol=1e-6)


def test_figures_are_those_of_the_covariance():
    model = open_field(np.random.default_rng(3).uniform(-8.0, 8.0, (5, 2)))
    pose = [0.3, -0.7, 0.0]
    covariance = fix_covariances(model, pose, FixOptions())[0]
    found = fixes(model, [pose[:2]], FixOptions())
    assert found.position_sigma[0] == pytest.approx(math.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[1]), rel=1e-9)
    assert found.heading_sigma[0] == pytest.approx(math.sqrt(covariance[2, 2]), rel=1e-9)
    assert found.position_dop[0] == pytest.approx(math.sqrt(np.trace(covariance[:2, :2])) / 0.02, rel=1e-9)


@given(
    motion=st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-math.pi, math.pi)),
    seed=st.integers(0, 1000),
    measurement=st.sampled_from(list(Measurement)),
)
def test_dilution_is_unchanged_when_the_whole_hall_is_moved_and_turned(motion, seed, measurement):
    rng = np.random.default_rng(seed)
    centers, points = rng.uniform(-8.0, 8.0, (5, 2)), rng.uniform(-5.0, 5.0, (4, 2))
    options = FixOptions(measurement=measurement)
    here = fixes(open_field(centers), points, options)
    there = fixes(open_field(transform_points(motion, centers)), transform_points(motion, points), options)
    for name in ("position_sigma", "heading_sigma", "position_dop", "heading_dop"):
        # Ill-conditioned spots amplify the rounding of coordinates (1e-14 m) at most by the singularity limit.
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), rtol=1e-6, err_msg=name)


def laboratory_map() -> tuple[np.ndarray, np.ndarray]:
    """Triangulation error [mm] over the 4 m x 6 m laboratory of Alenyà et al. 2005, Fig. 2, on a 0.1 m grid.

    Their marks' places are not printed. Here one stands behind each corner, one of them nearer to the corner itself:
    that corner then lies close to the circle through marks.
    """
    marks = np.array([[-0.3, 0.1], [4.3, -0.3], [4.3, 6.3], [-0.3, 6.3]])
    x, y = np.meshgrid(np.linspace(0.0, 4.0, 41), np.linspace(0.0, 6.0, 61))
    points = np.stack((x.ravel(), y.ravel()), axis=-1)
    options = FixOptions(measurement=Measurement.BEARING_ONLY, bearing_sigma=0.095e-3)
    return points, 1000.0 * fixes(open_field(marks), points, options).position_sigma


def test_goniometer_in_its_laboratory_is_best_near_the_center_and_worst_in_the_bottom_left_corner():
    points, error = laboratory_map()
    best, worst = points[error.argmin()], points[error.argmax()]
    assert math.hypot(*(best - [2.0, 3.0])) < 1.5
    assert worst.tolist() == [0.0, 0.0]
    # The paper: less than 0.25 mm and 1.72 mm. The worst depends on the marks, whose places are not known.
    assert 0.2 < error.min() < 0.25
    assert 1.0 < error.max() < 2.5


def test_triangulation_is_singular_where_the_vehicle_stands_on_the_circle_through_three_reflectors():
    centers = 5.0 * np.array([[math.cos(a), math.sin(a)] for a in (0.2, 1.9, 3.5)])
    points = [[5.0 * math.cos(a), 5.0 * math.sin(a)] for a in (1.0, 2.5, 5.0)]
    options = FixOptions(measurement=Measurement.BEARING_ONLY)
    model = open_field(centers)
    on, near = fixes(model, points, options), fixes(model, np.multiply(points, 0.999), options)
    assert np.isinf(on.position_sigma).all()
    assert np.isinf(on.heading_dop).all()
    # One part in a thousand off the circle is finite, and far worse than the middle.
    assert np.isfinite(near.position_sigma).all()
    assert (near.position_sigma > 100.0 * fixes(model, [[0.0, 0.0]], options).position_sigma).all()
    # Ranges, or a fourth reflector off the circle, remove the singularity.
    assert np.isfinite(fixes(model, points, FixOptions()).position_sigma).all()
    four = open_field(np.vstack((centers, [[1.0, 1.0]])))
    assert np.isfinite(fixes(four, points, options).position_sigma).all()


@pytest.mark.parametrize(("measurement", "needed"), [(Measurement.RANGE_BEARING, 2), (Measurement.BEARING_ONLY, 3)])
def test_too_few_reflectors_are_a_result_and_not_an_error(measurement, needed):
    for n in range(needed + 1):
        model = open_field(on_circle(5, 6.0)[:n])
        found = fixes(model, [[0.4, 0.3]], FixOptions(measurement=measurement))
        covariance = fix_covariances(model, [[0.4, 0.3, 0.0]], FixOptions(measurement=measurement))[0]
        assert np.isfinite(found.position_sigma[0]) == (n == needed)
        assert np.isfinite(covariance[0, 0]) == (n == needed)
        assert not np.isnan(covariance).any()


def test_a_scanner_on_top_of_a_reflector_learns_nothing_from_it():
    model = open_field(on_circle(3, 6.0), replace(FULL_TURN, range=(0.0, 100.0)))
    assert np.isfinite(fixes(model, on_circle(3, 6.0), FixOptions()).position_sigma).all()


def narrow(mounting: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Scanner:
    """A scanner that sees 270 degrees."""
    return replace(FULL_TURN, field_of_view_deg=(-135.0, 135.0), mounting=mounting)


def test_worst_and_best_heading_bracket_every_given_one():
    model = open_field(np.random.default_rng(1).uniform(-8.0, 8.0, (7, 2)), narrow())
    points = np.random.default_rng(2).uniform(-6.0, 6.0, (20, 2))
    options = FixOptions(headings=8, blocked_per_m=0.05)
    given_ones = [
        fixes(model, points, replace(options, heading=Heading.GIVEN, given_heading=k * math.pi / 4)) for k in range(8)
    ]
    worst, best = (fixes(model, points, replace(options, heading=h)) for h in (Heading.WORST, Heading.BEST))
    for i in range(1, 5):
        np.testing.assert_array_equal(worst[i], np.max([f[i] for f in given_ones], axis=0))
        np.testing.assert_array_equal(best[i], np.min([f[i] for f in given_ones], axis=0))
    for i in (0, 5, 6, 7):
        np.testing.assert_array_equal(worst[i], np.min([f[i] for f in given_ones], axis=0))
        np.testing.assert_array_equal(best[i], np.max([f[i] for f in given_ones], axis=0))


@pytest.mark.parametrize("view", [(-135.0, 135.0), (-90.0, 90.0), (-20.0, 40.0), (-5.0, 5.0), (-170.0, 175.0)])
@pytest.mark.parametrize("headings", [2, 7, 16, 32, 33])
@pytest.mark.parametrize("blocked", [0.0, 0.03])
def test_worst_and_best_headings_are_those_of_all_given_ones_one_by_one(view, headings, blocked):
    rng = np.random.default_rng(headings)
    points, centers = rng.uniform(2, 8, (40, 2)), rng.uniform(0, 10, (9, 2))
    # On the edge of the field of view of some headings, and alike from all: where a quick answer goes wrong first.
    centers[:3] = points[:3] + 3.0 * np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
    scanner = Scanner(field_of_view_deg=view, resolution_deg=1.0, mounting=(0.0, 0.0, 0.3), range=(0.05, 30.0))
    reflectors = ReflectorMap(tuple(Reflector(id=str(i), x=x, y=y) for i, (x, y) in enumerate(centers.tolist())))
    model = vehicle_visibility(Project(reflectors=reflectors, scanners=(scanner,)))
    options = FixOptions(headings=headings, blocked_per_m=blocked)
    turns = np.arange(headings) * (2.0 * math.pi / headings)
    each = [fixes(model, points, replace(options, heading=Heading.GIVEN, given_heading=float(t))) for t in turns]
    for heading, worst_of_first, worst_of_last in ((Heading.WORST, np.max, np.min), (Heading.BEST, np.min, np.max)):
        found = fixes(model, points, replace(options, heading=heading))
        for name in ("position_sigma", "heading_sigma", "position_dop", "heading_dop"):
            np.testing.assert_array_equal(
                getattr(found, name), worst_of_first([getattr(f, name) for f in each], axis=0)
            )
        for name in ("visible", "expected_visible", "two_or_more", "three_or_more"):
            np.testing.assert_array_equal(getattr(found, name), worst_of_last([getattr(f, name) for f in each], axis=0))


def test_a_given_heading_is_the_fix_of_that_pose_with_its_mounting():
    model = open_field(np.random.default_rng(5).uniform(-8.0, 8.0, (6, 2)), narrow((0.6, -0.2, 0.4)))
    points = np.random.default_rng(6).uniform(-4.0, 4.0, (10, 2))
    options = FixOptions(heading=Heading.GIVEN, given_heading=2.0)
    found = fixes(model, points, options)
    covariances = fix_covariances(model, np.column_stack((points, np.full(10, 2.0))), options)
    np.testing.assert_allclose(found.heading_sigma, np.sqrt(covariances[:, 2, 2]), rtol=1e-9)
    longest = np.array([np.linalg.eigvalsh(c[:2, :2])[1] if np.isfinite(c[0, 0]) else np.inf for c in covariances])
    np.testing.assert_allclose(found.position_sigma, np.sqrt(longest), rtol=1e-9)


def test_an_ellipse_for_all_round_is_that_of_a_full_turn():
    centers = np.random.default_rng(5).uniform(-8.0, 8.0, (6, 2))
    poses = np.random.default_rng(6).uniform(-3.0, 3.0, (10, 3))
    limited = fix_covariances(open_field(centers, narrow()), poses, FixOptions(heading=Heading.ALL_ROUND))
    np.testing.assert_array_equal(limited, fix_covariances(open_field(centers), poses, FixOptions()))


def test_figures_among_people_are_those_of_all_combinations_of_blocked_rays():
    centers = np.array([[3.0, 0.0], [0.0, 5.0], [-7.0, 1.0], [2.0, -4.0]])
    found = fixes(open_field(centers), [[0.0, 0.0]], FixOptions(blocked_per_m=0.1))
    seen = 0.9 ** np.hypot(*centers.T)
    at_least = np.zeros(5)
    for outcome in itertools.product((False, True), repeat=4):
        at_least[: sum(outcome) + 1] += np.prod(np.where(outcome, seen, 1.0 - seen))
    assert found.expected_visible[0] == pytest.approx(seen.sum(), rel=1e-12)
    assert found.two_or_more[0] == pytest.approx(at_least[2], rel=1e-12)
    assert found.three_or_more[0] == pytest.approx(at_least[3], rel=1e-12)


def test_without_people_two_or_more_are_certain_or_impossible():
    found = fixes(open_field(on_circle(2, 3.0)), [[0.0, 0.0], [500.0, 0.0]], FixOptions())
    assert found.two_or_more.tolist() == [1.0, 0.0]
    assert found.three_or_more.tolist() == [0.0, 0.0]


def test_options_take_the_noise_of_the_localizer():
    options = fix_options(ObservationParameters(range_sigma=0.07, bearing_sigma=0.01), heading=Heading.WORST)
    assert (options.range_sigma, options.bearing_sigma, options.heading) == (0.07, 0.01, Heading.WORST)


def test_prior_of_odometry_matches_a_fine_random_walk():
    parameters = OdometryParameters(
        heading_per_sqrt_m=0.02, forward_per_sqrt_m=0.001, lateral_per_sqrt_m=0.003, heading_per_sqrt_s=0.0
    )
    position, heading = odometry_prior(parameters, 4.0, 1.0)
    rng = np.random.default_rng(0)
    turns = np.cumsum(rng.normal(0.0, 0.02 * math.sqrt(0.01), (20000, 400)), axis=1)
    sideways = (turns * 0.01).sum(axis=1) + rng.normal(0.0, 0.003 * 2.0, 20000)
    # 20,000 drives know a sigma to 0.5 %, 1 sigma.
    assert heading == pytest.approx(turns[:, -1].std(), rel=0.02)
    assert position == pytest.approx(sideways.std(), rel=0.02)


@pytest.mark.parametrize(
    "bad", [{"range_sigma": 0.0}, {"bearing_sigma": -1.0}, {"headings": 0}, {"blocked_per_m": 1.5}], ids=str
)
def test_impossible_options_are_refused(bad):
    with pytest.raises(ValueError, match="expected"):
        FixOptions(**bad)
    with pytest.raises(ValueError, match="given_heading"):
        FixOptions(given_heading=math.nan)


@pytest.mark.parametrize(
    ("view", "blind", "meant"),
    [
        ((-180.0, 180.0), (), Heading.ALL_ROUND),
        ((-180.0, 179.5), (), Heading.ALL_ROUND),
        ((-180.0, 179.0), (), Heading.WORST),
        ((-180.0, 180.0), ((-10.0, 10.0),), Heading.WORST),
    ],
)
def test_by_scanner_is_all_round_where_a_scanner_sees_all_around_and_the_worst_heading_elsewhere(view, blind, meant):
    scanner = Scanner(field_of_view_deg=view, resolution_deg=0.5, blind_sectors_deg=blind)
    assert Heading.BY_SCANNER.seen_by((scanner,)) is meant
    assert Heading.BEST.seen_by((scanner,)) is Heading.BEST
    with pytest.raises(ValueError, match=r"fix\.heading is by-scanner"):
        FixOptions(heading=Heading.BY_SCANNER)
