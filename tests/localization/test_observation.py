"""Observation model: its Jacobian, its kernel, and the ellipses it lays on the floor."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from commission.geometry import se2
from commission.geometry.angles import difference
from commission.localization.estimate import Belief
from commission.localization.observation import (
    ObservationModel,
    expect,
    innovation_covariances,
    jacobians,
    project_detections,
    range_bearing,
    scanner_offset,
    validation_ellipses,
)

MODEL = ObservationModel(0.3, -0.1, 0.4, 4e-4, 1.6e-5, 0.05)
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
    H = np.array(expected[2:]).reshape(2, 3)
    np.testing.assert_allclose(H, jacobians(pose, MOUNTING, place)[0], atol=1e-10, rtol=0)


@given(POSES, PLACES)
def test_point_is_observed_where_it_lies_in_the_scanner_frame(pose: np.ndarray, polar: tuple[float, float]) -> None:
    seen = range_bearing(pose, MOUNTING, place_of(pose, polar))[0]
    np.testing.assert_allclose([seen[0] - polar[0], difference(seen[1], polar[1])], 0.0, atol=1e-11)
    # And back, the bias of the range taken off.
    measured = np.array([[polar[0] + MODEL.range_bias, polar[1]]])
    point = project_detections(pose[np.newaxis], np.array([0, 1]), measured, MODEL)
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
        offset = project_detections(belief.mean[np.newaxis], np.array([0, len(v)]), measured, MODEL) - place
        in_gate = np.einsum("ni,ni->n", v, np.linalg.solve(S[j], v.T).T) <= 5.991
        in_ellipse = np.einsum("ni,ni->n", offset, np.linalg.solve(ellipses[j], offset.T).T) <= 5.991
        # Only those on the edge differ, by the curvature of polar coordinates.
        assert np.mean(in_gate != in_ellipse) < 0.01
        assert np.mean(in_gate) > 0.93
