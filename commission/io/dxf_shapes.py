"""Curves of a drawing as points, elliptic arcs and B-splines: each stays of its kind under any map of the plane.

Blocks are inserted scaled, turned, mirrored and sheared; only the result is cut into chords, to a stated tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.io.dxf_tags import Group

MOST_CHORDS = 10_000
"""Chords of one curve; a circle of 100 km radius at a tolerance of 5 mm has as many."""
_COARSEST = math.radians(30.0)
"""A chord spans no more of an arc than this, however small the arc is: a pillar stays round."""

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Affine:
    """A map of the plane: x' = xx x + xy y + x0, y' = yx x + yy y + y0."""

    xx: float = 1.0
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 1.0
    x0: float = 0.0
    y0: float = 0.0

    def point(self, x: float, y: float) -> Point:
        """Image of a point."""
        return self.xx * x + self.xy * y + self.x0, self.yx * x + self.yy * y + self.y0

    def vector(self, x: float, y: float) -> Point:
        """Image of a difference of points."""
        return self.xx * x + self.xy * y, self.yx * x + self.yy * y

    def after(self, first: Affine) -> Affine:
        """Map that does `first` and then this one."""
        xx, yx = self.vector(first.xx, first.yx)
        xy, yy = self.vector(first.xy, first.yy)
        return Affine(xx, xy, yx, yy, *self.point(first.x0, first.y0))


@dataclass(frozen=True, slots=True)
class Polyline:
    """Straight lines through points."""

    points: Sequence[Point]

    def chords(self, to: Affine, tolerance: float) -> Sequence[Point]:  # noqa: ARG002  # lines are exact
        """Points of the image."""
        return [to.point(x, y) for x, y in self.points]


@dataclass(frozen=True, slots=True)
class Arc:
    """Points center + u cos t + v sin t, t from `start` to `end`: circles and ellipses, whole or in part."""

    center: Point
    u: Point
    v: Point
    start: float = 0.0
    end: float = 2.0 * math.pi

    def chords(self, to: Affine, tolerance: float) -> Sequence[Point]:
        """Points of the image, no farther than `tolerance` from it in between."""
        (cx, cy), (ux, uy), (vx, vy) = to.point(*self.center), to.vector(*self.u), to.vector(*self.v)
        # The ellipse is the image of the unit circle, stretched by at most this: a chord's error is too.
        stretch = math.hypot(math.hypot(ux, uy), math.hypot(vx, vy))
        step = 2.0 * math.acos(max(1.0 - tolerance / stretch, -1.0)) if stretch > tolerance else math.pi
        step = min(max(step, 1e-9), _COARSEST)
        count = min(math.ceil(abs(self.end - self.start) / step), MOST_CHORDS)
        angles = (self.start + (self.end - self.start) * i / max(count, 1) for i in range(count + 1))
        return [(cx + ux * (c := math.cos(t)) + vx * (s := math.sin(t)), cy + uy * c + vy * s) for t in angles]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A B-spline, rational where weights differ, over the part of its knots where it is defined."""

    degree: int
    knots: FloatArray
    controls: FloatArray
    """(N, 3) weighted control points: w x, w y, w."""

    def chords(self, to: Affine, tolerance: float) -> Sequence[Point]:
        """Points of the image; halved until the middles of chords lie within `tolerance`."""
        w = self.controls[:, 2]
        x = to.xx * self.controls[:, 0] + to.xy * self.controls[:, 1] + to.x0 * w
        y = to.yx * self.controls[:, 0] + to.yy * self.controls[:, 1] + to.y0 * w
        from scipy.interpolate import BSpline

        spline = BSpline(self.knots, np.column_stack((x, y, w)), self.degree)
        breaks = np.unique(self.knots[self.degree : len(self.controls) + 1])
        while True:
            u = np.sort(np.concatenate((breaks, 0.5 * (breaks[:-1] + breaks[1:]))))
            values = spline(u)
            points = values[:, :2] / values[:, 2:]
            error = np.linalg.norm(points[1:-1:2] - 0.5 * (points[:-2:2] + points[2::2]), axis=1)
            # A symmetric S has its middle on the chord: two halvings in any case.
            rough = error > tolerance if len(u) > 8 * self.degree else np.ones(len(error), dtype=np.bool_)
            if not rough.any() or len(u) > MOST_CHORDS:
                return [(float(px), float(py)) for px, py in points]
            breaks = np.sort(np.concatenate((breaks, u[1:-1:2][rough])))


Shape = Polyline | Arc | Curve


@dataclass(frozen=True, slots=True)
class Insert:
    """A block put into a drawing, or into another block."""

    block: str
    to: Affine
    """From the block's coordinates, its base point at the origin."""
    rows: int
    columns: int
    row_step: Point
    column_step: Point


