"""What disturbs localization in this hall: people, shiny things, tilted floor, faults. Read by the simulation alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

from commission.site.checks import at_least, between


@dataclass(frozen=True, slots=True)
class ShinyObject:
    """A fixed object that the scanner takes for a reflector: an upright plate or post of a given width."""

    x: float
    """Center, x in the map frame [m]."""
    y: float
    """Center, y in the map frame [m]."""
    radius: float = 0.1
    """Radius [m]."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise ValueError(f"shiny object at [{self.x}, {self.y}]; expected finite metres")
        between(self.radius, (0.001, 2.0), "shiny object's radius", "m")


@dataclass(frozen=True, slots=True)
class TiltedStretch:
    """A circular patch of uneven floor on which the laser meets the ground early."""

    x: float
    """Center, x in the map frame [m]."""
    y: float
    """Center, y in the map frame [m]."""
    radius: float
    """Radius of the patch [m]."""
    range_limit: float = 4.0
    """Range that is left while the vehicle stands on it [m]."""

    def __post_init__(self) -> None:
        at_least(self.radius, 0.0, "tilted stretch's radius", "m")
        at_least(self.range_limit, 0.1, "tilted stretch's range_limit", "m")


@dataclass(frozen=True, slots=True)
class CoveredPeriod:
    """A time during which every reflector is covered."""

    start: float
    """Seconds after the start of the drive [s]."""
    duration: float
    """Length [s]."""

    def __post_init__(self) -> None:
        at_least(self.start, 0.0, "covered period's start", "s")
        at_least(self.duration, 0.0, "covered period's duration", "s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbances:
    """Everything that a virtual drive suffers beyond the noise of its sensors."""

    people: int = 0
    """People walking about on the free floor."""
    walking_speed: float = 1.0
    """Mean speed of a person [m/s]."""
    shiny_objects: tuple[ShinyObject, ...] = ()
    """Fixed things that look like reflectors."""
    glints_per_scan: float = 0.0
    """Mean number of random short reflections in a scan."""
    tilted_stretches: tuple[TiltedStretch, ...] = ()
    """Patches of uneven floor."""
    dropped_scans: float = 0.0
    """Share of scans that never arrive [0..1]."""
    slips_per_100_m: float = 0.0
    """Mean number of wheel slips per 100 m driven."""
    covered: tuple[CoveredPeriod, ...] = ()
    """Times at which all reflectors are covered."""

    def __post_init__(self) -> None:
        between(self.people, (0, 10_000), "disturbances.people")
        between(self.walking_speed, (0.0, 10.0), "disturbances.walking_speed", "m/s")
        between(self.glints_per_scan, (0.0, 1000.0), "disturbances.glints_per_scan")
        between(self.dropped_scans, (0.0, 1.0), "disturbances.dropped_scans")
        between(self.slips_per_100_m, (0.0, 1000.0), "disturbances.slips_per_100_m")
