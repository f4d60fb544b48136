"""Edits of stations: put, rename, remove, by their names; and where a route would have them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from commission.errors import UsageError
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.site.editing.names import fresh_names
from commission.site.routes import Direction, Route
from commission.site.stations import Station

SAMPLES_PER_POINT = 32
"""Samples for each control point of a curve, the nearest of which lies in the right valley."""
ALONG = math.radians(45.0)
"""Angle to the way, or against it, up to which a station is taken to look along it [rad]."""


def put(stations: tuple[Station, ...], station: Station, name: str | None = None) -> tuple[Station, ...]:
    """Add a station, or replace the one called `name` (it may be renamed by that).

    Parameters
    ----------
    stations : those there are.
    station : the new or changed one.
    name : the one it takes the place of; None adds it at the end.

    Raises
    ------
    UsageError
        no station is called `name`, or another one has the new name already.
    """
    others = {s.name for s in stations} - {name}
    if station.name in others:
        raise UsageError(f"station name {station.name!r} is used already; expected another name")
    if name is None:
        return (*stations, station)
    _require(stations, name)
    return tuple(station if s.name == name else s for s in stations)


def remove(stations: tuple[Station, ...], name: str) -> tuple[Station, ...]:
    """Remove the station of that name; raises UsageError when there is none."""
    _require(stations, name)
    return tuple(s for s in stations if s.name != name)


def fresh_name(stations: tuple[Station, ...], like: str = "Station 0") -> str:
    """Return a name that no station has."""
    return fresh_names((s.name for s in stations), 1, like)[0]


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


def _require(stations: tuple[Station, ...], name: str) -> None:
    known = ", ".join(repr(s.name) for s in stations) or "none"
    if name not in {s.name for s in stations}:
        raise UsageError(f"no station is called {name!r}; the project has: {known}")
