"""What disturbs localization in this hall: people, shiny things, tilted floor, faults. Read by the simulation alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.quantity import NOT_NEGATIVE, PERCENT, SHARE, Bounds, Quantity, X, Y

PEOPLE = Quantity(label="People", bounds=Bounds.between(0, 10_000), step=1, entry=(0, 500))
_FREQUENCY = Bounds.between(0.0, 1000.0)


@dataclass(frozen=True, slots=True)
class ShinyObject:
    """A fixed object that the scanner takes for a reflector: an upright plate or post of a given width."""

    x: Annotated[float, X]
    """Center, x in the map frame."""
    y: Annotated[float, Y]
    """Center, y in the map frame."""
    radius: Annotated[float, Quantity(label="Radius", unit="m", bounds=Bounds.between(0.001, 2.0), decimals=4)] = 0.1
    """Half its width."""

    def __post_init__(self) -> None:
        check_fields(self, "shiny object's ")


@dataclass(frozen=True, slots=True)
class TiltedStretch:
    """A circular patch of uneven floor on which the laser meets the ground early."""

    x: Annotated[float, X]
    """Center, x in the map frame."""
    y: Annotated[float, Y]
    """Center, y in the map frame."""
    radius: Annotated[float, Quantity(label="Radius", unit="m", bounds=NOT_NEGATIVE, decimals=4)]
    """Radius of the patch."""
    range_limit: Annotated[float, Quantity(label="Range left", unit="m", bounds=Bounds.at_least(0.1), decimals=4)] = 4.0
    """Range that is left while the vehicle stands on it."""

    def __post_init__(self) -> None:
        check_fields(self, "tilted stretch's ")


@dataclass(frozen=True, slots=True)
class CoveredPeriod:
    """A time during which every reflector is covered."""

    start: Annotated[float, Quantity(label="Start", unit="s", bounds=NOT_NEGATIVE)]
    """Time after the start of the drive."""
    duration: Annotated[float, Quantity(label="Duration", unit="s", bounds=NOT_NEGATIVE)]
    """How long it lasts."""

    def __post_init__(self) -> None:
        check_fields(self, "covered period's ")


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbances:
    """Everything that a virtual drive suffers beyond the noise of its sensors."""

    people: Annotated[int, PEOPLE] = 0
    """People walking about on the free floor."""
    walking_speed: Annotated[float, Quantity(label="Walking speed", unit="m/s", bounds=Bounds.between(0.0, 10.0))] = 1.0
    """Mean speed of a person."""
    shiny_objects: tuple[ShinyObject, ...] = ()
    """Fixed things that look like reflectors."""
    glints_per_scan: Annotated[float, Quantity(label="Glints per scan", bounds=_FREQUENCY)] = 0.0
    """Mean number of random short reflections in a scan."""
    tilted_stretches: tuple[TiltedStretch, ...] = ()
    """Patches of uneven floor."""
    dropped_scans: Annotated[float, Quantity(label="Scans lost", shown=PERCENT, bounds=SHARE, step=0.1)] = 0.0
    """Share of scans that never arrive."""
    slips_per_100_m: Annotated[float, Quantity(label="Wheel slips per 100 m", bounds=_FREQUENCY)] = 0.0
    """Mean number of wheel slips per 100 m driven."""
    covered: tuple[CoveredPeriod, ...] = ()
    """Times at which all reflectors are covered."""

    def __post_init__(self) -> None:
        check_fields(self, "disturbances.")
