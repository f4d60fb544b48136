"""Compiled steps of people who walk: where a person can be, the next position of everybody, and their legs.

Nothing is drawn at random here: `people` draws points and speeds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray

LEG_RADIUS = 0.07
"""Radius of a leg at the height of a safety scanner, with its trouser [m]."""
HIP_WIDTH = 0.18
"""Distance between the two legs of a person, across [m]."""
STRIDE = 0.7
"""Length of a step [m]; the legs swing by up to half of it, fore and aft."""
KEEP_FROM_VEHICLE = 1.0
"""Distance from base at which a person steps aside [m]."""
ARRIVED = 1e-6
"""Distance to its target below which a person has arrived [m]."""
ASIDE = (0.0, 0.5, -0.5, 1.0, -1.0, 1.4, -1.4)
"""Turns away from straight back in which a person tries to step aside, in this order [rad]."""


class Walkable(NamedTuple):
    """Where a person's middle can be, as plain arrays and numbers."""

    cells: BoolArray
    """(H, W) cells far enough from everything."""
    resolution: float
    """Edge of a cell [m]."""
    from_map: FloatArray
    """(4,) x, y, cosine and sine of the pose of the map in the grid's frame [m]."""


class People(NamedTuple):
    """Everybody, as columns that change from scan to scan."""

    positions: FloatArray
    """(P, 2) middle of each [m], map frame."""
    targets: FloatArray
    """(P, 2) where each walks to [m], map frame."""
    speeds: FloatArray
    """(P,) [m/s]."""
    headings: FloatArray
    """(P,) [rad], map frame."""
    walked: FloatArray
    """(P,) way behind each [m]."""


@compiled
def can_stand(floor: Walkable, x: float, y: float) -> bool:
    """Whether a person can be at a point.

    Parameters
    ----------
    floor : where people can be.
    x, y : the point [m], map frame.

    Notes
    -----
    cell = floor(T_grid_map p / resolution), by definition; outside the grid nobody can be.
    """
    c, s = floor.from_map[2], floor.from_map[3]
    column = math.floor((floor.from_map[0] + (c * x - s * y)) / floor.resolution)
    row = math.floor((floor.from_map[1] + (s * x + c * y)) / floor.resolution)
    rows, columns = floor.cells.shape
    return 0 <= row < rows and 0 <= column < columns and bool(floor.cells[row, column])


@compiled
def can_walk(  # noqa: PLR0917 - two points, number by number
    floor: Walkable, x: float, y: float, end_x: float, end_y: float, count: int
) -> bool:
    """Whether a person can walk straight from one point to another.

    Parameters
    ----------
    floor : where people can be.
    x, y, end_x, end_y : the two points [m], map frame.
    count : places looked at, both ends among them; at least 2.

    Notes
    -----
    p + (q - p) k / (count - 1): evenly spaced places, by definition.
    """
    step = 1.0 / (count - 1)
    for k in range(count):
        share = k * step if k < count - 1 else 1.0
        if not can_stand(floor, x + (end_x - x) * share, y + (end_y - y) * share):
            return False
    return True


@compiled
def arrived(people: People) -> IntArray:
    """Return who is at its target: (A,) indices, ascending.

    Parameters
    ----------
    people : everybody.

    Notes
    -----
    |target - position| < `ARRIVED`, by definition.
    """
    found, count = np.empty(len(people.speeds), dtype=np.int64), 0
    for p in range(len(people.speeds)):
        ahead_x = people.targets[p, 0] - people.positions[p, 0]
        ahead_y = people.targets[p, 1] - people.positions[p, 1]
        if math.hypot(ahead_x, ahead_y) < ARRIVED:
            found[count] = p
            count += 1
    return found[:count]


@compiled
def walk_on(  # noqa: PLR0917 - people and the vehicle, number by number
    floor: Walkable, people: People, seconds: float, x: float, y: float, aside: float, moves: FloatArray
) -> None:
    """Move everybody on; people near the vehicle step aside. Headings stay: they follow from the moves.

    Parameters
    ----------
    floor, people : where people can be, and everybody; positions, targets and ways are changed in place.
    seconds : time that passes [s].
    x, y : base of the vehicle [m], map frame.
    aside : length of a step out of its way [m].
    moves : (P, 2) output: motion of each [m], map frame.

    Notes
    -----
    position += (target - position) min(1, speed t / distance), by definition.
    """
    for p in range(len(people.speeds)):
        here_x, here_y = people.positions[p, 0], people.positions[p, 1]
        move_x, move_y = people.targets[p, 0] - here_x, people.targets[p, 1] - here_y
        share = min(1.0, people.speeds[p] * seconds / max(math.hypot(move_x, move_y), 1e-9))
        move_x, move_y = move_x * share, move_y * share
        if math.hypot(here_x - x, here_y - y) < KEEP_FROM_VEHICLE:
            move_x, move_y = _step_aside(floor, here_x, here_y, math.atan2(here_y - y, here_x - x), aside)
            people.targets[p, 0], people.targets[p, 1] = here_x + move_x, here_y + move_y
        moves[p, 0], moves[p, 1] = move_x, move_y
        people.walked[p] += math.hypot(move_x, move_y)
        people.positions[p, 0], people.positions[p, 1] = here_x + move_x, here_y + move_y


@compiled
def _step_aside(floor: Walkable, x: float, y: float, heading: float, step: float) -> tuple[float, float]:
    """Motion away from the vehicle, or along a wall, or none where there is no room [m]."""
    for turn in ASIDE:
        move_x, move_y = step * math.cos(heading + turn), step * math.sin(heading + turn)
        if can_stand(floor, x + move_x, y + move_y):
            return move_x, move_y
    return 0.0, 0.0


@compiled
def legs_of(people: People) -> FloatArray:
    """Return every leg: (2 P, 3) x, y and radius [m], map frame; first one leg of each, then the other.

    Parameters
    ----------
    people : everybody.

    Notes
    -----
    position +- (hip / 2 to the left + stride / 4 sin(pi way / stride) ahead): legs swing against each other, derived.
    """
    count = len(people.speeds)
    legs = np.empty((2 * count, 3))
    for p in range(count):
        ahead_x, ahead_y = math.cos(people.headings[p]), math.sin(people.headings[p])
        swing = 0.5 * STRIDE * math.sin(math.pi * people.walked[p] / STRIDE)
        offset_x = 0.5 * HIP_WIDTH * -ahead_y + 0.5 * swing * ahead_x
        offset_y = 0.5 * HIP_WIDTH * ahead_x + 0.5 * swing * ahead_y
        legs[p, 0], legs[p, 1] = people.positions[p, 0] + offset_x, people.positions[p, 1] + offset_y
        other = count + p
        legs[other, 0], legs[other, 1] = people.positions[p, 0] - offset_x, people.positions[p, 1] - offset_y
        legs[p, 2] = legs[other, 2] = LEG_RADIUS
    return legs
