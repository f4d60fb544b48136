"""Small halls and routes that several tests of the simulation share."""

from __future__ import annotations

import numpy as np

from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle, Vehicle

RESOLUTION = 0.05
QUIET = Scanner(range_sigma=0.0, bearing_sigma_deg=0.0)
"""A scanner without noise."""


def room(width: float = 12.0, height: float = 8.0) -> FloorMap:
    """A rectangle with walls one cell thick whose inner faces lie at one cell from its outer edge."""
    cells = np.full((round(height / RESOLUTION), round(width / RESOLUTION)), FREE, np.int8)
    cells[[0, -1]] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    return FloorMap(cells, RESOLUTION)


def out_and_back(speed: float = 0.5) -> Route:
    """Forward through a double bend, reverse through another one, forward to the end: two cusps."""
    curves = (
        (Direction.FORWARD, [[2, 2], [4, 2], [6, 3], [8, 3]]),
        (Direction.REVERSE, [[8, 3], [6, 3], [5, 1], [3, 1]]),
        (Direction.FORWARD, [[3, 1], [5, 1], [6, 4], [9, 5]]),
    )
    return Route(
        "Out and back",
        tuple(Segment(control_points=np.array(points), direction=direction) for direction, points in curves),
        speed,
    )


def corner_reflectors() -> ReflectorMap:
    """Four cylinders in the corners of the room."""
    places = [(0.2, 0.2), (11.8, 0.2), (11.8, 7.8), (0.2, 7.8)]
    return ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(places)))


def hall(vehicle: Vehicle | None = None, scanner: Scanner | None = None) -> Project:
    """The room with its reflectors and the route."""
    return Project(
        floor_map=room(),
        reflectors=corner_reflectors(),
        routes=(out_and_back(),),
        vehicle=vehicle or DifferentialVehicle(),
        scanners=(scanner or Scanner(),),
    )
