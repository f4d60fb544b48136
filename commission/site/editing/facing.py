"""Plates of unknown direction turned away from the wall that they hang on; where that is doubtful, left as they are.

A wrong direction is worse than none: a plate that may face any side is counted on too often, one that is said to face
the wall never.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.angles import wrap_scalar
from commission.geometry.occupancy import OccupancyGrid
from commission.site.editing.snapping import WallPoint, nearest_wall
from commission.site.floor_map import FREE, FloorMap
from commission.site.quantity import counted_text
from commission.site.reflectors import Reflector, ReflectorMap

NEAR = 0.3
"""Distance from a wall up to which a plate hangs on it, on a bracket perhaps [m]."""
MOST_NAMED = 5
"""Plates left as they are that are named."""
AGREES = 0.5
"""Angle between the directions that different places within half a cell give, up to which they are one [rad]."""


@dataclass(frozen=True, slots=True)
class Faced:
    """What came of turning plates away from walls."""

    reflectors: ReflectorMap
    """All reflectors."""
    turned: tuple[str, ...]
    """Ids of the plates that have a direction now."""
    left: tuple[str, ...]
    """Ids of those that still have none: no wall near, walls of several directions, or locked."""


def faced_from_walls(reflectors: ReflectorMap, floor_map: FloorMap, near: float = NEAR) -> Faced:
    """Give each plate of unknown direction the free normal of the wall that it hangs on.

    Parameters
    ----------
    reflectors : those there are; what has a direction, is a cylinder or is locked stays.
    floor_map : walls and free floor.
    near : largest distance between a plate and its wall [m].
    """
    grid = floor_map.occupancy()
    changed: list[Reflector] = []
    turned: list[str] = []
    left: list[str] = []
    for reflector in reflectors.reflectors:
        heading = None
        if reflector.lacks_direction:
            if not reflector.locked:
                found = [nearest_wall(grid, place, near) for place in _places(reflector, floor_map)]
                heading = _agreed(
                    [wall for wall in found if wall is not None and _is_free_ahead(wall, floor_map, grid)]
                )
            (left if heading is None else turned).append(reflector.id)
        changed.append(reflector if heading is None else replace(reflector, heading=heading))
    return Faced(ReflectorMap(tuple(changed)), tuple(turned), tuple(left))


def _places(reflector: Reflector, floor_map: FloorMap) -> list[tuple[float, float]]:
    """Where the plate is, and half a cell around it: a direction that changes within that is none."""
    x, y, off = reflector.x, reflector.y, 0.5 * floor_map.resolution
    return [(x, y), (x + off, y), (x - off, y), (x, y + off), (x, y - off)]


def _is_free_ahead(wall: WallPoint, floor_map: FloorMap, grid: OccupancyGrid) -> bool:
    """Whether floor lies in front of a wall's surface, and not what nobody has seen; of a map of walls alone always."""
    if not (floor_map.cells == FREE).any():
        return True
    ahead = floor_map.resolution * np.array([np.cos(wall.heading), np.sin(wall.heading)])
    place = np.array([wall.x, wall.y]) + ahead
    row, column = grid.cells_at(place)
    return bool(grid.contains(place)) and bool(floor_map.cells[row, column] == FREE)


def _agreed(walls: list[WallPoint]) -> float | None:
    """The direction of the nearest of some surfaces [rad], if the others face it as well."""
    if not walls:
        return None
    first = min(walls, key=lambda wall: wall.distance)
    differ = any(abs(wrap_scalar(wall.heading - first.heading)) > AGREES for wall in walls)
    return None if differ else first.heading


def said_of(faced: Faced) -> str:
    """Say how many plates have a direction now, and which have none."""
    rest = f"; {_left(faced)}" if faced.left else ""
    one, several = "plate faces away from its wall", "plates face away from their walls"
    return f"{counted_text(len(faced.turned), one, several)} now{rest}"


def left_said(faced: Faced) -> str:
    """Say which plates stay without a direction, as a sentence; nothing where there are none."""
    return f"{_left(faced)}." if faced.left else ""


def _left(faced: Faced) -> str:
    shown = ", ".join(faced.left[:MOST_NAMED])
    more = f" and {len(faced.left) - MOST_NAMED} more" if len(faced.left) > MOST_NAMED else ""
    return f"{shown}{more} are locked, hang near no wall, or near several"
