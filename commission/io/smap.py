"""Maps of SEER robots (.smap, JSON): walls, reflectors, curves as routes, and the points where a vehicle serves.

The file is a protocol buffer written as JSON: a value that is zero is left out, so a coordinate that is absent is 0.
`reflectorPosList` holds the reflectors; `rssiPosList` beside it is a cloud of bright points, of which none is one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray
from commission.io.findings import Findings, shown
from commission.io.json_document import LARGEST, Fields, read_json
from commission.io.outline import outline_map
from commission.io.route_chains import routes_along
from commission.io.route_edges import Edge, angles_of, speed_in, unique
from commission.site.floor_map import FloorMap
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.stations import Station

SERVED = ("ActionPoint", "ChargePoint", "ParkPoint")
"""Classes of the points at which a vehicle stands to do something; others are way points."""
REFLECTOR_AREA = "ReflectorArea"
"""Class of the areas in which the vehicle localizes by reflectors."""
FIELDS = ("x", "y", "radius", "kind")
"""Fields of reflectors that the file speaks of: they have no names."""
_FEWEST = 3
_CURVES = {"StraightPath": "", "BezierPath": "0123", "DegenerateBezier": "011223"}
"""Which of start, two control points and end a curve's control polygon goes through: a cubic, and a quintic that has
each of its control points twice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SmapImport:
    """What a project can take from a map."""

    walls: FloatArray
    """(N, 2, 2) segments [m], map frame; single points are segments without length."""
    reflectors: ReflectorMap
    """Named R1, R2, ... in the order of the file."""
    routes: tuple[Route, ...]
    """Names are unique."""
    stations: tuple[Station, ...]
    """Names are unique."""
    warnings: tuple[str, ...]
    """What was doubtful, made up or passed over, one line each."""
    path: Path
    """The file."""

    def floor_map(self, resolution: float) -> FloorMap:
        """Return the walls in cells of an edge [m], see `outline_map`."""
        return outline_map(self.walls, resolution, self.path)


def read_smap(path: Path) -> SmapImport:
    """Read a map.

    Parameters
    ----------
    path : `.smap` file.

    Returns
    -------
    imported : what cannot be used is passed over and told.

    Raises
    ------
    FileFormatError
        the file is no JSON object, or has neither walls, reflectors nor curves.
    """
    found = Findings()
    root = read_json(path, found)
    walls = np.concatenate([_points(root), _lines(root)])
    reflectors = _reflectors(root)
    edges = [edge for each in root.mappings("advancedCurveList", "curve", "instanceName") for edge in _edge(each)]
    if not (len(walls) or len(reflectors) or edges):
        lists = "normalPosList, reflectorPosList or advancedCurveList"
        raise FileFormatError(path, "", "holds neither walls, reflectors nor curves", f"a SEER map with {lists}")
    if bright := root.values.get("rssiPosList"):
        count = len(bright) if isinstance(bright, list) else 1
        found.add("", f"rssiPosList holds {count} bright points of scans; they are no reflectors and are not read")
    _note_areas(root, reflectors)
    lines = Counter(line.text("className") or "line" for line in root.mappings("advancedLineList"))
    if lines:
        listed = ", ".join(f"{count} {kind}" for kind, count in lines.items())
        found.add("", f"drawn lines are no walls and are not read ({listed})")
    return SmapImport(
        walls=walls,
        reflectors=reflectors,
        routes=routes_along(edges, found),
        stations=tuple(_stations(root)),
        warnings=found.lines(),
        path=path,
    )


def _points(root: Fields) -> FloatArray:
    """(N, 2, 2) points of walls, as segments without length; there are up to a million, so all are read at once."""
    values = root.values.get("normalPosList") or []
    if not isinstance(values, list):
        root.found.add("", f"normalPosList is {shown(values)}; expected a list")
        return np.empty((0, 2, 2))
    places = [_xy(value) for value in values]
    usable = [place for place in places if place is not None]
    if len(usable) < len(places):
        root.found.add("", f"{len(places) - len(usable)} points of normalPosList have no usable place and are left out")
    return np.repeat(np.array(usable, np.float64).reshape(-1, 1, 2), 2, axis=1)


def _xy(value: Any) -> tuple[float, float] | None:
    """Place of a point [m]; None where it is no point, or not finite."""
    if not isinstance(value, dict):
        return None
    x, y = value.get("x", 0.0), value.get("y", 0.0)
    is_place = all(isinstance(c, int | float) and not isinstance(c, bool) and abs(c) <= LARGEST for c in (x, y))
    return (float(x), float(y)) if is_place else None


def _place(fields: Fields | None) -> tuple[float, float]:
    """Place under an object [m]; what is left out is 0."""
    if fields is None:
        return 0.0, 0.0
    return fields.number("x") or 0.0, fields.number("y") or 0.0


