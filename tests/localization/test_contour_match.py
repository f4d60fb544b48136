"""Perfect Match against what shares no code with it: finite differences, plain numpy, and scipy's least squares."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.optimize import least_squares

from commission.compiled import compiled
from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.occupancy import OccupancyGrid
from commission.localization.contour_match import (
    Cost,
    GridPose,
    MatchRule,
    Spread,
    best_start,
    cost_of,
    histogram_threshold,
    match,
)
from commission.localization.contour_tables import contour_tables, distances_at, read_distance, signed_distances
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from tests.localization.contour_halls import grid_pose, map_pose, points_of, room, scan_from

RULE = MatchRule(False, 0.2, 50, 1e-4, 0.5, 0.01)
RPROP = RULE._replace(by_rprop=True)
TRUTH = np.array((4.0, 3.6, 0.4))


@compiled
def cost(pose, lever, points, tables, length, threshold, exact) -> Cost:
    return cost_of(pose, lever, points, tables, length, threshold, exact)


@compiled
def threshold_of(pose, points, tables, rule) -> float:
    return histogram_threshold(pose, points, tables, rule)


def seen(floor, pose=TRUTH, *, noise=0.0, seed=0):
    """Points [cells] of a scan."""
    ranges, bearings = scan_from(floor, pose)
    return (
        points_of(ranges + noise * np.random.default_rng(seed).standard_normal(len(ranges)), bearings)
        / floor.resolution
    )


def plain_distance(tables, pose, points):
    """Distances by scipy's own interpolation [m]."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    u = pose[0] + c * points[:, 0] - s * points[:, 1]
    v = pose[1] + s * points[:, 0] + c * points[:, 1]
    return map_coordinates(tables.distances.astype(np.float64), (v, u), order=1)


def plain_cost(tables, pose, points, length):
    """Equation 1 of the paper, word by word."""
    d = plain_distance(tables, pose, points)
    return float(np.sum(1.0 - length**2 / (length**2 + d**2)))


def test_distance_is_zero_where_a_beam_stops_and_negative_inside_a_wall():
    occupied = np.zeros((7, 12), dtype=np.bool_)
    occupied[:, 6:9] = True
    found = signed_distances(OccupancyGrid(occupied, 0.1))[3]
    assert found == pytest.approx([0.55, 0.45, 0.35, 0.25, 0.15, 0.05, -0.05, -0.15, -0.05, 0.05, 0.15, 0.25], abs=1e-6)
    assert read_distance.py_func(signed_distances(OccupancyGrid(occupied, 0.1)), 5.5, 3.0).distance == pytest.approx(
        0.0
    )


def test_a_map_without_walls_is_far_from_any_contour():
    assert signed_distances(OccupancyGrid(np.zeros((3, 3), np.bool_), 0.1)).min() == 1e3
    assert np.isfinite(signed_distances(OccupancyGrid(np.ones((3, 3), np.bool_), 0.1))).all()


def test_beams_of_a_turned_map_end_on_its_contours():
    floor = room(origin=(-3.0, 2.0, 0.3))
    ranges, bearings = scan_from(floor, (1.0, 6.0, 1.0))
    points = np.add(points_of(ranges, bearings + 1.0), (1.0, 6.0))
    # Of straight faces to a tenth of a millimetre; at corners the table is as coarse as its cells.
    distances = np.abs(distances_at(contour_tables(floor), points))
    assert np.quantile(distances, 0.9) < 1e-4
    assert distances.max() < 0.7 * floor.resolution


def test_a_place_outside_of_the_table_has_no_distance():
    assert np.isnan(distances_at(contour_tables(room()), np.array(((-1.0, 2.0), (3.0, 99.0))))).all()


def test_cost_is_that_of_equation_1():
    floor, tables = room(), contour_tables(room())
    points = seen(floor, noise=0.02)
    for off in ((0.0, 0.0, 0.0), (1.3, -2.2, 0.05), (-3.0, 4.0, -0.02)):
        pose = np.array(grid_pose(floor, TRUTH)) + off
        found = cost(GridPose(*pose), 80.0, points, tables, 0.2, math.inf, False)
        assert found.beams == len(points)
        assert found.total == pytest.approx(plain_cost(tables, pose, points, 0.2), rel=1e-9)


