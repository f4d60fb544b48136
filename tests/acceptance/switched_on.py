"""Virtual vehicles that are switched on anywhere on a floor, stand for a second and then drive; or are carried away.

People walk about, and three of ten things that are detected are no reflectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from commission.geometry.se2 import compose
from commission.io.map_server import read_floor_map
from commission.io.project_file import load_project
from commission.localization.detection_log import DetectionLog, extract_detections
from commission.localization.detector import INLIER
from commission.localization.setup import LocalizerSetup
from commission.planning.ambiguity import ambiguous_poses
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.simulation.people import Crowd, WalkableFloor
from commission.simulation.scan import VirtualScanner
from commission.site.floor_map import FREE
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, Record, ReferencePose, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner, scan_moments
from commission.site.walls import walls_of

PEOPLE = 50
FALSE = 0.3
"""Share of the detections that are of no reflector."""
STANDS_S = 1.0
CLEARANCE = 0.6
"""Of the vehicle's middle from walls and reflectors [m]."""
STEP_NS = 20_000_000


def site_named(name: str, repository: Path, shared_data: Path) -> Project:
    """A bundled site; or a floor of a university, on whose map twelve reflectors are hung up."""
    if name != "utexas_gdc_3":
        return load_project(repository / "maps" / name)
    floor, rng = read_floor_map(shared_data / "maps" / name / "3.yaml"), np.random.default_rng(12)
    grid = floor.occupancy()
    away = grid.distance_field()
    beside, open_floor = (
        grid.cell_centers(cells[rng.permutation(len(cells))[:500]])
        for cells in (
            np.argwhere((floor.cells == FREE) & (away > 0.1) & (away < 0.2)),
            np.argwhere((floor.cells == FREE) & (away > CLEARANCE)),
        )
    )
    sees = walls_of(floor).line_of_sight(open_floor[:, np.newaxis], beside)
    counts, kept = np.zeros(len(open_floor), dtype=np.int64), list[np.ndarray]()
    for _ in range(12):
        # Where most of the floor gains one of the first five that it sees, well apart from the others.
        apart = np.array([all(math.dist(place, other) > 1.5 for other in kept) for place in beside])
        gains = np.where(apart, (sees & (counts < 5)[:, np.newaxis]).sum(axis=0), -1)
        best = int(np.argmax(gains))
        kept.append(beside[best])
        counts += sees[:, best]
    reflectors = tuple(Reflector(id=f"R{i}", x=float(x), y=float(y)) for i, (x, y) in enumerate(kept))
    around = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=40.0, range=(0.05, 60.0))
    return Project(name=name, floor_map=floor, reflectors=ReflectorMap(reflectors), scanners=(around,))


