"""Cold start: symmetric halls are flagged, and cleared by moving one reflector."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.geometry.angles import difference
from commission.planning.ambiguity import AmbiguityOptions, PairTable, ambiguous_poses, cold_start
from commission.planning.coverage import Lattice, lattice_of
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.site.project import Project
from commission.site.scanner import Scanner
from tests.planning.sites import reflectors_at, room

ALL_AROUND = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=20.0)
CORNERS = ((0.2, 0.2), (11.8, 0.2), (11.8, 7.8), (0.2, 7.8))


def hall(places, scanner=ALL_AROUND) -> Project:
    return Project(floor_map=room(12.0, 8.0), reflectors=reflectors_at(places), scanners=(scanner,))


def start_in(project):
    """The middle of the hall: near the walls a reflector may be too close to be measured."""
    return cold_start(vehicle_visibility(project), Lattice(x=1.0, y=1.0, spacing=0.5, rows=13, columns=21))


def test_a_symmetric_hall_is_flagged_with_its_pairs():
    result = start_in(hall(CORNERS))
    assert result.ambiguous.all()
    # Half a turn about the middle of the hall, (6, 4).
    np.testing.assert_allclose(result.partners[:, :2], np.array([12.0, 8.0]) - result.poses[:, :2], atol=1e-9)
    np.testing.assert_allclose(np.abs(difference(result.partners[:, 2], result.poses[:, 2])), math.pi)
    (pair,) = result.pairs
    assert (pair.constellation, pair.image) == ((0, 1, 2, 3), (2, 3, 0, 1))
    assert pair.poses == len(result.poses)


def test_moving_one_reflector_by_half_a_metre_clears_it():
    moved = [(0.7, 0.2), *CORNERS[1:]]
    result = start_in(hall(moved))
    assert not result.ambiguous.any()
    assert result.pairs == ()
    assert np.isnan(result.partners).all()


def test_moving_one_reflector_by_less_than_the_tolerance_does_not():
    assert start_in(hall([(0.25, 0.2), *CORNERS[1:]])).ambiguous.all()


def test_a_mirror_image_is_no_danger():
    # Symmetric about the line x = 6, not under any turn.
    places = [(1.0, 0.2), (11.0, 0.2), (4.0, 7.8), (8.0, 7.8), (6.0, 0.2)]
    assert not start_in(hall(places)).ambiguous.any()


def test_two_reflectors_are_always_taken_for_each_other_where_the_floor_allows_it():
    result = start_in(hall([(4.0, 0.2), (8.0, 0.2)]))
    # Half a turn about (6, 0.2) leads out of the hall; there it does not matter.
    assert not result.ambiguous.any()
    assert start_in(hall([(4.0, 4.0), (8.0, 4.0)])).ambiguous.all()


def test_fewer_than_two_reflectors_are_always_ambiguous():
    for places in ([], [(6.0, 4.0)]):
        result = start_in(hall(places))
        assert result.ambiguous.all()
        assert np.isnan(result.partners).all()


def test_a_further_reflector_in_sight_tells_two_places_apart():
    # Two equal triangles; only the second is accompanied by a fourth reflector in range.
    triangle = np.array([(0.0, 0.0), (2.0, 0.0), (0.0, 3.0)])
    shifted = triangle + np.array([40.0, 0.0])
    scanner = replace(ALL_AROUND, reflector_range=6.0)
    spot = [[0.5, 0.5, 0.0]]
    alike = Project(reflectors=reflectors_at([*triangle, *shifted]), scanners=(scanner,))
    found = ambiguous_poses(vehicle_visibility(alike), spot)
    np.testing.assert_allclose(found.partners, [[40.5, 0.5, 0.0]], atol=1e-9)
    accompanied = Project(reflectors=reflectors_at([*triangle, *shifted, (43.0, 2.0)]), scanners=(scanner,))
    assert not ambiguous_poses(vehicle_visibility(accompanied), spot).ambiguous.any()


def test_a_narrow_field_of_view_makes_a_hall_ambiguous_that_is_not_all_around():
    # Both long walls carry a pair at one distance; only a full turn sees how they stand to each other.
    places = [(4.0, 0.2), (7.0, 0.2), (5.0, 7.8), (8.0, 7.8), (11.8, 6.0)]
    narrow = Scanner(field_of_view_deg=(-90.0, 90.0), reflector_range=20.0)
    assert not start_in(hall(places)).ambiguous.any()
    assert start_in(hall(places, narrow)).ambiguous.any()


def test_two_scanners_back_to_back_are_as_clear_as_one_that_sees_all_around():
    places = [(4.0, 0.2), (7.0, 0.2), (5.0, 7.8), (8.0, 7.8), (11.8, 6.0)]
    front = Scanner(name="front", field_of_view_deg=(-90.0, 90.0), reflector_range=20.0)
    rear = replace(front, name="rear", mounting=(0.0, 0.0, math.pi))
    assert start_in(replace(hall(places), scanners=(front,))).ambiguous.any()
    both = start_in(replace(hall(places), scanners=(front, rear)))
    assert not both.ambiguous.any()
    # All eight headings of a spot see what the full turn sees from there.
    around = start_in(hall(places))
    assert both.visible.reshape(8, -1).tolist() == [around.visible.tolist()] * 8


def test_reflectors_that_only_both_scanners_together_see_are_compared():
    # Two pairs of one distance, farther apart than either scanner sees: 11 m of at most 12.1 m.
    front = Scanner(name="front", mounting=(0.5, 0.0, 0.0), field_of_view_deg=(-30.0, 30.0), reflector_range=5.0)
    rear = replace(front, name="rear", mounting=(-0.5, 0.0, math.pi))
    pair = np.array([(-5.5, 0.0), (5.5, 0.0)])
    project = Project(
        reflectors=reflectors_at(np.concatenate((pair, np.add(pair, (40.0, 0.0))))), scanners=(front, rear)
    )
    found = ambiguous_poses(vehicle_visibility(project), [[0.0, 0.0, 0.0]])
    assert found.visible.tolist() == [2]
    assert found.ambiguous.tolist() == [True]
    np.testing.assert_allclose(found.partners[0, 1], 0.0, atol=1e-9)
    assert any(abs(found.partners[0, 0] - x) < 1e-9 for x in (0.0, 40.0))


@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=2, max_size=6, unique=True),
    st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(-math.pi, math.pi)),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=60)
def test_a_moved_copy_of_a_constellation_is_always_found(places, motion, seed):
    points = np.array(places)
    apart = np.hypot(*(points[:, np.newaxis] - points).transpose(2, 0, 1))[np.triu_indices(len(points), 1)]
    if apart.min() < 0.5:
        return
    c, s = math.cos(motion[2]), math.sin(motion[2])
    noise = np.random.default_rng(seed).uniform(-0.03, 0.03, points.shape)
    copy = points @ np.array([[c, s], [-s, c]]) + np.array(motion[:2]) + np.array([200.0, 0.0]) + noise
    found = PairTable.of(np.concatenate((points, copy)), 400.0).motions(np.arange(len(points)), 0.1)
    expected = np.arange(len(points)) + len(points)
    assert any(np.array_equal(image, expected) for image in found.images)
    # And the identity, since the table does not know which of them is asked about.
    assert any(np.array_equal(image, np.arange(len(points))) for image in found.images)


def test_progress_rises_to_one():
    seen = []
    project = hall(CORNERS)
    cold_start(vehicle_visibility(project), lattice_of(project, 1.0), progress=lambda done, _: seen.append(done))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@pytest.mark.parametrize("field", ["tolerance", "separation", "turn"])
def test_options_out_of_range_are_refused(field):
    with pytest.raises(ValueError, match=f"ambiguity.{field} is 0"):
        AmbiguityOptions(**{field: 0.0})
