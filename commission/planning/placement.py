"""Suggested reflectors: few of them, so that the localizer keeps to its limits on the routes, whichever one fails.

How often each scan must see a reflector is a covering problem (`cover`). The limits of the uncertainty are not: where a
prediction over the chosen reflectors passes one, those scans are asked to see one reflector more, and it starts again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning.candidates import CandidateOptions, clear_of, wall_candidates
from commission.planning.cover import CoverProblem, cover, lower_bound, merged
from commission.planning.route_prediction import (
    NO_DAMAGE,
    Damage,
    PlannedRoute,
    PredictionOptions,
    plan_route,
    predict_route,
    station_scans,
)
from commission.planning.visibility import VisibleReflectors, visibility_model
from commission.site.checks import above, at_least
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap

ROUNDS = 12
"""How often scans over a limit are asked to see one reflector more."""


@dataclass(frozen=True, slots=True)
class Demands:
    """What the reflectors must achieve at every scan of the routes."""

    visible: int = 2
    """Reflectors that must be visible."""
    survive_failure: bool = True
    """Whether all demands must hold as well with any single reflector blocked."""
    position_limit: float | None = None
    """Largest 2-sigma of x and of y [m]. None: the supervisor's. Stations add what they require."""
    heading_limit: float | None = None
    """Largest 2-sigma of the heading [rad]. None: the supervisor's."""
    spacing: float = 0.5
    """Smallest distance between two reflectors [m]."""

    def __post_init__(self) -> None:
        at_least(self.visible, 1, "demands.visible")
        if self.position_limit is not None:
            above(self.position_limit, 0.0, "demands.position_limit", "m")
        if self.heading_limit is not None:
            above(self.heading_limit, 0.0, "demands.heading_limit", "rad")
        at_least(self.spacing, 0.0, "demands.spacing", "m")


@dataclass(frozen=True, slots=True)
class PlacementOptions:
    """Demands, candidates, and how long to search."""

    demands: Demands = field(default_factory=Demands)
    """What must hold."""
    candidates: CandidateOptions = field(default_factory=CandidateOptions)
    """Where reflectors may be put up."""
    prediction: PredictionOptions = field(default_factory=PredictionOptions)
    """How the routes are predicted."""
    extend: bool = True
    """Whether the project's reflectors stay; otherwise the layout starts empty."""
    exchanges: int = 120
    """Exchanges tried in each round."""
    checks: int = 300
    """Predictions spent at the end to do with fewer."""
    seed: int = 1
    """Seed of the exchanges: the same one gives the same layout."""

    def __post_init__(self) -> None:
        at_least(self.exchanges, 0, "placement.exchanges")
        at_least(self.checks, 0, "placement.checks")
        at_least(self.seed, 0, "placement.seed")


@dataclass(frozen=True, slots=True)
class Unmet:
    """Where a demand does not hold, whatever is put up at the candidates."""

    route: str
    """Name of the route."""
    metres: tuple[int, ...]
    """Metres of its way."""
    reason: str
    """`visible` or `uncertainty`."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A suggested layout."""

    reflectors: ReflectorMap
    """Those that stay, then the new ones."""
    added: int
    """Number of new ones."""
    at_least: int
    """No layout from the same candidates meets the demands with fewer new ones than this."""
    candidates: FloatArray
    """(C, 2) places that were looked at [m], map frame."""
    unmet: tuple[Unmet, ...]
    """Demands that do not hold; empty when all do."""


Progress = Callable[[float, str], None]


def place(
    project: Project,
    routes: tuple[str, ...] | None = None,
    options: PlacementOptions | None = None,
    progress: Progress | None = None,
) -> Placement:
    """Suggest reflectors on walls.

    Parameters
    ----------
    project : site, vehicle, scanner and parameters; without a floor map there is no wall to put a reflector on.
    routes : names of the routes that count; all when None.
    options : demands and candidates; the defaults when None.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.

    Raises
    ------
    UsageError
        unknown route.
    """
    options = options or PlacementOptions()
    names = tuple(route.name for route in project.routes) if routes is None else routes
    drives = [plan_route(project, name, options.prediction).drive for name in names]
    path = np.concatenate([np.empty((0, 2)), *(drive.poses[:, :2] for drive in drives)])
    centers = _candidates(project, path, options)
    return choose(project, names, centers, options, progress)


