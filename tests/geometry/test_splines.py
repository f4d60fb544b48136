"""Splines against exact circles, scipy, recursion by definition, and laws that hold for every curve."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from commission.geometry import spline_kernels
from commission.geometry.angles import difference
from commission.geometry.se2 import transform_points
from commission.geometry.splines import Spline, catmull_rom, clamped_uniform_knots

Array = NDArray[np.float64]
INNER = np.linspace(0.0, 1.0, 41)


def random_spline(seed: int, degree: int, *, rational: bool) -> Spline:
    """Curve over [-1, 3] with uneven, partly repeated inner knots."""
    rng = np.random.default_rng(seed)
    n = degree + 6
    inner = np.sort(rng.uniform(-1.0, 3.0, 5))
    inner[1] = inner[2] if degree > 2 else inner[1]
    knots = np.concatenate((np.full(degree + 1, -1.0), np.sort(inner), np.full(degree + 1, 3.0)))
    weights = rng.uniform(0.3, 3.0, n) if rational else np.ones(n)
    return Spline(degree, rng.uniform(-5.0, 5.0, (n, 2)), knots, weights)


def quarter_circle(radius: float = 1.0) -> Spline:
    """A quarter of a circle about the origin, exact as a rational Bezier curve (The NURBS Book, example 7.1)."""
    points = radius * np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return Spline(2, points, weights=np.array([1.0, math.sqrt(0.5), 1.0]))


def full_circle(radius: float) -> Spline:
    """The nine-point circle (The NURBS Book, figure 7.16a): inner knots of multiplicity 2."""
    square = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    weights = np.where(np.arange(9) % 2, math.sqrt(0.5), 1.0)
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]) / 4.0
    return Spline(2, radius * np.array(square, dtype=float), knots, weights)


def basis(i: int, p: int, knots: Array, u: float) -> float:
    """Basis function by its recursive definition (The NURBS Book, equation 2.5): slow and plain."""
    if p == 0:
        return 1.0 if knots[i] <= u < knots[i + 1] else 0.0
    rising, falling = knots[i + p] - knots[i], knots[i + p + 1] - knots[i + 1]
    left = (u - knots[i]) / rising * basis(i, p - 1, knots, u) if rising > 0 else 0.0
    right = (knots[i + p + 1] - u) / falling * basis(i + 1, p - 1, knots, u) if falling > 0 else 0.0
    return left + right


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_points_of_a_rational_curve_follow_the_recursive_definition(degree: int) -> None:
    spline = random_spline(degree, degree, rational=True)
    for u in np.linspace(-1.0, 2.999, 23):
        shares = np.array([basis(i, degree, spline.knots, u) for i in range(len(spline.weights))]) * spline.weights
        np.testing.assert_allclose(spline.point(u), shares @ spline.control_points / shares.sum(), atol=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_points_and_derivatives_agree_with_scipy(degree: int) -> None:
    spline = random_spline(10 + degree, degree, rational=False)
    reference = BSpline(spline.knots, spline.control_points, degree)
    u = np.linspace(-1.0, 2.999, 57)
    first, second = spline.derivatives(u)
    np.testing.assert_allclose(spline.point(u), reference(u), atol=1e-12)
    # Derivatives grow with the inverse of the knot gaps, here down to some 1e-2 each.
    np.testing.assert_allclose(first, reference.derivative(1)(u), rtol=1e-10, atol=1e-10)
    expected = reference.derivative(2)(u) if degree > 1 else np.zeros((57, 2))
    np.testing.assert_allclose(second, expected, rtol=1e-9, atol=1e-9)


def test_rational_derivatives_agree_with_finite_differences() -> None:
    spline = random_spline(3, 3, rational=True)
    u, h = np.linspace(-0.9, 2.9, 31), 1e-5
    first, second = spline.derivatives(u)
    near_knot = (np.abs(u[:, np.newaxis] - spline.knots) < 2 * h).any(axis=1)
    assert not near_knot.any()
    numeric = (spline.point(u + h) - spline.point(u - h)) / (2 * h)
    # Central differences: h^2 times third derivatives of up to 1e3, and rounding 1e-15 / h^2 in the second.
    np.testing.assert_allclose(first, numeric, atol=1e-5, rtol=1e-5)
    numeric = (spline.derivatives(u + h)[0] - spline.derivatives(u - h)[0]) / (2 * h)
    np.testing.assert_allclose(second, numeric, atol=1e-3, rtol=1e-4)


def test_nurbs_circle_is_exact() -> None:
    circle = full_circle(2.5)
    u = np.linspace(0.0, 1.0, 201)
    points = circle.point(u)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 2.5, rtol=1e-14)
    np.testing.assert_allclose(circle.curvature(u), 1 / 2.5, rtol=1e-12)
    tangent = np.arctan2(points[:, 1], points[:, 0]) + math.pi / 2
    np.testing.assert_allclose(difference(circle.heading(u), tangent), 0.0, atol=1e-12)
    assert circle.length == pytest.approx(2 * math.pi * 2.5, rel=1e-10)


def test_equal_arc_lengths_on_a_circle_are_equal_angles() -> None:
    circle = full_circle(1.0)
    points = circle.point(circle.u_at(np.linspace(0.0, 2 * math.pi, 25)[:-1]))
    np.testing.assert_allclose(
        difference(np.arctan2(points[:, 1], points[:, 0]), np.arange(24) * math.pi / 12), 0.0, atol=1e-9
    )


@pytest.mark.parametrize(
    "spline",
    [
        random_spline(5, 3, rational=True),
        random_spline(6, 1, rational=False),
        Spline(3, [[0, 0], [4, 4], [-1, 4], [3, 0]]),
        # Control points on one line that double back: the speed falls to zero inside.
        Spline(3, [[0, 0], [3, 0], [-1, 0], [2, 0]]),
        # A true cusp: the tangent vanishes at u = 0.5.
        Spline(3, [[0, 0], [1, 1], [0, 1], [1, 0]]),
    ],
)
def test_arc_length_is_accurate_and_invertible_even_at_a_cusp(spline: Spline) -> None:
    u = np.union1d(np.linspace(*spline.domain, 400_001), spline.knots)
    dense = np.linalg.norm(np.diff(spline.point(u), axis=0), axis=1)
    # A polygon of 4e5 chords is short by about (step * curvature)^2 / 24: below 1e-9 of the length.
    assert spline.length == pytest.approx(dense.sum(), rel=2e-9)
    s = np.linspace(0.0, spline.length, 301)
    np.testing.assert_allclose(spline.s_at(spline.u_at(s)), s, atol=1e-9 * spline.length)
    walked = np.interp(spline.u_at(s), u, np.concatenate(([0.0], np.cumsum(dense))))
    np.testing.assert_allclose(walked, s, atol=1e-7 * spline.length)


def test_parameters_outside_count_as_the_nearer_end() -> None:
    spline = Spline(3, [[0, 0], [2, 0], [4, 1], [6, 1]])
    np.testing.assert_array_equal(spline.point([-1.0, 0.0, 1.0, 2.0]), [[0, 0], [0, 0], [6, 1], [6, 1]])
    np.testing.assert_array_equal(spline.u_at([-1.0, spline.length + 1.0]), [0.0, 1.0])


def test_straight_line_has_its_chord_as_length_and_no_curvature() -> None:
    spline = Spline(1, [[0, 0], [3, 4]])
    assert spline.length == pytest.approx(5.0, rel=1e-14)
    np.testing.assert_array_equal(spline.curvature(INNER), 0.0)
    np.testing.assert_allclose(spline.heading(INNER), math.atan2(4, 3))


def test_heading_and_curvature_are_nan_where_the_tangent_vanishes() -> None:
    spline = Spline(3, [[0, 0], [0, 0], [1, 0], [2, 0]])
    assert math.isnan(spline.heading(0.0))
    assert math.isnan(spline.curvature(0.0))
    assert spline.heading(0.1) == 0.0


@given(st.floats(0.02, 0.98), st.floats(-0.5, 0.5), st.floats(-0.1, 0.1))
def test_closest_point_of_a_circle_is_below_the_point(u: float, offset: float, error: float) -> None:
    circle = full_circle(1.0)
    point = circle.point(u) * (1.0 + offset)
    found = circle.closest(point, u + error)
    # A quarter turn of the circle is a quarter of its parameter; rounding of the slope is about 1e-15.
    assert found == pytest.approx(u, abs=1e-9)


def test_closest_point_beyond_an_end_is_the_end() -> None:
    spline = Spline(3, [[0, 0], [2, 0], [4, 1], [6, 1]])
    assert spline.closest([-5.0, 0.0], 0.4) == 0.0
    assert spline.closest([9.0, 2.0], 0.4) == 1.0


@given(st.integers(0, 50), st.floats(-3.0, 3.0), st.floats(-6.0, 6.0), st.floats(-6.0, 6.0))
def test_closest_point_is_never_farther_than_the_guess(seed: int, guess: float, x: float, y: float) -> None:
    spline = random_spline(seed, 3, rational=True)
    found = spline.closest([x, y], guess)
    assert spline.domain[0] <= found <= spline.domain[1]
    offset, first = spline.point(found) - [x, y], spline.derivatives(found)[0]
    assert np.linalg.norm(offset) <= np.linalg.norm(spline.point(guess) - [x, y]) * (1 + 1e-9)
    slope = offset @ first
    # At rest the offset is square to the tangent, or an end holds it, or a corner of the curve does.
    at_end = (found == -1.0 and slope >= 0) or (found == 3.0 and slope <= 0)
    scale = np.linalg.norm(offset) * np.linalg.norm(first) + np.linalg.norm(first) ** 2
    at_knot = np.abs(spline.knots - found).min() < 1e-6
    assert at_end or at_knot or abs(slope) <= 1e-6 * scale


@given(
    st.integers(0, 1000),
    st.integers(1, 4),
    st.booleans(),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1)),
)
def test_rigid_motion_moves_the_curve_and_keeps_its_shape(
    seed: int, degree: int, rational: bool, pose: tuple[float, float, float]
) -> None:
    spline = random_spline(seed, degree, rational=rational)
    moved = spline.transformed(pose)
    u = np.linspace(-1.0, 3.0, 13)
    np.testing.assert_allclose(moved.point(u), transform_points(pose, spline.point(u)), atol=1e-10)
    assert moved.length == pytest.approx(spline.length, rel=1e-9)
    # Where the curve nearly stops its heading and curvature hang on the last bits.
    steady = np.linalg.norm(spline.derivatives(u)[0], axis=1) > 1e-2
    turned = difference(moved.heading(u), spline.heading(u))[steady]
    np.testing.assert_allclose(difference(turned, pose[2]), 0.0, atol=1e-8)
    np.testing.assert_allclose(moved.curvature(u)[steady], spline.curvature(u)[steady], rtol=1e-6, atol=1e-6)


def test_equal_weights_of_any_size_change_nothing() -> None:
    plain = random_spline(8, 3, rational=False)
    scaled = Spline(3, plain.control_points, plain.knots, np.full(9, 7.0))
    np.testing.assert_allclose(scaled.point(INNER), plain.point(INNER), atol=1e-13)
    np.testing.assert_allclose(scaled.curvature(INNER), plain.curvature(INNER), rtol=1e-9)


def test_catmull_rom_passes_through_its_points_with_continuous_heading() -> None:
    points = np.array([[0, 0], [1, 0], [1.2, 3], [5, 4], [5, 4.5]])
    spline = catmull_rom(points)
    joints = spline.knots[1:-1:3]
    np.testing.assert_allclose(spline.point(joints), points, atol=1e-14)
    inner = joints[1:-1]
    before, after = spline.heading(inner - 1e-9), spline.heading(inner + 1e-9)
    np.testing.assert_allclose(difference(before, after), 0.0, atol=1e-6)
    assert spline.heading(0.0) == pytest.approx(0.0, abs=1e-12)


def test_catmull_rom_is_the_curve_of_barry_and_goldman() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 4.0], [-3.0, 5.0]])
    # Barry, Goldman 1988: a pyramid of linear interpolations, over knots as far apart as the roots of the chords.
    t = np.concatenate(([0.0], np.cumsum(np.sqrt(np.hypot(*np.diff(points, axis=0).T)))))
    spline = catmull_rom(points)
    for share in (0.1, 0.5, 0.8):
        u = t[1] + share * (t[2] - t[1])
        a = [((t[i + 1] - u) * points[i] + (u - t[i]) * points[i + 1]) / (t[i + 1] - t[i]) for i in range(3)]
        b = [((t[i + 2] - u) * a[i] + (u - t[i]) * a[i + 1]) / (t[i + 2] - t[i]) for i in range(2)]
        expected = ((t[2] - u) * b[0] + (u - t[1]) * b[1]) / (t[2] - t[1])
        np.testing.assert_allclose(spline.point(u / t[-1]), expected, atol=1e-12)


def test_catmull_rom_of_points_on_a_line_is_the_line() -> None:
    spline = catmull_rom([[0, 0], [1, 1], [5, 5], [6, 6]])
    np.testing.assert_allclose(spline.heading(INNER), math.pi / 4)
    assert spline.length == pytest.approx(6 * math.sqrt(2), rel=1e-12)
    assert catmull_rom([[0, 0], [2, 0]]).length == pytest.approx(2.0)


LINE = [[0, 0], [1, 0], [2, 0], [3, 0]]


@pytest.mark.parametrize(
    ("degree", "points", "knots", "weights", "message"),
    [
        (0, LINE, None, None, "degree is 0; expected at least 1"),
        (3, LINE[:3], None, None, "3 control points; expected at least 4 for degree 3"),
        (3, [[0, 0, 0]] * 4, None, None, r"control_points has shape \(4, 3\)"),
        (3, [[1, 1]] * 4, None, None, "all 4 control points coincide"),
        (3, [[0, 0], [1, math.nan], [2, 0], [3, 0]], None, None, r"control_points\[1, 1\] is nan"),
        (3, LINE, [0, 0, 0, 1, 1, 1, 1], None, r"7 knots; expected 8"),
        (1, LINE, [0, 0, 2, 1, 3, 3], None, r"knots\[3\] is 1 after 2; expected nondecreasing"),
        (3, LINE, [0, 0, 0, 0.1, 1, 1, 1, 1], None, r"the first 4 knots are .* \(clamped end\)"),
        (3, LINE, [0, 0, 0, 0, 1, 1, 1, 2], None, r"the last 4 knots are"),
        (1, LINE, [0, 0, 0, 1, 2, 2], None, "an end knot occurs more than 2 times"),
        (1, LINE, [0, 0, 0, 0, 0, 0], None, "an end knot occurs more than 2 times"),
        (1, LINE, [0, 0, 1, 1, 2, 2], None, "inner knot 1 occurs 2 times; expected at most 1"),
        (
            1,
            LINE,
            [0, 0, 1e-320, 1, 2, 2],
            None,
            r"knots\[2\] lies 9.99\S* after knots\[1\], of 2 in all; expected equal",
        ),
        (3, LINE, None, [1, 1, 0, 1], r"weights\[2\] is 0; expected a number > 0"),
        (3, LINE, None, [1, 1, 1], r"weights has shape \(3,\); expected \(4\)"),
    ],
)
def test_impossible_curves_are_refused_with_the_reason(
    degree: int, points: list[list[float]], knots: list[float] | None, weights: list[float] | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Spline(degree, points, knots, weights)


def test_catmull_rom_refuses_equal_neighbors() -> None:
    with pytest.raises(ValueError, match="points 1 and 2 are equal"):
        catmull_rom([[0, 0], [1, 0], [1, 0], [2, 0]])


def test_curves_of_the_same_fields_are_equal() -> None:
    assert Spline(1, LINE) == Spline(1, LINE, clamped_uniform_knots(1, 4), np.ones(4))
    assert Spline(1, LINE) != Spline(2, LINE)
    assert Spline(1, LINE) != "a line"
    copied = dataclasses.replace(Spline(1, LINE), weights=np.array([1.0, 2.0, 1.0, 1.0]))
    assert copied.controls[0, 1, 2] == 2.0


def test_default_knots_are_uniform_over_zero_to_one() -> None:
    np.testing.assert_allclose(clamped_uniform_knots(3, 6), [0, 0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1, 1])


def test_warm_up_runs() -> None:
    spline_kernels.warm_up()
