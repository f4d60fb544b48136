"""The project: one frozen aggregate of what the engineer edits. An edit returns a new project; files are elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, field

from commission.errors import ProjectError
from commission.site.disturbances import Disturbances
from commission.site.floor_map import FloorMap
from commission.site.layout_brief import LayoutBrief
from commission.site.parameters import Parameters
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route, route_named
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import DifferentialVehicle, Vehicle
from commission.site.zones import Zone


@dataclass(frozen=True, slots=True, kw_only=True)
class Project:
    """A site, the vehicle that drives in it and the tunables of its localizer."""

    name: str = "Unnamed"
    """Shown in the title of the page."""
    floor_map: FloorMap | None = None
    """Walls and free floor; a site without one is an open field."""
    reflectors: ReflectorMap = field(default_factory=ReflectorMap)
    """The reflector map."""
    routes: tuple[Route, ...] = ()
    """Planned routes; names are unique."""
    vehicle: Vehicle = field(default_factory=DifferentialVehicle)
    """Wheels and outline."""
    scanners: tuple[Scanner, ...] = field(default_factory=lambda: (Scanner(),))
    """The laser scanners, one at least; names are unique."""
    tags: tuple[Tag, ...] = ()
    """Landmarks that tell place and heading at once; ids are unique."""
    tag_camera: TagCamera = field(default_factory=TagCamera)
    """The camera that sees them."""
    zones: tuple[Zone, ...] = ()
    """Parts of the floor in which only some kinds of observation correct the pose; names are unique."""
    parameters: Parameters = field(default_factory=Parameters)
    """Tunables of the localizer."""
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    """How well the constants of the site and the vehicle are known."""
    disturbances: Disturbances = field(default_factory=Disturbances)
    """What a virtual drive suffers."""
    stations: tuple[Station, ...] = ()
    """Places where the vehicle has to stand accurately; names are unique."""
    layout: LayoutBrief = field(default_factory=LayoutBrief)
    """What is asked of a suggested layout of reflectors."""

    def __post_init__(self) -> None:
        if not self.scanners:
            raise ProjectError("scanners is empty; expected at least one")
        turning = [scanner.name for scanner in self.scanners if scanner.is_goniometer]
        if len(turning) > 1:
            raise ProjectError(f"scanners {' and '.join(map(repr, turning))} are goniometers; expected one at most")
        tags = [tag.id for tag in self.tags]
        if len(set(tags)) < len(tags):
            twice = next(each for each in tags if tags.count(each) > 1)
            raise ProjectError(f"tag id {twice!r} is used twice; expected unique ids")
        for kind, named in (
            ("route", self.routes),
            ("station", self.stations),
            ("scanner", self.scanners),
            ("zone", self.zones),
        ):
            seen: set[str] = set()
            for name in (value.name for value in named):
                # Scanners give files their names, and some file systems know no capitals.
                key = name.casefold() if kind == "scanner" else name
                if key in seen:
                    raise ProjectError(f"{kind} name {name!r} is used twice; expected unique names")
                seen.add(key)

    def route(self, name: str) -> Route:
        """Return the route of that name; raises UsageError that lists the names there are."""
        return route_named(self.routes, name)
