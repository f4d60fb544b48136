"""What a layout of reflectors must achieve, and where reflectors may stand: what the engineer asks of a suggested one.

How a layout is found is in `planning.placement`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from commission.site.checks import above, at_least
from commission.site.routes import Route

Rectangle = tuple[float, float, float, float]
"""x and y of two opposite corners [m], map frame."""
Spot = tuple[float, ...]
"""x [m], y [m] of base in the map, and its heading [rad] where it matters; without one every heading counts."""


def low_high(area: Rectangle) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower-left and upper-right corner of a rectangle that any two opposite corners give [m]."""
    x_a, y_a, x_b, y_b = area
    return (min(x_a, x_b), min(y_a, y_b)), (max(x_a, x_b), max(y_a, y_b))


@dataclass(frozen=True, slots=True)
class AllowedHeights:
    """At which heights a reflector may be put up in a part of the hall."""

    lowest: float
    """Least height of its middle above the floor [m]."""
    highest: float
    """Greatest one [m]."""
    area: Rectangle | None = None
    """The part of the hall, by x and y of two opposite corners [m]; none: everywhere."""

    def __post_init__(self) -> None:
        at_least(self.lowest, 0.0, "allowed_heights.lowest", "m")
        if not self.lowest <= self.highest < math.inf:
            raise ValueError(f"allowed_heights are {self.lowest:g} to {self.highest:g} m; expected lowest <= highest")
        if self.area is not None and not all(map(math.isfinite, self.area)):
            raise ValueError(f"allowed_heights.area is {self.area}; expected finite metres")


@dataclass(frozen=True, slots=True, kw_only=True)
class CandidateOptions:
    """Where reflectors may be put up, and which kind."""

    spacing: float = 1.0
    """Distance between neighboring candidates on one face of a wall or pillar [m]."""
    radius: float = 0.04
    """Radius of the reflectors to be put up [m]."""
    height: float = 0.2
    """Height of the scanner's beams above the floor [m]: that of the middle of a reflector, where it is allowed."""
    gap: float = 0.02
    """Distance left between a reflector's surface and the wall [m]."""
    clearance: float = 0.3
    """Distance left between a reflector and the vehicle on its routes [m]."""
    keep_out: tuple[Rectangle, ...] = ()
    """Areas without reflectors: x and y of two opposite corners each [m]."""
    length: float = 0.2
    """Length of the reflectors [m]: a beam must still meet one whose middle is higher or lower than the beams."""
    allowed_heights: tuple[AllowedHeights, ...] = ()
    """Heights that are allowed for the middle of a reflector; of several for one place all count."""

    def __post_init__(self) -> None:
        above(self.spacing, 0.0, "candidates.spacing", "m")
        above(self.radius, 0.0, "candidates.radius", "m")
        at_least(self.height, 0.0, "candidates.height", "m")
        at_least(self.gap, 0.0, "candidates.gap", "m")
        at_least(self.clearance, 0.0, "candidates.clearance", "m")
        above(self.length, 0.0, "candidates.length", "m")
        if not all(math.isfinite(value) for rectangle in self.keep_out for value in rectangle):
            raise ValueError(f"candidates.keep_out is {self.keep_out}; expected finite metres")


@dataclass(frozen=True, slots=True, kw_only=True)
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
class LayoutBrief:
    """What is asked of a suggested layout."""

    demands: Demands = field(default_factory=Demands)
    """What must hold."""
    candidates: CandidateOptions = field(default_factory=CandidateOptions)
    """Where reflectors may be put up."""
    ignored_routes: tuple[str, ...] = ()
    """Names of the routes on which the demands need not hold."""

    def counted(self, routes: Iterable[Route]) -> tuple[str, ...]:
        """Names of the routes on which the demands must hold, in their order."""
        return tuple(route.name for route in routes if route.name not in self.ignored_routes)

    def renamed(self, route: str, name: str | None) -> LayoutBrief:
        """The same when a route is called otherwise, or (with no name) is gone."""
        if route not in self.ignored_routes:
            return self
        names = (name if each == route else each for each in self.ignored_routes)
        return replace(self, ignored_routes=tuple(each for each in names if each is not None))
