"""Edges of layouts and orders (VDMA LIF, VDA 5050) as segments of routes: their curves, directions and succession.

Both formats describe an edge by two nodes, an optional NURBS and an orientation; their files are read elsewhere.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.angles import wrap_scalar
from commission.geometry.splines import clamped_uniform_knots
from commission.io.findings import Findings
from commission.io.json_document import Fields
from commission.site.routes import SPEEDS, Direction, Route, Segment
from commission.site.stations import Station

GAP = 0.01
"""Distance [m] up to which two ends are one place: what `Route` accepts between its segments."""
CORNER = math.radians(10.0)
"""Change of heading [rad] beyond which a vehicle must turn on the spot."""
CROOKED = math.radians(5.0)
"""Angle [rad] between the vehicle and its path beyond which neither forward nor reverse describes it."""
HIGHEST_DEGREE = 10
MOST_POINTS = 10_000


@dataclass(frozen=True, slots=True)
class Edge:
    """One edge that can be driven."""

    id: str
    """Its name."""
    start: str
    """Node where it begins."""
    end: str
    """Node where it ends."""
    segment: Segment
    """The curve, with direction and speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteImport:
    """Routes from a file of another system."""

    routes: tuple[Route, ...]
    """Names are unique."""
    warnings: tuple[str, ...] = ()
    """What was doubtful, made up or passed over, one line each."""
    stations: tuple[Station, ...] = ()
    """Where vehicles stand to serve stations, where the format has them; names are unique."""
    vehicle_types: tuple[str, ...] = ()
    """Vehicle types that the file speaks of; the routes are those of one."""
    layouts: tuple[str, ...] = ()
    """Layouts that the file holds."""


@dataclass(frozen=True, slots=True)
class Angles:
    """How the angles of one key are meant."""

    key: str
    """Name of the key."""
    scale: float
    """Radians in one unit."""

    def of(self, fields: Fields) -> float | None:
        """Angle in an object [rad]; None when there is none."""
        value = fields.number(self.key)
        return None if value is None else value * self.scale


def angles_of(objects: Iterable[Fields], key: str) -> Angles:
    """Decide whether the angles of a key are radians, as both formats demand, or degrees, as some exporters write.

    Parameters
    ----------
    objects : all objects of the file that have the key.
    key : name of the key.

    Returns
    -------
    angles : degrees if one of them lies beyond a full turn in radians, which is noted.
    """
    farthest, place = 0.0, None
    for fields in objects:
        value = fields.number(key)
        if value is not None and abs(value) > farthest:
            farthest, place = abs(value), fields
    if place is None or farthest <= math.pi + 1e-6:
        return Angles(key, 1.0)
    if farthest <= 2.0 * math.pi + 1e-6:
        place.found.add(place.where, f"{key} reaches {farthest:g}; expected radians from -pi to pi")
        return Angles(key, 1.0)
    place.found.add(place.where, f"{key} reaches {farthest:g}, beyond a turn in radians: all are taken for degrees")
    return Angles(key, math.pi / 180.0)


def curve(fields: Fields, ends: tuple[Sequence[float] | None, Sequence[float] | None]) -> Segment | None:
    """Curve of an edge: its trajectory or, without a usable one, the straight line between its nodes.

    Parameters
    ----------
    fields : the edge (VDA 5050) or the part of it that belongs to one vehicle type (LIF).
    ends : places of start and end node [m], None where unknown.

    Returns
    -------
    segment : forward, without speed; None, which is noted, when there is nothing to drive along.
    """
    trajectory = fields.mapping("trajectory")
    if trajectory is not None:
        segment = _nurbs(trajectory)
        if segment is not None:
            _note_missed_nodes(segment, fields, ends)
            return segment
    if ends[0] is None or ends[1] is None:
        fields.found.add(fields.where, "has neither a usable trajectory nor two nodes of known place; it is left out")
        return None
    if math.dist(ends[0], ends[1]) < 1e-6:
        fields.found.add(fields.where, "begins and ends at one place; it is left out")
        return None
    return Segment(control_points=np.array([ends[0], ends[1]]), degree=1)


def _nurbs(trajectory: Fields) -> Segment | None:
    """Segment of a trajectory, or None after noting why it cannot be used."""
    where, found = trajectory.where, trajectory.found
    points = [(p.number("x"), p.number("y")) for p in trajectory.mappings("controlPoints")]
    weights = [1.0 if (w := p.number("weight")) is None else w for p in trajectory.mappings("controlPoints")]
    knots = trajectory.numbers("knotVector")
    degree = trajectory.number("degree")
    degree = 1.0 if degree is None else degree
    problem = ""
    if not 1 <= degree <= HIGHEST_DEGREE or degree != int(degree):
        problem = f"degree is {degree:g}; expected 1 to {HIGHEST_DEGREE}"
    elif not 2 <= len(points) <= MOST_POINTS:
        problem = f"{len(points)} control points; expected 2 to {MOST_POINTS}"
    elif any(x is None or y is None for x, y in points):
        problem = "a control point has no place"
    elif knots is None and "knotVector" in trajectory.values:
        problem = "the knot vector is unreadable"
    if not problem:
        try:
            # Weights of 1 are none; a curve that needs them is rational.
            rational = np.array(weights) if any(weight != 1.0 for weight in weights) else None
            controls = np.array(points, dtype=np.float64)
            segment = Segment(
                control_points=controls,
                degree=int(degree),
                knots=_usual(knots, int(degree), trajectory),
                weights=rational,
            )
        except (ValueError, OverflowError) as error:
            problem = str(error)
        else:
            return segment
    found.add(where, f"the trajectory cannot be used ({problem})")
    return None


