"""The reflector map M_B: known places of anonymous reflectors. Not how they are seen or stored.

A radius and a direction that nobody has measured are None: a guess would be a claim like any other. What is reckoned
with then is said here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np

from commission.errors import ProjectError
from commission.geometry.arrays import BoolArray, FloatArray, frozen
from commission.site.checks import check_fields
from commission.site.quantity import (
    DEGREES,
    MILLIMETRES,
    NOT_NEGATIVE,
    Bounds,
    Choice,
    Quantity,
    Switch,
    Words,
    X,
    Y,
)

UNKNOWN = "unknown"
"""How the page calls a radius or a direction that nobody has said."""
ASSUMED_RADIUS = 0.04
"""Radius that an unknown one is taken for where a single number is needed [m]: the usual post of 80 mm."""
UNKNOWN_RADII = (0.02, 0.08)
"""Smallest and largest radius that an unknown one is reckoned with [m]."""
UNKNOWN_RADIUS_SIGMA = 0.02
"""Root mean square distance from `ASSUMED_RADIUS` of radii spread evenly over `UNKNOWN_RADII` [m]."""
RANGE_PER_RADIUS = math.pi / 4.0
"""How far the fitted center of a cylinder moves along the ray where its radius is wrong by one: the mean distance, in
radii, from the lit half of a circle to the line through its center across the beam."""
_RADIUS = Bounds(0.0, 1.0, excludes_low=True)


class ReflectorKind(StrEnum):
    """Shape of a reflector."""

    CYLINDER = "cylinder"
    FLAT = "flat"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reflector:
    """One reflector on the floor plan."""

    id: Annotated[str, Words("Name")]
    """Name, unique within the map."""
    x: Annotated[float, X]
    """Center, x in the map frame."""
    y: Annotated[float, Y]
    """Center, y in the map frame."""
    radius: Annotated[
        float | None,
        Quantity(label="Radius", unit="m", shown=MILLIMETRES, bounds=_RADIUS, step=0.1, decimals=4, none=UNKNOWN),
    ] = ASSUMED_RADIUS
    """Radius of a cylinder, half the width of a flat plate. None: unknown."""
    kind: Annotated[ReflectorKind, Choice("Kind")] = ReflectorKind.CYLINDER
    """`cylinder` or `flat`."""
    heading: Annotated[
        float | None, Quantity(label="Faces", unit="rad", shown=DEGREES, step=0.01, decimals=6, none=UNKNOWN)
    ] = None
    """Direction that a flat plate faces, map frame. None: unknown; it counts as seen from every free side."""
    height: Annotated[float, Quantity(label="Height", unit="m", decimals=4)] = 0.2
    """Height of its middle above the floor."""
    sigma: Annotated[float, Quantity(label="Survey 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=0.1)] = (
        0.0
    )
    """1-sigma uncertainty of its surveyed position, each axis."""
    layer: Annotated[str, Words("Layer")] = ""
    """Group of reflectors that belong together."""
    note: Annotated[str, Words("Note")] = ""
    """Free text."""
    locked: Annotated[bool, Switch("Locked")] = False
    """Whether edits leave it as it is, until it is unlocked."""

    def __post_init__(self) -> None:
        if not self.id:
            raise ValueError("id is empty; expected a name")
        check_fields(self)

    @property
    def reckoned_radius(self) -> float:
        """Its radius, or the one that an unknown one is taken for [m]."""
        return ASSUMED_RADIUS if self.radius is None else self.radius

    @property
    def radii(self) -> tuple[float, float]:
        """Smallest and largest radius that it may have [m]."""
        return UNKNOWN_RADII if self.radius is None else (self.radius, self.radius)

    @property
    def lacks_direction(self) -> bool:
        """Whether it is a plate of which nobody knows which way it faces."""
        return self.kind is ReflectorKind.FLAT and self.heading is None

    @property
    def radius_sigma(self) -> float:
        """1-sigma by which its detections are too near or too far since its radius is unknown [m].

        0 of a known radius, and of a plate, whose width does not move its middle. It is a constant of the reflector,
        like its survey error, and is reckoned with as one: along the ray it is exact, across it too large.
        """
        is_known = self.radius is not None or self.kind is ReflectorKind.FLAT
        return 0.0 if is_known else RANGE_PER_RADIUS * UNKNOWN_RADIUS_SIGMA

    @property
    def own_sigma(self) -> float:
        """1-sigma of its place by what is said of it alone, each axis [m]: its survey, and an unknown radius."""
        return math.hypot(self.sigma, self.radius_sigma)


@dataclass(frozen=True, slots=True)
class ReflectorMap:
    """All reflectors of a site, in the order of their file."""

    reflectors: tuple[Reflector, ...] = ()
    """The reflectors; ids are unique."""
    centers: FloatArray = field(init=False, repr=False, compare=False)
    """(N, 2) centers [m], map frame."""
    radii: FloatArray = field(init=False, repr=False, compare=False)
    """(N,) radii [m]; of an unknown one what it is taken for."""

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for reflector in self.reflectors:
            if reflector.id in seen:
                raise ProjectError(f"reflector id {reflector.id!r} is used twice; expected unique ids")
            seen.add(reflector.id)
        object.__setattr__(
            self,
            "centers",
            frozen([(r.x, r.y) for r in self.reflectors], (None, 2), "reflector centers"),
        )
        object.__setattr__(
            self,
            "radii",
            frozen([r.reckoned_radius for r in self.reflectors], (None,), "reflector radii"),
        )

    def __len__(self) -> int:
        """Return the number of reflectors."""
        return len(self.reflectors)

    @property
    def is_flat(self) -> BoolArray:
        """(N,) whether each reflector is a flat plate."""
        return np.array([r.kind is ReflectorKind.FLAT for r in self.reflectors], dtype=np.bool_)

    @property
    def is_directed(self) -> BoolArray:
        """(N,) whether each reflector is a plate that is known to face a direction: it is seen from that side alone."""
        known = (r.kind is ReflectorKind.FLAT and r.heading is not None for r in self.reflectors)
        return np.array(list(known), dtype=np.bool_)

    @property
    def headings(self) -> FloatArray:
        """(N,) direction that each flat plate faces [rad], map frame; 0 where it is not `is_directed`."""
        return frozen([r.heading or 0.0 for r in self.reflectors], (None,), "reflector headings")
