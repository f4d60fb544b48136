"""People who walk from one random point of the free floor to the next, seen by a low scanner as pairs of legs.

They step aside for the vehicle and keep away from walls; they do not see each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.se2 import inverse
from commission.simulation.people_kernels import STRIDE, People, Walkable, arrived, can_walk, legs_of, walk_on
from commission.site.floor_map import FREE
from commission.site.project import Project

CLEARANCE = 0.35
"""Distance of a person's middle from walls and reflectors [m]."""
SPEED_SPREAD = 0.25
"""1-sigma of a person's walking speed, as a share of the mean."""
LONGEST_WALK = 8.0
"""Farthest next point [m]."""
TRIES = 30
"""Random points tried before a person stays for now."""
MARGIN = 2.0
"""Width of the floor around reflectors and routes on which people walk where there is no floor map [m]."""
STANDING = 1e-9
"""Way below which a person has not turned to where it goes [m]."""
FIELD_CELL = 0.1
"""Cell of that floor [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class WalkableFloor:
    """Where a person's middle can be."""

    grid: OccupancyGrid
    """Geometry of the cells."""
    walkable: BoolArray
    """(H, W) cells far enough from everything."""
    cells: NDArray[np.int64]
    """(n, 2) row and column of each walkable cell."""

    @staticmethod
    def of(project: Project) -> WalkableFloor:
        """Free cells of the floor map that keep `CLEARANCE` from walls and reflectors; or the field around the site."""
        if project.floor_map is None:
            grid = _field(project)
            walkable = np.ones(grid.occupied.shape, np.bool_)
        else:
            grid = project.floor_map.occupancy()
            walkable = (project.floor_map.cells == FREE) & (grid.distance_field() >= CLEARANCE)
        _keep_from(project.reflectors.centers, grid, walkable)
        return WalkableFloor(grid, walkable, np.argwhere(walkable))

    def allows(self, points: FloatArray) -> BoolArray:
        """Whether a person can be at points (N, 2) [m], map frame."""
        cells = self.grid.cells_at(points)
        inside = np.all((cells >= 0) & (cells < self.walkable.shape), axis=-1)
        rows, columns = np.where(inside[:, np.newaxis], cells, 0).T
        return inside & self.walkable[rows, columns]

    def plain(self) -> Walkable:
        """Return the same as plain arrays and numbers, for kernels."""
        to_grid = inverse(self.grid.origin)
        turned = np.array([to_grid[0], to_grid[1], np.cos(to_grid[2]), np.sin(to_grid[2])])
        return Walkable(self.walkable, self.grid.resolution, turned)

    def draw(self, rng: np.random.Generator) -> FloatArray:
        """Draw a point (2,) on the floor [m]; the middle of a cell."""
        return self.grid.cell_centers(self.cells[rng.integers(len(self.cells))])


class Crowd:
    """All people of a drive; the one mutable part of the simulation, moved on from scan to scan."""

    def __init__(self, floor: WalkableFloor, people: int, mean_speed: float, rng: np.random.Generator) -> None:
        if not len(floor.cells):
            people = 0
        self._floor, self._walkable = floor, floor.plain()
        self._rng = rng
        self._mean_speed = mean_speed
        positions = np.array([floor.draw(rng) for _ in range(people)]).reshape(-1, 2)
        self._people = People(
            positions=positions,
            targets=positions.copy(),
            speeds=np.zeros(people),
            headings=rng.uniform(-math.pi, math.pi, people),
            walked=rng.uniform(0.0, 2.0 * STRIDE, people),
        )
        self._moves = np.zeros((people, 2))

    @property
    def positions(self) -> FloatArray:
        """(P, 2) middle of each person [m], map frame."""
        return self._people.positions.copy()

    def legs(self) -> FloatArray:
        """(2 P, 3) x, y and radius of every leg [m], map frame."""
        return legs_of(self._people)

    def step(self, seconds: float, vehicle: FloatArray) -> None:
        """Move everybody on by a time [s]; people near the vehicle's pose (3,) step aside."""
        if not len(self._moves):
            return
        for person in arrived(self._people).tolist():
            self._choose_target(person)
        aside = 1.5 * self._mean_speed * seconds
        x, y = float(vehicle[0]), float(vehicle[1])
        walk_on(self._walkable, self._people, seconds, x, y, aside, self._moves)
        moves = self._moves
        turning = np.hypot(moves[:, 0], moves[:, 1]) > STANDING
        np.copyto(self._people.headings, np.arctan2(moves[:, 1], moves[:, 0]), where=turning)

    def _choose_target(self, person: int) -> None:
        """Give one person a new point that it can walk to straight, or leave it where it is."""
        here = self._people.positions[person]
        for _ in range(TRIES):
            target = self._floor.draw(self._rng)
            distance = math.dist(here, target)
            if distance <= LONGEST_WALK and self._can_walk(here, target, distance):
                self._people.targets[person] = target
                break
        self._people.speeds[person] = self._mean_speed * max(0.2, 1.0 + SPEED_SPREAD * self._rng.standard_normal())

    def _can_walk(self, start: FloatArray, end: FloatArray, distance: float) -> bool:
        """Whether a person can walk straight from one point (2,) to another, a distance [m] away."""
        count = max(2, math.ceil(distance / (0.5 * self._floor.grid.resolution)) + 1)
        (x, y), (end_x, end_y) = start.tolist(), end.tolist()
        return can_walk(self._walkable, x, y, end_x, end_y, count)


def _keep_from(points: FloatArray, grid: OccupancyGrid, walkable: BoolArray) -> None:
    """Clear the cells around points (N, 2) [m], map frame."""
    reach = math.ceil(CLEARANCE / grid.resolution)
    offsets = np.argwhere(np.ones((2 * reach + 1, 2 * reach + 1), np.bool_)) - reach
    offsets = offsets[np.hypot(offsets[:, 0], offsets[:, 1]) * grid.resolution <= CLEARANCE]
    for cell in grid.cells_at(points):
        cells = cell + offsets
        cells = cells[np.all((cells >= 0) & (cells < walkable.shape), axis=1)]
        walkable[cells[:, 0], cells[:, 1]] = False


def _field(project: Project) -> OccupancyGrid:
    """Empty grid around all reflectors and routes."""
    points = [project.reflectors.centers, *(s.control_points for route in project.routes for s in route.segments)]
    corners = np.concatenate(points) if points else np.zeros((1, 2))
    corners = corners if len(corners) else np.zeros((1, 2))
    low, high = corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN
    columns, rows = np.ceil((high - low) / FIELD_CELL).astype(int)
    return OccupancyGrid(np.zeros((rows, columns), np.bool_), FIELD_CELL, np.array([low[0], low[1], 0.0]))


def warm_up() -> None:
    """Compile the kernels of walking: three people around the place of an empty project."""
    crowd = Crowd(WalkableFloor.of(Project()), 3, 1.0, np.random.default_rng(0))
    crowd.step(0.04, np.zeros(3))
    crowd.legs()
