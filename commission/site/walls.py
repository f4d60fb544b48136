"""The walls of a floor map, prepared for rays once for all who ask: localizer, planning and virtual scanners."""

from __future__ import annotations

import functools

import numpy as np

from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.site.floor_map import FloorMap


class _Same:
    """A floor map that is equal only to itself: to compare millions of cells takes as long as to prepare them."""

    __slots__ = ("floor_map",)

    def __init__(self, floor_map: FloorMap) -> None:
        self.floor_map = floor_map

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.floor_map is other.floor_map

    def __hash__(self) -> int:
        # The map stays alive as long as this does, so that no other one has its address.
        return id(self.floor_map)


def walls_of(floor_map: FloorMap | None) -> RayCaster:
    """Return the walls of a floor map, prepared for rays; without one there are none.

    Parameters
    ----------
    floor_map : its occupied cells stop rays; the same value gives the same table.
    """
    return _no_walls() if floor_map is None else _prepared(_Same(floor_map))


@functools.lru_cache(maxsize=2)
def _prepared(same: _Same) -> RayCaster:
    """Prepare a floor map; the last two are kept: that of the page, and the one before an edit."""
    return RayCaster(same.floor_map.occupancy())


@functools.lru_cache(maxsize=1)
def _no_walls() -> RayCaster:
    """An open field."""
    return RayCaster(OccupancyGrid(np.zeros((1, 1), dtype=np.bool_), 1.0))
