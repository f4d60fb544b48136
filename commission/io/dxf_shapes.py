"""Curves of a drawing as points, elliptic arcs and B-splines: each stays of its kind under any map of the plane.

Blocks are inserted scaled, turned, mirrored and sheared; only the result is cut into chords, to a stated tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray

MOST_CHORDS = 10_000
"""Chords of one curve; a circle of 100 km radius at a tolerance of 5 mm has as many."""
_COARSEST = math.radians(30.0)
"""A chord spans no more of an arc than this, however small the arc is: a pillar stays round."""

Point = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
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
        x0, y0 = self.point(first.x0, first.y0)
        return Affine(xx=xx, xy=xy, yx=yx, yy=yy, x0=x0, y0=y0)


@dataclass(frozen=True, slots=True)
class Polyline:
    """Straight lines through points."""

    points: Sequence[Point]

    def chords(self, to: Affine, tolerance: float) -> Sequence[Point]:  # noqa: ARG002  # lines are exact
        """Points of the image."""
        return [to.point(x, y) for x, y in self.points]


@dataclass(frozen=True, slots=True, kw_only=True)
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
class BSpline:
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


Shape = Polyline | Arc | BSpline


def through(plane: Affine, arc: Arc) -> Arc:
    """Image of an arc."""
    return Arc(
        center=plane.point(*arc.center), u=plane.vector(*arc.u), v=plane.vector(*arc.v), start=arc.start, end=arc.end
    )


def bulged(points: list[Point], bulges: list[float], closed: bool, plane: Affine) -> Iterator[Shape]:
    """Straight runs and arcs.

    Parameters
    ----------
    points : the corners.
    bulges : per corner, of the stretch after it: tangent of a quarter of the arc's angle, positive to the left.
    closed : whether the last is joined to the first.
    plane : where the drawing's plane lies.
    """
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
        yield through(plane, Arc(center=(cx, cy), u=u, v=v, start=0.0, end=4.0 * math.atan(bulge)))
    if len(run) > 1:
        yield Polyline([plane.point(x, y) for x, y in run])
