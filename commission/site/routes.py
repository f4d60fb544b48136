"""Planned routes: splines with a direction and a speed. Not how a vehicle follows them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from commission.errors import ProjectError, UsageError
from commission.geometry.arrays import FloatArray, equal_fields, frozen
from commission.geometry.splines import Spline
from commission.site.checks import check_fields
from commission.site.quantity import COORDINATE, Bounds, Choice, Quantity, Words

SPEEDS = Bounds.between(0.001, 100.0)
"""Planned speeds [m/s]: a slower route would never end in a virtual drive."""
WEIGHTS = Bounds.between(1e-6, 1e6)
"""Weights of a control point [1]: beyond, a curve loses its digits."""


class Direction(StrEnum):
    """Whether the vehicle's front or its rear goes ahead."""

    FORWARD = "forward"
    REVERSE = "reverse"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Segment:
    """One curve of a route, driven without a stop."""

    control_points: Annotated[FloatArray, Quantity(label="Control points", unit="m", bounds=COORDINATE, decimals=4)]
    """(N, 2) control points of the curve, map frame."""
    direction: Annotated[Direction, Choice("Segment")] = Direction.FORWARD
    """Whether the vehicle's front or its rear goes ahead: `forward` or `reverse`."""
    degree: int = 3
    """Degree of the B-spline."""
    knots: Annotated[FloatArray | None, Quantity(label="Knots", decimals=9)] = None
    """(N + degree + 1,) knots, clamped; none: uniform in 0 to 1."""
    weights: Annotated[FloatArray | None, Quantity(label="Weights", bounds=WEIGHTS)] = None
    """(N,) positive weights (NURBS); none: all 1."""
    speed: Annotated[float | None, Quantity(label="Speed", unit="m/s", bounds=SPEEDS, step=0.01)] = None
    """Speed on this segment; none: the route's."""

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "control_points",
            frozen(self.control_points, (None, 2), "control_points"),
        )
        for name in ("knots", "weights"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name), (None,), name))
        check_fields(self)
        self.spline()

    def __eq__(self, other: object) -> bool:
        """Equal when every field is, arrays element by element."""
        return equal_fields(self, other)

    def spline(self) -> Spline:
        """Return the curve; raises ValueError when degree, knots, weights and points do not fit each other."""
        return Spline(self.degree, self.control_points, self.knots, self.weights)


@dataclass(frozen=True, slots=True)
class Route:
    """Segments driven one after the other; where the direction changes the vehicle stops."""

    name: Annotated[str, Words("Route")]
    """Name, unique within the project."""
    segments: tuple[Segment, ...]
    """The curves; each starts where the one before ends."""
    speed: Annotated[float, Quantity(label="Speed", unit="m/s", bounds=SPEEDS, step=0.01)] = 0.5
    """Speed of segments that name none."""

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("a route's name is empty; expected text")
        if not self.segments:
            raise ValueError(f"route {self.name!r} has no segments; expected 1 or more")
        check_fields(self, f"route {self.name!r}: ")
        for index, (before, after) in enumerate(zip(self.segments, self.segments[1:], strict=False)):
            gap = math.dist(before.control_points[-1], after.control_points[0])
            if gap > 0.01:
                raise ProjectError(
                    f"route {self.name!r}: segment {index + 2} starts {gap * 1000:.0f} mm from the end of segment "
                    f"{index + 1}; expected at most 10 mm"
                )

    def speed_of(self, segment: Segment) -> float:
        """Return the speed on a segment [m/s]."""
        return self.speed if segment.speed is None else segment.speed


def route_named(routes: Iterable[Route], name: str) -> Route:
    """Return the route of that name among those of a project; raises UsageError that lists the names there are."""
    known = {route.name: route for route in routes}
    if name not in known:
        names = ", ".join(map(repr, known)) or "none"
        raise UsageError(f"no route is called {name!r}; the project has: {names}")
    return known[name]
