"""Draws the bundled sites into `maps/`: run `python -m tests.tools.draw_sites` after a change here.

Walls, machines and racks are rectangles, routes are polygons with their corners cut, so that a reader can follow every
number. Tunables and disturbances of a site that is already there are kept: those are tuned with the simulation.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.io.project_file import load_project, save_project
from commission.site.disturbances import Disturbances, ShinyObject, TiltedStretch
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import ObservationParameters, OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle

MAPS = Path(__file__).resolve().parents[2] / "maps"
WALL = 0.2
"""Thickness of the outer walls [m]."""

Box = tuple[float, float, float, float]
"""x from, y from, x to, y to [m]."""
Point = tuple[float, float]


def hall(width: float, depth: float, resolution: float, boxes: Iterable[Box]) -> FloorMap:
    """A walled hall whose inner corner is the origin of the map, with boxes that stop the laser."""
    columns, rows = round((width + 2 * WALL) / resolution), round((depth + 2 * WALL) / resolution)
    cells = np.full((rows, columns), FREE, dtype=np.int8)
    outer = (
        (-WALL, -WALL, width + WALL, 0.0),
        (-WALL, depth, width + WALL, depth + WALL),
        (-WALL, 0.0, 0.0, depth),
        (width, 0.0, width + WALL, depth),
    )
    for x0, y0, x1, y1 in (*outer, *boxes):
        left, low, right, high = (round((v + WALL) / resolution) for v in (x0, y0, x1, y1))
        cells[low : max(high, low + 1), left : max(right, left + 1)] = OCCUPIED
    return FloorMap(cells, resolution, np.array([-WALL, -WALL, 0.0]))


def reflector_map(points: Sequence[Point], radius: float, prefix: str) -> ReflectorMap:
    digits = len(str(len(points)))
    return ReflectorMap(
        tuple(
            Reflector(id=f"{prefix}{number:0{digits}d}", x=round(x, 3), y=round(y, 3), radius=radius)
            for number, (x, y) in enumerate(points, start=1)
        )
    )


def curve(start: tuple[float, float, float], end: tuple[float, float, float], arm: float) -> np.ndarray:
    """Control points of one cubic curve between two directions of motion (x [m], y [m], direction [deg])."""
    (xs, ys, ds), (xe, ye, de) = start, end
    cs, ss, ce, se = (f(math.radians(d)) for d in (ds, de) for f in (math.cos, math.sin))
    points = [(xs, ys), (xs + arm * cs, ys + arm * ss), (xe - arm * ce, ye - arm * se), (xe, ye)]
    return np.round(np.array(points), 3)


def with_cut_corners(corners: Sequence[Point], cut: float) -> np.ndarray:
    """Control points along a polygon whose corners are cut: a cubic B-spline over them turns at about 1.1 * cut."""
    points = np.array(corners, dtype=np.float64)
    kept = [points[0]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        kept.append(corner + cut * _unit(before - corner))
        kept.append(corner + cut * _unit(after - corner))
    kept.append(points[-1])
    result = [kept[0]]
    for start, end in itertools.pairwise(kept):
        pieces = max(1, round(math.dist(start, end) / (1.5 * cut)))
        result += [start + (end - start) * step / pieces for step in range(1, pieces + 1)]
    return np.round(np.array(result), 3)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / math.hypot(*vector)


def laboratory() -> Project:
    """The room of the precision test: four reflectors on the walls, a route with four changes of direction."""
    p0, p1, p2, p3 = (2.0, 2.2, 0.0), (9.6, 2.4, -35.0), (5.6, 6.0, -10.0), (10.0, 5.2, 20.0)

    def reverse(pose: tuple[float, float, float]) -> tuple[float, float, float]:
        return (pose[0], pose[1], pose[2] + 180.0)

    segments = (
        Segment(control_points=curve(p0, p1, 3.0), direction=Direction.FORWARD),
        Segment(control_points=curve(reverse(p1), reverse(p2), 2.0), direction=Direction.REVERSE),
        Segment(control_points=curve(p2, p3, 1.6), direction=Direction.FORWARD),
        Segment(control_points=curve(reverse(p3), reverse(p0), 3.0), direction=Direction.REVERSE),
    )
    furniture = ((0.0, 7.0, 1.6, 8.0), (11.2, 0.0, 12.0, 1.2), (5.6, 7.4, 8.0, 8.0), (2.4, 0.0, 4.4, 0.5))
    return Project(
        name="Laboratory",
        floor_map=hall(12.0, 8.0, 0.02, furniture),
        reflectors=reflector_map([(0.07, 3.1), (3.4, 7.93), (11.93, 6.4), (7.6, 0.07)], 0.05, "L"),
        routes=(Route("P0-P1-P2-P3-P0", segments, 0.4),),
        vehicle=DifferentialVehicle(0.4, ((0.35, 0.28), (-0.35, 0.28), (-0.35, -0.28), (0.35, -0.28)), 0.4),
        scanners=(
            Scanner(
                mounting=np.array([0.15, 0.0, 0.0]),
                field_of_view_deg=(-180.0, 180.0),
                resolution_deg=0.36,
                range=(0.05, 30.0),
                reflector_range=20.0,
            ),
        ),
        parameters=Parameters(observation=ObservationParameters(range_sigma=0.0075, bearing_sigma=0.0015)),
    )


def _table(x0: float, y0: float, x1: float, y1: float) -> list[Box]:
    """The four legs of a table: all of it that a laser near the floor sees."""
    leg = 0.06
    return [(x, y, x + leg, y + leg) for x in (x0, x1 - leg) for y in (y0, y1 - leg)]


def shop_floor() -> Project:
    """The hall of the robustness test: machines, a fenced cell, tables, people, shiny things, uneven floor."""
    machines: list[Box] = [
        (1.5, 9.5, 4.5, 11.5),
        (6.0, 10.0, 9.0, 12.0),
        (10.5, 9.0, 12.5, 11.0),
        (20.0, 10.5, 22.5, 12.0),
        (2.8, 2.4, 5.5, 4.4),
        (6.8, 2.4, 9.0, 4.2),
        (13.3, 2.3, 15.6, 4.3),
        (16.8, 2.4, 18.6, 4.4),
        (21.8, 2.0, 23.5, 4.0),
    ]
    fence: list[Box] = [
        (14.5, 9.0, 16.0, 9.06),
        (17.2, 9.0, 18.5, 9.06),
        (14.5, 9.0, 14.56, 12.5),
        (18.44, 9.0, 18.5, 12.5),
        (14.5, 12.44, 18.5, 12.5),
        (16.2, 10.5, 17.0, 11.3),
    ]
    tables = [*_table(9.6, 2.6, 11.0, 3.8), *_table(7.0, 8.6, 8.4, 9.4), *_table(21.0, 8.4, 22.6, 9.2)]
    reflectors: list[Point] = [
        *[(3.9, 9.44), (6.6, 9.94), (11.2, 8.94), (10.44, 9.8), (14.9, 8.94), (18.1, 8.94), (21.4, 10.44)],
        *[(4.6, 4.46), (7.4, 4.26), (14.7, 4.36), (13.24, 3.1), (17.3, 4.46), (22.3, 4.06)],
        *[(2.2, 9.44), (2.74, 3.4), (3.3, 2.34)],
        *[(0.06, 1.7), (0.06, 5.3), (0.06, 8.4), (23.94, 1.2), (23.94, 5.6), (23.94, 8.9)],
        *[(6.2, 0.06), (12.6, 0.06), (18.2, 0.06)],
    ]
    into_station = with_cut_corners([(20.5, 6.6), (12.1, 6.6), (12.1, 2.2)], 1.6)
    out_of_station = with_cut_corners([(12.1, 2.2), (12.1, 6.6), (2.6, 6.6)], 1.6)
    around = with_cut_corners([(4.0, 6.6), (20.2, 6.6), (20.2, 1.2), (1.4, 1.2), (1.4, 6.6), (4.0, 6.6)], 1.3)
    return Project(
        name="Shop floor",
        floor_map=hall(24.0, 13.0, 0.02, [*machines, *fence, *tables]),
        reflectors=reflector_map(reflectors, 0.045, "S"),
        routes=(
            Route(
                "P0-P1-P2",
                (
                    Segment(control_points=into_station, direction=Direction.REVERSE),
                    Segment(control_points=out_of_station),
                ),
                0.5,
            ),
            Route("Around", (Segment(control_points=around),), 0.5),
        ),
        vehicle=DifferentialVehicle(0.45, ((0.5, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.5, -0.3)), 0.35),
        scanners=(Scanner(mounting=np.array([0.42, 0.0, 0.0]), resolution_deg=0.25, reflector_range=15.0),),
        parameters=Parameters(observation=ObservationParameters(range_sigma=0.008, bearing_sigma=0.0016)),
        disturbances=Disturbances(
            people=50,
            walking_speed=0.8,
            shiny_objects=(
                ShinyObject(9.03, 3.2, 0.03),
                ShinyObject(12.53, 10.2, 0.12),
                ShinyObject(20.6, 10.47, 0.03),
                ShinyObject(5.53, 3.4, 0.15),
                ShinyObject(16.77, 3.1, 0.03),
                ShinyObject(0.03, 7.0, 0.02),
            ),
            glints_per_scan=0.5,
            tilted_stretches=(
                TiltedStretch(17.0, 6.6, 0.7),
                TiltedStretch(7.5, 6.6, 0.7),
                TiltedStretch(20.2, 3.0, 0.6),
            ),
        ),
    )


ROWS = 8
ROW_PITCH = 5.6
RACK_DEPTH = 2.4
RACKS_X = ((10.0, 46.0), (54.0, 90.0))
BAY = 3.0
AISLES_OF_ROUTES = (2, 3, 5)
"""Counted from 0."""


def _rack_row(row: int) -> float:
    """y of the lower face of a rack [m]."""
    return 8.0 + ROW_PITCH * row


def _aisle(number: int) -> float:
    """y of the middle of an aisle between racks [m]."""
    return _rack_row(number) + (RACK_DEPTH + ROW_PITCH) / 2.0


def _racks() -> list[Box]:
    """Posts at every bay, pallets between them; some bays are empty."""
    boxes: list[Box] = []
    for row in range(ROWS):
        low = _rack_row(row)
        for block, (x0, x1) in enumerate(RACKS_X):
            bays = round((x1 - x0) / BAY)
            for bay in range(bays + 1):
                x = min(x0 + bay * BAY, x1 - 0.1)
                boxes += [(x, y, x + 0.1, y + 0.1) for y in (low, low + 1.15, low + RACK_DEPTH - 0.1)]
                for side, y in enumerate((low + 0.1, low + 1.3)):
                    if bay < bays and (3 * bay + 5 * row + 2 * side + block) % 7:
                        boxes.append((x + 0.3, y, x + BAY - 0.2, y + 1.0))
            boxes += [(x0, low, x0 + 0.1, low + RACK_DEPTH), (x1 - 0.1, low, x1, low + RACK_DEPTH)]
    return boxes


def _warehouse_reflectors() -> list[Point]:
    """120 reflectors: 32 on the walls, 32 on the ends of the racks, 56 on posts, most of them where routes lead."""
    away = 0.07
    walls = [
        *[(5.0 + 10.0 * i + (1.3 if i % 2 else 0.0), y) for y in (away, 60.0 - away) for i in range(10)],
        *[(x, 5.0 + 10.0 * i + (1.7 if i % 2 else 0.0)) for x in (away, 100.0 - away) for i in range(6)],
    ]
    ends = [
        (x, _rack_row(row) + 0.6 + 1.2 * ((row + side) % 2))
        for row in range(ROWS)
        for block in RACKS_X
        for side, x in enumerate((block[0] - away, block[1] + away))
    ]
    posts: list[Point] = []
    for number in range(ROWS - 1):
        lower, upper = _rack_row(number) + RACK_DEPTH + away, _rack_row(number + 1) - away
        for block, (x0, _) in enumerate(RACKS_X):
            for place, bay in enumerate((0, 1, 3, 5, 7, 9, 11, 12) if number in AISLES_OF_ROUTES else (6,)):
                # Each aisle gets another pattern of sides: equal aisles could be taken for each other.
                side = ((29 + 37 * number + 11 * block) >> place) % 2
                posts.append((x0 + min(bay * BAY + 0.05, 12 * BAY - 0.05), upper if side else lower))
    return [*walls, *ends, *posts]


def warehouse() -> Project:
    """A hall of 100 x 60 m with pallet racks in two blocks, aisles of 3.2 m and a tricycle forklift."""
    south, cross, east, west = 4.0, 50.0, 95.0, 5.0
    into_aisle = with_cut_corners([(west, south), (cross, south), (cross, _aisle(2)), (14.0, _aisle(2))], 2.6)
    back_out = with_cut_corners([(14.0, _aisle(2)), (cross, _aisle(2)), (cross, 33.0)], 2.6)
    to_shipping = with_cut_corners([(cross, 33.0), (cross, south), (92.0, south)], 2.6)
    loop = with_cut_corners([(8.0, south), (east, south), (east, 55.0), (west, 55.0), (west, 8.0)], 2.6)
    through = with_cut_corners(
        [(east, 12.0), (east, _aisle(5)), (cross, _aisle(5)), (cross, _aisle(3)), (west, _aisle(3)), (west, 10.0)], 2.6
    )
    return Project(
        name="Warehouse",
        floor_map=hall(100.0, 60.0, 0.05, _racks()),
        reflectors=reflector_map(_warehouse_reflectors(), 0.05, "W"),
        routes=(
            Route("Goods in to aisle 3", (Segment(control_points=into_aisle),), 1.2),
            Route(
                "Aisle 3 to shipping",
                (Segment(control_points=back_out, direction=Direction.REVERSE), Segment(control_points=to_shipping)),
                1.2,
            ),
            Route("Outer loop", (Segment(control_points=loop),), 1.5),
            Route("Through aisles 6 and 4", (Segment(control_points=through),), 1.2),
        ),
        vehicle=TricycleVehicle(),
        scanners=(
            Scanner(
                mounting=np.array([1.4, 0.0, 0.0]),
                field_of_view_deg=(-137.5, 137.5),
                resolution_deg=0.275,
                range=(0.05, 40.0),
                reflector_range=25.0,
            ),
        ),
        parameters=Parameters(observation=ObservationParameters(range_sigma=0.01, bearing_sigma=0.0016)),
        disturbances=Disturbances(people=12, glints_per_scan=0.1),
    )


def loading_bay() -> Project:
    """A hall with a conveyor in its middle, pallets along its walls, and a carrier with a scanner on two corners."""
    pallets: list[Box] = [
        (2.0, 10.5, 5.0, 13.0),
        (8.0, 10.8, 12.0, 13.0),
        (15.0, 10.5, 18.0, 13.0),
        (8.0, 1.0, 12.0, 3.0),
        (17.0, 1.0, 19.0, 3.0),
    ]
    conveyor = (7.0, 6.2, 13.0, 7.4)
    reflectors: list[Point] = [
        *[(0.06, 2.0), (0.06, 6.4), (0.06, 11.0), (19.94, 3.6), (19.94, 7.8), (19.94, 12.2)],
        *[(3.2, 0.06), (6.9, 0.06), (13.0, 0.06), (16.1, 0.06)],
        *[(3.1, 10.44), (10.6, 10.74), (15.9, 10.44), (9.2, 3.06), (11.3, 3.06)],
        *[(8.4, 6.14), (12.1, 7.46), (6.94, 6.9)],
    ]
    away = with_cut_corners([(17.0, 4.8), (14.5, 4.8), (14.5, 1.5)], 1.4)
    back = with_cut_corners([(14.5, 1.5), (14.5, 4.8), (3.5, 4.8)], 1.4)
    around = with_cut_corners([(10.0, 4.8), (16.5, 4.8), (16.5, 9.0), (3.5, 9.0), (3.5, 4.8), (10.0, 4.8)], 1.4)
    scanners = tuple(
        Scanner(
            name=name,
            mounting=np.array([x, y, round(math.radians(faces), 6)]),
            field_of_view_deg=(-137.5, 137.5),
            resolution_deg=0.25,
            reflector_range=15.0,
        )
        for name, x, y, faces in (("front left", 0.6, 0.4, 45.0), ("rear right", -0.6, -0.4, -135.0))
    )
    return Project(
        name="Loading bay",
        floor_map=hall(20.0, 14.0, 0.02, [*pallets, conveyor]),
        reflectors=reflector_map(reflectors, 0.045, "B"),
        routes=(
            Route(
                "To the dock and back",
                (
                    Segment(control_points=np.array([(3.5, 4.8), (8.0, 4.8), (12.5, 4.8), (17.0, 4.8)])),
                    Segment(control_points=away, direction=Direction.REVERSE),
                    Segment(control_points=back),
                ),
                0.6,
            ),
            Route("Around the conveyor", (Segment(control_points=around),), 0.6),
        ),
        vehicle=DifferentialVehicle(0.6, ((0.6, 0.4), (-0.6, 0.4), (-0.6, -0.4), (0.6, -0.4)), 0.3),
        scanners=scanners,
        parameters=Parameters(
            observation=ObservationParameters(range_sigma=0.008, bearing_sigma=0.0016),
            # What the wheels of a virtual drive do, `disturbances.wheels`.
            odometry=OdometryParameters(
                forward_per_sqrt_m=0.01, lateral_per_sqrt_m=0.003, heading_per_sqrt_m=0.006, heading_per_sqrt_rad=0.01
            ),
        ),
        disturbances=Disturbances(people=8, glints_per_scan=0.1),
    )


def assembly() -> Project:
    """Two cells in a hall; a carrier on four omnidirectional wheels, whose camera sees tags on walls and cells."""
    cells: list[Box] = [(4.0, 4.0, 7.0, 6.0), (9.0, 4.0, 12.0, 6.0)]
    around = with_cut_corners([(8.0, 2.0), (14.0, 2.0), (14.0, 8.0), (2.0, 8.0), (2.0, 2.0), (8.0, 2.0)], 1.4)
    between = [(5.0, 2.0), (5.8, 2.0), (6.8, 2.0), (7.6, 2.0)]
    south, north = math.pi / 2.0, -math.pi / 2.0
    tags: list[tuple[float, float, float]] = [
        *[(x, 0.03, south) for x in (4.0, 8.0, 12.0)],
        *[(15.97, y, math.pi) for y in (2.0, 5.0, 8.0)],
        *[(x, 9.97, north) for x in (12.0, 8.0, 4.0)],
        *[(0.03, y, 0.0) for y in (8.0, 5.0, 2.0)],
    ]
    reflectors: list[Point] = [(0.06, 6.5), (15.94, 3.5), (6.0, 0.06), (10.0, 9.94), (8.94, 5.0), (7.06, 5.6)]
    return Project(
        name="Assembly",
        floor_map=hall(16.0, 10.0, 0.02, cells),
        reflectors=reflector_map(reflectors, 0.045, "A"),
        tags=tuple(
            Tag(id=str(number), x=x, y=y, heading=round(heading, 6)) for number, (x, y, heading) in enumerate(tags, 1)
        ),
        tag_camera=TagCamera(mounting=np.array([0.3, 0.0, 0.0]), field_of_view_deg=110.0, range=(0.2, 5.0)),
        routes=(
            Route("Around both cells", (Segment(control_points=around),), 0.5),
            Route("Along the first cell", (Segment(control_points=np.array(between)),), 0.3),
        ),
        vehicle=OmnidirectionalVehicle(
            wheel_angles_deg=(45.0, 135.0, 225.0, 315.0),
            wheel_radius=0.076,
            center_distance=0.35,
            outline=((0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3)),
            height=0.3,
        ),
        scanners=(
            Scanner(
                mounting=np.array([0.35, 0.0, 0.0]),
                field_of_view_deg=(-135.0, 135.0),
                resolution_deg=0.5,
                reflector_range=10.0,
            ),
        ),
        parameters=Parameters(
            observation=ObservationParameters(range_sigma=0.008, bearing_sigma=0.0024),
            odometry=OdometryParameters(
                forward_per_sqrt_m=0.01, lateral_per_sqrt_m=0.01, heading_per_sqrt_m=0.01, heading_per_sqrt_rad=0.01
            ),
        ),
        disturbances=Disturbances(people=2, slips_per_100_m=20.0),
    )


SITES = {
    "laboratory": laboratory,
    "shop_floor": shop_floor,
    "warehouse": warehouse,
    "loading_bay": loading_bay,
    "assembly": assembly,
}


def main() -> None:
    for name, draw in SITES.items():
        project = draw()
        try:
            kept = load_project(MAPS / name)
            project = dataclasses.replace(project, parameters=kept.parameters, disturbances=kept.disturbances)
        except FileFormatError as error:
            sys.stderr.write(f"drawn anew: {error}\n")
        save_project(project, MAPS / name)


if __name__ == "__main__":
    main()
