"""Observation model: its Jacobian, its kernel, and the ellipses it lays on the floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry import se2
from commission.geometry.angles import difference
from commission.localization.estimate import Belief, Status
from commission.localization.localizer import Localizer
from commission.localization.observation import (
    ObservationModel,
    expect,
    innovation_covariances,
    jacobians,
    observation_model,
    observation_rows,
    project_detections,
    range_bearing,
    scanner_offset,
    validation_ellipses,
)
from commission.localization.setup import LocalizerSetup
from commission.localization.validation import validation_ellipses as areas_of
from commission.localization.validation import validation_outlines
from commission.site.parameters import AssociationParameters, FilterParameters, ObservationParameters, Parameters
from commission.site.records import Detections, Odometry
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from tests.localization import plain_observation as plain

MODEL = ObservationModel(0.3, -0.1, 0.4, 4e-4, 1.6e-5, 0.05)
ROWS = observation_rows([MODEL])
MOUNTING = np.array([MODEL.mount_x, MODEL.mount_y, MODEL.mount_theta])
POSES = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1)).map(np.array)
PLACES = st.tuples(st.floats(0.5, 30), st.floats(-math.pi, math.pi))


def place_of(pose: np.ndarray, polar: tuple[float, float]) -> np.ndarray:
    """A point given in the scanner frame, in the map."""
    r, b = polar
    return se2.transform_points(se2.compose(pose, MOUNTING), [[r * math.cos(b), r * math.sin(b)]])


@given(POSES, PLACES)
def test_jacobian_is_the_finite_difference_of_the_observation(pose: np.ndarray, polar: tuple[float, float]) -> None:
    place = place_of(pose, polar)
    H = jacobians(pose, MOUNTING, place)[0]
    for i, step in enumerate(1e-5 * np.eye(3)):
        ahead, behind = (range_bearing(pose + s, MOUNTING, place)[0] for s in (step, -step))
        slope = [(ahead[0] - behind[0]) / 2e-5, float(difference(ahead[1], behind[1])) / 2e-5]
        # Third derivatives at 0.5 m are about 20: 20 * 1e-10 / 6, and rounding of 50 m over 2e-5.
        np.testing.assert_allclose(H[:, i], slope, atol=1e-8, rtol=0)


@given(POSES, PLACES)
def test_kernel_agrees_with_the_array_functions(pose: np.ndarray, polar: tuple[float, float]) -> None:
    place = place_of(pose, polar)
    expected = expect(*pose, *scanner_offset(pose[2], MODEL), *place[0], MODEL.mount_theta)
    assert abs(expected.range - range_bearing(pose, MOUNTING, place)[0, 0]) < 1e-12
    assert abs(difference(expected.bearing, range_bearing(pose, MOUNTING, place)[0, 1])) < 1e-11
    assert -math.pi <= expected.bearing < math.pi
    H = np.array(expected[2:]).reshape(2, 3)
    np.testing.assert_allclose(H, jacobians(pose, MOUNTING, place)[0], atol=1e-10, rtol=0)


@given(POSES, PLACES)
def test_point_is_observed_where_it_lies_in_the_scanner_frame(pose: np.ndarray, polar: tuple[float, float]) -> None:
    seen = range_bearing(pose, MOUNTING, place_of(pose, polar))[0]
    np.testing.assert_allclose([seen[0] - polar[0], difference(seen[1], polar[1])], 0.0, atol=1e-11)
    # And back, the bias of the range taken off.
    measured = np.array([[polar[0] + MODEL.range_bias, polar[1]]])
    point = project_detections(pose[np.newaxis], np.array([0, 1]), measured, ROWS, scanners=np.zeros(1, np.int64))
    np.testing.assert_allclose(point, place_of(pose, polar), atol=1e-11)


def test_reflector_at_the_scanner_itself_has_a_finite_jacobian() -> None:
    place = se2.compose(np.zeros(3), MOUNTING)[np.newaxis, :2]
    assert np.isfinite(jacobians(np.zeros(3), MOUNTING, place)).all()
    assert np.isfinite(expect(0, 0, 0, *scanner_offset(0.0, MODEL), *place[0], MODEL.mount_theta)).all()


def test_validation_ellipse_holds_the_detections_that_the_gate_holds() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3)) * [[0.02], [0.02], [0.005]]
    belief = Belief(0, np.array([1.0, 2.0, 0.5]), root @ root.T)
    places = np.array([[6.0, 3.0], [1.0, -8.0]])
    S = innovation_covariances(belief, MODEL, places, 0.01)
    ellipses = validation_ellipses(belief, MODEL, places, 0.01)
    for j, place in enumerate(places):
        v = rng.multivariate_normal(np.zeros(2), S[j], 4000)
        measured = range_bearing(belief.mean, MOUNTING, places)[j] + v + [MODEL.range_bias, 0.0]
        offset = (
            project_detections(
                belief.mean[np.newaxis], np.array([0, len(v)]), measured, ROWS, scanners=np.zeros(1, np.int64)
            )
            - place
        )
        in_gate = np.einsum("ni,ni->n", v, np.linalg.solve(S[j], v.T).T) <= 5.991
        in_ellipse = np.einsum("ni,ni->n", offset, np.linalg.solve(ellipses[j], offset.T).T) <= 5.991
        # Only those on the edge differ, by the curvature of polar coordinates.
        assert np.mean(in_gate != in_ellipse) < 0.01
        assert np.mean(in_gate) > 0.93


def test_drawn_gate_of_an_exact_pose_is_the_noise_of_range_bearing_and_survey_laid_on_the_floor() -> None:
    # 8 m ahead of a scanner that looks along +y of the map, surveyed to 50 mm: along the ray 20 mm and 50 mm, across it
    # 8 m x 4 mrad and 50 mm. The bearing's own covariance has the survey as (50 mm / 8 m)^2.
    model = ObservationModel(0.0, 0.0, 0.0, 0.02**2, 0.004**2, 0.0)
    belief = Belief(0, np.array([1.0, 2.0, math.pi / 2]), np.zeros((3, 3)))
    S = innovation_covariances(belief, model, [[1.0, 10.0]], 0.05)
    np.testing.assert_allclose(S, [np.diag([4e-4 + 25e-4, 16e-6 + 25e-4 / 64.0])], rtol=1e-12, atol=1e-15)
    ellipses = validation_ellipses(belief, model, [[1.0, 10.0]], 0.05)
    np.testing.assert_allclose(ellipses, [np.diag([(8.0 * 0.004) ** 2 + 25e-4, 4e-4 + 25e-4])], rtol=1e-12, atol=1e-15)


@given(st.integers(0, 2**32 - 1))
def test_innovation_covariances_are_those_of_plain_matrices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3)) * [[0.3], [0.3], [0.1]]
    pose, places = rng.uniform([-9, -9, -3], [9, 9, 3]), rng.uniform(-20, 20, (5, 2))
    sigmas, surveyed = (math.sqrt(MODEL.range_variance), math.sqrt(MODEL.bearing_variance)), rng.uniform(0.0, 0.1, 5)
    if np.hypot(*(places - pose[:2]).T).min() < 1.0:
        return
    expected = plain.innovation_covariances(pose, root @ root.T, MOUNTING, places, sigmas, surveyed)
    found = innovation_covariances(Belief(0, pose, root @ root.T), MODEL, places, surveyed)
    # Differences of 1e-10 against variances that are a few orders below the largest.
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("consider", [False, True], ids=["white", "considered"])
@pytest.mark.parametrize("probability", [0.5, 0.95])
def test_drawn_outline_of_the_gate_parts_what_the_localizer_takes_from_what_it_leaves(
    probability: float, consider: bool
) -> None:
    reflectors = ReflectorMap((Reflector(id="near", x=4.0, y=1.0, sigma=0.02), Reflector(id="far", x=-3.0, y=11.0)))
    parameters = Parameters(
        association=AssociationParameters(gate_probability=probability), filter=FilterParameters(consider=consider)
    )
    setup = LocalizerSetup(reflectors=reflectors, scanners=(Scanner(mounting=MOUNTING),), parameters=parameters)
    covariance = np.array([[4e-4, 1e-4, 1e-5], [1e-4, 9e-4, -2e-5], [1e-5, -2e-5, 1e-5]])
    belief = Belief(0, np.array([0.5, -0.5, 0.3]), covariance)
    outlines = validation_outlines(setup, areas_of(setup, belief))
    for reflector, outline in zip(reflectors.reflectors, outlines, strict=True):
        center = np.array([reflector.x, reflector.y])
        # Polar coordinates bend an outline of 0.2 m at 4 m by up to 3 % of its size.
        for size, status in ((0.96, Status.INLIER), (1.04, Status.OUTLIER_ASSOCIATION)):
            for corner in outline[::4]:
                seen = plain.observed(belief.mean, MOUNTING, center + size * (corner - center)[np.newaxis])
                (estimate,) = Localizer(setup, belief).feed(Detections(0, seen))
                assert estimate.status.tolist() == [status], (reflector.id, size, estimate.d2)


def test_drawn_outline_follows_the_gate_once_constants_are_correlated_with_the_pose() -> None:
    reflectors = ReflectorMap((Reflector(id="near", x=4.0, y=1.0, sigma=0.02), Reflector(id="far", x=-3.0, y=11.0)))
    known = Uncertainty(survey=0.03, mounting_position=0.02, mounting_heading=0.01, range_bias=0.05, clock=0.1)
    setup = LocalizerSetup(
        reflectors=reflectors, scanners=(Scanner(mounting=MOUNTING),), parameters=Parameters(), uncertainty=known
    )
    driven = Localizer(setup, Belief(0, np.array([0.5, -0.5, 0.3]), np.diag([4e-4, 9e-4, 1e-4])))
    stamp, twist = 0, np.array([0.5, 0.0, 0.2])
    for _ in range(20):
        driven.feed(Odometry(stamp, np.zeros(3) if stamp == 0 else se2.exp(0.04 * twist)))
        seen = plain.observed(driven.belief.mean, MOUNTING, reflectors.centers)
        (estimate,) = driven.feed(Detections(stamp, seen))
        stamp += 40_000_000
    before = driven.state
    driven.feed(Odometry(stamp, se2.exp(0.04 * twist)))
    prior, moved = driven.belief, driven.state
    outlines = validation_outlines(setup, areas_of(setup, prior, before=before, twist=twist))
    alone = validation_outlines(setup, areas_of(setup, prior, twist=twist))
    assert np.ptp(outlines[0], axis=0).max() < 0.9 * np.ptp(alone[0], axis=0).max(), "the correlation counts"
    for reflector, outline in zip(reflectors.reflectors, outlines, strict=True):
        center = np.array([reflector.x, reflector.y])
        for size, status in ((0.95, Status.INLIER), (1.05, Status.OUTLIER_ASSOCIATION)):
            for corner in outline[::4]:
                place = plain.observed(prior.mean, MOUNTING, center + size * (corner - center)[np.newaxis])
                (estimate,) = Localizer(setup, moved).feed(Detections(stamp, place))
                assert estimate.status.tolist() == [status], (reflector.id, size, estimate.d2)


def test_kernels_are_given_the_mounting_and_the_variances_of_the_parameters() -> None:
    given_ones = ObservationParameters(range_sigma=0.03, bearing_sigma=0.005, range_bias=-0.01)
    found = observation_model(Scanner(mounting=[0.5, -0.2, 0.1]), given_ones)
    assert found == pytest.approx((0.5, -0.2, 0.1, 9e-4, 2.5e-5, -0.01), rel=1e-12)
