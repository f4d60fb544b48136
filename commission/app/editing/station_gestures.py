"""What a click or a drag hits of the stations, and where it puts them. Pure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.app.base.extent import extent_of
from commission.app.editing.editor import Editor, Grab, Point
from commission.site.editing.stations import aligned, on_route
from commission.site.project import Project
from commission.site.stations import Station

TIP_MARKS = 9.0
"""Distance from a station to the tip that turns it, in sizes of a mark."""


def station_at(project: Project, place: Point, reach: float) -> str | None:
    """Return the name of the nearest station within reach [m] of a place; none when there is none.

    Parameters
    ----------
    project : has the stations.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    if not project.stations:
        return None
    gaps = [math.dist(place, (station.x, station.y)) for station in project.stations]
    nearest = int(np.argmin(gaps))
    return project.stations[nearest].name if gaps[nearest] <= reach else None


def station_of(project: Project, editor: Editor) -> Station | None:
    """Return the selected station; none when that is nothing, or it is gone."""
    return next((station for station in project.stations if station.name == editor.station), None)


def heading_tip(project: Project, station: Station) -> Point:
    """Return the place by which a station is turned [m]."""
    reach = TIP_MARKS * extent_of(project).mark_size()
    return station.x + reach * math.cos(station.heading), station.y + reach * math.sin(station.heading)


def grabbed_of_station(project: Project, editor: Editor, start: Point) -> Grab | None:
    """Return what a drag takes hold of at the selected station: the station or its tip; none when neither.

    Parameters
    ----------
    project : has the stations.
    editor : which one is selected, and how far a click reaches.
    start : where the drag begins [m], map frame.
    """
    station = station_of(project, editor)
    if station is None:
        return None
    if math.dist(start, heading_tip(project, station)) <= editor.reach:
        return Grab.HEADING
    return Grab.STATION if math.dist(start, (station.x, station.y)) <= editor.reach else None


def moved_station(project: Project, editor: Editor) -> Station | None:
    """Return the selected station as the drag under way would leave it: a route attracts it and its heading."""
    station, drag = station_of(project, editor), editor.drag
    if station is None or drag is None:
        return station
    if drag.grab is Grab.HEADING:
        return replace(station, heading=math.atan2(drag.now[1] - station.y, drag.now[0] - station.x))
    if drag.grab is not Grab.STATION:
        return station
    pose = on_route(project.routes, drag.now, editor.reach)
    if pose is None:
        return replace(station, x=drag.now[0], y=drag.now[1])
    return aligned(station, pose)
