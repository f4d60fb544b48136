"""Edits of routes: new from clicked points, control points moved, inserted and deleted, direction and speed.

Each function returns a new route. Ends that two segments share stay together. A curve through clicked points is kept in
Bezier form: its joints carry their handles along, so that moving one leaves no kink.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.geometry.knot_insertion import insert_knot, multiplicity, split
from commission.geometry.splines import Spline, catmull_rom
from commission.site.fields import with_field
from commission.site.routes import Direction, Route, Segment

BEZIER = 3
"""Control points from one joint of a cubic in Bezier form to the next."""


class Curve(StrEnum):
    """How a new curve follows the points that were clicked."""

    THROUGH = "through"
    """Goes through each of them (Catmull-Rom); the tangent is continuous, the curvature jumps at the points."""
    NEAR = "near"
    """Is pulled by each of them (B-spline of degree 3); the curvature is continuous: kinder to a steered wheel."""


def segment_of(points: ArrayLike, curve: Curve = Curve.THROUGH) -> Segment:
    """Curve along clicked points.

    Parameters
    ----------
    points : (N, 2) array [m], map frame, N at least 2; a point clicked twice counts once.
    curve : through or near the points between the first and the last.

    Raises
    ------
    ValueError
        fewer than two different points.
    """
    given = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    is_new = np.append(True, np.any(np.diff(given, axis=0) != 0.0, axis=1)) if len(given) else np.zeros(0, np.bool_)
    distinct = given[is_new]
    if len(distinct) < 2:
        raise ValueError(f"{len(distinct)} different points; expected 2 or more")
    if curve is Curve.NEAR or len(distinct) == 2:
        return Segment(control_points=distinct, degree=min(3, len(distinct) - 1))
    return _segment(Segment(control_points=distinct, degree=1), catmull_rom(distinct))


def new_route(name: str, points: ArrayLike, curve: Curve = Curve.THROUGH, speed: float = 0.5) -> Route:
    """Route of one forward segment along clicked points.

    Parameters
    ----------
    name : no other route may have it.
    points, curve : as in `segment_of`.
    speed : [m/s]

    Raises
    ------
    ValueError
        fewer than two different points.
    """
    return Route(name, (segment_of(points, curve),), speed)


def append(route: Route, points: ArrayLike, direction: Direction, curve: Curve = Curve.THROUGH) -> Route:
    """Go on from the end of a route along clicked points.

    Parameters
    ----------
    route : the route.
    points : (N, 2) array [m], map frame; the end of the route is not among them.
    direction : in which the vehicle drives there.
    curve : through or near the points between the first and the last.
    """
    end = route.segments[-1].control_points[-1]
    added = segment_of(np.vstack((end, np.asarray(points, dtype=np.float64).reshape(-1, 2))), curve)
    return replace(route, segments=(*route.segments, replace(added, direction=direction)))


def move_point(route: Route, segment: int, point: int, to: tuple[float, float]) -> Route:
    """Move a control point.

    Parameters
    ----------
    route : the route.
    segment, point : index of the segment and of its control point.
    to : new place [m, m], map frame. A joint of a Bezier curve takes its handles along, a handle turns its opposite,
        and an end that the neighboring segment shares moves there too.
    """
    points = np.array(_segment_at(route, segment).control_points)
    if not 0 <= point < len(points):
        raise UsageError(f"control point {point} of segment {segment}; expected 0 to {len(points) - 1}")
    moved = _moved(route.segments[segment], point, np.asarray(to, dtype=np.float64))
    segments = list(route.segments)
    segments[segment] = moved
    if point == 0 and segment > 0:
        before = segments[segment - 1]
        segments[segment - 1] = _moved(before, len(before.control_points) - 1, moved.control_points[0])
    if point == len(points) - 1 and segment + 1 < len(segments):
        segments[segment + 1] = _moved(segments[segment + 1], 0, moved.control_points[-1])
    return replace(route, segments=tuple(segments))


def insert_point(route: Route, segment: int, near: tuple[float, float]) -> Route:
    """Insert a control point where the curve passes nearest to a place; the curve itself stays as it is.

    Parameters
    ----------
    route : the route.
    segment : index.
    near : the place [m, m], map frame.
    """
    old = _segment_at(route, segment)
    u = _nearest_parameter(old.spline(), near)
    times = BEZIER if is_bezier(old) else 1
    return _with_segment(route, segment, _segment(old, insert_knot(old.spline(), u, times)))


def delete_point(route: Route, segment: int, point: int) -> Route:
    """Delete a control point, or a joint of a Bezier curve with its handles.

    Parameters
    ----------
    route : the route.
    segment, point : index of the segment and of its control point.

    Raises
    ------
    UsageError
        it is a handle, an end that two segments share, or one of the last two points of the segment.
    """
    old = _segment_at(route, segment)
    n = len(old.control_points)
    if not 0 <= point < n:
        raise UsageError(f"control point {point} of segment {segment}; expected 0 to {n - 1}")
    if (point == 0 and segment > 0) or (point == n - 1 and segment + 1 < len(route.segments)):
        raise UsageError("this end is shared by two segments; expected one of them to be deleted instead")
    if is_bezier(old):
        return _with_segment(route, segment, _without_joint(old, point))
    if n <= 2:
        raise UsageError("a segment needs two points; expected the segment to be deleted instead")
    points = np.delete(old.control_points, point, axis=0)
    weights = None if old.weights is None else np.delete(old.weights, point)
    degree = min(old.degree, n - 2)
    knots = None
    if old.knots is not None and degree == old.degree:
        # The knot that is nearest to the point's own parameter (its Greville abscissa) goes with it.
        inner = np.arange(degree + 1, n)
        own = old.knots[point + 1 : point + degree + 1].mean()
        knots = np.delete(old.knots, inner[np.argmin(np.abs(old.knots[inner] - own))])
    new = Segment(
        control_points=points, direction=old.direction, degree=degree, knots=knots, weights=weights, speed=old.speed
    )
    return _with_segment(route, segment, new)


def split_segment(route: Route, segment: int, near: tuple[float, float]) -> Route:
    """Cut a segment in two where it passes nearest to a place, so that its parts can be driven differently.

    Parameters
    ----------
    route : the route.
    segment : index.
    near : the place [m, m], map frame.

    Raises
    ------
    UsageError
        the nearest place is an end of the segment.
    """
    old = _segment_at(route, segment)
    try:
        parts = split(old.spline(), _nearest_parameter(old.spline(), near))
    except ValueError as error:
        raise UsageError(f"segment {segment} cannot be cut at its end; expected a place along it") from error
    before, after = (_segment(old, part) for part in parts)
    return replace(route, segments=(*route.segments[:segment], before, after, *route.segments[segment + 1 :]))


def set_value(route: Route, segment: int, name: str, value: object) -> Route:
    """Return the route with one field of a segment changed.

    Parameters
    ----------
    route : the one there is.
    segment : which of its segments.
    name : of a field of `Segment`: `direction`, `speed`.
    value : its new content; a speed in m/s, none: the route's.

    Raises
    ------
    UsageError
        there is no such segment or field.
    ValueError
        the value is out of its range.
    """
    return _with_segment(route, segment, with_field(_segment_at(route, segment), name, value, "field of a segment"))


def is_bezier(segment: Segment) -> bool:
    """Whether a segment is a chain of cubics in Bezier form: every third control point lies on the curve.

    A single cubic is none: it is as well a B-spline, whose points can be inserted and deleted one by one.
    """
    n = len(segment.control_points)
    is_chain = segment.degree == BEZIER and n % BEZIER == 1 and n > BEZIER + 1
    if not is_chain or segment.knots is None or segment.weights is not None:
        return False
    inner = segment.knots[BEZIER + 1 : n].reshape(-1, BEZIER)
    return bool((inner == inner[:, :1]).all())


def _moved(segment: Segment, point: int, to: FloatArray) -> Segment:
    """Segment with one control point elsewhere."""
    points = np.array(segment.control_points)
    n, last = len(points), len(points) - 1
    if not is_bezier(segment):
        points[point] = to
        return replace(segment, control_points=points)
    if point % BEZIER == 0:
        low, high = max(point - 1, 0), min(point + 1, last)
        points[low : high + 1] += to - points[point]
        return replace(segment, control_points=points)
    joint = point + 1 if point % BEZIER == 2 else point - 1
    opposite = 2 * joint - point
    was_smooth = 0 < joint < last and _is_straight(points[point], points[joint], points[opposite])
    points[point] = to
    reach = math.dist(points[joint], to)
    if 0 <= opposite < n and was_smooth and reach > 0.0:
        length = math.dist(points[joint], points[opposite])
        points[opposite] = points[joint] + (points[joint] - to) / reach * length
    return replace(segment, control_points=points)


def _is_straight(before: FloatArray, joint: FloatArray, after: FloatArray) -> bool:
    """Whether the curve passes a joint without a kink."""
    (ax, ay), (bx, by) = joint - before, after - joint
    along, across = ax * bx + ay * by, ax * by - ay * bx
    return bool(along > 0.0 and abs(across) < 1e-6 * along)


def _without_joint(segment: Segment, point: int) -> Segment:
    """Bezier curve without one of its joints."""
    n = len(segment.control_points)
    if point % BEZIER != 0:
        raise UsageError("a handle cannot be deleted; expected the point on the curve that it belongs to")
    knots = np.asarray(segment.knots)
    if point == 0:
        points, knots = segment.control_points[BEZIER:], np.append(knots[BEZIER + 1], knots[BEZIER + 1 :])
    elif point == n - 1:
        points, knots = segment.control_points[:-BEZIER], np.append(knots[:n], knots[n - 1])
    else:
        points = np.delete(segment.control_points, [point - 1, point, point + 1], axis=0)
        knots = np.delete(knots, [point + 1, point + 2, point + 3])
    return replace(segment, control_points=points, knots=knots)


def _segment(like: Segment, spline: Spline) -> Segment:
    """Segment with another curve and the same direction and speed; weights of 1 are none."""
    weights = None if bool((spline.weights == 1.0).all()) else spline.weights
    return replace(
        like, control_points=spline.control_points, degree=spline.degree, knots=spline.knots, weights=weights
    )


def _nearest_parameter(spline: Spline, near: tuple[float, float]) -> float:
    """Parameter at which a curve passes nearest to a place; away from full knots, where nothing could be inserted."""
    # The nearest of dense samples lies in the right valley; from there the foot is found exactly.
    samples = np.linspace(*spline.domain, 32 * len(spline.control_points))
    guess = float(samples[np.argmin(np.hypot(*(spline.point(samples) - np.asarray(near)).T))])
    u = spline.closest(near, guess)
    first, last = spline.domain
    margin = 1e-3 * (last - first)
    u = min(max(u, first + margin), last - margin)
    return u if multiplicity(spline, u) < spline.degree else u + margin


def _segment_at(route: Route, segment: int) -> Segment:
    if not 0 <= segment < len(route.segments):
        raise UsageError(f"segment {segment} of route {route.name!r}; expected 0 to {len(route.segments) - 1}")
    return route.segments[segment]


def _with_segment(route: Route, segment: int, new: Segment) -> Route:
    return replace(route, segments=(*route.segments[:segment], new, *route.segments[segment + 1 :]))