def shapes_of(group: Group, vertices: Sequence[Group]) -> Iterator[Shape]:
    """Shapes of an entity; `vertices` are those of a POLYLINE. Raises ValueError or KeyError when it is unreadable."""
    if group.kind == b"LINE":
        values = dict(group.tags)
        start, end = (float(values[10]), float(values[20])), (float(values[11]), float(values[21]))
        yield Polyline((start, end))
    elif group.kind in (b"CIRCLE", b"ARC"):
        yield _circle(group)
    elif group.kind == b"LWPOLYLINE":
        yield from _bulged(*_light_points(group), bool(group.whole(70) & 1), _plane(group))
    elif group.kind == b"POLYLINE":
        flags = group.whole(70)
        # Bit 16 of a vertex: a control point of the spline that other vertices follow.
        kept = [v for v in vertices if not v.whole(70) & 16]
        points = [(v.number(10), v.number(20)) for v in kept]
        plane = Affine() if flags & 8 else _plane(group)
        yield from _bulged(points, [v.number(42) for v in kept], bool(flags & 1), plane)
    elif group.kind == b"ELLIPSE":
        yield _ellipse(group)
    elif group.kind == b"SPLINE":
        yield _spline(group)


def insert_of(group: Group) -> Insert:
    """Read an INSERT; raises ValueError when it is unreadable."""
    turn = math.radians(group.number(50))
    c, s = math.cos(turn), math.sin(turn)
    sx, sy = group.number(41, 1.0), group.number(42, 1.0)
    plane = _plane(group)
    to = plane.after(Affine(c * sx, -s * sy, s * sx, c * sy, group.number(10), group.number(20)))
    dx, dy = group.number(44), group.number(45)
    row_step, column_step = plane.vector(-s * dy, c * dy), plane.vector(c * dx, s * dx)
    return Insert(group.name(2), to, max(group.whole(71, 1), 1), max(group.whole(70, 1), 1), row_step, column_step)


def _plane(group: Group) -> Affine:
    """From an entity's own coordinates to the floor plan: mirrored when the entity was drawn from below."""
    extrusion = (group.number(210), group.number(220), group.number(230, 1.0))
    if extrusion[0] == extrusion[1] == 0.0 and extrusion[2] > 0.0:
        return Affine()
    from ezdxf.math import OCS, Vec3

    ocs = OCS(Vec3(extrusion))
    x, y, up = ocs.ux, ocs.uy, ocs.uz * (group.number(38) or group.number(30))
    return Affine(x.x, y.x, x.y, y.y, up.x, up.y)


def _through(plane: Affine, arc: Arc) -> Arc:
    return Arc(plane.point(*arc.center), plane.vector(*arc.u), plane.vector(*arc.v), arc.start, arc.end)


def _circle(group: Group) -> Arc:
    radius = group.number(40)
    if not radius > 0.0:
        raise ValueError("radius is not positive")
    start, end = 0.0, 2.0 * math.pi
    if group.kind == b"ARC":
        start = math.radians(group.number(50))
        end = start + (math.radians(group.number(51)) - start) % (2.0 * math.pi)
    return _through(_plane(group), Arc((group.number(10), group.number(20)), (radius, 0.0), (0.0, radius), start, end))


def _ellipse(group: Group) -> Arc:
    """Center and major axis are given in the drawing's coordinates; the minor axis lies across them and the normal."""
    from ezdxf.math import Vec3

    major = Vec3(group.number(11), group.number(21), group.number(31))
    normal = Vec3(group.number(210), group.number(220), group.number(230, 1.0)).normalize()
    minor = normal.cross(major) * group.number(40, 1.0)
    start, end = group.number(41), group.number(42, 2.0 * math.pi)
    if end <= start:
        end += 2.0 * math.pi
    return Arc((group.number(10), group.number(20)), (major.x, major.y), (minor.x, minor.y), start, end)


def _light_points(group: Group) -> tuple[list[Point], list[float]]:
    """Points and bulges of an LWPOLYLINE: codes 10, 20 and, if any, 42 for each point in turn."""
    points: list[Point] = []
    bulges: list[float] = []
    x = 0.0
    for code, value in group.tags:
        if code == 10:
            x = float(value)
        elif code == 20:
            points.append((x, float(value)))
            bulges.append(0.0)
        elif code == 42 and bulges:
            bulges[-1] = float(value)
    return points, bulges


def _bulged(points: list[Point], bulges: list[float], closed: bool, plane: Affine) -> Iterator[Shape]:
    """Straight runs and arcs; a bulge is the tangent of a quarter of the arc's angle, positive to the left."""
    if closed and points:
        points = [*points, points[0]]
    run: list[Point] = points[:1]
    for (x1, y1), (x2, y2), bulge in zip(points, points[1:], bulges, strict=False):
        if bulge == 0.0:
            run.append((x2, y2))
            continue
        if len(run) > 1:
            yield Polyline([plane.point(x, y) for x, y in run])
        run = [(x2, y2)]
        across = (1.0 - bulge * bulge) / (4.0 * bulge)
        cx, cy = 0.5 * (x1 + x2) - (y2 - y1) * across, 0.5 * (y1 + y2) + (x2 - x1) * across
        # From the center, so that the arc begins exactly at the first point whatever the radius.
        u, v = (x1 - cx, y1 - cy), (-(y1 - cy), x1 - cx)
        yield _through(plane, Arc((cx, cy), u, v, 0.0, 4.0 * math.atan(bulge)))
    if len(run) > 1:
        yield Polyline([plane.point(x, y) for x, y in run])


def _spline(group: Group) -> Curve:
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
    return Curve(degree, t, np.column_stack((np.array(points) * w[:, np.newaxis], w)))
