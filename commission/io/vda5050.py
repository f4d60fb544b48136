"""Orders of VDA 5050 (JSON; versions 2.0, 2.1 and 3.0): read into routes. Nothing is sent, and actions are not read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from commission.io.findings import Findings, shown
from commission.io.json_document import Fields, read_json
from commission.io.route_edges import (
    Angles,
    Edge,
    RouteImport,
    angles_of,
    curve,
    directed,
    follows,
    note_corners,
    route_of,
    speed_in,
    unique,
)

VERSIONS = ("2.0", "2.1", "3.0")
_SPEEDS = ("maxSpeed", "maximumSpeed")
"""Key of the permitted speed in versions 2 and 3."""


def read_order(path: Path) -> RouteImport:
    """Read an order.

    Parameters
    ----------
    path : JSON file with one order message.

    Returns
    -------
    imported : one route called after the order, or several where its edges do not follow one another; horizon included.

    Raises
    ------
    FileFormatError
        the file is no JSON or has no lists of nodes and edges.
    """
    found = Findings()
    root = read_json(path, found)
    root.require_list("nodes")
    root.require_list("edges")
    version = root.text("version")
    if not version.startswith(tuple(f"{known}." for known in VERSIONS)) and version not in VERSIONS:
        found.add("", f"version is {shown(version)}; known are {', '.join(VERSIONS)}")
    nodes = list(root.mappings("nodes", "node", "nodeId"))
    edges = _in_sequence(list(root.mappings("edges", "edge", "edgeId")))
    _note_left_out(nodes, edges, found)
    orientation = angles_of(edges, "orientation")
    places = _Places(nodes)
    chains: list[list[Edge]] = []
    for edge in (e for fields in edges for e in _edge(fields, places, orientation)):
        if chains and follows(chains[-1][-1], edge):
            chains[-1].append(edge)
        else:
            chains.append([edge])
    if len(chains) > 1:
        found.add("", f"edges do not follow one another; the order becomes {len(chains)} routes")
    taken: set[str] = set()
    named = [(unique(root.text("orderId") or path.stem, taken), chain) for chain in chains]
    for name, chain in named:
        note_corners(name, chain, found)
    return RouteImport(routes=tuple(route_of(name, chain) for name, chain in named), warnings=found.lines())


class _Places:
    """Where nodes are: by their place in the sequence, since one node may be visited twice, otherwise by name."""

    def __init__(self, nodes: Sequence[Fields]) -> None:
        self._by_sequence: dict[float, tuple[str, tuple[float, float] | None]] = {}
        self._by_name: dict[str, tuple[float, float]] = {}
        for node in nodes:
            position = node.mapping("nodePosition")
            x, y = (position.number("x"), position.number("y")) if position is not None else (None, None)
            place = None if x is None or y is None else (x, y)
            sequence = node.number("sequenceId", least=0.0)
            name = node.text("nodeId")
            if sequence is not None:
                self._by_sequence.setdefault(sequence, (name, place))
            if place is not None:
                self._by_name.setdefault(name, place)

    def end(self, edge: Fields, key: str, step: int) -> tuple[str, tuple[float, float] | None]:
        """Name and place of an end of an edge: the node one step before or behind it, or the one it names."""
        name = edge.text(key)
        sequence = edge.number("sequenceId", least=0.0)
        if sequence is not None and sequence + step in self._by_sequence:
            neighbor, place = self._by_sequence[sequence + step]
            if neighbor == name or not name:
                return neighbor, place
        return name, self._by_name.get(name)


def _in_sequence(edges: list[Fields]) -> list[Fields]:
    """Edges by their sequenceId; those without one come last, in the order of the file."""
    numbers = [edge.number("sequenceId", least=0.0) for edge in edges]
    order = sorted(range(len(edges)), key=lambda i: float("inf") if (n := numbers[i]) is None else n)
    return [edges[i] for i in order]


def _edge(fields: Fields, places: _Places, orientation: Angles) -> Iterator[Edge]:
    """Yield the edge, or nothing after noting why."""
    (start, start_place), (end, end_place) = places.end(fields, "startNodeId", -1), places.end(fields, "endNodeId", 1)
    segment = curve(fields, (start_place, end_place))
    if segment is None:
        return
    speed = speed_in(fields, _SPEEDS)
    yield Edge(fields.text("edgeId"), start, end, replace(directed(segment, fields, orientation), speed=speed))


def _note_left_out(nodes: Sequence[Fields], edges: Sequence[Fields], found: Findings) -> None:
    """Say what is in the order and not in a route."""
    waiting = sum(edge.values.get("released") is False for edge in edges)
    if waiting:
        found.add("", f"{waiting} edges are not released yet (horizon); they are read like the others")
    actions = sum(
        len(part.values["actions"]) for part in (*nodes, *edges) if isinstance(part.values.get("actions"), list)
    )
    if actions:
        found.add("", f"{actions} actions are not read")
    if any("corridor" in edge.values for edge in edges):
        found.add("", "corridors are not read")
