"""From the edges of a network to routes: which edges follow one another, and what the routes are called."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence

from commission.io.findings import Findings
from commission.io.route_edges import CORNER, Edge, follows, note_corners, route_of, turn, unique
from commission.site.routes import Route

_NUMBERED = re.compile(r"(?P<name>.+)/(?P<number>[1-9][0-9]{0,5})", re.DOTALL)


def routes_along(edges: Sequence[Edge], found: Findings) -> tuple[Route, ...]:
    """Join edges into routes: those that can only be driven one after the other, and those called NAME/1, NAME/2, ...

    Parameters
    ----------
    edges : in the order of the file.
    found : told where a vehicle would have to turn on the spot.
    """
    taken: set[str] = set()
    routes: list[Route] = []
    named, rest = _numbered(edges)
    for wanted, chain in [*named, *_chains(rest)]:
        name = unique(wanted, taken)
        note_corners(name, chain, found)
        routes.append(route_of(name, chain))
    return tuple(routes)


def _numbered(edges: Sequence[Edge]) -> tuple[list[tuple[str, list[Edge]]], list[Edge]]:
    """Edges called NAME/1, NAME/2, ... that follow one another, by NAME; and the others."""
    groups: dict[str, dict[int, Edge]] = {}
    for edge in edges:
        if match := _NUMBERED.fullmatch(edge.id):
            groups.setdefault(match["name"], {}).setdefault(int(match["number"]), edge)
    chains: list[tuple[str, list[Edge]]] = []
    used: set[int] = set()
    for name, group in groups.items():
        chain = [group[number] for number in range(1, len(group) + 1) if number in group]
        pairs = itertools.pairwise(chain)
        if len(chain) == len(group) and all(a.end == b.start and follows(a, b) for a, b in pairs):
            chains.append((name, chain))
            used.update(id(edge) for edge in chain)
    return chains, [edge for edge in edges if id(edge) not in used]


def _chains(edges: list[Edge]) -> Iterator[tuple[str, list[Edge]]]:
    """Longest chains in which each edge has one successor and that one no other predecessor, ways back not counted."""
    leaving: dict[str, list[Edge]] = {}
    arriving: dict[str, list[Edge]] = {}
    for edge in edges:
        leaving.setdefault(edge.start, []).append(edge)
        arriving.setdefault(edge.end, []).append(edge)
    following: dict[int, Edge] = {}
    for edge in edges:
        onward = [e for e in leaving.get(edge.end, ()) if e.end != edge.start]
        if len(onward) != 1:
            continue
        rivals = [e for e in arriving[edge.end] if e.start != onward[0].end]
        if len(rivals) == 1 and follows(edge, onward[0]) and turn(edge.segment, onward[0].segment) <= CORNER:
            following[id(edge)] = onward[0]
    # A ring has no beginning: after the chains that have one, it is begun at the first of its edges.
    heads = {id(edge) for edge in edges} - {id(edge) for edge in following.values()}
    done: set[int] = set()
    for edge in [*(e for e in edges if id(e) in heads), *(e for e in edges if id(e) not in heads)]:
        chain: list[Edge] = []
        step: Edge | None = edge
        while step is not None and id(step) not in done:
            done.add(id(step))
            chain.append(step)
            step = following.get(id(step))
        if chain:
            yield (chain[0].id if len(chain) == 1 else f"{chain[0].start} to {chain[-1].end}"), chain
