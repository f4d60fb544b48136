from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, ProjectError, UsageError
from commission.geometry.angles import difference
from commission.site.editing import reflectors as edits
from commission.site.editing.names import fresh_names
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

METRES = st.floats(-1e3, 1e3)
ANGLE = st.floats(-math.pi, math.pi)
OFFSET = st.tuples(METRES, METRES)


@st.composite
def selections(draw: st.DrawFn) -> tuple[ReflectorMap, tuple[str, ...]]:
    """A map and some of its ids."""
    ids = draw(st.lists(st.integers(0, 30).map(lambda n: f"R{n}"), max_size=6, unique=True))
    kinds = st.sampled_from(ReflectorKind)
    one = [draw(st.builds(Reflector, id=st.just(i), x=METRES, y=METRES, kind=kinds, heading=ANGLE)) for i in ids]
    return ReflectorMap(tuple(one)), tuple(draw(st.lists(st.sampled_from(ids), unique=True)) if ids else ())


def assert_same(found: ReflectorMap, expected: ReflectorMap) -> None:
    """Equal up to rounding: coordinates of 1e3 m, turned twice, keep 1e-9 m."""
    assert [r.id for r in found.reflectors] == [r.id for r in expected.reflectors]
    np.testing.assert_allclose(found.centers, expected.centers, atol=1e-9)
    np.testing.assert_allclose(difference(found.headings, expected.headings), 0.0, atol=1e-12)


@given(selections(), METRES, METRES, ANGLE)
def test_mirroring_twice_gives_back_what_was(selection, x, y, angle):
    reflectors, ids = selection
    axis = edits.Axis(x, y, angle)
    assert_same(edits.mirror(edits.mirror(reflectors, ids, axis), ids, axis), reflectors)


@given(selections(), OFFSET, ANGLE)
def test_turning_there_and_back_gives_back_what_was(selection, pivot, angle):
    reflectors, ids = selection
    assert_same(edits.turn(edits.turn(reflectors, ids, pivot, angle), ids, pivot, -angle), reflectors)


@given(selections(), OFFSET)
def test_moving_there_and_back_gives_back_what_was(selection, offset):
    reflectors, ids = selection
    back = (-offset[0], -offset[1])
    assert_same(edits.move(edits.move(reflectors, ids, offset), ids, back), reflectors)


@given(selections(), OFFSET, st.integers(0, 5))
def test_deleting_the_copies_of_an_array_gives_back_what_was(selection, step, count):
    reflectors, ids = selection
    added = edits.repeat(reflectors, ids, step, count)
    assert len(added.ids) == count * len(ids)
    assert edits.delete(added.reflectors, added.ids) == reflectors


@given(selections(), OFFSET, ANGLE)
def test_edits_leave_locked_reflectors_and_the_rest_of_the_map_alone(selection, offset, angle):
    reflectors, ids = selection
    locked = edits.set_locked(reflectors, ids, True)
    everyone = [r.id for r in reflectors.reflectors]
    edited = [
        edits.move(locked, ids, offset),
        edits.turn(locked, ids, offset, angle),
        edits.mirror(locked, ids, edits.Axis(*offset, angle)),
        edits.delete(locked, ids),
        edits.set_value(locked, ids, "radius", 0.5),
        edits.place(locked, dict.fromkeys(ids, offset)),
    ]
    assert all(result == locked for result in edited)
    assert set(edits.locked_among(locked, everyone)) == set(ids)
    assert edits.set_locked(locked, ids, False) == reflectors


@given(st.lists(st.text("R01x٣²", max_size=4)), st.integers(0, 5), st.text("R01x٣²", max_size=4))
def test_fresh_names_are_new_and_all_different(taken, count, like):
    names = fresh_names(taken, count, like)
    assert len(set(names)) == count
    assert not set(names) & set(taken)


def test_names_go_on_counting_with_the_width_that_is_there():
    assert fresh_names(["R07", "R12", "wall"], 2, "R07") == ("R13", "R14")
    assert fresh_names(["A"], 1, "A") == ("A1",)


def test_added_reflectors_are_like_the_given_one_and_numbered_on():
    added = edits.add(
        ReflectorMap((Reflector(id="R1", x=0.0, y=0.0),)), [[1, 2], [3, 4]], Reflector(id="R1", x=0, y=0, radius=0.05)
    )
    assert added.ids == ("R2", "R3")
    assert [(r.x, r.y, r.radius) for r in added.reflectors.reflectors[1:]] == [(1, 2, 0.05), (3, 4, 0.05)]


