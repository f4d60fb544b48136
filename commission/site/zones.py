"""Zones: parts of the floor in which only some kinds of observation correct the pose.

Reflectors in the racks, contours at the walls, a tag at the dock: each where it is trusted. How the filter reads them
is `localization.zones`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.polygon import Corners, area, check_polygon
from commission.site.quantity import Quantity, Words

LEAST_AREA = 1e-6
"""Floor below which a zone has none [m^2]: corners in line, or in one place."""


class ObservationKind(StrEnum):
    """What the pose can be corrected by."""

    REFLECTORS = "reflectors"
    CONTOURS = "contours"
    TAGS = "tags"


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """A part of the floor, and what corrects the pose there; outside of all zones everything does."""

    name: Annotated[str, Words("Called")]
    """Name, unique within the project."""
    outline: Annotated[Corners, Quantity(label="Corners", unit="m", decimals=4)]
    """Its corners in their order, map frame; where zones overlap the first of them counts."""
    kinds: Annotated[tuple[ObservationKind, ...], Words("Corrected by")] = tuple(ObservationKind)
    """What corrects the pose of a vehicle that is in it: reflectors, contours, tags."""

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise ValueError("a zone's name is empty; expected text")
        check_fields(self, "zones.")
        check_polygon(self.outline, f"the outline of zone {self.name!r}", "the zone")
        if area(self.outline) < LEAST_AREA:
            raise ValueError(
                f"the outline of zone {self.name!r} encloses no floor; expected corners that are not in line"
            )
        if not self.kinds:
            raise ValueError(
                f"zone {self.name!r} is corrected by nothing; expected one of: {', '.join(ObservationKind)}"
            )
        if len(set(self.kinds)) < len(self.kinds):
            raise ValueError(f"zone {self.name!r} names a kind twice; expected each once")
