"""Corners that go around something: how many there must be, and that they do not cross. No drawing."""

from __future__ import annotations

import itertools
from typing import TypeAlias

Corners: TypeAlias = tuple[tuple[float, float], ...]
"""x and y of each corner [m], in their order around what they enclose."""
_Edge: TypeAlias = tuple[tuple[float, float], tuple[float, float]]


def check_polygon(corners: Corners, name: str, around: str) -> None:
    """Check that corners enclose something.

    Parameters
    ----------
    corners : to be checked.
    name : of the field, for messages.
    around : what they enclose, for messages.

    Raises
    ------
    ValueError
        fewer than three, or two edges meet.
    """
    if len(corners) < 3:
        raise ValueError(f"{name} has {len(corners)} corners; expected 3 or more")
    count = len(corners)
    edges = [(corners[i], corners[(i + 1) % count]) for i in range(count)]
    for i, j in itertools.combinations(range(count), 2):
        if _cross(edges[i], edges[j]):
            one, other = (f"from corner {k + 1} to {(k + 1) % count + 1}" for k in (i, j))
            raise ValueError(
                f"{name} crosses itself: the edge {one} meets the one {other}; "
                f"expected corners in their order around {around}"
            )


def area(corners: Corners) -> float:
    """Area that corners enclose [m^2], whichever way they go around: half the sum of the cross products of neighbors.

    Parameters
    ----------
    corners : x and y of each [m].
    """
    pairs = zip(corners, corners[1:] + corners[:1], strict=True)
    return 0.5 * abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in pairs))


def _cross(one: _Edge, other: _Edge) -> bool:
    """Whether two edges meet inside of both."""

    def side(edge: _Edge, corner: tuple[float, float]) -> float:
        (ax, ay), (bx, by) = edge
        return (bx - ax) * (corner[1] - ay) - (by - ay) * (corner[0] - ax)

    return side(one, other[0]) * side(one, other[1]) < 0.0 and side(other, one[0]) * side(other, one[1]) < 0.0
