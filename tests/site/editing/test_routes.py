from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.errors import UsageError
from commission.site.editing import routes as edits
from commission.site.editing.routes import Curve
from commission.site.routes import Direction, Route

CLICKS = st.lists(st.tuples(st.integers(-40, 40), st.integers(-40, 40)), min_size=2, max_size=7, unique=True)
CURVES = st.sampled_from(Curve)
WAY = [(0, 0), (4, 0), (6, 3), (10, 3)]


def drawn(route: Route, segment: int = 0) -> np.ndarray:
    spline = route.segments[segment].spline()
    return spline.point(np.linspace(*spline.domain, 101))


@given(CLICKS)
@settings(max_examples=50)
def test_a_route_through_clicked_points_passes_each_of_them(clicks):
    segment = edits.segment_of(clicks, Curve.THROUGH)
    joints = segment.control_points[:: 3 if segment.degree == 3 else 1]
    np.testing.assert_allclose(joints, clicks)


@given(CLICKS, CURVES, st.integers(-40, 40), st.integers(-40, 40))
@settings(max_examples=50)
def test_an_inserted_point_leaves_the_curve_as_it_is(clicks, curve, x, y):
    route = edits.new_route("r", clicks, curve)
    more = edits.insert_point(route, 0, (x, y))
    assert len(more.segments[0].control_points) > len(route.segments[0].control_points)
    np.testing.assert_allclose(drawn(more), drawn(route), atol=1e-9)


@given(CLICKS, CURVES, st.floats(-40, 40), st.floats(-40, 40))
@settings(max_examples=50)
def test_a_point_moved_there_and_back_leaves_the_route_as_it_was(clicks, curve, x, y):
    route = edits.new_route("r", clicks, curve)
    last = len(route.segments[0].control_points) - 1
    home = route.segments[0].control_points[last]
    back = edits.move_point(edits.move_point(route, 0, last, (x, y)), 0, last, tuple(home))
    np.testing.assert_allclose(back.segments[0].control_points, route.segments[0].control_points, atol=1e-9)


def test_a_point_clicked_twice_counts_once():
    assert edits.segment_of([(0, 0), (0, 0), (3, 0), (3, 0), (5, 5)]) == edits.segment_of([(0, 0), (3, 0), (5, 5)])
    with pytest.raises(ValueError, match="1 different points; expected 2 or more"):
        edits.segment_of([(0, 0), (0, 0)])


@pytest.mark.parametrize("point", [3, 4, 5])
def test_a_moved_joint_or_handle_leaves_no_kink(point):
    route = edits.move_point(edits.new_route("r", WAY), 0, point, (5.0, -2.0))
    before, joint, after = (
        route.segments[0].control_points[[2, 3, 4]] if point < 5 else route.segments[0].control_points[5:8]
    )
    turn = np.arctan2(*(after - joint)[::-1]) - np.arctan2(*(joint - before)[::-1])
    assert math.sin(turn) == pytest.approx(0.0, abs=1e-9)
    assert math.cos(turn) > 0.0


def test_an_end_that_two_segments_share_moves_in_both():
    route = edits.append(edits.new_route("r", WAY), [(8, 3), (5, 5)], Direction.REVERSE)
    assert [s.direction for s in route.segments] == ["forward", "reverse"]
    for segment, point in ((0, len(route.segments[0].control_points) - 1), (1, 0)):
        moved = edits.move_point(route, segment, point, (11.0, 4.0))
        assert moved.segments[0].control_points[-1].tolist() == [11.0, 4.0]
        assert moved.segments[1].control_points[0].tolist() == [11.0, 4.0]


def test_a_split_route_drives_the_same_way_and_takes_other_speeds():
    route = edits.split_segment(edits.new_route("r", WAY), 0, (5.0, 1.5))
    route = edits.set_value(edits.set_value(route, 1, "direction", Direction.REVERSE), 1, "speed", 0.2)
    assert [(s.direction, s.speed) for s in route.segments] == [("forward", None), ("reverse", 0.2)]
    whole = edits.new_route("r", WAY).segments[0].spline().length
    assert sum(s.spline().length for s in route.segments) == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("point", [0, 3, 6, 9])
def test_deleting_a_joint_leaves_a_curve_through_the_others(point):
    route = edits.delete_point(edits.new_route("r", WAY), 0, point)
    rest = [p for i, p in enumerate(WAY) if i != point // 3]
    np.testing.assert_allclose(route.segments[0].control_points[::3], rest)
    assert edits.is_bezier(route.segments[0])


@given(CLICKS, st.integers(0, 6))
@settings(max_examples=50)
def test_deleting_points_of_a_b_spline_ends_at_a_straight_line(clicks, point):
    route = edits.insert_point(edits.new_route("r", clicks, Curve.NEAR), 0, (1.0, 1.0))
    while len(route.segments[0].control_points) > 2:
        n = len(route.segments[0].control_points)
        route = edits.delete_point(route, 0, point % n)
    assert route.segments[0].degree == 1


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda r: edits.delete_point(r, 0, 1), "a handle cannot be deleted"),
        (lambda r: edits.delete_point(r, 0, 99), "control point 99 of segment 0; expected 0 to 9"),
        (lambda r: edits.move_point(r, 0, -1, (0, 0)), "control point -1"),
        (lambda r: edits.move_point(r, 3, 0, (0, 0)), "segment 3 of route 'r'; expected 0 to 0"),
        (lambda r: edits.delete_point(edits.new_route("r", WAY[:2]), 0, 0), "needs two points"),
        (lambda r: edits.delete_point(edits.append(r, [(9, 9)], "forward"), 0, 9), "shared by two segments"),
    ],
)
def test_an_edit_of_a_route_that_cannot_be_is_refused_in_one_line(edit, message):
    with pytest.raises(UsageError, match=message):
        edit(edits.new_route("r", WAY))
