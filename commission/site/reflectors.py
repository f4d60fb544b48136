"""The reflector map M_B: known places of anonymous reflectors. Not how they are seen or stored."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np

from commission.errors import ProjectError
from commission.geometry.arrays import FloatArray, frozen
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
        float, Quantity(label="Radius", unit="m", shown=MILLIMETRES, bounds=_RADIUS, step=0.1, decimals=4)
    ] = 0.04
    """Radius of a cylinder, half the width of a flat plate."""
    kind: Annotated[ReflectorKind, Choice("Kind")] = ReflectorKind.CYLINDER
    """`cylinder` or `flat`."""
    heading: Annotated[float, Quantity(label="Faces", unit="rad", shown=DEGREES, step=0.01, decimals=6)] = 0.0
    """Direction that a flat plate faces, map frame."""
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