def _lines(root: Fields) -> FloatArray:
    """(N, 2, 2) walls that are drawn as lines."""
    ends = [
        (_place(line.mapping("startPos")), _place(line.mapping("endPos")))
        for line in root.mappings("normalLineList", "line")
    ]
    return np.array(ends, np.float64).reshape(-1, 2, 2)


def _reflectors(root: Fields) -> ReflectorMap:
    """Reflectors; a plate's direction is not in the file, and some have no width."""
    reflectors: list[Reflector] = []
    for number, fields in enumerate(root.mappings("reflectorPosList", "reflector"), start=1):
        word = fields.text("type").lower()
        if word not in ("cylinder", "plane", ""):
            fields.found.add(fields.where, f"type is {shown(word)}; expected cylinder or plane, taken for a cylinder")
        kind = ReflectorKind.FLAT if word == "plane" else ReflectorKind.CYLINDER
        width = fields.number("width", least=0.0)
        if width and width > 2.0:
            fields.found.add(fields.where, f"width is {width:g} m; expected at most 2, so it is unknown")
            width = None
        elif not width:
            fields.found.add(fields.where, "has no width; its radius is unknown")
        if kind is ReflectorKind.FLAT:
            fields.found.add(fields.where, "the format does not say which way a plate faces; its direction is unknown")
        x, y = _place(fields)
        radius = 0.5 * width if width else None
        reflectors.append(Reflector(id=f"R{number}", x=x, y=y, radius=radius, kind=kind))
    return ReflectorMap(tuple(reflectors))


def _edge(fields: Fields) -> Iterator[Edge]:
    """Yield a curve as an edge, or nothing after noting why."""
    name, kind = fields.text("className"), fields.where
    start, end = (fields.mapping(key) for key in ("startPos", "endPos"))
    if start is None or end is None:
        fields.found.add(kind, "has no start or no end; it is left out")
        return
    ends = [_place(each.mapping("pos")) for each in (start, end)]
    if math.dist(*ends) < 1e-6:
        fields.found.add(kind, "begins and ends at one place; it is left out")
        return
    controls = [_place(each) for key in ("controlPos1", "controlPos2") if (each := fields.mapping(key)) is not None]
    order = _CURVES.get(name)
    if order is None or (order and len(controls) < 2):
        problem = f"className {shown(name)} is not known" if order is None else "has no two control points"
        fields.found.add(kind, f"{problem}; a straight line is taken")
        order = ""
    polygon = np.array([ends[0], *controls[:2], ends[1]]) if order else np.array(ends)
    points = polygon[[int(index) for index in order]] if order else polygon
    properties = _properties(fields)
    segment = Segment(control_points=points, degree=len(points) - 1, speed=speed_in(properties, ("maxspeed",)))
    if properties.number("direction") == 1.0:
        segment = replace(segment, direction=Direction.REVERSE)
    names = [
        each.text("instanceName") or f"{place[0]:.11g}, {place[1]:.11g}"
        for each, place in zip((start, end), ends, strict=True)
    ]
    yield Edge(fields.text("instanceName") or "-".join(names), names[0], names[1], segment)


def _properties(fields: Fields) -> Fields:
    """Properties of an element, by their keys: each holds its value under a key that names its type."""
    values: dict[str, Any] = {}
    for each in fields.mappings("property"):
        typed = [value for key, value in each.values.items() if key.endswith("Value")]
        if typed:
            values[each.text("key")] = typed[0]
    return replace(fields, values=values)


def _stations(root: Fields) -> Iterator[Station]:
    """Yield the points at which a vehicle serves."""
    points = [
        each for each in root.mappings("advancedPointList", "point", "instanceName") if each.text("className") in SERVED
    ]
    angles, taken = angles_of(points, "dir"), set[str]()
    for each in points:
        x, y = _place(each.mapping("pos"))
        if each.values.get("ignoreDir") is True:
            each.found.add(each.where, "any heading will do; it is set to 0 rad")
        yield Station(
            name=unique(each.text("instanceName") or "Station", taken), x=x, y=y, heading=angles.of(each) or 0.0
        )


def _note_areas(root: Fields, reflectors: ReflectorMap) -> None:
    """Say what is not read of the areas, and in which of those for reflectors there are too few to localize."""
    from matplotlib.path import Path as Outline

    areas = list(root.mappings("advancedAreaList", "area", "instanceName"))
    if not areas:
        return
    kinds = Counter(area.text("className") or "area" for area in areas)
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    root.found.add("", f"areas are not read ({listed})")
    for area in areas:
        corners = np.array([_place(each) for each in area.mappings("posGroup")])
        if area.text("className") != REFLECTOR_AREA or len(corners) < _FEWEST:
            continue
        inside = int(np.count_nonzero(Outline(corners).contains_points(reflectors.centers)))
        if inside < _FEWEST:
            problem = f"is for localization by reflectors and has fewer than {_FEWEST} inside"
            area.found.add(area.where, f"{problem}; check what can be seen from there")
