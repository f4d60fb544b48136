"""Stations: places where the vehicle stops for a purpose, and how accurately. Not the routes that lead there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, frozen
from commission.site.checks import FARTHEST, between

DOCKING = 0.01
"""Accuracy that taking over a load usually needs [m]."""
TRANSIT = 0.1
"""Accuracy that waiting and passing usually need [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """A pose that the vehicle has to reach."""

    name: str
    """Name, unique within the project."""
    x: float
    """Place of the vehicle's base, x in the map frame [m]."""
    y: float
    """Place of the vehicle's base, y in the map frame [m]."""
    heading: float = 0.0
    """Heading of the vehicle, map frame [rad]."""
    required_accuracy: float = TRANSIT
    """Largest allowed 2-sigma of the position there, each axis [m]: 0.01 to dock, 0.1 to pass."""

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("a station's name is empty; expected text")
        for axis in ("x", "y"):
            between(getattr(self, axis), (-FARTHEST, FARTHEST), axis, "m")
        if not math.isfinite(self.heading):
            raise ValueError(f"heading is {self.heading}; expected a finite number [rad]")
        between(self.required_accuracy, (0.001, 10.0), "required_accuracy", "m")

    @property
    def pose(self) -> FloatArray:
        """(3,) `T_map_base` of a vehicle that stands there [m, m, rad]."""
        return frozen(np.array([self.x, self.y, self.heading]), (3,), "station")
