"""Where in the whole hall a scan lies: against plain numpy, and against every pose that there is."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import read_only
from commission.localization.contour import lever_of
from commission.localization.contour_match import GridPose, MatchRule
from commission.localization.contour_search import FULL_SCORE, ScanPoints, places_of, promising, scored_floor, thinned
from commission.localization.contour_tables import contour_tables
from commission.localization.hypotheses import each_place_once
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from tests.localization.contour_halls import map_pose, points_of, room, scan_from

RULE = MatchRule(False, 0.2, 50, 1e-4, 0.5, 0.01)


def plain_scores(floor: FloorMap, points: np.ndarray, poses: np.ndarray, length: float = 0.5) -> np.ndarray:
    """(n,) mean of L^2 / (L^2 + d^2), d to the nearest occupied cell; points [m] of the scanner, map at the origin."""
    away = distance_transform_edt(floor.cells != OCCUPIED) * floor.resolution
    scores = np.pad(length**2 / (length**2 + away**2), 500)
    c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x, y = c * points[:, 0] - s * points[:, 1] + poses[:, :1], s * points[:, 0] + c * points[:, 1] + poses[:, 1:2]
    column, row = (np.floor(each / floor.resolution).astype(int) + 500 for each in (x, y))
    return scores[row, column].mean(axis=1)


def free_poses(floor: FloorMap, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 3) at least half a metre from any wall, inside the room."""
    field = floor.occupancy().distance_field()
    inside = np.argwhere((field > 0.5)[12:-12, 12:-12]) + 12
    at = (inside[rng.choice(len(inside), count)][:, ::-1] + rng.random((count, 2))) * floor.resolution
    headings = rng.uniform(-math.pi, math.pi, count)
    return np.column_stack((se2.transform_points(floor.origin, at), headings + floor.origin[2]))


def cells_of(floor: FloorMap, pose: np.ndarray, longest: float = 20.0, beams: int = 360) -> np.ndarray:
    """Points of a scan [cells]."""
    return points_of(*scan_from(floor, pose, beams=beams, longest=longest)) / floor.resolution


def searched(floor: FloorMap, points: np.ndarray) -> np.ndarray:
    """(P, 3) poses in the map, each place once, the best first."""
    tables = contour_tables(floor)
    found = places_of(ScanPoints(points, lever_of(points), 0.0, 0.0), tables, scored_floor(floor), RULE)
    poses = np.array([map_pose(floor, GridPose(*each)) for each in found[:, :3]])
    return poses[each_place_once(poses, 24)]


@pytest.mark.parametrize("resolution", [0.02, 0.05, 0.1, 0.25])
def test_a_score_is_that_of_the_nearest_wall_in_its_cell(resolution: float) -> None:
    cells = np.full((round(6.0 / resolution), round(8.0 / resolution)), FREE, dtype=np.int8)
    cells[0, 0] = OCCUPIED
    floor = FloorMap(cells, resolution, np.zeros(3))
    scored = scored_floor(floor)
    assert scored.cell == pytest.approx(scored.per_cell * resolution)
    assert scored.cell == pytest.approx(max(0.1, resolution), rel=0.3)
    assert scored.scores[0, 0] >= FULL_SCORE * 0.25 / (0.25 + resolution**2) - 1.0
    # Corner of a cell that is nearest to the wall; its distance is that of cells' centers.
    away = np.hypot(10 * scored.per_cell, 20 * scored.per_cell) * resolution
    assert scored.scores[10, 20] == pytest.approx(FULL_SCORE * 0.25 / (0.25 + away**2), abs=3.0)
    rows, columns = scored.places.T
    assert (np.hypot(rows * scored.cell, columns * scored.cell) > 0.15).all()
    assert np.diff(np.unique(rows)).max() * scored.cell == pytest.approx(0.4, rel=0.3)


def test_of_two_maps_each_has_its_own_scores() -> None:
    first, second = room(), room(11.0, 8.0)
    assert scored_floor(first) is scored_floor(first)
    assert scored_floor(first).scores.shape != scored_floor(second).scores.shape


def test_points_that_are_near_are_left_out_and_what_stays_is_spread_evenly() -> None:
    near = np.column_stack((np.linspace(0.0, 1.0, 101), np.zeros(101)))
    few = thinned(near, 0.095, 60)
    assert few[:, 0] == pytest.approx(np.linspace(0.0, 1.0, 11))
    assert len(thinned(near, 0.0, 25)) == 25
    assert np.diff(thinned(near, 0.0, 25)[:, 0]).max() < 0.06
    assert len(thinned(np.empty((0, 2)), 0.1, 5)) == 0