def choose(
    project: Project,
    routes: tuple[str, ...],
    centers: FloatArray,
    options: PlacementOptions,
    progress: Progress | None = None,
) -> Placement:
    """Choose among given candidates; parameters as for `place`, and `centers`, (C, 2) places [m], map frame."""
    kept = project.reflectors.reflectors if options.extend else ()
    everything = ReflectorMap((*kept, *_named(centers, kept, options.candidates)))
    site = replace(project, reflectors=everything)
    model = visibility_model(site)
    planned = [plan_route(site, name, options.prediction, model) for name in routes]
    search = _Search(planned, site, len(kept), options, progress)
    taken = search.run()
    chosen = tuple(reflector for reflector, is_in in zip(everything.reflectors, taken, strict=True) if is_in)
    # Named anew, so that the new ones count without gaps.
    added = _named(everything.centers[len(kept) :][taken[len(kept) :]], kept, options.candidates)
    reflectors = ReflectorMap((*chosen[: len(kept)], *added))
    return Placement(reflectors, len(added), search.bound(), centers, search.unmet(taken))


class _Search:
    """State of one search: what each scan must see grows until the predictions keep to the limits."""

    def __init__(
        self,
        planned: list[PlannedRoute],
        project: Project,
        kept: int,
        options: PlacementOptions,
        progress: Progress | None,
    ) -> None:
        self._planned, self._options, self._progress, self._fraction = planned, options, progress, 0.0
        count, demands = len(project.reflectors), options.demands
        self._fixed = np.arange(count) < kept
        self._covers = [_incidence(route.visible, count) for route in planned]
        self._base = demands.visible + int(demands.survive_failure)
        self._needs = [np.full(len(route.drive), self._base, dtype=np.int64) for route in planned]
        self._limits = [_limits(route, project, demands) for route in planned]
        near = cKDTree(project.reflectors.centers).query_ball_point(project.reflectors.centers, demands.spacing)
        self._conflicts = tuple(
            np.array([b for b in others if b != a], dtype=np.int64) for a, others in enumerate(near)
        )

    def run(self) -> BoolArray:
        """Return which reflectors to take."""
        rng = np.random.default_rng(self._options.seed)
        taken = self._fixed
        raised = False
        for number in range(ROUNDS):
            self._report(number / (ROUNDS + 1), "covering")
            taken = cover(self._problem(self._needs), rng, self._options.exchanges, self._step(number))
            if not self._raise_needs(self._over(taken)):
                break
            raised = True
        return self._fewer(taken) if raised else taken

    def bound(self) -> int:
        """Fewest new reflectors that every scan's need for visible ones leaves possible."""
        return lower_bound(self._problem([np.full_like(needs, self._base) for needs in self._needs]))

    def unmet(self, taken: BoolArray) -> tuple[Unmet, ...]:
        """Metres of the routes where a demand does not hold."""
        found: list[Unmet] = []
        for route, covers, over in zip(self._planned, self._covers, self._over(taken), strict=True):
            unseen = covers[:, taken].sum(axis=1) < self._base
            for mask, reason in ((unseen, "visible"), (over, "uncertainty")):
                metres = np.unique(route.drive.metres[mask].astype(np.int64))
                if len(metres):
                    found.append(Unmet(route.name, tuple(metres.tolist()), reason))
        return tuple(found)

    def _problem(self, needs: list[IntArray]) -> CoverProblem:
        rows, greatest = merged(np.concatenate(self._covers), np.concatenate(needs))
        return CoverProblem(rows.astype(np.float32), greatest, self._fixed, self._conflicts)

    def _over(self, taken: BoolArray) -> list[BoolArray]:
        """Per route, which scans pass a limit, with nothing broken or with any single reflector blocked."""
        return [self._over_on(index, taken) for index in range(len(self._planned))]

    def _over_on(self, index: int, taken: BoolArray) -> BoolArray:
        route = _restricted(self._planned[index], taken)
        over = np.zeros(len(route.drive), dtype=np.bool_)
        for damage in self._damages(route):
            self._report(None, "predicting")
            over |= (predict_route(route, damage).two_sigma > self._limits[index]).any(axis=1)
        return over

    def _damages(self, route: PlannedRoute) -> Iterator[Damage]:
        yield NO_DAMAGE
        if self._options.demands.survive_failure:
            for reflector in np.unique(route.visible.indices).tolist():
                yield Damage(blocked=(reflector,))

    def _raise_needs(self, over: list[BoolArray]) -> bool:
        """Ask the scans over a limit for one reflector more; False when none can see one more."""
        any_raised = False
        for needs, covers, mask in zip(self._needs, self._covers, over, strict=True):
            more = mask & (covers.sum(axis=1) > needs)
            needs[more] += 1
            any_raised |= bool(more.any())
        return any_raised

    def _fewer(self, taken: BoolArray) -> BoolArray:
        """Take out what the raised needs asked for and the limits do not: one of them, or two for another one."""
        checks = self._options.checks
        goal = [np.minimum(self._base, covers.sum(axis=1)) for covers in self._covers]
        unavoidable = self._over(taken)
        found = True
        while found and checks > 0:
            found = False
            for tried in _smaller(taken, self._fixed, self._conflicts):
                seen = (
                    np.all(covers[:, tried].sum(axis=1) >= need)
                    for covers, need in zip(self._covers, goal, strict=True)
                )
                if not all(seen):
                    continue
                checks -= 1
                self._report(1.0 - 0.07 * checks / self._options.checks, "doing with fewer")
                if all(not np.any(self._over_on(i, tried) & ~before) for i, before in enumerate(unavoidable)):
                    taken, found = tried, True
                    break
                if checks <= 0:
                    break
        return taken

    def _step(self, number: int) -> Callable[[float], None]:
        return lambda done: self._report((number + done) / (ROUNDS + 1), "covering")

    def _report(self, fraction: float | None, what: str) -> None:
        """Tell how far the search is; without a fraction only give the chance to cancel."""
        if fraction is not None:
            self._fraction = fraction
        if self._progress is not None:
            self._progress(self._fraction, what)


