"""Keeps an eye on the site while it is edited: its problems, and how the selected routes drive.

Called by the owner thread alone; the looking itself is done by a background thread of its own, since it takes
milliseconds and must not wait for a simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from commission.app.base.jobs import Lane
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.editing.editor import editors_of
from commission.app.editing.route_gestures import route_of
from commission.app.plan.upkeep import Upkeep
from commission.app.problems.checker import Checker
from commission.app.problems.view import InspectionView
from commission.planning.route_profile import RouteProfile, route_profile
from commission.progress import Progress
from commission.site.routes import Route
from commission.site.vehicle import Vehicle
from commission.studies.problems import Problem, ProblemsResult
from commission.studies.violations import Violation

CHECK, PROFILE = "Checking the site", "Looking along the route"


@dataclass(frozen=True, slots=True, eq=False)
class Profiles:
    """How some routes drive with one vehicle."""

    vehicle: Vehicle
    """The vehicle."""
    routes: tuple[Route, ...]
    """The routes."""
    profiles: tuple[RouteProfile, ...]
    """One for each of them."""


class Inspection(Service):
    """What there is to say about the site as it was last looked at."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._checker = Checker()
        self._check = Upkeep[ProblemsResult](CHECK, context.jobs, Lane.QUICK, is_shown=False)
        self._profile = Upkeep[Profiles](PROFILE, context.jobs, Lane.QUICK, is_shown=False)
        self._found: ProblemsResult | None = None
        self._looked_along: Profiles | None = None
        self.problems: tuple[Problem, ...] = ()
        """Errors first."""
        self.violations: tuple[Violation, ...] = ()
        """Where routes ask too much of the vehicle."""
        self.profiles: Mapping[str, RouteProfile] = MappingProxyType({})
        """How the selected routes drive, by name; one that was just edited as it was, until it is looked at."""

    def follow(self, state: AppState) -> Due:
        """Look at what is new: edits meanwhile are looked at afterwards, and nothing at what nobody has selected."""
        self._take_results()
        project = state.project
        self._check.keep((project,), lambda progress: self._checker.check(project, progress))
        selected = {route.name: route for editor in editors_of(state) if (route := route_of(project, editor))}
        routes, vehicle, before = tuple(selected.values()), project.vehicle, self._profile.result
        if routes:
            self._profile.keep((vehicle, *routes), lambda progress: profiles_of(routes, vehicle, before, progress))
        elif self._profile.key or self._profile.is_running:
            self._profile.drop()
            self.profiles = MappingProxyType({})
        return Due.NEVER

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what was found."""
        return (InspectionView(self.problems, self.violations, self.profiles),)

    def _take_results(self) -> None:
        """Sort what was found; what failed leaves what there was before."""
        found, profiles = self._check.result, self._profile.result
        if found is not None and found is not self._found:
            self._found = found
            self.problems = found.problems
            self.violations = tuple(violation for route in found.by_route for violation in route.violations)
        if profiles is not None and profiles is not self._looked_along:
            self._looked_along = profiles
            named = zip(profiles.routes, profiles.profiles, strict=True)
            self.profiles = MappingProxyType({route.name: profile for route, profile in named})

    @property
    def is_busy(self) -> bool:
        """Whether something is being looked at."""
        return self._check.is_running or self._profile.is_running


def profiles_of(routes: tuple[Route, ...], vehicle: Vehicle, before: Profiles | None, progress: Progress) -> Profiles:
    """Look along some routes.

    Parameters
    ----------
    routes : those that are selected.
    vehicle : what drives.
    before : an earlier result: a route that is still the same object is not looked at again.
    progress : called between the routes; may raise to cancel.
    """
    known: dict[int, RouteProfile] = {}
    if before is not None and before.vehicle is vehicle:
        known = dict(zip(map(id, before.routes), before.profiles, strict=True))
    found: list[RouteProfile] = []
    for number, route in enumerate(routes):
        progress(number / len(routes), route.name)
        found.append(known[id(route)] if id(route) in known else route_profile(route, vehicle))
    return Profiles(vehicle, routes, tuple(found))
