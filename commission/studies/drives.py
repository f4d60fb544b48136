"""Planned drives along routes of a site, and what is seen on them: with them begin prediction, failures, neighbors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from commission.planning.route_prediction import PlannedRoute, PredictionOptions, plan_route
from commission.planning.visibility import VisibilityOptions, visibility_models
from commission.progress import Progress, silent
from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route, route_named
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import Vehicle
from commission.site.zones import Zone
from commission.studies.inputs import StudyInput

SEEING = 0.2
"""Share of the time that walls and reflectors take; the rest goes to the routes."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivesInput(StudyInput):
    """What the planned drives along some routes depend on."""

    reflectors: ReflectorMap
    """The reflector map."""
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
    """The routes, and no others."""
    prediction: PredictionOptions
    """Where a prediction starts, and what it expects of the hall."""
    visibility: VisibilityOptions
    """What counts as visible."""

    @staticmethod
    def of(
        project: Project,
        names: Iterable[str] | None = None,
        prediction: PredictionOptions | None = None,
        visibility: VisibilityOptions | None = None,
    ) -> DrivesInput:
        """Take what the drives along some routes read from a project.

        Parameters
        ----------
        project : the site.
        names : of the routes; all when None.
        prediction : where a prediction starts, and what it expects of the hall; the defaults when None.
        visibility : what counts as visible; the defaults when None.

        Raises
        ------
        UsageError
            unknown route.
        """
        return DrivesInput(
            reflectors=project.reflectors,
            floor_map=project.floor_map,
            scanners=project.scanners,
            vehicle=project.vehicle,
            parameters=project.parameters,
            uncertainty=project.uncertainty,
            zones=project.zones,
            routes=project.routes if names is None else tuple(map(project.route, names)),
            prediction=prediction or PredictionOptions(),
            visibility=visibility or VisibilityOptions(),
        )

    def route(self, name: str) -> Route:
        """Return the route of that name; raises UsageError that lists the names there are."""
        return route_named(self.routes, name)


@dataclass(frozen=True, slots=True, eq=False)
class PlannedDrives:
    """Drives that were planned, and what they were planned from."""

    inputs: DrivesInput
    """The site."""
    planned: tuple[PlannedRoute, ...]
    """One for each route, in their order."""


def plan_drives(inputs: DrivesInput, progress: Progress = silent, known: PlannedDrives | None = None) -> PlannedDrives:
    """Plan the drives along all routes of an input.

    Parameters
    ----------
    inputs : site and routes.
    progress : told how far it is; may raise to cancel.
    known : drives that are at hand; they are returned where they were planned from the same.
    """
    if known is not None and known.inputs == inputs:
        return known
    progress(0.0, "sight of each reflector")
    models = visibility_models(inputs, inputs.visibility)
    planned: list[PlannedRoute] = []
    for number, route in enumerate(inputs.routes):
        progress(SEEING + (1.0 - SEEING) * number / len(inputs.routes), f"route {route.name}")
        planned.append(plan_route(inputs, route.name, inputs.prediction, models))
    return PlannedDrives(inputs, tuple(planned))
