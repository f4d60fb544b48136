"""Suggested reflectors for a site: few of them, so that the routes that count are driven within limits.

The search itself is in `planning.placement`; files and pictures are elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from commission.compiled import warm_up
from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.planning.layout_figures import LayoutFigures, layout_figures
from commission.planning.nominal_drive import nominal_drive
from commission.planning.placement import Placement, PlacementOptions, Unmet, place
from commission.planning.unmet import Beyond
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route, route_named
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import Vehicle
from commission.site.zones import ObservationKind, Zone
from commission.studies.inputs import StudyInput
from commission.studies.kernels import DRIVES, ERRORS, INFORMATION, SHARES

COMPILING, COMPARED = 0.1, 0.15
"""Shares of the time until which kernels are compiled, and it is found out what the present reflectors come to."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlacementInput(StudyInput):
    """What a suggested layout depends on."""

    reflectors: ReflectorMap
    """The reflectors that are there."""
    floor_map: FloorMap | None
    """Walls and free floor."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    vehicle: Vehicle
    """Wheels and outline."""
    parameters: Parameters
    """Tunables of the localizer."""
    uncertainty: Uncertainty
    """How well the constants of the site and the vehicle are known."""
    zones: tuple[Zone, ...]
    """Where which kinds of observation correct the pose."""
    routes: tuple[Route, ...]
    """The routes that count."""
    stations: tuple[Station, ...]
    """Where the vehicle has to stand accurately."""
    options: PlacementOptions
    """Demands, candidates, and how long to search."""

    @staticmethod
    def of(
        project: Project, options: PlacementOptions | None = None, routes: Iterable[str] | None = None
    ) -> PlacementInput:
        """Take what the study reads from a project.

        Parameters
        ----------
        project : the site.
        options : demands and candidates; what the project asks for when None.
        routes : names of the routes that count; those that count in the project when None.

        Raises
        ------
        UsageError
            unknown route, or none counts.
        """
        brief = project.layout
        names = tuple(brief.counted(project.routes) if routes is None else routes)
        if not names:
            raise UsageError("the project has no route that counts; expected one to place reflectors for")
        return PlacementInput(
            reflectors=project.reflectors,
            floor_map=project.floor_map,
            scanners=project.scanners,
            vehicle=project.vehicle,
            parameters=project.parameters,
            uncertainty=project.uncertainty,
            zones=project.zones,
            routes=tuple(map(project.route, names)),
            stations=project.stations,
            options=options or PlacementOptions(demands=brief.demands, candidates=brief.candidates),
        )

    def route(self, name: str) -> Route:
        """Return the route of that name; raises UsageError that lists the names there are."""
        return route_named(self.routes, name)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class UnmetStretch:
    """Metres in a row where a demand does not hold."""

    route: str
    """Name of the route."""
    reason: str
    """As in `planning.placement.Unmet`."""
    first: int
    """First metre of the way."""
    last: int
    """Metre at which the stretch ends."""
    points: FloatArray
    """(N, 2) the way there [m], map frame."""
    beyond: Beyond | None = None
    """Of an uncertainty, by how much it passes its limit there."""

    @property
    def place(self) -> tuple[float, float]:
        """Where the stretch begins [m]."""
        return float(self.points[0, 0]), float(self.points[0, 1])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlacementResult:
    """A suggested layout, and what it was made from."""

    inputs: PlacementInput
    """The site, and what was asked."""
    placement: Placement
    """What was found."""
    unmet: tuple[UnmetStretch, ...]
    """Where it does not do."""
    before: LayoutFigures
    """What the reflectors that are there come to."""
    after: LayoutFigures
    """What the suggested layout comes to."""

    @property
    def farthest(self) -> Beyond | None:
        """Of the stretches on which a limit is passed, the one where it is passed most; None without any."""
        over = [each.beyond for each in self.unmet if each.beyond is not None]
        return max(over, key=lambda each: each.kept[each.worst()] / each.limits[each.worst()], default=None)

    @property
    def zones_told(self) -> str:
        """Say in which zones no reflector helps, where a demand is not met and there are such zones; else empty."""
        names = [zone.name for zone in self.inputs.zones if ObservationKind.REFLECTORS not in zone.kinds]
        if not names or not self.unmet:
            return ""
        return f"no reflector helps in {', '.join(names)}, and contours and tags are not reckoned with"

    @property
    def added(self) -> FloatArray:
        """(N, 2) places of the new reflectors [m]."""
        return self.placement.reflectors.centers[len(self.placement.reflectors) - self.placement.added :]

    @property
    def removed(self) -> FloatArray:
        """(M, 2) places of the reflectors that would go [m]: all that are not locked, where the layout starts empty."""
        if self.inputs.options.extend:
            return np.empty((0, 2))
        return np.array([(r.x, r.y) for r in self.inputs.reflectors.reflectors if not r.locked]).reshape(-1, 2)


def placement(inputs: PlacementInput, progress: Progress = silent) -> PlacementResult:
    """Look for few reflectors that meet the demands.

    Locked reflectors stay even where the layout starts empty. Without a floor map there is no wall to put one on.

    Parameters
    ----------
    inputs : the site, and what is asked.
    progress : told how far it is; may raise to cancel.
    """
    warm_up((*DRIVES, ERRORS, INFORMATION, SHARES), part(progress, 0.0, COMPILING))
    names = tuple(route.name for route in inputs.routes)
    given = inputs.options.prediction
    before = layout_figures(inputs, inputs.reflectors, names, given, part(progress, COMPILING, COMPARED))
    found = place(inputs, names, inputs.options, part(progress, COMPARED, 1.0))
    # Whoever ended the search with what there is wants to see what that comes to.
    after = layout_figures(inputs, found.reflectors, names, given)
    return PlacementResult(
        inputs=inputs, placement=found, unmet=tuple(_stretches(inputs, found.unmet)), before=before, after=after
    )


def _stretches(inputs: PlacementInput, unmet: tuple[Unmet, ...]) -> list[UnmetStretch]:
    """Metres where demands do not hold, those in a row together, in the order of their routes."""
    found: list[UnmetStretch] = []
    for each in unmet:
        drive = nominal_drive(inputs.route(each.route), inputs.vehicle, inputs.scanners)
        for first, last in each.stretches():
            on_it = (drive.metres >= first) & (drive.metres < last)
            points = drive.poses[on_it, :2]
            by = None if each.beyond is None else each.beyond.between(first, last)
            found.append(
                UnmetStretch(route=each.route, reason=each.reason, first=first, last=last, points=points, beyond=by)
            )
    return found
