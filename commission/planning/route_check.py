"""What a route demands of its vehicle: room around the outline, curvature, corners. Numbers along the way, no judgment.

Walls are asked through a field of distances that is made once per floor map; outside of the map there is room.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from commission.compiled import compiled
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, frozen
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.spline_kernels import evaluate_many
from commission.geometry.splines import Spline
from commission.site.floor_map import FloorMap
from commission.site.routes import Direction, Route
from commission.site.vehicle import TricycleVehicle, Vehicle

STEP = 0.05
"""Distance between the poses that are looked at [m]."""
OUTLINE_STEP = 0.05
"""Distance between the points of the outline that are looked at [m]: a cell of a usual map."""
MOST_ROOM = 1.0
"""Room beyond which nobody asks how much it is [m]."""
_MOST_SAMPLES = 200_000


@dataclass(frozen=True, slots=True, eq=False)
class FloorDistances:
    """A floor map prepared for questions about room; making it takes about a second for 200 x 100 m."""

    floor_map: FloorMap
    """The map."""
    grid: OccupancyGrid = field(init=False, repr=False)
    """Its occupied cells."""
    distances: NDArray[np.float32] = field(init=False, repr=False)
    """(H, W) distance from each cell's center to that of the nearest occupied cell [m]."""

    def __post_init__(self) -> None:
        grid = self.floor_map.occupancy()
        distances = grid.distance_field().astype(np.float32)
        distances.setflags(write=False)
        object.__setattr__(self, "grid", grid)
        object.__setattr__(self, "distances", distances)


class Way(NamedTuple):
    """Poses of a vehicle along a route, one segment after the other."""

    poses: FloatArray
    """(N, 3) `T_map_base` [m, m, rad]; in reverse the vehicle looks back."""
    curvatures: FloatArray
    """(N,) curvature of the way [1/m]."""
    segments: NDArray[np.int64]
    """(N,) index of the segment."""
    corners: FloatArray
    """(N - 1,) change of the vehicle's heading from one pose to the next that no curvature explains [rad]."""


def way_of(route: Route, step: float = STEP) -> Way:
    """Poses along a route.

    Parameters
    ----------
    route : the route.
    step : largest distance between poses [m]; a route of more than 200,000 poses is sampled more coarsely.
    """
    splines = [segment.spline() for segment in route.segments]
    step = max(step, sum(spline.length for spline in splines) / _MOST_SAMPLES)
    parts = [_rows(spline, step) for spline in splines]
    rows = np.concatenate(parts)
    segments = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    speed = np.hypot(rows[:, 2], rows[:, 3])
    safe = np.where(speed > 0.0, speed, np.inf)
    headings = np.arctan2(rows[:, 3], rows[:, 2])
    is_reverse = np.array([segment.direction is Direction.REVERSE for segment in route.segments])[segments]
    headings = wrap(headings + np.where(is_reverse, math.pi, 0.0))
    curvatures = (rows[:, 2] * rows[:, 5] - rows[:, 3] * rows[:, 4]) / safe / safe / safe
    hops = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    turns = wrap(np.diff(headings))
    # A pose without a tangent (coinciding control points) says nothing about corners.
    known = (speed[1:] > 0.0) & (speed[:-1] > 0.0)
    explained = hops * np.maximum(np.abs(curvatures[1:]), np.abs(curvatures[:-1]))
    corners = np.where(known & (np.abs(turns) > 1.5 * explained + 1e-6), turns, 0.0)
    return Way(np.column_stack((rows[:, :2], headings)), curvatures, segments, corners)


def room_along(way: Way, outline: ArrayLike, floor: FloorDistances, enough: float = MOST_ROOM) -> FloatArray:
    """Room between a vehicle's outline and the walls along a way.

    Parameters
    ----------
    way : poses of the vehicle.
    outline : (K, 2) corners [m], base frame.
    floor : the walls.
    enough : room beyond which it does not matter how much it is [m]; less is faster.

    Returns
    -------
    room : (N,) array [m], at most `enough` and good to a cell; 0 or less where the outline cuts an occupied cell.
    """
    points = outline_points(outline)
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.hypot(*(points - center).T).max())
    grid = floor.grid
    frame = frozen([*grid.origin, grid.resolution], (4,), "frame")
    return _room(floor.distances, frame, way.poses, np.vstack((center, points)), (radius, float(enough)))


