"""Zones in which nothing corrects the pose, though the site says that something does: in words.

Whether what counts is also in sight there is for coverage to say.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from commission.site.parts import HasFloorMap, HasParameters, HasReflectors, HasZones
from commission.site.tags import Tag
from commission.site.zones import ObservationKind, Zone


class Zoned(HasFloorMap, HasReflectors, HasParameters, HasZones, Protocol):
    """What says which kinds of observation there are, and where they count."""

    @property
    def tags(self) -> tuple[Tag, ...]:
        """Landmarks that tell place and heading at once."""
        ...


def idle_zones(site: Zoned) -> Iterator[tuple[Zone, str]]:
    """Zones in which a vehicle has odometry alone, and what is said of each.

    Parameters
    ----------
    site : its zones, and what there is to correct the pose by.
    """
    lacking = _lacking(site)
    for zone in site.zones:
        if all(kind in lacking for kind in zone.kinds):
            why = ", ".join(lacking[kind] for kind in zone.kinds)
            text = f"Zone {zone.name!r} leaves a vehicle to its odometry: {why}"
            yield zone, f"{text}; expected one of the kinds that correct the pose in it"


def _lacking(site: Zoned) -> dict[ObservationKind, str]:
    """Kinds that correct nothing anywhere, and why."""
    found: dict[ObservationKind, str] = {}
    if not len(site.reflectors):
        found[ObservationKind.REFLECTORS] = "there are no reflectors"
    if site.floor_map is None:
        found[ObservationKind.CONTOURS] = "there is no floor map that has contours"
    elif not site.parameters.contour.enabled:
        found[ObservationKind.CONTOURS] = "contours are switched off (contour.enabled)"
    if not site.tags:
        found[ObservationKind.TAGS] = "there are no tags"
    return found
