"""How one browser draws on the floor map."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MapPen:
    """How the floor map's tools draw."""

    thickness: float = 0.1
    """Thickness of a wall [m]."""
    to_unknown: bool = False
    """Whether erased cells become unknown instead of free."""

    def __post_init__(self) -> None:
        if not 0.001 <= self.thickness <= 10.0:
            raise ValueError(f"thickness is {self.thickness:g} m; expected 0.001 to 10 m")
