"""Where a route asks too much of its vehicle: stretches of the way, with the poses at which it does.

Numbers and places only; `problems` says them in words, the page marks them on the floor.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.geometry.stretches import stretches_of
from commission.planning.route_check import FloorDistances, Way, room_along, smallest_radius, way_of
from commission.site.path import KINK
from commission.site.routes import Route
from commission.site.vehicle import OmnidirectionalVehicle, Vehicle


class ViolationKind(StrEnum):
    """What is too much."""

    CURVE = "curve"
    """A curve is tighter than the vehicle can drive."""
    CORNER = "corner"
    """The vehicle would have to turn on the spot."""
    WALL = "wall"
    """The vehicle's outline cuts a wall."""
    ROOM = "room"
    """There is less room between outline and wall than expected."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A piece of a route's way."""

    poses: FloatArray
    """(N, 3) `T_map_base` along it [m, m, rad]; a single one has no length."""
    metres: tuple[float, float]
    """Where it begins and ends, along the route [m]."""
    worst: int
    """Index of the pose that is worst."""

    @property
    def length(self) -> float:
        """Its way [m]."""
        return self.metres[1] - self.metres[0]

    @property
    def worst_pose(self) -> FloatArray:
        """(3,) the pose that is worst [m, m, rad]."""
        return self.poses[self.worst]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Violation:
    """One stretch of a route that asks too much."""

    kind: ViolationKind
    """What is too much."""
    route: str
    """Name of the route."""
    where: Stretch
    """Where along it."""
    found: float
    """Radius [m], angle [rad] or room [m] at the worst place."""
    expected: float
    """Smallest radius or room [m], largest angle [rad]."""
    is_fatal: bool
    """Whether the vehicle cannot drive it at all."""


@dataclass(frozen=True, slots=True, eq=False)
class CheckedRoute:
    """One route as it was looked along."""

    poses: FloatArray
    """(N, 3) `T_map_base` along it, at most `route_check.STEP` apart [m, m, rad]."""
    violations: tuple[Violation, ...]
    """One for each stretch: curves, corners, walls, little room, each in order of driving."""


class _Walk(NamedTuple):
    """A way with its length."""

    name: str
    way: Way
    metres: FloatArray

    def stretch(self, first: int, last: int, worst: int) -> Stretch:
        """Piece from one pose to another, both included; `worst` is an index of the whole way."""
        metres = float(self.metres[first]), float(self.metres[last])
        return Stretch(self.way.poses[first : last + 1], metres, worst - first)


def check_route(route: Route, vehicle: Vehicle, floor: FloorDistances | None, clearance: float) -> CheckedRoute:
    """Look along one route.

    Parameters
    ----------
    route : the route.
    vehicle : its outline and the tightest curve it can drive.
    floor : the walls; None: room is not asked for.
    clearance : smallest room between the vehicle's outline and a wall [m].
    """
    way = way_of(route)
    steps = np.hypot(*np.diff(way.poses[:, :2], axis=0).T)
    walk = _Walk(route.name, way, np.concatenate(([0.0], np.cumsum(steps))))
    found = [*_curves(walk, vehicle), *_corners(walk, vehicle)]
    if floor is not None:
        found.extend(_room(walk, room_along(way, vehicle.outline, floor, clearance), clearance))
    return CheckedRoute(way.poses, tuple(found))


def _curves(walk: _Walk, vehicle: Vehicle) -> Iterable[Violation]:
    """Curves tighter than the vehicle can drive."""
    radius, bends = smallest_radius(vehicle), np.abs(walk.way.curvatures)
    # A thousandth is the rounding of a circle that was drawn with just that radius.
    for first, end in stretches_of(bends * radius > 1.001).tolist():
        tightest = first + int(np.argmax(bends[first:end]))
        where = walk.stretch(first, end - 1, tightest)
        yield Violation(
            kind=ViolationKind.CURVE,
            route=walk.name,
            where=where,
            found=1.0 / float(bends[tightest]),
            expected=radius,
            is_fatal=True,
        )


def _corners(walk: _Walk, vehicle: Vehicle) -> Iterable[Violation]:
    """Places where the vehicle would have to turn on the spot."""
    if isinstance(vehicle, OmnidirectionalVehicle):
        return
    way, can_turn = walk.way, smallest_radius(vehicle) <= 0.0
    for index in np.flatnonzero(np.abs(way.corners) > KINK):
        # Between two segments a vehicle that can turn stops and does.
        if can_turn and way.segments[index] != way.segments[index + 1]:
            continue
        after = int(index) + 1
        turn = abs(float(way.corners[index]))
        yield Violation(
            kind=ViolationKind.CORNER,
            route=walk.name,
            where=walk.stretch(after, after, after),
            found=turn,
            expected=KINK,
            is_fatal=not can_turn,
        )


def _room(walk: _Walk, room: FloatArray, clearance: float) -> Iterable[Violation]:
    """Walls in the way, and stretches with little room that meet none."""
    for first, end in stretches_of(room <= 0.0).tolist():
        where = walk.stretch(first, end - 1, (first + end - 1) // 2)
        yield Violation(
            kind=ViolationKind.WALL,
            route=walk.name,
            where=where,
            found=float(room[first:end].min()),
            expected=clearance,
            is_fatal=True,
        )
    for first, end in stretches_of(room < clearance).tolist():
        least = first + int(np.argmin(room[first:end]))
        if room[least] > 0.0:
            where = walk.stretch(first, end - 1, least)
            yield Violation(
                kind=ViolationKind.ROOM,
                route=walk.name,
                where=where,
                found=float(room[least]),
                expected=clearance,
                is_fatal=False,
            )
