"""Milliseconds of one match of 1,440 beams, beside scipy's least squares of the same cost from the same start; then
those of a search in the whole room, beside numpy.

Run from the checkout: `python -m tests.benchmarks.bench_contour`. Exits 1 above 0.4 ms, or when both disagree.
"""

# pyright: basic

from __future__ import annotations

import math
import sys
import time

import numpy as np
from scipy.optimize import least_squares

from commission.geometry.arrays import read_only
from commission.localization.contour import lever_of
from commission.localization.contour_match import GridPose, MatchRule, match
from commission.localization.contour_search import (
    BETWEEN_POINTS,
    BETWEEN_TURNS,
    MOST_POINTS,
    ScanPoints,
    places_of,
    promising,
    scored_floor,
    thinned,
)
from commission.localization.contour_tables import contour_tables, distances_at
from commission.localization.wall_depth import AS_DRAWN, learned
from commission.site.floor_map import FloorMap
from tests.localization.contour_halls import grid_pose, map_pose, points_of, room, scan_from

TRUTH = np.array((4.0, 3.6, 0.4))
START = np.add(TRUTH, (0.08, -0.05, 0.03))
LENGTH, LONGEST_MS, RUNS = 0.2, 0.4, 400


def main() -> int:
    """Print milliseconds and the ratio; return the exit code."""
    floor = room(25.0, 20.0)
    tables = contour_tables(floor)
    ranges, bearings = scan_from(floor, TRUTH, longest=40.0)
    points = points_of(ranges + 0.01 * np.random.default_rng(0).standard_normal(len(ranges)), bearings)
    lever = math.sqrt(float(np.mean(np.sum(points**2, axis=1))))

    def residuals(moved: np.ndarray) -> np.ndarray:
        c, s = math.cos(START[2] + moved[2] / lever), math.sin(START[2] + moved[2] / lever)
        placed = points @ np.array(((c, s), (-s, c))) + START[:2] + moved[:2]
        d = np.nan_to_num(distances_at(tables, placed), nan=1e3)
        return d / np.sqrt(LENGTH**2 + d**2)

    slow, theirs = [], np.zeros(3)
    for _ in range(10):
        before = time.perf_counter()
        theirs = least_squares(residuals, np.zeros(3)).x
        slow.append(time.perf_counter() - before)
    peer = START + theirs / (1.0, 1.0, lever)
    print(f"{len(points)} beams; scipy least squares {1e3 * min(slow):.2f} ms")
    failed = False
    cells = points / floor.resolution
    for name, by_rprop in (("Gauss-Newton", False), ("RPROP", True)):
        rule = MatchRule(by_rprop, LENGTH, 50, 1e-4, 0.5, 0.01)
        start = GridPose(*map(float, grid_pose(floor, START)))
        found = match(start, lever / floor.resolution, cells, tables, rule)
        times = []
        for _ in range(RUNS):
            before = time.perf_counter()
            match(start, lever / floor.resolution, cells, tables, rule)
            times.append(time.perf_counter() - before)
        off = map_pose(floor, found.pose) - peer
        best, usual = 1e3 * min(times), 1e3 * float(np.median(times))
        print(
            f"{name}: {best:.3f} ms at best, {usual:.3f} ms usually, {found.iterations} iterations, "
            f"{min(slow) * 1e3 / best:.0f} times as fast; {1e3 * math.hypot(off[0], off[1]):.2f} mm from scipy's pose"
        )
        failed = failed or math.hypot(off[0], off[1]) > 2e-3 or (not by_rprop and best > LONGEST_MS)
    times = []
    for _ in range(RUNS):
        before = time.perf_counter()
        learned(AS_DRAWN, 0.05**2, 1.0, found.pose, lever / floor.resolution, cells, tables, LENGTH)
        times.append(time.perf_counter() - before)
    print(
        f"depth of the walls learned: {1e3 * min(times):.3f} ms at best, {1e3 * float(np.median(times)):.3f} ms usually"
    )
    return int(failed or not searched(floor, cells))


def searched(floor: FloorMap, cells: np.ndarray) -> bool:
    """Print milliseconds of a search in the whole room, and of its scores by numpy; whether both agree."""
    tables, scored, turns = contour_tables(floor), scored_floor(floor), math.ceil(2.0 * math.pi / BETWEEN_TURNS)
    few = read_only(thinned(cells / scored.per_cell, BETWEEN_POINTS / scored.cell, MOST_POINTS))
    scores, headings = np.empty(len(scored.places), dtype=np.int64), np.empty(len(scored.places))
    before = time.perf_counter()
    beside = math.ceil(np.hypot(*few.T).max()) + 1
    padded, best = np.pad(scored.scores, beside).astype(np.int64), np.zeros(len(scored.places), dtype=np.int64)
    for angle in np.arange(turns) * 2.0 * np.pi / turns:
        c, s = math.cos(angle), math.sin(angle)
        column, row = np.floor(few @ np.array(((c, s), (-s, c))) + 0.5).astype(int).T + beside
        at = scored.places[:, 0, np.newaxis] + row, scored.places[:, 1, np.newaxis] + column
        best = np.maximum(best, padded[at].sum(axis=1))
    slow = time.perf_counter() - before
    rule, times, whole = MatchRule(False, LENGTH, 50, 1e-4, 0.5, 0.01), [], []
    scan = ScanPoints(cells, lever_of(cells), 0.0, 0.0)
    for _ in range(RUNS // 20):
        before = time.perf_counter()
        promising(few, scored, turns, scores, headings)
        times.append(time.perf_counter() - before)
        before = time.perf_counter()
        places_of(scan, tables, scored, rule)
        whole.append(time.perf_counter() - before)
    usual, fast = 1e3 * float(np.median(whole)), min(times)
    print(
        f"search among {len(scored.places)} places: {1e3 * min(whole):.0f} ms at best, {usual:.0f} ms usually; "
        f"their scores {1e3 * fast:.1f} ms, numpy {1e3 * slow:.0f} ms: {slow / fast:.0f} times as fast"
    )
    return bool((scores == best).all())


if __name__ == "__main__":
    sys.exit(main())
