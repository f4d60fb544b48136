"""Parts of a project, as protocols: a function says by the type of its argument what of a site it may read.

A project has all of them; the frozen input of a study has those that the study may read, and no others.
"""

from __future__ import annotations

from typing import Protocol

from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import Vehicle
from commission.site.zones import Zone


class HasReflectors(Protocol):
    """The reflector map."""

    @property
    def reflectors(self) -> ReflectorMap:
        """The reflector map."""
        ...


class HasFloorMap(Protocol):
    """Walls and free floor."""

    @property
    def floor_map(self) -> FloorMap | None:
        """Walls and free floor; a site without one is an open field."""
        ...


class HasRoutes(Protocol):
    """Planned routes."""

    @property
    def routes(self) -> tuple[Route, ...]:
        """Planned routes; names are unique."""
        ...


class HasScanners(Protocol):
    """The laser scanners."""

    @property
    def scanners(self) -> tuple[Scanner, ...]:
        """The laser scanners, one at least; names are unique."""
        ...


class HasStations(Protocol):
    """Stations."""

    @property
    def stations(self) -> tuple[Station, ...]:
        """Places where the vehicle has to stand accurately; names are unique."""
        ...


class HasVehicle(Protocol):
    """The vehicle."""

    @property
    def vehicle(self) -> Vehicle:
        """Wheels and outline."""
        ...


class HasParameters(Protocol):
    """Parameters."""

    @property
    def parameters(self) -> Parameters:
        """Tunables of the localizer."""
        ...


class HasZones(Protocol):
    """Zones."""

    @property
    def zones(self) -> tuple[Zone, ...]:
        """Parts of the floor in which only some kinds of observation correct the pose."""
        ...


class HasUncertainty(Protocol):
    """How well constants are known."""

    @property
    def uncertainty(self) -> Uncertainty:
        """1-sigma of errors that stay over a drive."""
        ...


class Extended(HasFloorMap, HasReflectors, HasRoutes, Protocol):
    """What says how far a site reaches."""


class Sighted(HasFloorMap, HasReflectors, HasScanners, Protocol):
    """What says which reflectors are seen from where."""


class Told(HasParameters, HasScanners, Protocol):
    """What says which reflectors are told apart."""


class Driven(Sighted, HasVehicle, HasParameters, HasUncertainty, HasZones, Protocol):
    """What says how a vehicle drives a route, and what it sees and believes on it."""

    def route(self, name: str, /) -> Route:
        """Return the route of that name; raises UsageError that lists the names there are."""
        ...


class Equipped(Driven, HasRoutes, HasStations, Protocol):
    """Everything that stands in the hall and drives in it."""
