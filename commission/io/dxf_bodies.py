"""Bodies of a drawing by their outlines: wide polylines, faces, multilines (how AutoCAD draws walls), hatches.

A laser sees the outside of a wall and nothing of its inside, so outlines are all that a floor map needs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from commission.io.dxf_shapes import Affine, BSpline, Point, Polyline, Shape, bulged
from commission.io.dxf_tags import DxfGroup


@dataclass(slots=True)
class Corner:
    """A vertex of a polyline, and what leads from it to the next one."""

    point: Point
    bulge: float = 0.0
    """Tangent of a quarter of the arc's angle, positive to the left; 0: straight."""
    widths: tuple[float, float] = (0.0, 0.0)
    """Width at its start and at its end."""


def polyline(corners: list[Corner], closed: bool, plane: Affine) -> Iterator[Shape]:
    """Center line of a thin polyline, outlines of the stretches of a wide one: a wall drawn with its thickness.

    Parameters
    ----------
    corners : with widths and bulges.
    closed : whether the last is joined to the first.
    plane : where the drawing's plane lies.
    """
    if any(width > 0.0 for corner in corners for width in corner.widths):
        yield from _outlines(corners, closed, plane)
    else:
        yield from bulged([c.point for c in corners], [c.bulge for c in corners], closed, plane)


def _outlines(corners: list[Corner], closed: bool, plane: Affine) -> Iterator[Shape]:
    """Both sides and both ends of each stretch."""
    following = corners[1:] + (corners[:1] if closed else [])
    for corner, after in zip(corners, following, strict=False):
        (x1, y1), (x2, y2) = corner.point, after.point
        chord = math.hypot(x2 - x1, y2 - y1)
        if chord == 0.0:
            continue
        # The direction of travel turns from -2 atan(bulge) to +2 atan(bulge) against the chord.
        turn, along = 2.0 * math.atan(corner.bulge), math.atan2(y2 - y1, x2 - x1)
        sides: list[list[Point]] = []
        for sign in (1.0, -1.0):
            (ax, ay), (bx, by) = _left(along - turn), _left(along + turn)
            start, end = (0.5 * sign * width for width in corner.widths)
            sides.append([(x1 + start * ax, y1 + start * ay), (x2 + end * bx, y2 + end * by)])
        for side in sides:
            yield from bulged(side, [corner.bulge], False, plane)
        for end in (0, 1):
            yield Polyline([plane.point(*side[end]) for side in sides])


def _left(heading: float) -> Point:
    """Unit vector to the left of a heading."""
    return -math.sin(heading), math.cos(heading)


def faces(group: DxfGroup, flat: Affine) -> Iterator[Shape]:
    """Outline of a SOLID, TRACE or 3DFACE; the third and fourth corner of the first two are swapped in the file."""
    corners = [(group.number(10 + i), group.number(20 + i)) for i in range(3)]
    last = (group.number(13, corners[2][0]), group.number(23, corners[2][1]))
    if group.kind == b"3DFACE":
        ring, hidden, plane = [*corners, last], group.whole(70), Affine()
    else:
        ring, hidden, plane = [*corners[:2], last, corners[2]], 0, flat
    for side, (start, end) in enumerate(zip(ring, [*ring[1:], ring[0]], strict=True)):
        if not hidden >> side & 1 and start != end:
            yield Polyline([plane.point(*start), plane.point(*end)])


def multiline(group: DxfGroup) -> Iterator[Shape]:
    """Elements of an MLINE, how AutoCAD draws a wall, and a cap at each open end.

    Each vertex (codes 11, 21) has a miter (13, 23) on which each element lies at its first parameter (41 behind 74).
    """
    vertices: list[tuple[list[float], list[float], list[float]]] = []
    is_first = False
    for code, value in group.tags:
        if code == 11:
            vertices.append(([float(value)], [], []))
        elif code == 21 and vertices:
            vertices[-1][0].append(float(value))
        elif code in (13, 23) and vertices:
            vertices[-1][1].append(float(value))
        elif code == 74 and vertices:
            is_first = int(value) > 0
        elif code == 41 and vertices and is_first:
            vertices[-1][2].append(float(value))
            is_first = False
    rows = [
        [(x + mx * offset, y + my * offset) for offset in offsets or [0.0]] for (x, y), (mx, my), offsets in vertices
    ]
    elements = [list(element) for element in zip(*rows, strict=True)]
    is_closed = bool(group.whole(71) & 2)
    for element in elements:
        yield Polyline([*element, element[0]] if is_closed else element)
    if len(elements) > 1 and not is_closed:
        for row in (rows[0], rows[-1]):
            yield Polyline(row)


def hatch(group: DxfGroup) -> Iterator[Shape]:
    """Boundaries of a hatch; ezdxf knows their many forms."""
    from ezdxf.entities.factory import load
    from ezdxf.lldxf.extendedtags import ExtendedTags
    from ezdxf.lldxf.tagger import tag_compiler
    from ezdxf.lldxf.types import DXFTag
    from ezdxf.path import from_hatch

    tags = (DXFTag(code, value.decode("latin-1")) for code, value in ((0, group.kind), *group.tags))
    entity = load(ExtendedTags(tag_compiler(tags)))
    for path in from_hatch(entity):  # type: ignore[arg-type]  # a HATCH is a DXFPolygon
        at = path.start
        for command in path.commands():
            points = [at, *(getattr(command, name) for name in ("ctrl1", "ctrl2", "ctrl") if hasattr(command, name))]
            at = command.end
            points.append(at)
            if len(points) == 2:
                yield Polyline([(points[0].x, points[0].y), (at.x, at.y)])
            else:
                degree = len(points) - 1
                knots = np.repeat([0.0, 1.0], degree + 1)
                yield BSpline(degree, knots, np.array([(p.x, p.y, 1.0) for p in points]))
