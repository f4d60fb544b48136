"""Stations: places where the vehicle stops for a purpose, and how accurately. Not the routes that lead there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from commission.geometry.arrays import FloatArray, frozen
from commission.site.checks import check_fields
from commission.site.quantity import DEGREES, MILLIMETRES, Bounds, Quantity, Words, X, Y

DOCKING = 0.01
"""Accuracy that taking over a load usually needs [m]."""
TRANSIT = 0.1
"""Accuracy that waiting and passing usually need [m]."""


ACCURACY = Quantity(
    label="Within", unit="m", shown=MILLIMETRES, bounds=Bounds.between(0.001, 10.0), step=0.1, decimals=4
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """A pose that the vehicle has to reach."""

    name: Annotated[str, Words("Name")]
    """Name, unique within the project."""
    x: Annotated[float, X]
    """Place of the vehicle's base, x in the map frame."""
    y: Annotated[float, Y]
    """Place of the vehicle's base, y in the map frame."""
    heading: Annotated[float, Quantity(label="Heading", unit="rad", shown=DEGREES, step=0.01, decimals=6)] = 0.0
    """Heading of the vehicle, map frame."""
    required_accuracy: Annotated[float, ACCURACY] = TRANSIT
    """Largest allowed 2-sigma of the position there, each axis: 0.01 m to dock, 0.1 m to pass."""

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("a station's name is empty; expected text")
        check_fields(self)

    @property
    def pose(self) -> FloatArray:
        """(3,) `T_map_base` of a vehicle that stands there [m, m, rad]."""
        return frozen(np.array([self.x, self.y, self.heading]), (3,), "station")
