"""Chosen places at which a vehicle that is switched on must see where it is: what would tell them from their rivals.

A rival of a place is another pose that sees the same constellation. Each one becomes a row of the covering problem:
some reflector must be taken that only one of the two sees. Which poses are rivals is `ambiguity`'s business.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.se2 import compose, inverse, transform_points
from commission.planning.ambiguity import AmbiguityOptions, ambiguous_poses, headings_tried
from commission.planning.route_prediction import PlannedRoute
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.site.layout_brief import Demands
from commission.site.quantity import X, Y
from commission.site.scanner import Scanner
from commission.site.stations import Station

FEWEST = 2
"""Reflectors without which every place is ambiguous."""
CLEARLY_ELSEWHERE = 3.0
"""A reflector is certainly missed at its image when none is within that many tolerances: what a fit may give way."""


@dataclass(frozen=True, slots=True, eq=False)
class ChosenPlace:
    """A place at which the vehicle may be switched on."""

    name: str
    """For a person."""
    poses: FloatArray
    """(H, 3) `T_map_base` [m, m, rad]: one heading, or all that are tried."""


def chosen_places(
    demands: Demands,
    planned: Sequence[PlannedRoute],
    stations: Sequence[Station],
    scanners: Sequence[Scanner],
    options: AmbiguityOptions,
) -> tuple[ChosenPlace, ...]:
    """List the places that the demands name: starts of the routes, stations, spots.

    Parameters
    ----------
    demands : what must be unambiguous.
    planned : routes that count, with their drives.
    stations : of the project.
    scanners, options : say which headings are tried where a spot names none.
    """
    places: list[ChosenPlace] = []
    if demands.unambiguous_starts:
        places += [ChosenPlace(f"start of {route.name!r}", route.drive.poses[:1]) for route in planned]
    if demands.unambiguous_stations:
        places += [ChosenPlace(f"station {each.name!r}", each.pose[np.newaxis]) for each in stations]
    for spot in demands.unambiguous_spots:
        headings = np.array(spot[2:]) if len(spot) == 3 else headings_tried(scanners, options)
        poses = np.column_stack((np.tile(spot[:2], (len(headings), 1)), headings))
        places.append(ChosenPlace(f"spot {X.digits(spot[0])}, {Y.digits(spot[1])} m", poses))
    return tuple(places)


class Distinction:
    """Which layouts tell the chosen places from all others, and what each of the others asks for.

    Parameters
    ----------
    visible : visibility of everything that could be taken, M reflectors.
    places : chosen places.
    survive_failure : whether a place must stay clear without any single reflector.
    options : when two poses count as alike.
    """

    def __init__(
        self,
        visible: VehicleVisibility,
        places: Sequence[ChosenPlace],
        survive_failure: bool,
        options: AmbiguityOptions,
    ) -> None:
        self._visible, self._fragile, self._options = visible, survive_failure, options
        self._poses = np.concatenate([np.empty((0, 3)), *(place.poses for place in places)])
        self._place = np.repeat(np.arange(len(places)), [len(place.poses) for place in places])
        self._count = len(places)
        self.sees = visible.visible_from_poses(self._poses).incidence(len(visible.reflectors))
        """(P, M) whether each pose of the places sees each reflector."""
        self.need = FEWEST + int(survive_failure)
        """Reflectors that each of these poses must see at least."""
        self.apart = 1 + int(survive_failure)
        """Reflectors that must tell a place from a rival."""

    def rivals(self, taken: BoolArray) -> IntArray:
        """How often each of the places is ambiguous with a layout (M,): its poses, and what may fail, counted."""
        result = np.zeros(self._count, dtype=np.int64)
        for blocked in self._failures(taken):
            poses = self._affected(blocked)
            found = ambiguous_poses(
                self._visible.restricted(_without(taken, blocked)), self._poses[poses], self._options
            )
            np.add.at(result, self._place[poses[found.ambiguous]], 1)
        return result

    def rows(self, taken: BoolArray) -> list[BoolArray]:
        """Ask for what tells the places from their rivals under a layout (M,): a row (M,) for each rival found.

        Two that the row asks for may be each other's image, and tell nothing when both are taken.
        """
        rows: list[BoolArray] = []
        for blocked in self._failures(taken):
            layout, poses = _without(taken, blocked), self._affected(blocked)
            found = ambiguous_poses(self._visible.restricted(layout), self._poses[poses], self._options)
            rivals = np.flatnonzero(np.isfinite(found.partners[:, 0]))
            rows += [self._row(layout, self._poses[poses[n]], found.partners[n]) for n in rivals]
        return rows

    def _failures(self, taken: BoolArray) -> list[int | None]:
        """Nothing, and each reflector of a layout that a place sees."""
        seen = np.flatnonzero(taken & self.sees.any(axis=0)).tolist() if self._fragile else []
        return [None, *seen] if self._count else []

    def _affected(self, blocked: int | None) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        """Poses that a failure concerns: those that would see the reflector."""
        return np.arange(len(self._poses)) if blocked is None else np.flatnonzero(self.sees[:, blocked])

    def _row(self, layout: BoolArray, place: FloatArray, rival: FloatArray) -> BoolArray:
        """(M,) reflectors that one of two poses would see while nothing stands where the other one misses it."""
        centers = self._visible.reflectors.centers
        motion = compose(rival, inverse(place))
        seen = self._visible.visible_from_poses(np.stack((place, rival))).incidence(len(centers))
        here = seen[0] & ~_occupied(transform_points(motion, centers), centers[seen[1] & layout], self._options)
        there = seen[1] & ~_occupied(
            transform_points(inverse(motion), centers), centers[seen[0] & layout], self._options
        )
        return here | there


def _occupied(points: FloatArray, others: FloatArray, options: AmbiguityOptions) -> BoolArray:
    """Whether one of the others stands so near to each of (N, 2) points that a fit may take it for one there."""
    if len(others) == 0:
        return np.zeros(len(points), dtype=np.bool_)
    distance, _ = cKDTree(others).query(points)
    return np.asarray(distance <= CLEARLY_ELSEWHERE * options.tolerance, dtype=np.bool_)


def _without(taken: BoolArray, blocked: int | None) -> BoolArray:
    """Layout without one reflector."""
    if blocked is None:
        return taken
    rest = taken.copy()
    rest[blocked] = False
    return rest


def nearest_on_routes(point: FloatArray, planned: Sequence[PlannedRoute]) -> tuple[str, tuple[int, ...]]:
    """Name of the route that leads nearest to a point (2,) [m], and that metre of its way; nothing without routes."""
    best, name, metres = math.inf, "", ()
    for route in planned:
        distance = np.hypot(*(route.drive.poses[:, :2] - point).T)
        scan = int(np.argmin(distance))
        if distance[scan] < best:
            best, name, metres = float(distance[scan]), route.name, (int(route.drive.metres[scan]),)
    return name, metres
