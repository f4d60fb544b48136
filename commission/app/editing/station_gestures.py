"""What a click or a drag hits of the stations, and where it puts them. Pure."""

from __future__ import annotations

from dataclasses import replace

from commission.app.editing.editor import Editor, Grab, Point
from commission.app.editing.posed_gestures import nearest_posed, turned_to
from commission.site.editing.stations import aligned, on_route
from commission.site.project import Project
from commission.site.stations import Station


def station_at(project: Project, place: Point, reach: float) -> str | None:
    """Return the name of the nearest station within reach [m] of a place; none when there is none.

    Parameters
    ----------
    project : has the stations.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    found = nearest_posed(project.stations, place, reach)
    return None if found is None else project.stations[found].name


def station_of(project: Project, editor: Editor) -> Station | None:
    """Return the selected station; none when that is nothing, or it is gone."""
    return next((station for station in project.stations if station.name == editor.station), None)


def moved_station(project: Project, editor: Editor) -> Station | None:
    """Return the selected station as the drag under way would leave it: a route attracts it and its heading."""
    station, drag = station_of(project, editor), editor.drag
    if station is None or drag is None:
        return station
    if drag.grab is Grab.HEADING:
        return replace(station, heading=turned_to(station, drag.now))
    if drag.grab is not Grab.POSED:
        return station
    pose = on_route(project.routes, drag.now, editor.reach)
    if pose is None:
        return replace(station, x=drag.now[0], y=drag.now[1])
    return aligned(station, pose)
