"""Entities of a drawing as shapes: what the pairs of code and value of each kind mean."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from commission.io.dxf_bodies import Corner, faces, hatch, multiline, polyline
from commission.io.dxf_shapes import Affine, Arc, BSpline, Point, Polyline, Shape, through
from commission.io.dxf_tags import DxfGroup


@dataclass(frozen=True, slots=True, kw_only=True)
class Insert:
    """A block put into a drawing, or into another block."""

    block: str
    to: Affine
    """From the block's coordinates, its base point at the origin."""
    rows: int
    columns: int
    row_step: Point
    column_step: Point


def shapes_of(group: DxfGroup, vertices: Sequence[DxfGroup]) -> Iterator[Shape]:
    """Shapes of an entity; `vertices` are those of a POLYLINE. Raises ValueError or KeyError when it is unreadable."""
    if group.kind == b"LINE":
        values = dict(group.tags)
        start, end = (float(values[10]), float(values[20])), (float(values[11]), float(values[21]))
        yield Polyline((start, end))
    elif group.kind in (b"CIRCLE", b"ARC"):
        yield _circle(group)
    elif group.kind == b"LWPOLYLINE":
        corners = _light_corners(group)
        yield from polyline(corners, bool(group.whole(70) & 1), _plane(group))
    elif group.kind == b"POLYLINE":
        flags = group.whole(70)
        # Bit 16 of a vertex: a control point of the spline that other vertices follow.
        kept = [v for v in vertices if not v.whole(70) & 16]
        widths = group.number(40), group.number(41)
        corners = [
            Corner((v.number(10), v.number(20)), v.number(42), (v.number(40, widths[0]), v.number(41, widths[1])))
            for v in kept
        ]
        yield from polyline(corners, bool(flags & 1), Affine() if flags & 8 else _plane(group))
    elif group.kind == b"ELLIPSE":
        yield _ellipse(group)
    elif group.kind == b"SPLINE":
        yield _spline(group)
    elif group.kind in (b"SOLID", b"TRACE", b"3DFACE"):
        yield from faces(group, _plane(group))
    elif group.kind == b"MLINE":
        yield from multiline(group)
    elif group.kind == b"HATCH":
        yield from hatch(group)


def insert_of(group: DxfGroup) -> Insert:
    """Read an INSERT; raises ValueError when it is unreadable."""
    turn = math.radians(group.number(50))
    c, s = math.cos(turn), math.sin(turn)
    sx, sy = group.number(41, 1.0), group.number(42, 1.0)
    plane = _plane(group)
    to = plane.after(Affine(xx=c * sx, xy=-s * sy, yx=s * sx, yy=c * sy, x0=group.number(10), y0=group.number(20)))
    dx, dy = group.number(44), group.number(45)
    row_step, column_step = plane.vector(-s * dy, c * dy), plane.vector(c * dx, s * dx)
    return Insert(
        block=group.name(2),
        to=to,
        rows=max(group.whole(71, 1), 1),
        columns=max(group.whole(70, 1), 1),
        row_step=row_step,
        column_step=column_step,
    )


def _plane(group: DxfGroup) -> Affine:
    """From an entity's own coordinates to the floor plan: mirrored when the entity was drawn from below."""
    extrusion = (group.number(210), group.number(220), group.number(230, 1.0))
    if extrusion[0] == extrusion[1] == 0.0 and extrusion[2] > 0.0:
        return Affine()
    from ezdxf.math import OCS, Vec3

    ocs = OCS(Vec3(extrusion))
    x, y, up = ocs.ux, ocs.uy, ocs.uz * (group.number(38) or group.number(30))
    return Affine(xx=x.x, xy=y.x, yx=x.y, yy=y.y, x0=up.x, y0=up.y)


def _circle(group: DxfGroup) -> Arc:
    radius = group.number(40)
    if not radius > 0.0:
        raise ValueError("radius is not positive")
    start, end = 0.0, 2.0 * math.pi
    if group.kind == b"ARC":
        start = math.radians(group.number(50))
        end = start + (math.radians(group.number(51)) - start) % (2.0 * math.pi)
    return through(
        _plane(group),
        Arc(center=(group.number(10), group.number(20)), u=(radius, 0.0), v=(0.0, radius), start=start, end=end),
    )


def _ellipse(group: DxfGroup) -> Arc:
    """Center and major axis are given in the drawing's coordinates; the minor axis lies across them and the normal."""
    from ezdxf.math import Vec3

    major = Vec3(group.number(11), group.number(21), group.number(31))
    normal = Vec3(group.number(210), group.number(220), group.number(230, 1.0)).normalize()
    minor = normal.cross(major) * group.number(40, 1.0)
    start, end = group.number(41), group.number(42, 2.0 * math.pi)
    if end <= start:
        end += 2.0 * math.pi
    return Arc(
        center=(group.number(10), group.number(20)), u=(major.x, major.y), v=(minor.x, minor.y), start=start, end=end
    )


def _light_corners(group: DxfGroup) -> list[Corner]:
    """Vertices of an LWPOLYLINE: codes 10, 20 and, if any, 40, 41, 42 for each in turn; 43 is a width of all."""
    width = group.number(43)
    corners: list[Corner] = []
    x = 0.0
    for code, value in group.tags:
        if code == 10:
            x = float(value)
        elif code == 20:
            corners.append(Corner((x, float(value)), widths=(width, width)))
        elif code == 42 and corners:
            corners[-1].bulge = float(value)
        elif code in (40, 41) and corners and not width:
            start, end = corners[-1].widths
            corners[-1].widths = (float(value), end) if code == 40 else (start, float(value))
    return corners


def _spline(group: DxfGroup) -> BSpline:
    values: dict[int, list[float]] = {code: [] for code in (10, 20, 11, 21, 40, 41)}
    for code, value in group.tags:
        if code in values:
            values[code].append(float(value))
    degree = group.whole(71, 3)
    if values[10]:
        points, knots, weights = list(zip(values[10], values[20], strict=True)), values[40], values[41]
    else:
        from ezdxf.math import Vec3, fit_points_to_cad_cv

        fitted = fit_points_to_cad_cv([Vec3(x, y) for x, y in zip(values[11], values[21], strict=True)])
        points, knots, weights = [(p.x, p.y) for p in fitted.control_points], list(fitted.knots()), []
        degree = fitted.degree
    w = np.array(weights if len(weights) == len(points) else [1.0] * len(points))
    t = np.array(knots)
    if not 1 <= degree <= 10 or len(t) != len(points) + degree + 1 or (np.diff(t) < 0.0).any() or not (w > 0.0).all():
        raise ValueError("degree, knots and control points do not fit each other")
    if not t[degree] < t[len(points)] or not np.isfinite(t).all():
        raise ValueError("the knots span nothing")
    return BSpline(degree, t, np.column_stack((np.array(points) * w[:, np.newaxis], w)))
