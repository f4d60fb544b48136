"""How deep beams end in drawn walls: against a general optimizer, a filter by hand, and drawn walls of known depth."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from commission.localization.contour import ACCEPTED, DEPTH, LEARNED_DEPTH, LEARNED_INFORMATION, USE
from commission.localization.contour_tables import contour_tables, distances_at
from commission.localization.wall_depth import (
    AS_DRAWN,
    DEEPEST,
    OF_A_SCAN,
    REMEMBERED,
    WallDepth,
    deepened,
    fitted,
    learned,
)
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from tests.localization.contour_halls import grid_pose, points_of, scan_from
from tests.localization.test_contour import TRUTH, belief_at, observed

LENGTH = 0.1


def hall(drawn: float, *, far_walls: bool = True) -> FloorMap:
    """A room of 9 m by 6 m with solid walls, drawn by so many metres too far inside."""
    cells = np.full((160, 220), FREE, dtype=np.int8)
    inner = round(drawn / 0.05)
    cells[:20, :] = cells[:, :20] = OCCUPIED
    cells[20 : 20 + inner, :] = cells[:, 20 : 20 + inner] = OCCUPIED
    if far_walls:
        cells[140 - inner :, :] = cells[:, 200 - inner :] = OCCUPIED
    return FloorMap(cells, 0.05, np.zeros(3))


def ends(pose=TRUTH, *, sigma: float = 0.0, every: int = 1, far_walls: bool = True) -> np.ndarray:
    """(n, 2) ends of beams in the real room [m], frame of the vehicle."""
    ranges, bearings = scan_from(hall(0.0, far_walls=far_walls), pose)
    ranges = ranges + sigma * np.random.default_rng(1).standard_normal(len(ranges))
    return points_of(ranges, bearings)[::every]


def fit(floor: FloorMap, points: np.ndarray, start, depth: float = 0.0) -> tuple[float, float]:
    cells = np.ascontiguousarray(points / 0.05)
    return fitted(grid_pose(floor, start), 80.0, cells, deepened(contour_tables(floor), depth), LENGTH)


@pytest.mark.parametrize("drawn", [0.0, 0.05, 0.1])
def test_the_depth_of_walls_that_are_drawn_too_far_inside_is_found(drawn):
    depth, share = fit(hall(drawn), ends(sigma=0.01), np.add(TRUTH, (0.03, -0.02, 0.01)))
    assert depth == pytest.approx(drawn, abs=0.002)
    assert share > 0.5


@pytest.mark.parametrize("seed", range(5))
def test_pose_and_depth_are_those_of_a_general_optimizer(seed):
    """Of the same cost: sum 1 - L^2 / (L^2 + (d + depth)^2), by Nelder and Mead."""
    floor, rng = hall(0.05), np.random.default_rng(seed)
    points = ends(sigma=0.02, every=7) + 0.01 * rng.standard_normal(2)
    points[rng.random(len(points)) < 0.1] *= 0.985  # some end a little before the wall
    tables = contour_tables(floor)

    def cost(unknown):
        x, y, theta, depth = unknown
        c, s = math.cos(theta), math.sin(theta)
        off = distances_at(tables, points @ np.array(((c, s), (-s, c))) + (x, y)) + depth
        return np.sum(1.0 - LENGTH**2 / (LENGTH**2 + off**2))

    best = minimize(
        cost, (*TRUTH, 0.05), method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-12, "maxiter": 9999}
    )
    depth, _ = fit(floor, points, TRUTH)
    assert depth == pytest.approx(best.x[3], abs=5e-4)


def test_walls_on_one_side_of_each_direction_say_nothing():
    """The pose takes all of it: a vehicle that sees two walls at a right angle may as well be farther away."""
    one_sided = ends(far_walls=False)
    assert len(one_sided) > 300
    depth, share = fit(hall(0.05, far_walls=False), one_sided, TRUTH)
    assert (depth, share) == (0.0, 0.0)


def test_what_is_learned_is_what_a_kalman_filter_of_a_constant_says():
    """In the form of weights: sum of information times value over all information."""
    floor, variance, known = hall(0.05), 0.05**2, AS_DRAWN
    points = np.ascontiguousarray(ends(sigma=0.01) / 0.05)
    pose, plain = grid_pose(floor, TRUTH), contour_tables(floor)
    values, weights = [0.0], [1.0 / variance]
    for moved in (0.0, 0.3, 2.0):
        tables = deepened(plain, known.depth)
        value, share = fitted(pose, 80.0, points[::3], tables, LENGTH)
        fresh = 1.0 if moved == 0.0 else min(moved, 1.0)
        values.append(value)
        weights.append(fresh * share / OF_A_SCAN**2)
        known = learned(known, variance, moved, pose, 80.0, points, tables, LENGTH)
        assert known.depth == pytest.approx(np.average(values, weights=weights), rel=1e-9)
        assert known.information == pytest.approx(sum(weights[1:]), rel=1e-9)


def test_a_vehicle_that_stands_learns_from_its_first_scan_alone():
    floor, pose = hall(0.05), grid_pose(hall(0.05), TRUTH)
    points = np.ascontiguousarray(ends(sigma=0.01) / 0.05)
    first = learned(AS_DRAWN, 0.05**2, 0.0, pose, 80.0, points, contour_tables(floor), LENGTH)
    for _ in range(5):
        tables = deepened(contour_tables(floor), first.depth)
        assert learned(first, 0.05**2, 0.0, pose, 80.0, points, tables, LENGTH) == first


def test_no_depth_is_learned_where_it_is_said_to_be_none_or_no_wall_is_there():
    floor, pose = hall(0.05), grid_pose(hall(0.05), TRUTH)
    points = np.ascontiguousarray(ends() / 0.05)
    assert learned(AS_DRAWN, 0.0, 1.0, pose, 80.0, points, contour_tables(floor), LENGTH) == WallDepth(0.0, 0.0)
    known = WallDepth(0.02, 100.0)
    far_from_walls = np.full((30, 2), 10.0)
    assert learned(known, 0.05**2, 1.0, pose, 80.0, far_from_walls, contour_tables(floor), LENGTH) == known


def test_it_stays_within_its_limits():
    """Walls drawn outside of where they are are not deep, and 0.3 m behind a face is another wall."""
    behind, pose = hall(0.1), grid_pose(hall(0.1), TRUTH)
    room = np.ascontiguousarray(points_of(*scan_from(behind, TRUTH)) / 0.05)
    assert fitted(pose, 80.0, room, contour_tables(hall(0.0)), LENGTH)[0] < -0.05
    assert learned(AS_DRAWN, 0.05**2, 1.0, pose, 80.0, room, contour_tables(hall(0.0)), LENGTH).depth == 0.0
    known, most = WallDepth(0.14, 1.0), REMEMBERED / OF_A_SCAN**2
    for _ in range(100):
        tables = deepened(contour_tables(hall(0.2)), known.depth)
        points = np.ascontiguousarray(ends() / 0.05)
        known = learned(known, 0.05**2, 1.0, grid_pose(hall(0.2), TRUTH), 80.0, points, tables, LENGTH)
    assert known.depth <= DEEPEST
    assert known.information == most


def test_a_scan_is_matched_with_walls_as_deep_as_they_are_known_to_be():
    """The same pose and correction as by a map whose walls are drawn where they are."""
    ranges, _ = scan_from(hall(0.0), TRUTH)
    belief = belief_at(np.add(TRUTH, (0.02, 0.03, 0.004)), (0.1, 0.1, 0.02))
    right, _ = observed(hall(0.0), belief, ranges)
    after, figures = observed(hall(0.1), belief, ranges, walls=WallDepth(0.1, 1e6))
    assert figures[USE] == ACCEPTED
    assert figures[DEPTH] == 0.1
    assert figures[LEARNED_DEPTH] == pytest.approx(0.1, abs=0.001)
    assert figures[LEARNED_INFORMATION] > 0.0
    assert tuple(after) == pytest.approx(tuple(right), abs=1e-3)
