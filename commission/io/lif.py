"""Layouts in the Layout Interchange Format of VDMA (LIF 1.0, JSON): read into routes and stations, with a lint.

A layout is a graph and a project has routes: edges that can only be driven one after the other become one route, and
so do edges called NAME/1, NAME/2, ..., as `lif_writer` calls them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from commission.errors import UsageError
from commission.io.findings import Findings, shown
from commission.io.json_document import Fields, read_json
from commission.io.route_chains import routes_along
from commission.io.route_edges import (
    Angles,
    Edge,
    RouteImport,
    angles_of,
    curve,
    directed,
    speed_in,
    unique,
)
from commission.site.stations import Station


@dataclass(frozen=True, slots=True, kw_only=True)
class _Layout:
    """What all layouts of a file hold, before routes are made of it."""

    nodes: dict[str, tuple[float, float]]
    edges: list[tuple[Fields, Fields]]
    stations: list[Fields]
    orientation: Angles
    theta: Angles
    headings: dict[tuple[str, str], float]
    """Heading of a vehicle type on a node [rad]."""


def read_lif(path: Path, *, vehicle_type: str | None = None, layout: str | None = None) -> RouteImport:
    """Read routes and stations.

    Parameters
    ----------
    path : LIF file.
    vehicle_type : vehicle type whose edges are read; the one with the most edges when None.
    layout : identifier of the layout that is read; all of them when None.

    Returns
    -------
    imported : routes, stations, and what the lint found. Elements that cannot be used are passed over and named.

    Raises
    ------
    FileFormatError
        the file is no JSON or has no list of layouts.
    UsageError
        the file has no such vehicle type or layout; names those that it has.
    """
    found = Findings()
    root = _as_published(read_json(path, found))
    root.require_list("layouts")
    _note_version(root, found)
    layouts = list(root.mappings("layouts", "layout", "layoutId"))
    names = tuple(fields.text("layoutId") for fields in layouts)
    chosen = _chosen(layouts, names, layout, found)
    content = _content(chosen, found)
    counts = Counter(part.text("vehicleTypeId") for _, part in content.edges)
    kind = _vehicle_type(counts, vehicle_type, found)
    edges = [
        edge
        for fields, part in content.edges
        if part.text("vehicleTypeId") == kind
        for edge in _edge(fields, part, content)
    ]
    routes = routes_along(edges, found)
    stations = tuple(_stations(content, kind))
    return RouteImport(
        routes=routes, warnings=found.lines(), stations=stations, vehicle_types=tuple(counts), layouts=names
    )


_RENAMED = {
    "mobileRobotTypeNodeProperties": "vehicleTypeNodeProperties",
    "mobileRobotTypeEdgeProperties": "vehicleTypeEdgeProperties",
    "mobileRobotTypes": "vehicleTypeIds",
    "mobileRobotOrientations": "vehicleOrientations",
}
"""What the drafts of LIF 2 of September 2025 and later call otherwise than version 1."""


def _as_published(root: Fields) -> Fields:
    """Return a draft of LIF 2, whose layouts lie in origins and whose vehicles are mobile robots, as version 1 has it.

    Each origin has coordinates of its own, so that several are noted.
    """
    if "layouts" in root.values or "origins" not in root.values:
        return root
    layouts: list[Any] = []
    origins = list(root.mappings("origins", "origin", "originId"))
    for origin in origins:
        for layout in origin.mappings("layouts", "layout", "layoutId"):
            layouts.append({"stations": [], **_renamed(layout.values)})
    if len(origins) > 1:
        named = ", ".join(shown(origin.text("originId")) for origin in origins[:5])
        root.found.add("", f"{len(origins)} origins ({named}) have coordinates of their own; choose a layout of one")
    return replace(root, values={**root.values, "layouts": layouts})


def _renamed(value: Any) -> Any:
    """Return a value with keys, and types of vehicles, as version 1 has them."""
    if isinstance(value, list):
        return [_renamed(each) for each in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {"manufacturer", "seriesName"}:
        return f"{value['manufacturer']} {value['seriesName']}"
    return {_RENAMED.get(str(key).strip(), key): _renamed(each) for key, each in value.items()}


def is_layout(root: Fields) -> bool:
    """Whether a document is a LIF layout, of version 1 or a draft of version 2."""
    return "layouts" in root.values or "origins" in root.values


def _note_version(root: Fields, found: Findings) -> None:
    """Say when the file is of another version than the one that is published."""
    meta = root.values.get("metaInformation")
    version = meta.get("lifVersion") if isinstance(meta, dict) else None
    if isinstance(version, str) and not version.startswith(("1.", "0.")) and version != "1":
        found.add("", f"lifVersion is {shown(version)}; 1.0 is known, and of later drafts what this file uses of them")


def _for_each_type(part: Fields) -> Iterator[Fields]:
    """Properties of each vehicle type: drafts of LIF 2 give one set for several types, and several orientations."""
    values = dict(part.values)
    orientations = values.pop("vehicleOrientations", None)
    if isinstance(orientations, list) and orientations and "vehicleOrientation" not in values:
        values["vehicleOrientation"] = orientations[0]
        if len(orientations) > 1:
            part.found.add(part.where, "allows several vehicleOrientations; the first counts")
    types = values.pop("vehicleTypeIds", None)
    if "vehicleTypeId" in values or not isinstance(types, list):
        types = [values.get("vehicleTypeId")]
    for name in types:
        yield replace(part, values={**values, "vehicleTypeId": name} if name is not None else values)


def _chosen(layouts: list[Fields], names: tuple[str, ...], layout: str | None, found: Findings) -> list[Fields]:
    if layout is not None:
        if layout not in names:
            raise UsageError(f"no layout is called {layout!r}; the file has: {', '.join(map(repr, names)) or 'none'}")
        return [fields for fields, name in zip(layouts, names, strict=True) if name == layout]
    if len(layouts) > 1:
        listed = ", ".join(map(shown, names[:5]))
        levels = {fields.text("layoutLevelId") or "" for fields in layouts}
        floors = {node.text("mapId") or "" for fields in layouts for node in fields.mappings("nodes", "node", "nodeId")}
        if len(levels) > 1 or len(floors) > 1:
            count = max(len(levels), len(floors))
            found.add("", f"{len(layouts)} layouts ({listed}) of {count} floors are laid over one another; choose one")
        else:
            found.add("", f"{len(layouts)} layouts ({listed}) are laid over one another")
    return layouts


def _content(layouts: list[Fields], found: Findings) -> _Layout:
    """Collect nodes, edges and stations; the same identifier twice is noted, the first counts."""
    nodes: dict[str, tuple[float, float]] = {}
    edges: list[tuple[Fields, Fields]] = []
    stations: list[Fields] = []
    poses: list[tuple[str, Fields]] = []
    for layout in layouts:
        if "stations" not in layout.values:
            found.add(layout.where, "stations is missing; LIF demands the key, if only with an empty list")
        for node in layout.mappings("nodes", "node", "nodeId"):
            for part in node.mappings("vehicleTypeNodeProperties"):
                poses.extend((node.text("nodeId"), each) for each in _for_each_type(part))
            _add_node(node, nodes)
        for edge in layout.mappings("edges", "edge", "edgeId"):
            parts = [each for part in edge.mappings("vehicleTypeEdgeProperties") for each in _for_each_type(part)]
            if not parts:
                found.add(edge.where, "no vehicle type may drive it; it is left out")
            edges.extend((edge, replace(part, where=edge.where)) for part in parts)
        stations.extend(layout.mappings("stations", "station", "stationId"))
    positions = [p for station in stations if (p := station.mapping("stationPosition")) is not None]
    orientation = angles_of((part for _, part in edges), "vehicleOrientation")
    theta = angles_of([*(part for _, part in poses), *positions], "theta")
    headings = {
        (node, part.text("vehicleTypeId")): angle for node, part in poses if (angle := theta.of(part)) is not None
    }
    return _Layout(nodes=nodes, edges=edges, stations=stations, orientation=orientation, theta=theta, headings=headings)


def _add_node(node: Fields, nodes: dict[str, tuple[float, float]]) -> None:
    name = node.text("nodeId")
    position = node.mapping("nodePosition")
    x, y = (position.number("x"), position.number("y")) if position is not None else (None, None)
    if not name or x is None or y is None:
        node.found.add(node.where, "has no name or no place; it is left out")
    elif name in nodes:
        node.found.add(node.where, "nodeId is used twice; the first counts")
    else:
        nodes[name] = (x, y)


def _vehicle_type(counts: Counter[str], wanted: str | None, found: Findings) -> str:
    if wanted is not None:
        if wanted not in counts:
            known = ", ".join(map(repr, counts)) or "none"
            raise UsageError(f"no vehicle type is called {wanted!r}; the file has: {known}")
        return wanted
    if len(counts) > 1:
        kind = counts.most_common(1)[0][0]
        others = ", ".join(shown(name) for name in counts if name != kind)
        found.add("", f"routes are those of vehicle type {shown(kind)}; the file also has {others}")
    return counts.most_common(1)[0][0] if counts else ""


def _edge(fields: Fields, part: Fields, content: _Layout) -> Iterator[Edge]:
    """Yield the edge, or nothing after noting why."""
    start, end = fields.text("startNodeId"), fields.text("endNodeId")
    for node in (start, end):
        if node not in content.nodes:
            part.found.add(part.where, f"node {shown(node)} does not exist or has no place")
    segment = curve(part, (content.nodes.get(start), content.nodes.get(end)))
    if segment is None:
        return
    segment = directed(segment, part, content.orientation)
    speed = speed_in(part, ("maxSpeed",))
    yield Edge(fields.text("edgeId") or f"{start}-{end}", start, end, replace(segment, speed=speed))


def _stations(content: _Layout, kind: str) -> Iterator[Station]:
    """Yield a station for each node at which a vehicle stands to serve one; notes those without a place."""
    taken: set[str] = set()
    for fields in content.stations:
        values = fields.values.get("interactionNodeIds")
        nodes = [node for node in values if isinstance(node, str)] if isinstance(values, list) else []
        for node in nodes:
            if node not in content.nodes:
                fields.found.add(fields.where, f"node {shown(node)} does not exist or has no place")
        usable = [node for node in nodes if node in content.nodes]
        if not usable:
            fields.found.add(fields.where, "no vehicle can stand at it; it is left out")
        position = fields.mapping("stationPosition")
        for node in usable:
            name = fields.text("stationName") or fields.text("stationId") or node
            theta = content.headings.get((node, kind))
            if theta is None and position is not None:
                theta = content.theta.of(position)
            if theta is None:
                fields.found.add(fields.where, "says no heading; it is set to 0 rad")
            name = unique(name if len(usable) == 1 else f"{name} from {node}", taken)
            x, y = content.nodes[node]
            yield Station(name=name, x=x, y=y, heading=0.0 if theta is None else theta)
