"""Which stations the routes of a project pass: where prediction and report look at their accuracy. Not what it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.angles import difference
from commission.planning.route_prediction import AT_STATION, FACING_STATION
from commission.site.stations import Station
from commission.studies.violations import CheckedRoute


@dataclass(frozen=True, slots=True, eq=False)
class Passed:
    """Stations that are passed, of one state of routes and stations."""

    routes: tuple[CheckedRoute, ...]
    """The routes."""
    stations: tuple[Station, ...]
    """The stations."""
    names: frozenset[str]
    """Names of the stations that a route passes, near enough and looking their way."""


def passed_stations(stations: tuple[Station, ...], routes: tuple[CheckedRoute, ...], before: Passed | None) -> Passed:
    """Look which stations the routes pass.

    Parameters
    ----------
    stations, routes : of the project, the routes as they were looked along.
    before : an earlier result, which is returned when both are the same objects still.
    """
    if before is not None and before.stations is stations and before.routes == routes:
        return before
    names: set[str] = set()
    if stations:
        from scipy.spatial import KDTree

        wanted = np.array([station.pose for station in stations])
        for route in routes:
            near = KDTree(route.poses[:, :2]).query_ball_point(wanted[:, :2], AT_STATION)
            for station, heading, indices in zip(stations, wanted[:, 2], near, strict=True):
                if np.any(np.abs(difference(route.poses[indices, 2], heading)) < FACING_STATION):
                    names.add(station.name)
    return Passed(routes, stations, frozenset(names))