def test_a_mirrored_plate_faces_the_mirrored_way():
    plate = Reflector(id="P", x=1.0, y=0.0, kind=ReflectorKind.FLAT, heading=math.radians(30))
    mirrored = edits.mirror(ReflectorMap((plate,)), ["P"], edits.Axis.through((0, -1), (0, 5))).reflectors[0]
    assert (mirrored.x, mirrored.y) == pytest.approx((-1.0, 0.0), abs=1e-12)
    assert math.degrees(mirrored.heading) == pytest.approx(150)


def test_a_plate_that_is_turned_about_a_pivot_moves_and_faces_the_turned_way():
    plate = Reflector(id="P", x=3.0, y=1.0, kind=ReflectorKind.FLAT, heading=math.radians(170))
    post = Reflector(id="C", x=1.0, y=2.0, heading=0.5)
    turned = edits.turn(ReflectorMap((plate, post)), ["P", "C"], (1.0, 1.0), math.radians(90)).reflectors
    assert [(r.x, r.y) for r in turned] == [pytest.approx((1.0, 3.0)), pytest.approx((0.0, 1.0))]
    # 260 degrees, wrapped; a post faces everywhere.
    assert (math.degrees(turned[0].heading), turned[1].heading) == (pytest.approx(-100), 0.5)


def test_an_array_has_each_copy_one_step_from_the_one_before_and_none_is_locked():
    two = (Reflector(id="R1", x=1.0, y=2.0, locked=True), Reflector(id="R2", x=4.0, y=2.0))
    added = edits.repeat(ReflectorMap(two), ["R1", "R2"], (0.5, -1.0), 3)
    placed = [(r.id, r.x, r.y, r.locked) for r in added.reflectors.reflectors[2:]]
    assert placed == [
        *(("R3", 1.5, 1.0, False), ("R4", 4.5, 1.0, False), ("R5", 2.0, 0.0, False)),
        *(("R6", 5.0, 0.0, False), ("R7", 2.5, -1.0, False), ("R8", 5.5, -1.0, False)),
    ]
    assert added.reflectors.reflectors[0].locked


def test_a_mirrored_copy_leaves_the_original():
    added = edits.duplicate_mirrored(ReflectorMap((Reflector(id="R1", x=1.0, y=2.0),)), ["R1"], edits.Axis(0, 0, 0))
    assert [(r.id, r.x, r.y) for r in added.reflectors.reflectors] == [("R1", 1.0, 2.0), ("R2", 1.0, -2.0)]


def test_a_row_reaches_its_end_when_the_spacing_fits():
    points = edits.row((1.0, 0.0), (1.3, 0.0), 0.1)
    np.testing.assert_allclose(points[:, 0], [1.0, 1.1, 1.2, 1.3])
    assert len(edits.row((0, 0), (0, 1.05), 0.5)) == 3
    assert edits.row((1, 2), (1, 2), 0.5).tolist() == [[1, 2]]


@pytest.mark.parametrize(
    ("edit", "kind", "message"),
    [
        (lambda m: edits.delete(m, ["Z"]), UsageError, "no reflector is called 'Z'"),
        (lambda m: edits.set_value(m, ["A"], "color", 1), UsageError, "no field of a reflector is called 'color'"),
        (lambda m: edits.set_value(m, ["A", "B"], "id", "C"), UsageError, "2 reflectors would be called 'C'"),
        (lambda m: edits.set_value(m, ["A"], "id", "B"), ProjectError, "'B' is used twice"),
        (lambda m: edits.set_value(m, ["A"], "radius", 0.0), ValueError, "radius is 0"),
        (lambda m: edits.repeat(m, ["A"], (1, 0), 10_001), UsageError, "expected 0 to 10000"),
        (lambda m: edits.row((0, 0), (1, 0), 0.0), UsageError, "expected more than 0 m"),
        (lambda m: edits.Axis.through((1, 1), (1, 1)), ValueError, "coincide"),
    ],
)
def test_an_edit_that_cannot_be_is_refused_in_one_line(edit, kind, message):
    with pytest.raises(kind, match=message) as caught:
        edit(ReflectorMap((Reflector(id="A", x=0, y=0), Reflector(id="B", x=1, y=0))))
    assert isinstance(caught.value, CommissionError | ValueError)