def _smaller(taken: BoolArray, fixed: BoolArray, conflicts: tuple[IntArray, ...]) -> Iterator[BoolArray]:
    """Sets of one reflector less: without one, then without two and with another."""
    movable = np.flatnonzero(taken & ~fixed)
    for out in movable:
        tried = taken.copy()
        tried[out] = False
        yield tried
    for i, first in enumerate(movable):
        for second in movable[i + 1 :]:
            without = taken.copy()
            without[[first, second]] = False
            for other in np.flatnonzero(~taken):
                if not without[conflicts[other]].any():
                    tried = without.copy()
                    tried[other] = True
                    yield tried


def _candidates(project: Project, path: FloatArray, options: PlacementOptions) -> FloatArray:
    """Places on walls that no vehicle touches and that are not too near to a reflector that stays."""
    if project.floor_map is None:
        return np.empty((0, 2))
    given = options.candidates
    centers = wall_candidates(project.floor_map.occupancy(), given)
    half_width = max(abs(y) for _, y in project.vehicle.outline)
    clear = clear_of(centers, path, half_width + given.clearance + given.radius)
    if options.extend:
        clear &= clear_of(centers, project.reflectors.centers, options.demands.spacing)
    return centers[clear]


def _named(centers: FloatArray, kept: tuple[Reflector, ...], options: CandidateOptions) -> tuple[Reflector, ...]:
    """Reflectors at places, with names that are not taken."""
    used = {reflector.id for reflector in kept}
    free = (name for name in (f"S{number}" for number in range(1, len(used) + len(centers) + 1)) if name not in used)
    return tuple(
        Reflector(name, float(x), float(y), options.radius, height=options.height, note="suggested")
        for name, (x, y) in zip(free, centers, strict=False)
    )


def _incidence(visible: VisibleReflectors, count: int) -> BoolArray:
    """(K, count) whether each scan sees each reflector."""
    sees = np.zeros((len(visible.offsets) - 1, count), dtype=np.bool_)
    sees[np.repeat(np.arange(len(sees)), visible.counts()), visible.indices] = True
    return sees


def _restricted(route: PlannedRoute, taken: BoolArray) -> PlannedRoute:
    """Drop from a planned route all reflectors but some; they keep their indices."""
    kept = taken[route.visible.indices]
    offsets = np.concatenate(([0], np.cumsum(kept, dtype=np.int64)))[route.visible.offsets]
    return replace(route, visible=VisibleReflectors(offsets, route.visible.indices[kept]))


def _limits(route: PlannedRoute, project: Project, demands: Demands) -> FloatArray:
    """(K, 3) largest 2-sigma of x [m], y [m] and heading [rad] at each scan."""
    supervisor = project.parameters.supervisor
    position = supervisor.position_limit if demands.position_limit is None else demands.position_limit
    heading = supervisor.heading_limit if demands.heading_limit is None else demands.heading_limit
    limits = np.tile((position, position, heading), (len(route.drive), 1))
    for station, scans in station_scans(route.drive, project.stations):
        limits[scans, :2] = np.minimum(limits[scans, :2], station.required_accuracy)
    return limits
