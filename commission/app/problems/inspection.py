"""Keeps an eye on the site while it is edited: its problems, and how the selected routes drive.

Called by the owner thread alone; the looking itself is done by a background thread of its own, since it takes
milliseconds and must not wait for a simulation.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from types import MappingProxyType

from commission.app.base.jobs import Lane
from commission.app.base.kept import Kept
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.editing.editor import editors_of
from commission.app.editing.route_gestures import route_of
from commission.app.problems.view import InspectionView
from commission.planning.route_profile import RouteProfile
from commission.studies.problems import Problem, ProblemsInput, ProblemsResult, errors_first, problems
from commission.studies.profiles import ProfilesInput, ProfilesResult, profiles
from commission.studies.sight import SightInput, SightResult, sight
from commission.studies.violations import Violation

CHECK, PROFILE, SIGHT = "Checking the site", "Looking along the route", "Counting reflectors in sight"


class Inspection(Service):
    """What there is to say about the site as it was last looked at."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._check = Kept[ProblemsInput, ProblemsResult](CHECK, context.jobs, Lane.QUICK, is_shown=False)
        self._profile = Kept[ProfilesInput, ProfilesResult](PROFILE, context.jobs, Lane.QUICK, is_shown=False)
        self._sight = Kept[SightInput, SightResult](SIGHT, context.jobs, Lane.QUICK, is_shown=False)
        self._found: ProblemsResult | None = None
        self._seen: SightResult | None = None
        self._looked_along: ProfilesResult | None = None
        self.problems: tuple[Problem, ...] = ()
        """Errors first."""
        self.violations: tuple[Violation, ...] = ()
        """Where routes ask too much of the vehicle."""
        self.profiles: Mapping[str, RouteProfile] = MappingProxyType({})
        """How the selected routes drive, by name; one that was just edited as it was, until it is looked at."""

    def follow(self, state: AppState) -> Due:
        """Look at what is new: edits meanwhile are looked at afterwards, and nothing at what nobody has selected."""
        self._take_results()
        project, found, looked_along = state.project, self._found, self._looked_along
        site = ProblemsInput.of(project)
        self._check.keep(site, lambda progress: problems(site, progress, found))
        self._sight.keep(SightInput.of(project), lambda progress: sight(SightInput.of(project), progress))
        selected = {route.name: route for editor in editors_of(state) if (route := route_of(project, editor))}
        if selected:
            routes = ProfilesInput(vehicle=project.vehicle, routes=tuple(selected.values()))
            self._profile.keep(routes, lambda progress: profiles(routes, progress, looked_along))
        elif self.profiles or self._profile.is_running:
            self._profile.drop()
            self.profiles = MappingProxyType({})
        return Due.NEVER

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what was found."""
        view = InspectionView(self.problems, self.violations, self.profiles)
        return (view,) if self._found is None else (view, self._found)

    def _take_results(self) -> None:
        """Sort what was found; what failed leaves what there was before."""
        found, seen, looked_along = self._check.result, self._sight.result, self._profile.result
        is_new = False
        if found is not None and found is not self._found:
            self._found, is_new = found, True
            self.violations = tuple(violation for route in found.by_route for violation in route.violations)
        if seen is not None and seen is not self._seen:
            self._seen, is_new = seen, True
        if is_new:
            parts = (each.problems for each in (self._found, self._seen) if each is not None)
            self.problems = errors_first(itertools.chain.from_iterable(parts))
        if looked_along is not None and looked_along is not self._looked_along:
            self._looked_along = looked_along
            self.profiles = MappingProxyType(looked_along.by_name())

    @property
    def is_busy(self) -> bool:
        """Whether something is being looked at."""
        return self._check.is_running or self._sight.is_running or self._profile.is_running
