"""Small sites for the tests of the page: a room with four reflectors, and a drive in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle
from tests.odometry_of import PRECISE


def room(rate: float = 10.0, resolution_deg: float = 0.5) -> Project:
    """Return a project of 12 x 8 m with four reflectors on its walls and one route there and back."""
    cells = np.full((160, 240), FREE, np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = (OCCUPIED,) * 4
    cells[70:84, 150:170] = OCCUPIED
    places = ((0.25, 2.0), (0.25, 6.5), (11.75, 1.5), (11.75, 5.5))
    there = Segment(control_points=np.array([[2.0, 2.0], [4.0, 2.0], [5.0, 2.5], [6.0, 3.0]]))
    back = Segment(control_points=there.control_points[::-1].copy(), direction=Direction.REVERSE)
    return Project(
        name="Room",
        floor_map=FloorMap(cells, 0.05),
        reflectors=ReflectorMap(tuple(Reflector(id=f"R{i + 1}", x=x, y=y) for i, (x, y) in enumerate(places))),
        routes=(Route("There and back", (there, back), speed=0.6),),
        vehicle=DifferentialVehicle(),
        scanners=(Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=resolution_deg, rate=rate),),
        parameters=Parameters(odometry=PRECISE),
    )


def moved(project: Project, east: float, north: float) -> Project:
    """Return a project with its map, reflectors and routes moved [m]."""
    assert project.floor_map is not None
    routes = tuple(
        replace(
            route,
            segments=tuple(
                replace(segment, control_points=np.add(segment.control_points, (east, north)))
                for segment in route.segments
            ),
        )
        for route in project.routes
    )
    reflectors = tuple(replace(r, x=r.x + east, y=r.y + north) for r in project.reflectors.reflectors)
    return replace(
        project,
        floor_map=replace(project.floor_map, origin=np.add(project.floor_map.origin, (east, north, 0.0))),
        reflectors=ReflectorMap(reflectors),
        routes=routes,
    )
