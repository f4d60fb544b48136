"""What suggested reflectors must achieve, and where a demand does not hold. How they are found is in `placement`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from commission.site.checks import above, at_least

Spot = tuple[float, float] | tuple[float, float, float]
"""x [m], y [m] of base in the map, and its heading [rad] where it matters; without one every heading counts."""


@dataclass(frozen=True, slots=True)
class Demands:
    """What the reflectors must achieve at every scan of the routes, and where a vehicle may be switched on."""

    visible: int = 2
    """Reflectors that must be visible."""
    survive_failure: bool = True
    """Whether all demands must hold as well with any single reflector blocked."""
    position_limit: float | None = None
    """Largest 2-sigma of x and of y [m]. None: the supervisor's. Stations add what they require."""
    heading_limit: float | None = None
    """Largest 2-sigma of the heading [rad]. None: the supervisor's."""
    spacing: float = 0.5
    """Smallest distance between two reflectors [m]."""
    unambiguous_stations: bool = False
    """Whether a vehicle that is switched on at a station must see which place it is."""
    unambiguous_starts: bool = False
    """Whether a vehicle that is switched on at the start of a route must see which place it is."""
    unambiguous_spots: tuple[Spot, ...] = ()
    """Further spots at which it must."""

    def __post_init__(self) -> None:
        at_least(self.visible, 1, "demands.visible")
        if self.position_limit is not None:
            above(self.position_limit, 0.0, "demands.position_limit", "m")
        if self.heading_limit is not None:
            above(self.heading_limit, 0.0, "demands.heading_limit", "rad")
        at_least(self.spacing, 0.0, "demands.spacing", "m")
        for spot in self.unambiguous_spots:
            if len(spot) not in (2, 3) or not all(math.isfinite(value) for value in spot):
                raise ValueError(f"demands.unambiguous_spots has {spot}; expected x, y [m] and maybe a heading [rad]")


@dataclass(frozen=True, slots=True)
class Unmet:
    """Where a demand does not hold, whatever is put up at the candidates."""

    route: str
    """Name of the route; of an ambiguous place the route that leads nearest to it."""
    metres: tuple[int, ...]
    """Metres of its way; of an ambiguous place the metre nearest to it."""
    reason: str
    """`visible`, `uncertainty` or `ambiguous`."""
    place: str = ""
    """Which place is ambiguous."""
