"""How one browser draws on the floor map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.quantity import MILLIMETRES, Bounds, Quantity, Switch

THICKNESS = Quantity(label="Thickness", unit="m", shown=MILLIMETRES, bounds=Bounds.between(0.001, 10.0), step=1.0)


@dataclass(frozen=True, slots=True)
class MapPen:
    """How the floor map's tools draw."""

    thickness: Annotated[float, THICKNESS] = 0.1
    """Thickness of a wall: half of it on each side of the line."""
    to_unknown: Annotated[bool, Switch("Becomes")] = False
    """Whether erased cells are unknown then, and not free; both let the laser pass."""

    def __post_init__(self) -> None:
        check_fields(self)
