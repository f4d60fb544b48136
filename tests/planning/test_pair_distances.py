"""Pairs of reflectors by their distances: against a plain count of all of them, and in suggested layouts."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from commission.planning.pair_distances import alike_pairs, seen_at_once
from commission.planning.placement import Demands, PlacementOptions, place
from commission.planning.route_prediction import plan_route
from commission.site.layout_brief import DEMAND_PRESETS, CandidateOptions
from commission.site.project import Project
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from tests.planning.sites import room

LEAST = 0.3


def counted(sees: np.ndarray, centers: np.ndarray, least: float) -> set[frozenset[tuple[int, int]]]:
    """Two pairs that some scan sees all of and whose distances differ by no more than that: pair by pair."""
    pairs = list(itertools.combinations(range(len(centers)), 2))
    return {
        frozenset((one, other))
        for one, other in itertools.combinations(pairs, 2)
        if abs(math.dist(*centers[list(one)]) - math.dist(*centers[list(other)])) <= least
        and any(all(scan[each] for each in (*one, *other)) for scan in sees)
    }


@pytest.mark.parametrize("seed", range(6))
def test_alike_pairs_are_those_of_a_plain_count(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centers, sees = rng.uniform(0.0, 20.0, (9, 2)), rng.random((12, 9)) < 0.5
    found = alike_pairs(sees, centers, LEAST)
    named = {frozenset(((a, b), (c, d))) for a, b, c, d in found.reflectors.tolist()}
    assert named == counted(sees, centers, LEAST)
    assert len(named) == len(found.reflectors) > 0
    assert np.all(np.diff(np.abs(np.diff(found.distances, axis=1)).ravel()) >= 0.0)
    at = seen_at_once(found, sees)
    assert at.tolist() == [bool(counted(scan[np.newaxis], centers, LEAST)) for scan in sees]


def test_a_difference_of_just_more_is_enough_and_none_is_asked_for_with_0() -> None:
    sees = np.ones((1, 3), np.bool_)
    for gap, count in ((0.299, 1), (0.301, 0)):
        centers = np.array([(0.0, 0.0), (5.0, 0.0), (10.0 + gap, 0.0)])
        assert len(alike_pairs(sees, centers, LEAST).distances) == count
    assert len(alike_pairs(sees, np.array([(0.0, 0.0), (5.0, 0.0), (10.0, 0.0)]), 0.0).distances) == 0


def site() -> Project:
    """A route through the middle of a hall in which every wall is a comb of places one metre apart."""
    route = Route("Through", (Segment(control_points=np.array([[2.0, 4.0], [14.0, 4.0]]), degree=1),), 1.0)
    scanner = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=12.0, rate=5.0)
    return Project(floor_map=room(16.0, 8.0), scanners=(scanner,), routes=(route,))


def suggested(**demands: object):
    asked = Demands(visible=4, position_limit=0.1, heading_limit=0.05, **demands)  # type: ignore[arg-type]
    options = PlacementOptions(demands=asked, candidates=CandidateOptions(spacing=1.0), extend=False, checks=80)
    return place(site(), options=options)


def pairs_of(found) -> set[frozenset[tuple[int, int]]]:
    with_them = replace(site(), reflectors=found.reflectors)
    return counted(plan_route(with_them, "Through").sees(), found.reflectors.centers, LEAST)


def test_a_layout_keeps_the_distances_of_its_pairs_apart_where_that_is_demanded() -> None:
    plain, apart = suggested(), suggested(pairs_differ=LEAST)
    assert pairs_of(plain)
    assert len(pairs_of(apart)) == 0
    assert apart.unmet == ()
    assert apart.added == plain.added


def test_pairs_that_stay_alike_are_told_by_route_and_metre() -> None:
    """The hall is too small for pairs that differ by metres."""
    found = suggested(pairs_differ=5.0)
    assert {each.reason for each in found.unmet} == {"pairs"}
    assert all(each.route == "Through" and each.metres for each in found.unmet)


def test_no_place_along_the_walls_is_farther_from_a_reflector_than_demanded() -> None:
    plain, spread = suggested(), suggested(wall_reach=3.0)

    def farthest(found) -> float:
        delta = found.candidates[:, np.newaxis] - found.reflectors.centers
        return float(np.hypot(delta[..., 0], delta[..., 1]).min(axis=1).max())

    assert farthest(plain) > 3.0 >= farthest(spread)
    assert spread.unmet == ()


def test_the_preset_asks_for_three_in_sight_after_any_one_has_failed() -> None:
    demands = Demands(visible=1, survive_failure=False, position_limit=0.05).preset("NAV350")
    assert (demands.visible, demands.survive_failure, demands.position_limit) == (3, True, 0.05)
    options = PlacementOptions(demands=demands, candidates=CandidateOptions(spacing=2.0), extend=False, checks=5)
    found = place(site(), options=options)
    sees = plan_route(replace(site(), reflectors=found.reflectors), "Through").sees()
    left = [np.delete(sees, gone, axis=1).sum(axis=1).min() for gone in range(sees.shape[1])]
    assert min(left) >= 3
    assert list(DEMAND_PRESETS) == ["NAV350"]
    with pytest.raises(ValueError, match="NAV999"):
        demands.preset("NAV999")
