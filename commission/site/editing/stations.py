"""Edits of stations: where a route would have them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.site.routes import Direction, Route
from commission.site.stations import Station

SAMPLES_PER_POINT = 32
"""Samples for each control point of a curve, the nearest of which lies in the right valley."""
ALONG = math.radians(45.0)
"""Angle to the way, or against it, up to which a station is taken to look along it [rad]."""


def on_route(routes: Sequence[Route], place: tuple[float, float], reach: float) -> FloatArray | None:
    """Find where a vehicle on one of the routes passes nearest to a place.

    Parameters
    ----------
    routes : any number of routes.
    place : where [m, m], map frame.
    reach : distance beyond which a route is none of the place's business [m].

    Returns
    -------
    pose : (3,) `T_map_base` of the vehicle there [m, m, rad], in reverse it looks back; None: no route is near.
    """
    best, pose = reach, None
    for segment in (segment for route in routes for segment in route.segments):
        # The curve lies within the hull of its control points: most need not be evaluated.
        outside = np.maximum(segment.control_points.min(axis=0) - place, place - segment.control_points.max(axis=0))
        if outside.max() > best:
            continue
        spline = segment.spline()
        samples = np.linspace(*spline.domain, SAMPLES_PER_POINT * len(segment.control_points))
        guess = float(samples[np.argmin(np.hypot(*(spline.point(samples) - place).T))])
        u = spline.closest(place, guess)
        foot, heading = spline.point(u), float(spline.heading(u))
        gap = math.dist(foot, place)
        if gap <= best and math.isfinite(heading):
            facing = math.pi if segment.direction is Direction.REVERSE else 0.0
            best, pose = gap, np.array([*foot, wrap_scalar(heading + facing)])
    return pose


def aligned(station: Station, pose: FloatArray) -> Station:
    """Put a station onto a pose of a route; it keeps looking across the way, or against it, where it did."""
    x, y, along = (float(value) for value in pose)
    headings = (along, wrap_scalar(along + math.pi))
    turns = [abs(wrap_scalar(heading - station.heading)) for heading in headings]
    nearest = int(np.argmin(turns))
    heading = headings[nearest] if turns[nearest] <= ALONG else station.heading
    return replace(station, x=x, y=y, heading=heading)
