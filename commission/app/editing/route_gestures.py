"""What a click or a drag hits of the routes, and how a route looks while it is drawn or bent. Pure."""

from __future__ import annotations

import numpy as np

from commission.app.editing.editor import ControlPoint, Editor, Grab, Point
from commission.site.editing.routes import move_point
from commission.site.project import Project
from commission.site.routes import Route, Segment

CURVE_POINTS = 120


def control_point_at(project: Project, route: str, place: Point, reach: float) -> ControlPoint | None:
    """Return the nearest control point of a route within reach [m]; none when there is none.

    Parameters
    ----------
    project : has the routes.
    route : name of the route.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    best: tuple[float, ControlPoint] | None = None
    for chosen in (r for r in project.routes if r.name == route):
        for number, segment in enumerate(chosen.segments):
            gaps = np.hypot(*(segment.control_points - place).T)
            index = int(np.argmin(gaps))
            if gaps[index] <= reach and (best is None or gaps[index] < best[0]):
                best = float(gaps[index]), ControlPoint(route, number, index)
    return None if best is None else best[1]


def curve(segment: Segment) -> np.ndarray:
    """Return (N, 2) points along a segment [m]."""
    spline = segment.spline()
    return spline.point(spline.u_at(np.linspace(0.0, spline.length, CURVE_POINTS)))


def route_at(project: Project, place: Point, reach: float) -> ControlPoint | None:
    """Return the control point nearest to where a click hit a route's curve within reach [m]; none when it hit none.

    Parameters
    ----------
    project : has the routes.
    place : that was clicked [m], map frame.
    reach : largest distance to the curve [m].
    """
    best: tuple[float, ControlPoint] | None = None
    for route in project.routes:
        for number, segment in enumerate(route.segments):
            # The curve lies within the hull of its control points: most routes need not be evaluated.
            low, high = segment.control_points.min(axis=0) - reach, segment.control_points.max(axis=0) + reach
            if np.any(low > place) or np.any(high < place):
                continue
            gap = float(np.min(np.hypot(*(curve(segment) - place).T)))
            if gap <= reach and (best is None or gap < best[0]):
                index = int(np.argmin(np.hypot(*(segment.control_points - place).T)))
                best = gap, ControlPoint(route.name, number, index)
    return None if best is None else best[1]


def route_of(project: Project, editor: Editor) -> Route | None:
    """Return the selected route; none when nothing of a route is selected, or it is gone."""
    if editor.point is None:
        return None
    return next((route for route in project.routes if route.name == editor.point.route), None)


def routes_of(project: Project, editor: Editor) -> tuple[str, ...]:
    """Return the names of all routes that are selected, that of the control point first.

    Parameters
    ----------
    project : has them; those that are gone are left out.
    editor : of a browser.
    """
    if editor.point is None:
        return ()
    names = {route.name for route in project.routes}
    return tuple(name for name in (editor.point.route, *editor.further) if name in names)


def segment_of(project: Project, editor: Editor) -> Segment | None:
    """Return the segment of the selected control point; none when it is gone."""
    route = route_of(project, editor)
    if route is None or editor.point is None or editor.point.segment >= len(route.segments):
        return None
    return route.segments[editor.point.segment]


def moved_route(project: Project, editor: Editor) -> tuple[Segment, ...]:
    """Return the segments of the selected route as the drag under way would leave them."""
    route = route_of(project, editor)
    if route is None or editor.point is None:
        return ()
    drag = editor.drag
    if drag is not None and drag.grab is Grab.CONTROL_POINT and segment_of(project, editor) is not None:
        route = move_point(route, editor.point.segment, editor.point.index, drag.now)
    return route.segments