def _usual(knots: list[float] | None, degree: int, trajectory: Fields) -> np.ndarray | None:
    """Knots, or None for the usual ones; notes those beyond [0, 1], which both formats forbid."""
    if knots is None:
        return None
    if knots and (knots[0], knots[-1]) != (0.0, 1.0):
        problem = f"knots run from {knots[0]:g} to {knots[-1]:g}; expected 0 to 1 (the curve is the same)"
        trajectory.found.add(trajectory.where, problem)
    n = len(knots) - degree - 1
    is_usual = n > degree and np.array_equal(knots, clamped_uniform_knots(degree, n))
    return None if is_usual else np.array(knots)


def _note_missed_nodes(
    segment: Segment, fields: Fields, ends: tuple[Sequence[float] | None, Sequence[float] | None]
) -> None:
    points = (segment.control_points[0], segment.control_points[-1])
    for word, node, point in zip(("starts", "ends"), ends, points, strict=True):
        if node is not None and math.dist(node, point) > GAP:
            problem = f"the trajectory {word} {math.dist(node, point):.3f} m from its node; the trajectory is used"
            fields.found.add(fields.where, problem)


def directed(segment: Segment, fields: Fields, angles: Angles) -> Segment:
    """Give a curve its direction: which end of the vehicle goes ahead.

    Parameters
    ----------
    segment : the curve.
    fields : object with the orientation and `orientationType` (TANGENTIAL when absent: 0 is forward, pi reverse;
        GLOBAL: heading in the map).
    angles : how the orientation is meant.
    """
    angle = angles.of(fields)
    if angle is None:
        return segment
    kind = fields.text("orientationType").upper() or "TANGENTIAL"
    if kind not in ("TANGENTIAL", "GLOBAL"):
        fields.found.add(fields.where, f"orientationType is {kind!r}; taken for TANGENTIAL")
    relative = angle
    if kind == "GLOBAL":
        relative = angle - _heading(segment, 0)
        fields.found.add(fields.where, "the heading is fixed in the map; only forward or reverse is kept")
    relative = abs(wrap_scalar(relative))
    if CROOKED < relative < math.pi - CROOKED:
        problem = f"the vehicle drives at {math.degrees(relative):.0f} deg to its path; only forward or reverse is kept"
        fields.found.add(fields.where, problem)
    return replace(segment, direction=Direction.REVERSE) if relative > math.pi / 2.0 else segment


def speed_in(fields: Fields, keys: Sequence[str]) -> float | None:
    """Permitted speed under the first of the keys that holds one [m/s]; None, which is noted, if nobody drives so."""
    speed = next((value for key in keys if (value := fields.number(key)) is not None), None)
    if speed is not None and speed not in SPEEDS:
        problem = f"the speed is {speed:g}; expected {SPEEDS.words('m/s')}, so it is passed over"
        fields.found.add(fields.where, problem)
        return None
    return speed


def turn(before: Segment, after: Segment) -> float:
    """Angle by which the vehicle must turn on the spot between two segments [rad]."""
    return abs(wrap_scalar(_heading(after, 0) - _heading(before, 1)))


def _heading(segment: Segment, end: int) -> float:
    """Heading of the vehicle at an end of a segment [rad].

    A clamped curve leaves along its control polygon (The NURBS Book, equation 3.7), so none is evaluated.
    """
    points = segment.control_points if end == 0 else segment.control_points[::-1]
    onward = points[np.flatnonzero((points != points[0]).any(axis=1))[0]] - points[0]
    x, y = onward if end == 0 else -onward
    return math.atan2(y, x) + (math.pi if segment.direction is Direction.REVERSE else 0.0)


def follows(before: Edge, after: Edge) -> bool:
    """Whether one edge begins where another ends."""
    return math.dist(before.segment.control_points[-1], after.segment.control_points[0]) <= GAP


def route_of(name: str, edges: Sequence[Edge]) -> Route:
    """Route along edges that follow one another; a speed that all of them have becomes the route's."""
    segments = [edge.segment for edge in edges]
    speeds = [segment.speed for segment in segments if segment.speed is not None]
    if not speeds:
        return Route(name, tuple(segments))
    usual = max(speeds, key=speeds.count)
    if len(speeds) < len(segments):
        return Route(name, tuple(segments))
    return Route(name, tuple(replace(s, speed=None) if s.speed == usual else s for s in segments), usual)


def unique(name: str, taken: set[str]) -> str:
    """Return the name, or with a number behind it the first that is not taken; it is taken then."""
    result, number = name, 1
    while result in taken:
        number += 1
        result = f"{name} ({number})"
    taken.add(result)
    return result


def note_corners(name: str, edges: Sequence[Edge], found: Findings) -> None:
    """Note where a vehicle would have to turn on the spot.

    Parameters
    ----------
    name : of the route, for the note.
    edges : in the order in which they are driven.
    found : where it is noted.
    """
    for before, after in itertools.pairwise(edges):
        angle = turn(before.segment, after.segment)
        if angle > CORNER:
            place = f"route {name!r}, node {after.start!r}"
            found.add(place, f"the vehicle must turn by {math.degrees(angle):.0f} deg on the spot")
