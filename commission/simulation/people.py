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
from commission.site.floor_map import FREE
from commission.site.project import Project

LEG_RADIUS = 0.07
"""Radius of a leg at the height of a safety scanner, with its trouser [m]."""
HIP_WIDTH = 0.18
"""Distance between the two legs of a person, across [m]."""
STRIDE = 0.7
"""Length of a step [m]; the legs swing by up to half of it, fore and aft."""
CLEARANCE = 0.35
"""Distance of a person's middle from walls and reflectors [m]."""
KEEP_FROM_VEHICLE = 1.0
"""Distance from base at which a person steps aside [m]."""
SPEED_SPREAD = 0.25
"""1-sigma of a person's walking speed, as a share of the mean."""
LONGEST_WALK = 8.0
"""Farthest next point [m]."""
TRIES = 30
"""Random points tried before a person stays for now."""
MARGIN = 2.0
"""Width of the floor around reflectors and routes on which people walk where there is no floor map [m]."""
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

    def allows_straight(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether a person can walk straight from one point (2,) to another."""
        count = max(2, math.ceil(math.dist(start, end) / (0.5 * self.grid.resolution)) + 1)
        return bool(self.allows(start + (end - start) * np.linspace(0.0, 1.0, count)[:, np.newaxis]).all())

    def draw(self, rng: np.random.Generator) -> FloatArray:
        """Draw a point (2,) on the floor [m]; the middle of a cell."""
        return self.grid.cell_centers(self.cells[rng.integers(len(self.cells))])


class Crowd:
    """All people of a drive; the one mutable part of the simulation, moved on from scan to scan."""

    def __init__(self, floor: WalkableFloor, people: int, mean_speed: float, rng: np.random.Generator) -> None:
        if not len(floor.cells):
            people = 0
        self._floor = floor
        self._rng = rng
        self._mean_speed = mean_speed
        self._positions = np.array([floor.draw(rng) for _ in range(people)]).reshape(-1, 2)
        self._targets = self._positions.copy()
        self._speeds = np.zeros(people)
        self._headings = rng.uniform(-math.pi, math.pi, people)
        self._walked = rng.uniform(0.0, 2.0 * STRIDE, people)

    @property
    def positions(self) -> FloatArray:
        """(P, 2) middle of each person [m], map frame."""
        return self._positions.copy()

    def legs(self) -> FloatArray:
        """(2 P, 3) x, y and radius of every leg [m], map frame."""
        ahead = np.stack([np.cos(self._headings), np.sin(self._headings)], axis=1)
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
        swing = 0.5 * STRIDE * np.sin(math.pi * self._walked / STRIDE)[:, np.newaxis]
        offset = 0.5 * HIP_WIDTH * left + 0.5 * swing * ahead
        centers = np.concatenate([self._positions + offset, self._positions - offset])
        return np.concatenate([centers, np.full((len(centers), 1), LEG_RADIUS)], axis=1)

    def step(self, seconds: float, vehicle: FloatArray) -> None:
        """Move everybody on by a time [s]; people near the vehicle's pose (3,) step aside."""
        if not len(self._positions):
            return
        to_target = self._targets - self._positions
        left = np.hypot(to_target[:, 0], to_target[:, 1])
        for person in np.flatnonzero(left < 1e-6):
            self._choose_target(int(person))
        to_target = self._targets - self._positions
        left = np.hypot(to_target[:, 0], to_target[:, 1])
        moves = to_target * np.minimum(1.0, self._speeds * seconds / np.maximum(left, 1e-9))[:, np.newaxis]
        from_vehicle = self._positions - vehicle[:2]
        distance = np.hypot(from_vehicle[:, 0], from_vehicle[:, 1])
        for person in np.flatnonzero(distance < KEEP_FROM_VEHICLE):
            moves[person] = self._step_aside(int(person), from_vehicle[person], seconds)
        walked = np.hypot(moves[:, 0], moves[:, 1])
        turning = walked > 1e-9
        self._headings[turning] = np.arctan2(moves[turning, 1], moves[turning, 0])
        self._walked += walked
        self._positions += moves

    def _choose_target(self, person: int) -> None:
        """Give one person a new point that it can walk to straight, or leave it where it is."""
        here = self._positions[person]
        for _ in range(TRIES):
            target = self._floor.draw(self._rng)
            if math.dist(here, target) <= LONGEST_WALK and self._floor.allows_straight(here, target):
                self._targets[person] = target
                break
        self._speeds[person] = self._mean_speed * max(0.2, 1.0 + SPEED_SPREAD * self._rng.standard_normal())

    def _step_aside(self, person: int, away: FloatArray, seconds: float) -> FloatArray:
        """Motion (2,) away from the vehicle, or along a wall, or none where there is no room."""
        self._targets[person] = self._positions[person]
        heading = math.atan2(away[1], away[0])
        step = 1.5 * self._mean_speed * seconds
        for turn in (0.0, 0.5, -0.5, 1.0, -1.0, 1.4, -1.4):
            move = step * np.array([math.cos(heading + turn), math.sin(heading + turn)])
            if self._floor.allows((self._positions[person] + move)[np.newaxis])[0]:
                self._targets[person] = self._positions[person] + move
                return move
        return np.zeros(2)


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