def test_the_best_heading_of_each_place_is_that_of_all_of_them() -> None:
    floor = room()
    scored = scored_floor(floor)
    points = read_only(thinned(cells_of(floor, np.array((4.0, 3.6, 0.4))) / scored.per_cell, 1.5, 60))
    turns = 24
    best, headings = np.empty(len(scored.places), dtype=np.int64), np.empty(len(scored.places))
    promising(points, scored, turns, best, headings)
    table = np.pad(scored.scores.astype(np.int64), 400)
    for place in range(0, len(scored.places), 17):
        sums = []
        for angle in np.arange(turns) * 2.0 * np.pi / turns:
            turned = points @ np.array(((np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle)))).T
            column, row = np.floor(turned + 0.5).astype(int).T
            sums.append(table[row + scored.places[place, 0] + 400, column + scored.places[place, 1] + 400].sum())
        assert best[place] == max(sums)
        assert sums[round(headings[place] * turns / (2.0 * np.pi))] == max(sums)


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (5.7e3, -120.0, 2.2)])
def test_where_a_scan_was_seen_comes_first(origin: tuple[float, float, float]) -> None:
    floor = room(14.0, 10.0, origin=origin)
    for truth in free_poses(floor, 12, np.random.default_rng(3)):
        best = searched(floor, cells_of(floor, truth))[0]
        assert np.hypot(*(best - truth)[:2]) < 0.05
        assert abs(wrap(best[2] - truth[2])) < 0.02


@pytest.mark.parametrize("seed", range(4))
def test_nowhere_else_in_the_whole_hall_a_scan_lies_better_than_where_it_is_found(seed: int) -> None:
    """Every pose on a lattice of 0.2 m and 4 degrees; the best of them, and what is found, moved on by random steps."""
    floor, rng = room(), np.random.default_rng(seed)
    free = np.argwhere(floor.occupancy().distance_field() > 0.2)[:, ::-1]
    at = np.unique(free // 4, axis=0) * 0.2 + 0.1
    headings = np.arange(0.0, 2.0 * np.pi, np.radians(4.0))
    lattice = np.column_stack((np.repeat(at, len(headings), axis=0), np.tile(headings, len(at))))
    truth = free_poses(floor, 1, rng)[0]
    # Half a view: some of it fits elsewhere, too.
    ranges, bearings = scan_from(floor, truth, beams=90)
    points = points_of(ranges[22:68], bearings[22:68])
    found = searched(floor, points / floor.resolution)
    best = found[0]
    rivals = lattice[np.argsort(-plain_scores(floor, points, lattice))[:100]]
    # A beam ends at the face of a cell, and this knows their middles alone.
    near = np.concatenate((best[np.newaxis], rivals))[:, np.newaxis] + rng.normal(0.0, (0.06, 0.06, 0.02), (100, 3))
    narrow = plain_scores(floor, points, near.reshape(-1, 3), 0.1).reshape(-1, 100).max(axis=1)
    is_elsewhere = np.hypot(*(rivals - best)[:, :2].T) + np.abs(wrap(rivals[:, 2] - best[2])) > 0.6
    assert narrow[0] >= narrow[1:][is_elsewhere].max(initial=0.0)
    # One of the four looks at a wall that is as long elsewhere.
    assert (np.hypot(*(found - truth)[:, :2].T) < 0.1).any()


def test_places_that_look_alike_are_all_found() -> None:
    """A rectangle is the same one turned by half a turn."""
    cells = room(12.0, 8.0).cells.copy()
    cells[10:-10, 10:-10] = FREE
    floor = FloorMap(cells, 0.05, np.zeros(3))
    truth = np.array((4.0, 3.0, 0.7))
    found = searched(floor, cells_of(floor, truth))
    middle = np.array(cells.shape[::-1]) * 0.05 / 2.0
    turned = np.array((*(2.0 * middle - truth[:2]), truth[2] + np.pi))
    for place in (truth, turned):
        off = np.hypot(*(found[:2, :2] - place[:2]).T) + np.abs(wrap(found[:2, 2] - place[2]))
        assert off.min() < 0.06


def test_a_map_without_a_wall_or_without_room_has_no_place() -> None:
    for state in (FREE, OCCUPIED):
        floor = FloorMap(np.full((40, 60), state, dtype=np.int8), 0.05, np.zeros(3))
        scored = scored_floor(floor)
        assert len(scored.places) == 0 or not scored.scores.any()
    full = FloorMap(np.full((40, 60), OCCUPIED, dtype=np.int8), 0.05, np.zeros(3))
    points = cells_of(room(), np.array((4.0, 3.6, 0.4)))
    scan = ScanPoints(points, 1.0, 0.0, 0.0)
    assert places_of(scan, contour_tables(full), scored_floor(full), RULE).shape == (0, 4)