def places_on(project: Project, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random poses from which two reflectors at least are seen, and whether the map calls each of them ambiguous."""
    rng, floor = np.random.default_rng(seed), project.floor_map
    assert floor is not None
    grid = floor.occupancy()
    free = np.argwhere((floor.cells == FREE) & (grid.distance_field() >= CLEARANCE))
    visible = vehicle_visibility(project)
    poses = np.empty((0, 3))
    while len(poses) < count:
        points = grid.cell_centers(free[rng.integers(len(free), size=count)])
        more = np.column_stack((points, rng.uniform(-math.pi, math.pi, count)))
        more = more[visible.visible_from_poses(more).counts() >= 2]
        poses = np.concatenate((poses, more))[:count]
    return poses, ambiguous_poses(visible, poses).ambiguous


def way_from(project: Project, pose: np.ndarray, seconds: float, rng: np.random.Generator) -> np.ndarray:
    """Poses each 20 ms: the vehicle stands, then creeps on where there is room, and turns where there is none."""
    floor = project.floor_map
    assert floor is not None
    grid, away = floor.occupancy(), floor.occupancy().distance_field()
    way, turn = [pose], rng.uniform(-0.2, 0.2)
    for step in range(round(seconds / 0.02)):
        now = way[-1]
        if step * 0.02 < STANDS_S:
            way.append(now)
            continue
        ahead = compose(now, np.array([0.3, 0.0, 0.0]))
        row, column = grid.cells_at(ahead[:2])
        inside = 0 <= row < away.shape[0] and 0 <= column < away.shape[1]
        free = inside and away[row, column] > 0.35 and floor.cells[row, column] == FREE
        way.append(compose(now, np.array([0.01 if free else 0.0, 0.0, 0.02 * turn if free else 0.02])))
    return np.array(way)


@dataclass(frozen=True, eq=False)
class Seen:
    """A vehicle's records, and what was detected."""

    log: RecordLog
    detected: DetectionLog
    setup: LocalizerSetup


def seen_on(project: Project, way: np.ndarray, seed: int, told: np.ndarray | None = None) -> Seen:
    """Drive a way among people; odometry tells of another one where it is given."""
    rng, floor = np.random.default_rng(seed), WalkableFloor.of(project)
    virtual = [VirtualScanner.of(project, scanner) for scanner in project.scanners]
    crowd = Crowd(floor, PEOPLE, 1.0, rng)
    records: list[Record] = []
    told = way if told is None else told
    for step in range(len(way)):
        before = told[max(step - 1, 0)]
        c, s = math.cos(before[2]), math.sin(before[2])
        dx, dy = told[step, :2] - before[:2]
        moved = np.array([c * dx + s * dy, c * dy - s * dx, told[step, 2] - before[2]])
        wrong = rng.normal(0.0, 0.01, 3) * (abs(moved[0]), 0.0, abs(moved[2]) + 0.02 * abs(moved[0]))
        records.append(Odometry(step * STEP_NS, moved + wrong))
    stamps, scanners = scan_moments(project.scanners, (len(way) - 1) * STEP_NS)
    last = 0
    for stamp, scanner in zip(stamps.tolist(), scanners.tolist(), strict=True):
        pose = way[stamp // STEP_NS]
        crowd.step((stamp - last) * 1e-9, pose)
        last = stamp
        ranges, flags = virtual[scanner].scan(pose, crowd.legs(), rng)
        model = project.scanners[scanner]
        records.append(ReferencePose(stamp, pose))
        records.append(
            Scan(
                stamp_ns=stamp,
                ranges=ranges,
                angle_min=model.angle_min,
                angle_increment=model.angle_increment,
                reflector=flags,
                scanner=scanner,
            )
        )
    log = RecordLog.collect(records, tuple(scanner.name for scanner in project.scanners))
    setup = LocalizerSetup.of(project)
    return Seen(log, with_false_ones(extract_detections(log, setup), setup, rng), setup)


def with_false_ones(detected: DetectionLog, setup: LocalizerSetup, rng: np.random.Generator) -> DetectionLog:
    """Add as many detections of nothing as make their share, evenly over what each scanner sees."""
    mean = FALSE / (1.0 - FALSE) * len(detected.range_bearing) / len(detected)
    counts = rng.poisson(mean, len(detected))
    rows: list[np.ndarray] = []
    for cycle, count in enumerate(counts.tolist()):
        model = setup.scanners[int(detected.scanners[cycle])]
        first, last = np.radians(model.field_of_view_deg)
        rows.append(detected.range_bearing[detected.offsets[cycle] : detected.offsets[cycle + 1]])
        rows.append(rng.uniform((0.5, first), (model.reflector_range, last), (count, 2)))
    at = np.repeat(detected.offsets[1:], counts)
    return replace(
        detected,
        offsets=detected.offsets + np.concatenate(([0], np.cumsum(counts))),
        range_bearing=np.concatenate(rows),
        beams=np.insert(detected.beams, at, 0),
        expected=np.insert(detected.expected, at, np.nan),
        status=np.insert(detected.status, at, INLIER),
    )