@pytest.mark.parametrize("off", [(0.4, -0.7, 0.01), (3.1, 1.2, -0.06), (-5.0, 6.0, 0.1)])
def test_gradient_is_that_of_finite_differences(off):
    floor, tables, lever, step = room(), contour_tables(room()), 80.0, 1e-6
    points = seen(floor, noise=0.02)
    pose = np.array(grid_pose(floor, TRUTH)) + off
    found = cost(GridPose(*pose), lever, points, tables, 0.2, math.inf, False)
    for axis, value in enumerate((found.gx, found.gy, found.gt * lever)):
        moved = np.eye(3)[axis] * step
        difference = plain_cost(tables, pose + moved, points, 0.2) - plain_cost(tables, pose - moved, points, 0.2)
        # Each of the points crosses from cell to cell at some place, where the slope jumps.
        assert value == pytest.approx(difference / (2.0 * step), rel=1e-4, abs=1e-3)


def test_second_derivative_is_that_of_finite_differences_on_the_contours():
    floor, tables, lever = room(), contour_tables(room()), 80.0
    # Away from corners, where the distance itself bends.
    pose = np.array(grid_pose(floor, TRUTH))
    points = seen(floor)
    straight = np.abs(plain_distance(tables, pose, points)) < 1e-5
    for off in np.eye(3) * (0.3, 0.3, 0.002):
        straight &= (
            np.abs(plain_distance(tables, pose + off, points) + plain_distance(tables, pose - off, points)) < 1e-4
        )
    points = points[straight]
    found = cost(GridPose(*pose), lever, points, tables, 0.2, math.inf, True)

    def gradient(at):
        given = cost(GridPose(*at), lever, points, tables, 0.2, math.inf, True)
        return np.array((given.gx, given.gy, given.gt))

    second = np.array(((found.xx, found.xy, found.xt), (found.xy, found.yy, found.yt), (found.xt, found.yt, found.tt)))
    steps = np.diag((0.02, 0.02, 0.02 / lever))
    differences = [(gradient(pose + step) - gradient(pose - step)) / 0.04 for step in steps]
    assert len(points) > 500
    # E'' is that at d = 0; a fiftieth of a cell is a millimetre, of an L of 200.
    assert second == pytest.approx(np.array(differences), rel=2e-3, abs=2e-3 * second.max())


@pytest.mark.parametrize("rule", [RULE, RPROP], ids=["Gauss-Newton", "RPROP"])
def test_match_is_where_scipy_finds_the_least_squares(rule):
    floor, tables, lever = room(), contour_tables(room()), 80.0
    points = seen(floor, noise=0.01, seed=3)
    start = np.add(grid_pose(floor, TRUTH), (2.0, -1.5, 0.03))
    found = match(GridPose(*start), lever, points, tables, rule._replace(smallest_step=1e-6, iterations=300))

    def residuals(moved):
        d = plain_distance(tables, moved / (1.0, 1.0, lever) + (0.0, 0.0, start[2]), points)
        return d[np.abs(d) < 1e9] / np.sqrt(0.2**2 + d**2)

    best = least_squares(residuals, np.array((start[0], start[1], 0.0)), xtol=1e-12, ftol=1e-12).x / (1.0, 1.0, lever)
    mine = map_pose(floor, found.pose)
    theirs = map_pose(floor, GridPose(best[0], best[1], best[2] + start[2]))
    # Theirs keeps the few beams beyond the threshold of the histogram.
    assert np.hypot(*(mine - theirs)[:2]) < 1e-3
    assert abs(wrap(mine[2] - theirs[2])) < 3e-4