def outline_points(outline: ArrayLike, step: float = OUTLINE_STEP) -> FloatArray:
    """Points on the edges of a polygon (K, 2) [m], at most `step` [m] apart: (P, 2) array."""
    corners = np.asarray(outline, dtype=np.float64)
    edges = np.roll(corners, -1, axis=0) - corners
    counts = np.clip(np.ceil(np.hypot(*edges.T) / step), 1, 10_000).astype(np.int64)
    return np.concatenate(
        [
            corner + np.arange(count)[:, np.newaxis] / count * edge
            for corner, edge, count in zip(corners, edges, counts, strict=True)
        ]
    )


def smallest_radius(vehicle: Vehicle) -> float:
    """Radius of the tightest curve that the base of a vehicle can drive [m]; 0 where it can turn on the spot."""
    if not isinstance(vehicle, TricycleVehicle):
        return 0.0
    return (
        abs(vehicle.wheelbase)
        * max(0.0, math.cos(math.radians(vehicle.max_steering_deg)))
        / math.sin(math.radians(vehicle.max_steering_deg))
    )


def _rows(spline: Spline, step: float) -> FloatArray:
    """Rows of `evaluate_many` along a curve: each piece of its length table in equal steps of the parameter."""
    lengths = np.diff(spline.break_lengths)
    counts = np.maximum(1, np.ceil(lengths / step)).astype(np.int64)
    starts = np.repeat(spline.breaks[:-1], counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    parameters = starts + within / np.repeat(counts, counts) * np.repeat(np.diff(spline.breaks), counts)
    return evaluate_many(spline.knots, spline.controls, spline.degree, np.append(parameters, spline.breaks[-1]))


@compiled
def _room(
    distances: NDArray[np.float32],
    frame: FloatArray,
    poses: FloatArray,
    points: FloatArray,
    limits: tuple[float, float],
) -> FloatArray:
    """Room of each pose; points[0] is the center of the circle around the outline, which is asked first.

    `limits` are that circle's radius and the room that is enough [m].
    """
    radius, enough = limits
    rows, columns = distances.shape
    cell = frame[3]
    c, s = math.cos(frame[2]), math.sin(frame[2])
    room = np.empty(len(poses))
    for n in range(len(poses)):
        dx, dy = poses[n, 0] - frame[0], poses[n, 1] - frame[1]
        x, y = c * dx + s * dy, c * dy - s * dx
        turn = poses[n, 2] - frame[2]
        ct, st = math.cos(turn), math.sin(turn)
        least = enough + 0.5 * cell
        k = 0
        while k < len(points):
            px = x + ct * points[k, 0] - st * points[k, 1]
            py = y + st * points[k, 0] + ct * points[k, 1]
            row, column = math.floor(py / cell), math.floor(px / cell)
            here = least
            if 0 <= row < rows and 0 <= column < columns:
                here = float(distances[row, column])
                # Centers of cells are what the field knows: half a cell is the wall's own.
                if k == 0 and here - radius - 0.5 * cell > enough + cell:
                    break
            if k > 0 or here <= 0.0:
                least = min(least, here)
            # The next points of the outline are near: none of them can be nearer to a wall than this one by more.
            k += 1 + (max(0, int((here - least - 2.0 * cell) / OUTLINE_STEP)) if k > 0 else 0)
        room[n] = least - 0.5 * cell
    return room


def warm_up() -> None:
    """Compile the kernel of this module."""
    floor = FloorDistances(FloorMap(np.zeros((2, 2), np.int8), 1.0))
    way = Way(np.zeros((1, 3)), np.zeros(1), np.zeros(1, np.int64), np.zeros(0))
    room_along(way, [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], floor)
