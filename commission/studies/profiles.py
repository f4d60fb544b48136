"""How routes drive with a vehicle: one profile each, and only those that have changed are looked along again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from commission.planning.route_profile import RouteProfile, route_profile
from commission.progress import Progress, silent
from commission.site.project import Project
from commission.site.routes import Route
from commission.site.vehicle import Vehicle
from commission.studies.inputs import StudyInput, is_same


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProfilesInput(StudyInput):
    """What the profiles of some routes depend on."""

    vehicle: Vehicle
    """Wheels and outline."""
    routes: tuple[Route, ...]
    """The routes."""

    @staticmethod
    def of(project: Project, names: Iterable[str]) -> ProfilesInput:
        """Take what the study reads from a project; raises UsageError for an unknown route."""
        return ProfilesInput(vehicle=project.vehicle, routes=tuple(map(project.route, names)))


@dataclass(frozen=True, slots=True, eq=False)
class ProfilesResult:
    """How some routes drive with one vehicle."""

    inputs: ProfilesInput
    """The vehicle and the routes."""
    profiles: tuple[RouteProfile, ...]
    """One for each route, in their order."""

    def by_name(self) -> dict[str, RouteProfile]:
        """The profiles by the names of their routes."""
        return {route.name: profile for route, profile in zip(self.inputs.routes, self.profiles, strict=True)}


def profiles(
    inputs: ProfilesInput, progress: Progress = silent, before: ProfilesResult | None = None
) -> ProfilesResult:
    """Look along some routes.

    Parameters
    ----------
    inputs : the vehicle and the routes.
    progress : told how far it is; may raise to cancel.
    before : an earlier result: a route that is still the same object is not looked along again.
    """
    known: dict[int, RouteProfile] = {}
    if before is not None and is_same(before.inputs.vehicle, inputs.vehicle):
        known = dict(zip(map(id, before.inputs.routes), before.profiles, strict=True))
    found: list[RouteProfile] = []
    for number, route in enumerate(inputs.routes):
        progress(number / len(inputs.routes), f"route {route.name}")
        found.append(known.get(id(route)) or route_profile(route, inputs.vehicle))
    return ProfilesResult(inputs, tuple(found))