@pytest.mark.parametrize("rule", [RULE, RPROP], ids=["Gauss-Newton", "RPROP"])
@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (-3.0, 2.0, 0.3)], ids=["as it is", "moved and turned"])
def test_match_finds_the_truth_in_a_hall_moved_and_turned(rule, origin):
    floor = room(origin=origin)
    tables, truth = contour_tables(floor), map_pose(room(), grid_pose(room(), TRUTH))
    moved = np.array(grid_pose(room(), truth))
    points = seen(room(), truth, noise=0.01)
    found = match(GridPose(*np.add(moved, (3.0, 2.0, -0.05))), 80.0, points, tables, rule)
    assert np.hypot(*((np.array(found.pose) - moved)[:2] * floor.resolution)) < 2e-3
    assert abs(found.pose.theta - moved[2]) < 1e-3


@pytest.mark.parametrize("rule", [RULE, RPROP], ids=["Gauss-Newton", "RPROP"])
@pytest.mark.parametrize("thick", [1, 2, 4])
@pytest.mark.parametrize("yaw", [0.0, 0.5])
def test_the_far_face_of_a_thin_wall_holds_no_match(rule, thick, yaw):
    """Few beams tell the place along a corridor; a start from which they end beyond its end's middle draws them on."""
    cells = np.full((80, 400), FREE, np.uint8)
    cells[8:10] = cells[-10:-8] = OCCUPIED
    cells[:, 300 : 300 + thick] = OCCUPIED
    floor = FloorMap(cells, 0.05, np.array((0.0, 0.0, yaw)))
    truth = se2.compose((0.0, 0.0, yaw), (8.0, 2.1, 0.1))
    points, right = seen(floor, truth, noise=0.005), np.array(grid_pose(floor, truth))
    found = match(GridPose(*np.add(right, (thick + 0.2, 0.0, 0.0))), 80.0, points, contour_tables(floor), rule)
    assert np.hypot(*((np.array(found.pose) - right)[:2] * floor.resolution)) < 5e-3


def test_rprop_ends_when_its_steps_are_small_and_never_after_its_iterations():
    floor, tables = room(), contour_tables(room())
    points, start = seen(floor), grid_pose(floor, np.add(TRUTH, (0.1, 0.1, 0.03)))
    fine, coarse = (match(start, 80.0, points, tables, RPROP._replace(smallest_step=step)) for step in (1e-5, 1e-2))
    assert coarse.iterations < fine.iterations < 2 * RPROP.iterations
    assert match(start, 80.0, points, tables, RPROP._replace(iterations=7, smallest_step=1e-9)).iterations == 14


def test_threshold_lies_in_the_valley_between_contours_and_what_the_map_lacks():
    floor, tables = room(), contour_tables(room())
    ranges, bearings = scan_from(floor, TRUTH)
    ranges = ranges + 0.01 * np.random.default_rng(0).standard_normal(len(ranges))
    ranges[100:500] -= 0.3
    pose = grid_pose(floor, TRUTH)
    threshold = threshold_of(pose, points_of(ranges, bearings) / floor.resolution, tables, RULE)
    assert 0.03 <= threshold < 0.15


def test_beams_on_things_that_the_map_lacks_move_the_match_by_millimetres():
    floor, tables = room(), contour_tables(room())
    ranges, bearings = scan_from(floor, TRUTH)
    ranges = ranges + 0.01 * np.random.default_rng(0).standard_normal(len(ranges))
    for first in range(0, 1440, 240):
        ranges[first : first + 72] *= 0.6
    start = grid_pose(floor, np.add(TRUTH, (0.05, -0.05, 0.02)))
    found = match(start, 80.0, points_of(ranges, bearings) / floor.resolution, tables, RULE)
    assert np.hypot(*(map_pose(floor, found.pose) - TRUTH)[:2]) < 5e-3


def test_a_wide_start_is_searched_and_a_narrow_one_is_left_alone():
    floor, tables = room(), contour_tables(room())
    points = seen(floor, noise=0.01)
    wrong = grid_pose(floor, np.add(TRUTH, (0.35, -0.35, 0.26)))
    narrow = Spread(1.0, 1.0, 0.01)
    assert best_start(wrong, narrow, 80.0, points, tables, RULE) == wrong
    found = best_start(wrong, Spread(7.0, 7.0, 0.18), 80.0, points, tables, RULE)
    assert np.hypot(*(map_pose(floor, found) - TRUTH)[:2]) < 0.05
