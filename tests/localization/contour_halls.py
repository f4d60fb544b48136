"""Halls and scans for the tests of contours: rays are cast by the ray caster, which knows nothing of distances."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np

from commission.geometry import se2
from commission.geometry.raycast import RayCaster
from commission.localization.contour_match import GridPose
from commission.site.floor_map import FREE, OCCUPIED, FloorMap


def room(width: float = 9.0, height: float = 7.0, *, resolution: float = 0.05, origin=(0.0, 0.0, 0.0)) -> FloorMap:
    """A room with a niche and a pillar, walls two cells thick: no two of its corners look alike."""
    rows, columns = round(height / resolution), round(width / resolution)
    cells = np.full((rows + 20, columns + 20), FREE, dtype=np.int8)
    cells[8:10, 8:-8] = cells[-10:-8, 8:-8] = OCCUPIED
    cells[8:-8, 8:10] = cells[8:-8, -10:-8] = OCCUPIED
    cells[10:40, 10:30] = OCCUPIED
    cells[-60:-50, -80:-70] = OCCUPIED
    return FloorMap(cells, resolution, np.array(origin))


def divided_room(width: float = 20.0, height: float = 14.0) -> FloorMap:
    """A room that walls without a pattern divide, with doors of 1.5 m."""
    whole = room(width, height)
    cells = whole.cells.copy()
    rows, columns = cells.shape
    cells[10 : rows - 120, 150:152] = OCCUPIED
    cells[60:90, 150:152] = FREE
    cells[rows - 110 : rows - 108, 40 : columns - 130] = OCCUPIED
    cells[rows - 110 : rows - 108, 180:210] = FREE
    cells[80 : rows - 40, columns - 125 : columns - 123] = OCCUPIED
    cells[80:82, columns - 125 : columns - 70] = OCCUPIED
    cells[150:170, columns - 60 : columns - 10] = OCCUPIED
    return FloorMap(cells, whole.resolution, whole.origin)


def corridor(length: float = 60.0, width: float = 2.0, *, resolution: float = 0.05, yaw: float = 0.0) -> FloorMap:
    """Two long walls and no end within reach of a scanner."""
    rows, columns = round(width / resolution), round(length / resolution)
    cells = np.full((rows + 8, columns), FREE, dtype=np.int8)
    cells[2:4, :] = cells[-4:-2, :] = OCCUPIED
    return FloorMap(cells, resolution, np.array((0.0, 0.0, yaw)))


def scan_from(floor: FloorMap, pose, *, beams: int = 1440, longest: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    """Ranges [m], inf where nothing is met, and bearings [rad] of a full turn from a pose of the scanner."""
    bearings = np.linspace(-math.pi, math.pi, beams, endpoint=False)
    x, y, theta = pose
    rays = np.stack((np.full(beams, x), np.full(beams, y), theta + bearings), axis=1)
    return RayCaster(floor.occupancy()).cast(rays, longest), bearings


def points_of(ranges: np.ndarray, bearings: np.ndarray) -> np.ndarray:
    """(n, 2) points that came back [m], frame of the scanner."""
    back = np.isfinite(ranges)
    return ranges[back, np.newaxis] * np.stack((np.cos(bearings[back]), np.sin(bearings[back])), axis=1)


def grid_pose(floor: FloorMap, pose) -> GridPose:
    """Pose in cells of the table."""
    x, y, theta = se2.compose(se2.inverse(floor.origin), pose)
    return GridPose(x / floor.resolution - 0.5, y / floor.resolution - 0.5, theta)


def map_pose(floor: FloorMap, pose: GridPose) -> np.ndarray:
    """(3,) the same in the map [m, m, rad]."""
    x, y = (pose.u + 0.5) * floor.resolution, (pose.v + 0.5) * floor.resolution
    return se2.compose(floor.origin, (x, y, pose.theta))
