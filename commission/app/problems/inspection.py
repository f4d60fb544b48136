"""Keeps an eye on the site while it is edited: its problems, and how the selected routes drive.

Called by the owner thread alone; the looking itself is done by a background thread of its own, since it takes
milliseconds and must not wait for a simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from commission.app.base.jobs import JobReport, Jobs
from commission.app.base.state import AppState
from commission.app.editing.route_gestures import route_of
from commission.app.plan.upkeep import Upkeep
from commission.app.problems.checker import Checker
from commission.planning.route_profile import RouteProfile, route_profile
from commission.progress import Progress
from commission.site.routes import Route
from commission.site.vehicle import Vehicle
from commission.studies.problems import Findings, Problem
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


class Inspection:
    """What there is to say about the site as it was last looked at.

    Parameters
    ----------
    jobs : a background thread of its own; its reports come back through `hear`.
    """

    def __init__(self, jobs: Jobs) -> None:
        self._jobs = jobs
        self._checker = Checker()
        self._check = Upkeep(CHECK, Findings, self._jobs)
        self._profile = Upkeep(PROFILE, Profiles, self._jobs)
        self.problems: tuple[Problem, ...] = ()
        """Errors first."""
        self.violations: tuple[Violation, ...] = ()
        """Where routes ask too much of the vehicle."""
        self.profiles: Mapping[str, RouteProfile] = MappingProxyType({})
        """How the selected routes drive, by name; one that was just edited as it was, until it is looked at."""

    def follow(self, state: AppState) -> None:
        """Look at what is new: edits meanwhile are looked at afterwards, and nothing at what nobody has selected."""
        project = state.project
        self._check.keep((project,), lambda progress: self._checker.check(project, progress))
        selected = {route.name: route for editor in state.editors.values() if (route := route_of(project, editor))}
        routes, vehicle, before = tuple(selected.values()), project.vehicle, self._profile.result
        if routes:
            self._profile.keep((vehicle, *routes), lambda progress: profiles_of(routes, vehicle, before, progress))
        elif self._profile.key or self._profile.is_running:
            self._profile.drop()
            self.profiles = MappingProxyType({})

    def hear(self, report: JobReport) -> bool:
        """Take news of the background thread; return whether it was this one's."""
        if report.job.name not in (CHECK, PROFILE):
            return False
        if self._check.hear(report) and self._check.result is not None:
            self.problems = self._check.result.problems
            self.violations = tuple(found for route in self._check.result.by_route for found in route.violations)
        if self._profile.hear(report) and self._profile.result is not None:
            profiles = self._profile.result
            named = zip(profiles.routes, profiles.profiles, strict=True)
            self.profiles = MappingProxyType({route.name: profile for route, profile in named})
        return True

    @property
    def is_busy(self) -> bool:
        """Whether something is being looked at."""
        return self._check.is_running or self._profile.is_running

    def close(self) -> None:
        """End the background thread."""
        self._jobs.close()


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
