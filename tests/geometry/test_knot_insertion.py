from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.geometry.knot_insertion import insert_knot, multiplicity, split
from commission.geometry.splines import Spline, catmull_rom

POINT = st.tuples(st.integers(-50, 50), st.integers(-50, 50))
SHARE = st.floats(0.01, 0.99)


@st.composite
def curves(draw: st.DrawFn) -> Spline:
    degree = draw(st.integers(1, 4))
    points = np.array(draw(st.lists(POINT, min_size=degree + 1, max_size=degree + 5, unique=True)), float)
    weights = draw(st.none() | st.lists(st.floats(0.2, 5.0), min_size=len(points), max_size=len(points)))
    return Spline(degree, points, None, weights)


@settings(max_examples=40)
@given(curves(), SHARE, st.integers(1, 5))
def test_a_curve_with_more_knots_is_the_same_curve(curve, u, times):
    finer = insert_knot(curve, u, times)
    parameters = np.linspace(0.0, 1.0, 41)
    # Coordinates of 50 m and weights up to 25 : 1 leave 12 digits.
    np.testing.assert_allclose(finer.point(parameters), curve.point(parameters), atol=1e-10)
    assert len(finer.control_points) - len(curve.control_points) == len(finer.knots) - len(curve.knots)


@settings(max_examples=40)
@given(curves(), SHARE)
def test_the_two_parts_of_a_split_curve_are_the_curve(curve, u):
    before, after = split(curve, u)
    # Both parts know their piece of the parameter.
    assert before.domain[1] == after.domain[0] == pytest.approx(u, abs=1e-9)
    for part in (before, after):
        parameters = np.linspace(*part.domain, 21)
        np.testing.assert_allclose(part.point(parameters), curve.point(parameters), atol=1e-10)
    assert before.length + after.length == pytest.approx(curve.length, rel=1e-7, abs=1e-9)


def test_a_knot_that_is_full_is_not_filled_further():
    curve = catmull_rom([[0, 0], [1, 1], [3, 0]])
    joint = float(curve.knots[4])
    assert multiplicity(curve, joint) == 3
    assert insert_knot(curve, joint, 2) == curve
    assert [len(part.control_points) for part in split(curve, joint)] == [4, 4]


@pytest.mark.parametrize("u", [0.0, 1.0, -1.0, float("nan")])
def test_an_end_of_the_curve_is_refused(u):
    with pytest.raises(ValueError, match="expected inside"):
        insert_knot(catmull_rom([[0, 0], [1, 1]]), u)


def test_what_is_nearly_an_end_cannot_be_cut_off():
    with pytest.raises(ValueError, match="is an end of the curve"):
        split(catmull_rom([[0, 0], [1, 1]]), 1e-12)
