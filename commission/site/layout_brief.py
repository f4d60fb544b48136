"""What a layout of reflectors must achieve, and where reflectors may stand: what the engineer asks of a suggested one.

How a layout is found is in `planning.placement`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, NamedTuple

from commission.site.checks import check_fields
from commission.site.quantity import (
    DEGREES,
    MILLIMETRES,
    NOT_NEGATIVE,
    PERCENT,
    POSITIVE,
    Bounds,
    Group,
    Quantity,
    Switch,
)
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

    lowest: Annotated[float, Quantity(label="From", unit="m", bounds=NOT_NEGATIVE, decimals=4)]
    """Least height of its middle above the floor."""
    highest: Annotated[float, Quantity(label="To", unit="m", decimals=4)]
    """Greatest height of its middle."""
    area: Annotated[Rectangle | None, Quantity(label="Area", unit="m", decimals=4)] = None
    """The part of the hall, by x and y of two opposite corners; none: everywhere."""

    def __post_init__(self) -> None:
        check_fields(self, "allowed_heights.")
        if not self.lowest <= self.highest:
            raise ValueError(f"allowed_heights are {self.lowest:g} to {self.highest:g} m; expected lowest <= highest")


@dataclass(frozen=True, slots=True, kw_only=True)
class CandidateOptions:
    """Where reflectors may be put up, and which kind."""

    spacing: Annotated[
        float, Quantity(label="Try every", unit="m", bounds=POSITIVE, step=0.1, entry=(0.1, 20.0), decimals=4)
    ] = 1.0
    """Distance along the walls between the places that are tried: finer finds fewer and takes longer."""
    radius: Annotated[
        float,
        Quantity(
            label="Radius",
            unit="m",
            shown=MILLIMETRES,
            bounds=POSITIVE,
            step=1.0,
            entry=(5.0, 500.0),
            decimals=4,
        ),
    ] = 0.04
    """Radius of the reflectors to be put up."""
    height: Annotated[
        float, Quantity(label="Height", unit="m", bounds=NOT_NEGATIVE, step=0.01, entry=(0.0, 10.0), decimals=4)
    ] = 0.2
    """Height of the scanner's beams above the floor, and of the middle of the reflectors where it is allowed."""
    gap: Annotated[float, Quantity(label="Off the wall", unit="m", bounds=NOT_NEGATIVE, decimals=4)] = 0.02
    """Distance left between a reflector's surface and the wall."""
    clearance: Annotated[
        float,
        Quantity(label="Clear of routes", unit="m", bounds=NOT_NEGATIVE, step=0.05, entry=(0.0, 10.0), decimals=4),
    ] = 0.3
    """Distance left between a reflector and the vehicle on its routes."""
    keep_out: Annotated[tuple[Rectangle, ...], Quantity(label="Keep out", unit="m", decimals=4)] = ()
    """Areas without reflectors: x and y of two opposite corners each."""
    length: Annotated[float, Quantity(label="Length", unit="m", bounds=POSITIVE, decimals=4)] = 0.2
    """Length of the reflectors: one whose middle is not at the height of the beams must still be met by them."""
    allowed_heights: tuple[AllowedHeights, ...] = ()
    """Heights that are allowed for the middle of a reflector; of several for one place all count."""

    def __post_init__(self) -> None:
        check_fields(self, "candidates.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Demands:
    """What the reflectors must achieve at every scan of the routes, and where a vehicle may be switched on."""

    visible: Annotated[int, Quantity(label="Visible, at least", bounds=Bounds.at_least(1), step=1, entry=(1, 20))] = 2
    """Reflectors that must be visible everywhere on the routes."""
    survive_failure: Annotated[bool, Switch("One may fail")] = True
    """Whether all demands must hold as well with any single reflector blocked."""
    position_limit: Annotated[
        float | None,
        Quantity(label="2σ x, y", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=1.0, entry=(1.0, 10_000.0)),
    ] = None
    """Largest 2-sigma of x and of y on the routes. None: the supervisor's. Stations add what they require."""
    heading_limit: Annotated[
        float | None,
        Quantity(label="2σ heading", unit="rad", shown=DEGREES, bounds=POSITIVE, step=0.01, entry=(0.01, 90.0)),
    ] = None
    """Largest 2-sigma of the heading on the routes. None: the supervisor's."""
    leeway: Annotated[
        float, Quantity(label="Leeway", shown=PERCENT, bounds=Bounds.between(0.0, 1.0), step=1.0, entry=(0.0, 100.0))
    ] = 0.1
    """Where reflectors at all places together hardly keep a limit, or do not: how much more than what they give is
    good enough. Otherwise such a stretch takes nearly all of them for very little."""
    spacing: Annotated[
        float, Quantity(label="Apart", unit="m", bounds=NOT_NEGATIVE, step=0.05, entry=(0.0, 100.0), decimals=4)
    ] = 0.5
    """Smallest distance between two reflectors."""
    pairs_differ: Annotated[
        float,
        Quantity(label="Pairs differ by", unit="m", bounds=NOT_NEGATIVE, step=0.05, entry=(0.0, 10.0), decimals=4),
    ] = 0.0
    """By how much the distances between reflectors must differ, of any two pairs that are in sight at once, so that a
    start search tells them apart; 0.3 m is usual. 0: they need not."""
    wall_reach: Annotated[
        float,
        Quantity(label="Spread: within", unit="m", bounds=NOT_NEGATIVE, step=0.5, entry=(0.0, 1000.0), decimals=4),
    ] = 0.0
    """How far any place along the walls that is seen from a route may be from the nearest reflector, so that they
    spread along the walls. 0: any distance."""
    unambiguous_stations: Annotated[bool, Switch("Unique stations")] = False
    """Whether a vehicle that is switched on at a station must see which place it is."""
    unambiguous_starts: Annotated[bool, Switch("Unique starts")] = False
    """Whether a vehicle that is switched on at the start of a route must see which place it is."""
    unambiguous_spots: Annotated[tuple[Spot, ...], Quantity(label="Unique spots", unit="m, m, rad", decimals=6)] = ()
    """Further spots at which it must."""

    def __post_init__(self) -> None:
        check_fields(self, "demands.")
        for spot in self.unambiguous_spots:
            if len(spot) not in (2, 3) or not all(math.isfinite(value) for value in spot):
                raise ValueError(f"demands.unambiguous_spots has {spot}; expected x, y [m] and maybe a heading [rad]")

    def preset(self, name: str) -> Demands:
        """Return these demands with what a preset asks for; raises ValueError for one that there is not."""
        if name not in DEMAND_PRESETS:
            raise ValueError(f"preset of the demands is {name!r}; expected one of {', '.join(DEMAND_PRESETS)}")
        return replace(self, **DEMAND_PRESETS[name].asks)


class DemandPreset(NamedTuple):
    """What the maker of a scanner or a plant asks of every layout."""

    says: str
    """For a person."""
    asks: dict[str, Any]
    """Fields of `Demands` and their values."""


DEMAND_PRESETS = {
    "NAV350": DemandPreset(
        "at least 3 reflectors visible everywhere on the routes, after any single one has failed",
        {"visible": 3, "survive_failure": True},
    ),
}
"""By name."""


@dataclass(frozen=True, slots=True)
class LayoutBrief:
    """What is asked of a suggested layout."""

    demands: Annotated[Demands, Group("Demands")] = field(default_factory=Demands)
    """What must hold."""
    candidates: Annotated[CandidateOptions, Group("Where they may stand")] = field(default_factory=CandidateOptions)
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
