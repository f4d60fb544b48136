"""Small halls that several tests of planning share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.geometry.arrays import read_only
from commission.planning.route_prediction import PlannedRoute
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner

RESOLUTION = 0.05


def room(width: float, height: float) -> FloorMap:
    """A rectangle with walls one cell thick."""
    cells = np.full((round(height / RESOLUTION), round(width / RESOLUTION)), FREE, np.int8)
    cells[[0, -1]] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    return FloorMap(cells, RESOLUTION)


def reflectors_at(places) -> ReflectorMap:
    """Cylinders named R0, R1 and so on."""
    return ReflectorMap(tuple(Reflector(id=f"R{i}", x=float(x), y=float(y)) for i, (x, y) in enumerate(places)))


def straight(length: float = 20.0, speed: float = 1.0) -> Route:
    """A straight line along x from the origin."""
    return Route("Line", (Segment(control_points=np.array([[0.0, 0.0], [length, 0.0]]), degree=1),), speed)


def open_field(places, length: float = 20.0, *, scanner: Scanner | None = None, **changes) -> Project:
    """Reflectors on an open field around a straight route, and a scanner that sees all around."""
    scanners = (scanner or Scanner(field_of_view_deg=(-180.0, 180.0)),)
    given = {"scanners": scanners, "routes": (straight(length),), **changes}
    return Project(reflectors=reflectors_at(places), **given)


def surely_detected(planned: PlannedRoute) -> PlannedRoute:
    """The same drive, on which every reflector in sight is detected in every scan."""
    columns = np.array(planned.quality.noise.columns)
    columns[:, :, 0] = 1.0
    noise = planned.quality.noise._replace(columns=read_only(columns))
    return replace(planned, quality=planned.quality._replace(noise=noise))
