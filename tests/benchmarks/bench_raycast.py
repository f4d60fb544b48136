"""Rays per second of the ray caster and of cell-by-cell traversal, on a plant of 200 x 100 m with cells of 0.05 m.

Run from the checkout: `python -m tests.benchmarks.bench_raycast`. Exits 1 when a ray differs or the ratio is below 3.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster

ROWS, COLUMNS, RESOLUTION = 2000, 4000, 0.05
RAYS = 400_000
MAX_RANGE = 250.0
REQUIRED_RATIO = 3.0
Floats = NDArray[np.float64]


@compiled
def traverse(occupied: NDArray[np.bool_], rays: Floats, resolution: float, max_range: float) -> Floats:
    """Cell by cell (Amanatides, Woo 1987): the peer, as fast as it can be written; starts inside the grid."""
    ranges = np.full(len(rays), np.inf)
    rows, columns = occupied.shape
    for i in range(len(rays)):
        x, y = rays[i, 0] / resolution, rays[i, 1] / resolution
        dx, dy = math.cos(rays[i, 2]), math.sin(rays[i, 2])
        row, column = math.floor(y), math.floor(x)
        step_x, step_y = 1 if dx > 0.0 else -1, 1 if dy > 0.0 else -1
        per_x, per_y = 1.0 / dx, 1.0 / dy
        border_x, border_y = column + (dx > 0.0) - x, row + (dy > 0.0) - y
        time_x, time_y = border_x * per_x, border_y * per_y
        t, limit = 0.0, max_range / resolution
        while t <= limit and 0 <= row < rows and 0 <= column < columns:
            if occupied[row, column]:
                ranges[i] = t * resolution
                break
            # Borders are counted and multiplied: accumulated times drift, and then other cells are visited.
            if time_x < time_y:
                t = time_x
                column += step_x
                border_x += step_x
                time_x = border_x * per_x
            else:
                t = time_y
                row += step_y
                border_y += step_y
                time_y = border_y * per_y
    return ranges


def plant(rng: np.random.Generator) -> NDArray[np.bool_]:
    """Outer walls, 250 machines and racks of 0.5 to 8 m, 400 columns and posts of 0.1 to 0.4 m."""
    occupied = np.zeros((ROWS, COLUMNS), dtype=np.bool_)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    for count, smallest, largest in ((250, 10, 160), (400, 2, 8)):
        for _ in range(count):
            height, width = rng.integers(smallest, largest, 2)
            row, column = rng.integers(0, ROWS - height), rng.integers(0, COLUMNS - width)
            occupied[row : row + height, column : column + width] = True
    return occupied


def free_poses(grid: OccupancyGrid, rng: np.random.Generator, count: int) -> Floats:
    """Uniform poses in free cells: (count, 3) array."""
    width, height = grid.size
    poses = rng.uniform([0.0, 0.0, -math.pi], [width, height, math.pi], (3 * count, 3))
    return poses[~grid.is_occupied(poses[:, :2])][:count]


def drive(grid: OccupancyGrid, rng: np.random.Generator, count: int) -> Floats:
    """Fans of 1,000 beams over 270 degrees from free poses: (count, 3) array."""
    poses = free_poses(grid, rng, count // 1000)
    rays = np.repeat(poses, 1000, axis=0)
    rays[:, 2] += np.tile(np.linspace(-0.75 * math.pi, 0.75 * math.pi, 1000), len(poses))
    return rays


def best_of(times: int, job: Callable[[], Floats]) -> tuple[float, Floats]:
    """Shortest duration [s] of several runs, and the result."""
    job()
    shortest = math.inf
    for _ in range(times):
        start = time.perf_counter()
        result = job()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest, result


def main() -> int:
    """Print one line per kind of rays and return the exit code."""
    rng = np.random.default_rng(7)
    grid = OccupancyGrid(plant(rng), RESOLUTION)
    RayCaster(OccupancyGrid(np.ones((8, 8), dtype=np.bool_), 1.0))
    start = time.perf_counter()
    caster = RayCaster(grid)
    duration, megabytes = time.perf_counter() - start, caster.tables.rectangles.nbytes / 1e6
    print(f"tables for {COLUMNS} x {ROWS} cells: {duration:.2f} s, {megabytes:.0f} MB")
    passed = True
    for name, rays in (("random poses", free_poses(grid, rng, RAYS)), ("scans", drive(grid, rng, RAYS))):
        peer_time, expected = best_of(2, lambda rays=rays: traverse(grid.occupied, rays, RESOLUTION, MAX_RANGE))
        own_time, ranges = best_of(3, lambda rays=rays: caster.cast(rays, MAX_RANGE))
        both_time, _ = best_of(3, lambda rays=rays: caster.cast_parallel(rays, MAX_RANGE))
        # The peer rounds differently: it divides by the resolution, and counts borders from the start.
        different = int((np.abs(ranges - expected) > 1e-9).sum())
        ratio = peer_time / own_time
        print(
            f"{name:>12}: mean range {ranges.mean():5.1f} m, cell by cell {len(rays) / peer_time / 1e6:5.2f} Mrays/s, "
            f"project {len(rays) / own_time / 1e6:5.2f} (all cores {len(rays) / both_time / 1e6:5.2f}), "
            f"ratio {ratio:4.1f}, different {different}"
        )
        passed = passed and different == 0 and ratio >= REQUIRED_RATIO
    print("passed" if passed else f"FAILED: expected no difference and a ratio of at least {REQUIRED_RATIO:g}")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
