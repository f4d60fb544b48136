"""Layouts in the Layout Interchange Format of VDMA (LIF 1.0, JSON): written from the routes of a project.

A master control system needs nodes and edges; LIF has no place for how a vehicle localizes. What stays behind is said.
"""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.angles import wrap_scalar
from commission.geometry.splines import clamped_uniform_knots
from commission.io.atomic import write_text
from commission.io.findings import Findings
from commission.site.fields import in_file
from commission.site.project import Project
from commission.site.quantity import counted_text
from commission.site.routes import Direction, Route, Segment
from commission.site.stations import Station

LIF_VERSION = "1.0.0"
SAME_NODE = 0.001
"""Ends of routes at most so far apart [m] share a node: routes are drawn to the millimetre."""


def write_lif(project: Project, path: Path, *, exported_at: datetime | None = None) -> tuple[str, ...]:
    """Write the routes of a project as one layout.

    Parameters
    ----------
    project : its routes become edges called NAME/1, NAME/2, ...; ends within a millimetre share a node.
    path : LIF file.
    exported_at : time that the file states; now when None.

    Returns
    -------
    losses : what LIF cannot carry, one line each.

    Raises
    ------
    FileFormatError
        the file cannot be written.
    """
    found = Findings()
    project = in_file(project)
    vehicle = f"commission.{project.vehicle.kind}"
    nodes = _Nodes()
    edges = [
        _edge(f"{route.name}/{number}", start, end, _properties(route, segment, vehicle, found))
        for route in project.routes
        for number, (segment, start, end) in enumerate(_steps(route, nodes, found), start=1)
    ]
    stations = [_station(station, nodes.at(np.array([station.x, station.y]))) for station in project.stations]
    _note_losses(project, found)
    document = {
        "metaInformation": {
            "projectIdentification": project.name,
            "creator": "commission",
            "exportTimestamp": f"{(exported_at or datetime.now(UTC)).astimezone(UTC):%Y-%m-%dT%H:%M:%S.00Z}",
            "lifVersion": LIF_VERSION,
        },
        "layouts": [
            {
                "layoutId": project.name or "layout",
                "layoutVersion": "1",
                "nodes": [
                    {
                        "nodeId": f"N{index}",
                        "nodePosition": {"x": x, "y": y},
                        "vehicleTypeNodeProperties": [{"vehicleTypeId": vehicle}],
                    }
                    for index, (x, y) in enumerate(nodes.places, start=1)
                ],
                "edges": edges,
                "stations": stations,
            }
        ],
    }
    try:
        text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    except ValueError as error:
        raise FileFormatError(path, "", f"cannot be written ({error})", "finite numbers") from error
    write_text(path, text + "\n")
    return found.lines()


class _Nodes:
    """Gives each place a node; places within SAME_NODE share one."""

    def __init__(self) -> None:
        self.places: list[tuple[float, float]] = []
        self._cells: dict[tuple[int, int], list[int]] = {}

    def at(self, point: np.ndarray) -> str:
        """Name of the node at a place, which is made when there is none."""
        x, y = float(point[0]), float(point[1])
        column, row = math.floor(x / SAME_NODE), math.floor(y / SAME_NODE)
        for key in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            for index in self._cells.get(key, ()):
                if math.dist(self.places[index], (x, y)) <= SAME_NODE:
                    return f"N{index + 1}"
        self.places.append((x, y))
        self._cells.setdefault((column, row), []).append(len(self.places) - 1)
        return f"N{len(self.places)}"


def _steps(route: Route, nodes: _Nodes, found: Findings) -> list[tuple[Segment, str, str]]:
    """Segments of a route with their nodes; the end of one is the start of the next, also across a small gap."""
    steps: list[tuple[Segment, str, str]] = []
    here = nodes.at(route.segments[0].control_points[0])
    for number, segment in enumerate(route.segments, start=1):
        before = route.segments[number - 2].control_points[-1] if number > 1 else segment.control_points[0]
        gap = math.dist(before, segment.control_points[0])
        if gap > SAME_NODE:
            found.add(f"edge {route.name}/{number}", f"its trajectory starts {1000.0 * gap:.0f} mm from its node")
        there = nodes.at(segment.control_points[-1])
        steps.append((segment, here, there))
        here = there
    return steps


def _edge(name: str, start: str, end: str, properties: dict[str, Any]) -> dict[str, Any]:
    return {"edgeId": name, "startNodeId": start, "endNodeId": end, "vehicleTypeEdgeProperties": [properties]}


def _properties(route: Route, segment: Segment, vehicle: str, found: Findings) -> dict[str, Any]:
    """How the vehicle drives a segment."""
    knots = segment.knots
    if knots is None:
        knots = clamped_uniform_knots(segment.degree, len(segment.control_points))
    elif (knots[0], knots[-1]) != (0.0, 1.0):
        knots = (knots - knots[0]) / (knots[-1] - knots[0])
        found.add(f"route {route.name!r}", "knots are scaled to 0 to 1, as LIF demands; the curve is the same")
    weights = np.ones(len(segment.control_points)) if segment.weights is None else segment.weights
    return {
        "vehicleTypeId": vehicle,
        "vehicleOrientation": math.pi if segment.direction is Direction.REVERSE else 0.0,
        "orientationType": "TANGENTIAL",
        "rotationAllowed": False,
        "maxSpeed": float(route.speed_of(segment)),
        "trajectory": {
            "degree": segment.degree,
            # As a project has them: thirds have no end.
            "knotVector": [round(float(knot), 9) for knot in knots],
            "controlPoints": [
                {"x": float(x), "y": float(y), **({} if weight == 1.0 else {"weight": float(weight)})}
                for (x, y), weight in zip(segment.control_points, weights, strict=True)
            ],
        },
    }


def _station(station: Station, node: str) -> dict[str, Any]:
    """Station served from a node; its heading lies within [-pi, pi], as LIF demands."""
    heading = station.heading
    if abs(heading) > math.pi:
        wrapped = wrap_scalar(heading)
        # Toward zero: half a turn, rounded up, would be more than half a turn.
        heading = math.copysign(math.floor(abs(wrapped) * 1e6) / 1e6, wrapped)
    position = {"x": float(station.x), "y": float(station.y), "theta": float(heading)}
    return {"stationId": station.name, "interactionNodeIds": [node], "stationPosition": position}


def _note_losses(project: Project, found: Findings) -> None:
    """Say what LIF has no place for."""
    if len(project.reflectors):
        what = counted_text(len(project.reflectors), "reflector is", "reflectors are")
        found.add("", f"{what} not carried: LIF knows no localization")
    if project.floor_map is not None:
        found.add("", "the floor map is not carried")
    found.add("", "vehicle, scanner, parameters, disturbances and demands on the layout are not carried")
    if project.stations:
        found.add("", f"the required accuracy of {counted_text(len(project.stations), 'station')} is not carried")
    if any(segment.speed is not None for route in project.routes for segment in route.segments):
        found.add("", "each edge carries its speed; which of them were a route's own is lost")
