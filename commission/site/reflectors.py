"""The reflector map M_B: known places of anonymous reflectors. Not how they are seen or stored."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from commission.errors import ProjectError
from commission.geometry.arrays import FloatArray, frozen
from commission.site.checks import FARTHEST, at_least


class ReflectorKind(StrEnum):
    """Shape of a reflector."""

    CYLINDER = "cylinder"
    FLAT = "flat"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reflector:
    """One reflector on the floor plan."""

    id: str
    """Name, unique within the map."""
    x: float
    """Center, x in the map frame [m]."""
    y: float
    """Center, y in the map frame [m]."""
    radius: float = 0.04
    """Radius of a cylinder, half the width of a flat plate [m]."""
    kind: ReflectorKind = ReflectorKind.CYLINDER
    """`cylinder` or `flat`."""
    heading: float = 0.0
    """Direction that a flat plate faces, map frame [rad]."""
    height: float = 0.2
    """Height of its middle above the floor [m]."""
    sigma: float = 0.0
    """1-sigma uncertainty of its surveyed position, each axis [m]."""
    layer: str = ""
    """Group of reflectors that belong together."""
    note: str = ""
    """Free text."""
    locked: bool = False
    """Whether edits leave it as it is, until it is unlocked."""

    def __post_init__(self) -> None:
        if not self.id:
            raise ValueError("id is empty; expected a name")
        for name in ("x", "y", "heading", "height"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number")
        if max(abs(self.x), abs(self.y)) > FARTHEST:
            name = "x" if abs(self.x) > FARTHEST else "y"
            raise ValueError(
                f"{name} is {getattr(self, name):g}; expected at most {FARTHEST:g} m from the map's origin"
            )
        if not 0.0 < self.radius <= 1.0:
            raise ValueError(f"radius is {self.radius:g}; expected more than 0 and at most 1 m")
        at_least(self.sigma, 0.0, "sigma", "m")


@dataclass(frozen=True, slots=True)
class ReflectorMap:
    """All reflectors of a site, in the order of their file."""

    reflectors: tuple[Reflector, ...] = ()
    """The reflectors; ids are unique."""
    centers: FloatArray = field(init=False, repr=False, compare=False)
    """(N, 2) centers [m], map frame."""
    radii: FloatArray = field(init=False, repr=False, compare=False)
    """(N,) radii [m]."""

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
            frozen([r.radius for r in self.reflectors], (None,), "reflector radii"),
        )

    def __len__(self) -> int:
        """Return the number of reflectors."""
        return len(self.reflectors)

    @property
    def is_flat(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """(N,) whether each reflector is a flat plate."""
        return np.array([r.kind is ReflectorKind.FLAT for r in self.reflectors], dtype=np.bool_)

    @property
    def headings(self) -> FloatArray:
        """(N,) direction that each flat plate faces [rad], map frame."""
        return frozen([r.heading for r in self.reflectors], (None,), "reflector headings")
