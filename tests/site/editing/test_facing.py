"""Plates of unknown direction take that of their wall, and only where it is certain."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.site.editing.facing import faced_from_walls, said_of
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

CELL = 0.1


def hall(beyond: int = UNKNOWN) -> FloorMap:
    """10 x 6 m: walls of one cell, `beyond` around them, a partition of one cell at x = 5 m, a pillar of 0.4 m."""
    cells = np.full((60, 100), beyond, np.int8)
    cells[5:55, 5:95] = OCCUPIED
    cells[6:54, 6:94] = FREE
    cells[6:30, 50] = OCCUPIED
    cells[40:44, 20:24] = OCCUPIED
    return FloorMap(cells, CELL)


def plate(x: float, y: float, name: str = "P") -> Reflector:
    return Reflector(id=name, x=x, y=y, kind=ReflectorKind.FLAT)


def direction(x: float, y: float, floor_map: FloorMap | None = None) -> float | None:
    return faced_from_walls(ReflectorMap((plate(x, y),)), floor_map or hall()).reflectors.reflectors[0].heading


@pytest.mark.parametrize(
    ("x", "y", "degrees"),
    [
        (3.0, 0.61, 90.0),
        (3.0, 0.55, 90.0),
        (3.0, 0.52, 90.0),
        (3.0, 5.38, -90.0),
        (0.63, 3.0, 0.0),
        (9.35, 3.0, 180.0),
        (3.0, 0.85, 90.0),
        (5.12, 2.0, 0.0),
        (4.95, 2.0, 180.0),
        (2.2, 3.97, -90.0),
    ],
    ids=["south", "in its cell", "deep in it", "north", "west", "east", "bracket", "partition", "its back", "pillar"],
)
def test_a_plate_faces_the_free_side_of_its_wall(x: float, y: float, degrees: float) -> None:
    heading = direction(x, y)
    assert heading is not None
    assert math.remainder(heading - math.radians(degrees), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("x", "y"), [(3.0, 3.0), (5.05, 2.0), (0.63, 0.63)], ids=["far from walls", "in a partition", "in a corner"]
)
def test_a_plate_stays_without_direction_where_walls_do_not_say_one(x: float, y: float) -> None:
    assert direction(x, y) is None


def test_a_map_of_walls_alone_says_the_direction_of_a_plate_in_front_of_one() -> None:
    floor_map = hall()
    walls = replace(floor_map, cells=np.where(floor_map.cells == FREE, UNKNOWN, floor_map.cells))
    assert direction(3.0, 0.66, walls) == pytest.approx(math.pi / 2)


def test_only_unlocked_plates_without_direction_change_and_the_rest_is_told() -> None:
    before = (
        plate(3.0, 0.61, "A"),
        replace(plate(4.0, 0.61, "L"), locked=True),
        plate(3.0, 3.0, "F"),
        replace(plate(2.0, 0.61, "K"), heading=1.0),
        Reflector(id="C", x=7.0, y=0.65),
    )
    faced = faced_from_walls(ReflectorMap(before), hall())
    assert faced.turned == ("A",)
    assert faced.left == ("L", "F")
    assert faced.reflectors.reflectors[1:] == before[1:]
    assert said_of(faced) == (
        "1 plate faces away from its wall now; L, F are locked, hang near no wall, or near several"
    )
