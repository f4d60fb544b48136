"""Maps moved onto a plant's coordinates by two points: these land where they were said to lie, all else with them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from commission.errors import UsageError
from commission.geometry import se2
from commission.site.disturbances import Disturbances, ShinyObject, TiltedStretch
from commission.site.editing.alignment import WRONG, KnownPoint, align, aligned
from commission.site.layout_brief import AllowedHeights, CandidateOptions, Demands, LayoutBrief
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import Zone
from tests.app.sites import room

PLACE = st.tuples(st.floats(-500.0, 500.0), st.floats(-500.0, 500.0))
POSE = st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(-math.pi, math.pi))


@given(a=PLACE, b=PLACE, pose=POSE)
def test_both_points_land_where_they_lie_in_the_plant(
    a: tuple[float, float], b: tuple[float, float], pose: tuple[float, float, float]
) -> None:
    assume(math.dist(a, b) > 1.0)
    there_a, there_b = se2.transform_points(np.array(pose), [a, b])
    found = align(KnownPoint(a, tuple(there_a)), KnownPoint(b, tuple(there_b)))
    # A tenth of a micrometre at 100 km from the origin.
    np.testing.assert_allclose(se2.transform_points(found.T_plant_map, [a, b]), [there_a, there_b], atol=1e-7)
    assert found.residual == pytest.approx(0.0, abs=1e-7)


@given(a=PLACE, b=PLACE, pose=POSE, share=st.floats(-0.01, 0.01))
def test_a_difference_of_distances_is_told_and_split_between_the_points(
    a: tuple[float, float], b: tuple[float, float], pose: tuple[float, float, float], share: float
) -> None:
    assume(math.dist(a, b) > 1.0)
    distance = math.dist(a, b)
    there = se2.transform_points(np.array(pose), np.array([a, b]) * (1.0 + share))
    found = align(KnownPoint(a, tuple(there[0])), KnownPoint(b, tuple(there[1])))
    assert found.residual == pytest.approx(share * distance, abs=1e-7)
    missed = se2.transform_points(found.T_plant_map, [a, b]) - there
    np.testing.assert_allclose(np.hypot(*missed.T), abs(0.5 * share * distance), atol=1e-7)
    np.testing.assert_allclose(missed[0], -missed[1], atol=1e-7)


def site() -> Project:
    return replace(
        room(),
        stations=(Station(name="Dock", x=3.0, y=2.0, heading=0.3),),
        disturbances=Disturbances(
            shiny_objects=(ShinyObject(1.0, 2.0),), tilted_stretches=(TiltedStretch(4.0, 5.0, 1.0),)
        ),
    )


TURNED = align(KnownPoint((0.0, 0.0), (100.0, 50.0)), KnownPoint((4.0, 0.0), (100.0, 54.0)))
"""A quarter turn, and away."""


def test_the_map_alone_moves_when_the_rest_is_in_plant_coordinates_already() -> None:
    before = site()
    after = aligned(before, TURNED, everything=False)
    assert after.floor_map is not None and before.floor_map is not None
    np.testing.assert_allclose(after.floor_map.origin, (100.0, 50.0, math.pi / 2))
    assert after.floor_map.cells is before.floor_map.cells
    assert replace(after, floor_map=before.floor_map) == before


def test_a_map_whose_origin_is_turned_already_is_turned_on_from_there() -> None:
    before = site()
    assert before.floor_map is not None
    lying = replace(before, floor_map=replace(before.floor_map, origin=np.array([3.0, -2.0, 0.5])))
    after = aligned(lying, TURNED, everything=False)
    assert after.floor_map is not None
    # A quarter turn takes (3, -2) to (2, 3).
    np.testing.assert_allclose(after.floor_map.origin, (102.0, 53.0, 0.5 + math.pi / 2))


def test_everything_that_was_placed_on_the_map_goes_with_it() -> None:
    before = site()
    facing = tuple(replace(each, heading=0.3 * k) for k, each in enumerate(before.reflectors.reflectors))
    zone, tag = Zone(name="Hall", outline=((0.0, 0.0), (4.0, 0.0), (4.0, 2.0))), Tag(id="7", x=1.0, y=2.0, heading=0.3)
    before = replace(before, reflectors=ReflectorMap(facing), zones=(zone,), tags=(tag,))
    after = aligned(before, TURNED, everything=True)
    # A quarter turn: x becomes y, y becomes -x.
    for old, new in zip(before.reflectors.reflectors, after.reflectors.reflectors, strict=True):
        assert (new.x, new.y) == pytest.approx((100.0 - old.y, 50.0 + old.x))
        assert new.heading is not None and old.heading is not None
        assert math.remainder(new.heading - old.heading - math.pi / 2, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
    for old, new in zip(before.routes[0].segments, after.routes[0].segments, strict=True):
        expected = np.column_stack((100.0 - old.control_points[:, 1], 50.0 + old.control_points[:, 0]))
        np.testing.assert_allclose(new.control_points, expected)
    (moved,), (seen,) = after.zones, after.tags
    np.testing.assert_allclose(moved.outline, ((100.0, 50.0), (100.0, 54.0), (98.0, 54.0)))
    assert (seen.x, seen.y, seen.heading) == pytest.approx((98.0, 51.0, 0.3 + math.pi / 2))
    dock, shiny, tilted = after.stations[0], after.disturbances.shiny_objects[0], after.disturbances.tilted_stretches[0]
    assert (dock.x, dock.y, dock.heading) == pytest.approx((98.0, 53.0, 0.3 + math.pi / 2))
    assert (shiny.x, shiny.y, tilted.x, tilted.y) == pytest.approx((98.0, 51.0, 95.0, 54.0))
    assert before.floor_map is not None and after.floor_map is not None
    walls = before.floor_map.occupancy()
    probe = np.random.default_rng(1).uniform((0.0, 0.0), (12.0, 8.0), (200, 2))
    there = se2.transform_points(TURNED.T_plant_map, probe)
    np.testing.assert_array_equal(after.floor_map.occupancy().is_occupied(there), walls.is_occupied(probe))


def test_areas_and_spots_of_a_suggested_layout_go_with_the_map() -> None:
    heights = (AllowedHeights(0.1, 0.3), AllowedHeights(0.1, 0.5, (0.0, 0.0, 2.0, 1.0)))
    candidates = CandidateOptions(keep_out=((1.0, 2.0, 4.0, 3.0),), allowed_heights=heights)
    demands = Demands(unambiguous_spots=((1.0, 2.0), (3.0, 4.0, 0.5)))
    layout = aligned(replace(site(), layout=LayoutBrief(demands, candidates)), TURNED, everything=True).layout
    assert layout.candidates.keep_out[0] == pytest.approx((97.0, 51.0, 98.0, 54.0))
    everywhere, there = layout.candidates.allowed_heights
    assert everywhere.area is None
    assert there.area == pytest.approx((99.0, 50.0, 100.0, 52.0))
    place, pose = layout.demands.unambiguous_spots
    assert place == pytest.approx((98.0, 51.0))
    assert pose == pytest.approx((96.0, 53.0, 0.5 + math.pi / 2))


def test_there_and_back_again_is_where_it_began() -> None:
    before = site()
    back = align(KnownPoint((100.0, 50.0), (0.0, 0.0)), KnownPoint((100.0, 54.0), (4.0, 0.0)))
    again = aligned(aligned(before, TURNED, everything=True), back, everything=True)
    assert again.floor_map is not None
    np.testing.assert_allclose(again.floor_map.origin, (0.0, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(again.reflectors.centers, before.reflectors.centers, atol=1e-12)


def test_points_that_no_map_could_fit_are_refused() -> None:
    a = KnownPoint((0.0, 0.0), (0.0, 0.0))
    far = align(a, KnownPoint((10.0, 0.0), (10.0 * (1.0 + 2.0 * WRONG), 0.0)))
    with pytest.raises(UsageError, match=r"10\.000 m apart on the map and 10\.400 m in the plant"):
        aligned(site(), far, everything=False)
    with pytest.raises(UsageError, match=r"0\.010 m apart on the map"):
        align(a, KnownPoint((0.01, 0.0), (10.0, 0.0)))
    with pytest.raises(UsageError, match="no floor map"):
        aligned(replace(site(), floor_map=None), TURNED, everything=False)
