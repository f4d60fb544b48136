"""An office as a robot of others drives through it: their coarse map, poor wheels, half a view, people."""

# pyright: basic

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation, gaussian_filter1d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.raycast import RayCaster
from commission.localization.estimate import Belief
from commission.localization.growing_run import GrowingRun
from commission.localization.run_columns import RunColumns
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_unlocated
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import ContourParameters, Parameters
from commission.site.records import Odometry, Record, Scan
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner

LASER = Scanner(field_of_view_deg=(-90.0, 90.0), resolution_deg=1.0, range=(0.1, 30.0), rate=5.0)
"""181 beams, five scans a second, as in the logs of the first years of such robots."""
CELL = 0.1
"""Of the map that they made [m]."""
SPEED, BEAM_SIGMA, TURN = 0.5, 0.02, 0.2
"""Of the robot [m/s]; of a range [m]; angle between two scans where it turns on the spot [rad]."""
SCALE_SIGMA, FORWARD, LATERAL, HEADING, TURNING = 0.03, 0.02, 0.005, 0.02, 0.05
"""Its wheels: scale of way and of turns; along and across [m/√m], heading per way [rad/√m] and per turn [rad/√rad]. The
filter takes the noise of headings for a third and a fifth of that, and knows of no scale."""


@dataclass(frozen=True, eq=False)
class Office:
    """One drive."""

    floor: FloorMap
    records: list[Record]
    poses: np.ndarray
    """(K, 3) where the robot was at each scan."""

    def slipped(self, jump) -> Office:
        """The same drive, but in the middle wheels say a motion [m, m, rad] that the robot has not made."""
        records = list(self.records)
        middle = next(k for k in range(len(records) // 2, len(records)) if isinstance(records[k], Odometry))
        moved = se2.compose(records[middle].displacement, np.array(jump))
        records[middle] = replace(records[middle], displacement=moved)
        return replace(self, records=records)

    def carried(self, first: int, last: int) -> Office:
        """The same drive without what lies between two scans: somebody carries the robot, and no wheel turns."""
        kept = [*range(first), *range(last, len(self.poses))]
        records: list[Record] = []
        for number, k in enumerate(kept):
            odometry, scan = self.records[2 * k : 2 * k + 2]
            still = np.zeros(3) if k == last else odometry.displacement  # type: ignore[union-attr]
            stamp_ns = round(number * 1e9 / LASER.rate)
            records.append(replace(odometry, stamp_ns=stamp_ns, displacement=still))
            records.append(replace(scan, stamp_ns=stamp_ns + 1))
        return replace(self, records=records, poses=self.poses[kept])

    def localized(self, *, told: bool = True) -> RunColumns:
        """By contours alone, with default parameters; not told where it starts, it looks for that."""
        parameters = Parameters(contour=ContourParameters(enabled=True))
        setup = LocalizerSetup(reflectors=ReflectorMap(), scanners=(LASER,), parameters=parameters, floor=self.floor)
        start = Belief(0, self.poses[0], np.diag(np.square((0.1, 0.1, 0.05))))
        run = GrowingRun(setup, start if told else state_unlocated(0, search_map(setup).anywhere))
        for record in self.records:
            run.feed(record)
        run.flush()
        return run.columns()


def way_through(floor: FloorMap, metres: float, rng: np.random.Generator) -> np.ndarray:
    """(N, 2) points 2 cm apart from one random place to the next by the shortest way, half a metre from anything."""
    every = round(0.2 / floor.resolution)
    open_floor = ((floor.cells == FREE) & (floor.occupancy().distance_field() > 0.5))[::every, ::every]
    rows, columns = open_floor.shape
    number = np.arange(rows * columns).reshape(rows, columns)
    edges = []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        begin = np.s_[: rows - down, max(0, -right) : columns - max(0, right)]
        end = np.s_[down:, max(0, right) : columns + min(0, right)]
        both = open_floor[begin] & open_floor[end]
        edges.append((number[begin][both], number[end][both], np.full(both.sum(), math.hypot(down, right))))
    first, last, length = (np.concatenate(each) for each in zip(*edges, strict=True))
    graph = coo_matrix((length, (first, last)), shape=(rows * columns,) * 2).tocsr()
    labels = connected_components(graph, directed=False)[1]
    largest = np.bincount(labels[open_floor.ravel()]).argmax()
    nodes = np.flatnonzero((labels == largest) & open_floor.ravel())
    here, driven, parts = rng.choice(nodes), 0.0, []
    while driven < metres:
        goal = rng.choice(nodes)
        _, before = dijkstra(graph, directed=False, indices=here, return_predecessors=True)
        steps = [goal]
        while steps[-1] != here:
            steps.append(before[steps[-1]])
        row, column = np.divmod(np.array(steps[::-1]), columns)
        parts.append((np.column_stack((column, row)) + 0.5) * every * floor.resolution)
        driven += np.hypot(*np.diff(parts[-1], axis=0).T).sum()
        here = goal
    corners = np.concatenate(parts)
    corners = corners[np.insert(np.hypot(*np.diff(corners, axis=0).T) > 0.0, 0, True)]
    along = np.insert(np.cumsum(np.hypot(*np.diff(corners, axis=0).T)), 0, 0.0)
    at = np.arange(0.0, along[-1], 0.02)
    smooth = [gaussian_filter1d(np.interp(at, along, axis), 15, mode="nearest") for axis in corners.T]
    return se2.transform_points(floor.origin, np.column_stack(smooth))


def poses_along(points: np.ndarray) -> np.ndarray:
    """(K, 3) poses at each scan; on the spot where the way turns by more."""
    ahead = points[:: round(SPEED / LASER.rate / 0.02)]
    headings = np.arctan2(*np.gradient(ahead, axis=0).T[::-1])
    poses = [np.array((*ahead[0], headings[0]))]
    for place, heading in zip(ahead[1:], headings[1:], strict=True):
        turn = wrap(heading - poses[-1][2])
        count = int(abs(turn) // TURN)
        poses += [poses[-1] + (0.0, 0.0, turn / (count + 1)) for _ in range(count)]
        poses.append(np.array((*place, heading)))
    return np.array(poses)


def ranges_from(caster: RayCaster, pose: np.ndarray, bearings: np.ndarray) -> np.ndarray:
    """Ranges [m] of the beams of a scanner at a pose, without noise; inf where nothing is met."""
    rays = np.column_stack((np.full(len(bearings), pose[0]), np.full(len(bearings), pose[1]), pose[2] + bearings))
    return caster.cast(rays, LASER.range[1])


def map_of_others(floor: FloorMap, rng: np.random.Generator) -> FloorMap:
    """The hall as they have mapped it: coarse, a tenth of the walls' cells missing, some of them one cell off."""
    every = round(CELL / floor.resolution)
    rows, columns = (size // every for size in floor.cells.shape)
    blocks = floor.cells[: rows * every, : columns * every].reshape(rows, every, columns, every)
    walls, free = (blocks == OCCUPIED).any(axis=(1, 3)), (blocks == FREE).any(axis=(1, 3))
    cells = np.where(walls, OCCUPIED, np.where(free, FREE, blocks[:, 0, :, 0])).astype(floor.cells.dtype)
    cells[walls & (rng.random(walls.shape) < 0.1)] = FREE
    aside = np.roll(walls, rng.integers(-1, 2), axis=rng.integers(0, 2))
    cells[aside & (rng.random(walls.shape) < 0.15)] = OCCUPIED
    return FloorMap(cells, CELL, floor.origin)


def map_of_scans(floor: FloorMap, poses: np.ndarray, seed: int, *, cell: float = 0.05) -> FloorMap:
    """The hall as scans of a robot have drawn it, its poses good to 3 cm and 0.3 degrees: walls are bands of cells."""
    rng, caster = np.random.default_rng(1000 + seed), RayCaster(floor.occupancy())
    rows, columns = (int(size * floor.resolution / cell) for size in floor.cells.shape)
    met = np.zeros((rows, columns), dtype=np.int64)
    bearings = np.radians(np.arange(-90.0, 90.01, 0.5))
    for pose in poses[::2]:
        ranges = ranges_from(caster, pose, bearings) + BEAM_SIGMA * rng.standard_normal(len(bearings))
        taken_for = pose + np.array((0.03, 0.03, 0.005)) * rng.standard_normal(3)
        back = np.isfinite(ranges)
        along = taken_for[2] + bearings[back]
        ends = taken_for[:2] + ranges[back, None] * np.column_stack((np.cos(along), np.sin(along)))
        at = np.floor(se2.transform_points(se2.inverse(floor.origin), ends) / cell).astype(int)
        at = at[((at >= 0) & (at < (columns, rows))).all(axis=1)]
        np.add.at(met, (at[:, 1], at[:, 0]), 1)
    return FloorMap(np.where(met >= 3, OCCUPIED, FREE).astype(floor.cells.dtype), cell, floor.origin)


def map_with_thick_walls(floor: FloorMap) -> FloorMap:
    """The hall, its walls drawn one cell too thick to all sides."""
    thick = np.where(binary_dilation(floor.cells == OCCUPIED, np.ones((3, 3))), OCCUPIED, floor.cells)
    return FloorMap(thick.astype(floor.cells.dtype), floor.resolution, floor.origin)


def drive(floor: FloorMap, seed: int, metres: float = 60.0) -> Office:
    """Drive through a floor, beams met by people here and there."""
    rng = np.random.default_rng(seed)
    poses = poses_along(way_through(floor, metres, rng))
    others, caster = map_of_others(floor, rng), RayCaster(floor.occupancy())
    bearings = LASER.angle_min + LASER.angle_increment * np.arange(LASER.beam_count)
    scales = 1.0 + SCALE_SIGMA * rng.standard_normal(2)
    records: list[Record] = []
    for number, pose in enumerate(poses):
        stamp_ns = round(number * 1e9 / LASER.rate)
        moved = se2.relative(poses[max(number - 1, 0)], pose)
        way, turn = math.hypot(*moved[:2]), abs(moved[2])
        turned = math.sqrt(HEADING**2 * way + TURNING**2 * turn)
        noise = (FORWARD * math.sqrt(way), LATERAL * math.sqrt(way), turned)
        records.append(Odometry(stamp_ns, moved * scales[[0, 0, 1]] + noise * rng.standard_normal(3)))
        ranges = ranges_from(caster, pose, bearings) + BEAM_SIGMA * rng.standard_normal(len(bearings))
        for first in np.flatnonzero(rng.random(len(ranges)) < 0.012):
            legs = slice(first, first + rng.integers(3, 14))
            ranges[legs] = np.minimum(ranges[legs], rng.uniform(0.6, 4.0))
        records.append(
            Scan(
                stamp_ns=stamp_ns + 1,
                ranges=np.where(np.isfinite(ranges), ranges, np.nan).astype(np.float32),
                angle_min=LASER.angle_min,
                angle_increment=LASER.angle_increment,
                reflector=np.zeros(len(ranges), np.bool_),
            )
        )
    return Office(others, records, poses)
