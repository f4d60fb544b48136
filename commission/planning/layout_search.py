"""The search for few reflectors among many: covering, asked for more wherever the result does not do yet.

How often each scan must see a reflector is a covering problem (`cover`). Limits of the uncertainty and ambiguous places
are not. Where a prediction over the chosen reflectors passes a limit, those scans are asked to see one reflector more;
where a place has a rival, a reflector that only one of the two sees is asked for; and the covering starts again.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning.ambiguity import AmbiguityOptions
from commission.planning.cover import CoverProblem, cover, lower_bound, merged, smaller_covers
from commission.planning.route_prediction import PlannedRoute, PredictionOptions, restricted, station_scans
from commission.planning.telling_apart import ChosenPlace, Distinction, chosen_places, nearest_on_routes
from commission.planning.true_error import two_sigma_of
from commission.planning.unmet import Unmet
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.progress import Progress
from commission.site.checks import at_least
from commission.site.layout_brief import CandidateOptions, Demands
from commission.site.parts import Equipped

ROUNDS = 20
"""How often scans over a limit are asked to see one reflector more, and places to be told from their rivals."""
CORES = os.cpu_count() or 1
COVERING = 0.9
"""Share of the progress that these rounds take; the rest is doing with fewer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementOptions:
    """Demands, candidates, and how long to search."""

    demands: Demands = field(default_factory=Demands)
    """What must hold."""
    candidates: CandidateOptions = field(default_factory=CandidateOptions)
    """Where reflectors may be put up."""
    prediction: PredictionOptions = field(default_factory=PredictionOptions)
    """How the routes are predicted."""
    extend: bool = True
    """Whether the project's reflectors stay; otherwise the layout starts empty, with the locked ones alone."""
    exchanges: int = 120
    """Exchanges tried in each round."""
    checks: int = 300
    """Layouts looked at in the end to do with fewer."""
    seed: int = 1
    """Seed of the exchanges: the same one gives the same layout."""
    ambiguity: AmbiguityOptions = field(default_factory=AmbiguityOptions)
    """When two poses count as alike, where the demands ask for places that are not ambiguous."""

    def __post_init__(self) -> None:
        at_least(self.exchanges, 0, "placement.exchanges")
        at_least(self.checks, 0, "placement.checks")
        at_least(self.seed, 0, "placement.seed")


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """What a layout achieves; another one is as good when it achieves as much everywhere."""

    seen: list[IntArray]
    """Per route and for the places, reflectors that each scan or pose sees, as far as demanded."""
    over: list[BoolArray]
    """Per route, which scans pass a limit."""
    rivals: IntArray
    """How often each place is ambiguous."""


class LayoutSearch:
    """State of one search: what is asked for grows until predictions and places are as demanded.

    Parameters
    ----------
    planned : the routes, with all M reflectors that stay or could be taken.
    site : parameters, scanner and stations.
    visible : visibility of the site with these reflectors.
    kept : number of reflectors that stay; they come first.
    options : demands and effort.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.
    """

    def __init__(
        self,
        planned: Sequence[PlannedRoute],
        site: Equipped,
        visible: VehicleVisibility,
        *,
        kept: int,
        options: PlacementOptions,
        progress: Progress,
    ) -> None:
        self._planned, self._options, self._progress, self._fraction = planned, options, progress, 0.0
        count, demands = len(visible.reflectors), options.demands
        self._fixed = np.arange(count) < kept
        self._covers = [route.sees() for route in planned]
        self._seen = [covers.any(axis=0) for covers in self._covers]
        self._base = demands.visible + int(demands.survive_failure)
        self._needs = [np.full(len(route.drive), self._base, dtype=np.int64) for route in planned]
        self._limits = [_limits(route, site, demands) for route in planned]
        self._conflicts = _conflicts(visible.reflectors.centers, demands.spacing)
        self._places = chosen_places(demands, planned, site.stations, site.scanners, options.ambiguity)
        self._distinction = Distinction(visible, self._places, demands.survive_failure, options.ambiguity)
        self._apart: list[BoolArray] = []

    def run(self) -> BoolArray:
        """Return which reflectors to take: (M,) array."""
        rng = np.random.default_rng(self._options.seed)
        taken, asked_more = self._fixed, False
        for number in range(ROUNDS):
            self._report(COVERING * number / ROUNDS, "choosing reflectors")
            taken = cover(self._problem(self._needs, self._apart), rng, self._options.exchanges, self._step(number))
            # Both, so that one round asks for all that is missing.
            if not any([self._raise_needs(self._over(taken), taken), self._tell_apart(taken)]):
                break
            asked_more = True
        return self._fewer(self._cleared(taken)) if asked_more else taken

    def bound(self) -> int:
        """Fewest new reflectors that the need for visible ones alone leaves possible.

        Every layout that keeps to limits and clears places meets these needs as well, so that the bound holds for it.
        """
        return lower_bound(self._base_problem())

    def unmet(self, taken: BoolArray) -> tuple[Unmet, ...]:
        """Metres of the routes and places where a demand does not hold with a layout (M,)."""
        found: list[Unmet] = []
        for route, covers, over in zip(self._planned, self._covers, self._over(taken), strict=True):
            unseen = covers[:, taken].sum(axis=1) < self._base
            for mask, reason in ((unseen, "visible"), (over, "uncertainty")):
                metres = np.unique(route.drive.metres[mask].astype(np.int64))
                if len(metres):
                    found.append(Unmet(route.name, tuple(metres.tolist()), reason))
        for place, rivals in zip(self._places, self._distinction.rivals(taken).tolist(), strict=True):
            if rivals:
                found.append(self._ambiguous_at(place))
        return tuple(found)

    def _ambiguous_at(self, place: ChosenPlace) -> Unmet:
        route, metres = nearest_on_routes(place.poses[0, :2], self._planned)
        return Unmet(route, metres, "ambiguous", place.name)

    def _base_problem(self) -> CoverProblem:
        """What must be visible whatever the predictions and the places come to."""
        return self._problem([np.full_like(needs, self._base) for needs in self._needs], [])

    def _problem(self, needs: list[IntArray], apart: list[BoolArray]) -> CoverProblem:
        """Covering of the routes' scans with their needs, of the places, and of rows that tell places from rivals."""
        places = self._distinction
        covers = [*self._covers, places.sees, *(row[np.newaxis] for row in apart)]
        counts = [*needs, np.full(len(places.sees), places.need), np.full(len(apart), places.apart)]
        rows, greatest = merged(np.concatenate(covers), np.concatenate(counts))
        return CoverProblem(rows.astype(np.float32), greatest, self._fixed, self._conflicts)

    def _over(self, taken: BoolArray) -> list[BoolArray]:
        """Per route, which scans pass a limit, with nothing broken or with any single reflector blocked."""
        result: list[BoolArray] = []
        for index, route in enumerate(self._planned):
            over = np.zeros(len(route.drive), dtype=np.bool_)
            for passed in self._over_on(index, taken):
                over |= passed
            result.append(over)
        return result

    def _over_on(self, index: int, taken: BoolArray, changed: BoolArray | None = None) -> Iterator[BoolArray]:
        """Which scans of a route pass a limit, for one damage after the other.

        Neither what the filter will say nor what its error will be may pass it. Damages near to what has changed since
        a layout that was good come first: they are the likeliest to be too much.
        """
        route = restricted(self._planned[index], taken)
        blocked = np.unique(route.visible.indices).tolist() if self._options.demands.survive_failure else []

        def passed(gone: int) -> BoolArray:
            left = taken.copy()
            left[[gone] if gone >= 0 else []] = False
            over = two_sigma_of(restricted(route, left)) > self._limits[index]
            return np.asarray(over.any(axis=1), dtype=np.bool_)

        # Some at a time: the kernels run side by side, and whoever has seen enough asks for no more of them.
        damages = [-1, *(sorted(blocked, key=self._gaps(changed).__getitem__) if changed is not None else blocked)]
        with ThreadPoolExecutor(CORES) as pool:
            for start in range(0, len(damages), CORES):
                self._report(None, "predicting")
                yield from pool.map(passed, damages[start : start + CORES])

    def _gaps(self, changed: BoolArray) -> FloatArray:
        """(M,) distance of each reflector to the nearest one of a mask [m]."""
        centers = self._planned[0].places[:, :2]
        return np.asarray(cKDTree(centers[changed]).query(centers)[0], dtype=np.float64)

    def _raise_needs(self, over: list[BoolArray], taken: BoolArray) -> bool:
        """Ask the scans over a limit for one reflector more than they see; False when none can see one more."""
        any_raised = False
        for needs, covers, mask in zip(self._needs, self._covers, over, strict=True):
            now = np.maximum(needs, covers[:, taken].sum(axis=1))
            more = mask & (covers.sum(axis=1) > now)
            needs[more] = now[more] + 1
            any_raised |= bool(more.any())
        return any_raised

    def _tell_apart(self, taken: BoolArray) -> bool:
        """Ask for what tells the chosen places from their rivals; False when nothing new can be asked for."""
        known = {row.tobytes() for row in self._apart}
        fresh = {row.tobytes(): row for row in self._distinction.rows(taken) if row.any()}
        fresh = {key: row for key, row in fresh.items() if key not in known}
        self._apart += fresh.values()
        return bool(fresh)

    def _cleared(self, taken: BoolArray) -> BoolArray:
        """Add what leaves the chosen places fewer rivals where covering has not done; its rows do not say all."""
        state = self._state(taken)
        while state.rivals.any():
            wanted = np.logical_or.reduce(self._distinction.rows(taken) or [np.zeros_like(taken)])
            best = taken
            for column in np.flatnonzero(wanted & ~taken):
                self._report(COVERING, "telling places apart")
                tried = taken.copy()
                tried[self._conflicts[column]] = False
                tried[column] = True
                if np.any(self._fixed & ~tried):
                    continue
                rivals = self._distinction.rivals(tried)
                if rivals.sum() < state.rivals.sum() and self._is_as_good(tried, replace(state, rivals=rivals)):
                    best, state = tried, replace(state, rivals=rivals)
            if best is taken:
                break
            taken = best
        return taken

    def _fewer(self, taken: BoolArray) -> BoolArray:
        """Take out what was asked for and the demands can do without: one of them, or two for another one."""
        problem, checks, state, found = self._base_problem(), self._options.checks, self._state(taken), True
        # Most layouts are tried a few reflectors apart: what the other routes see of them has been judged before.
        judged: dict[tuple[int, bytes], bool] = {}
        while found and checks > 0:
            found = False
            for tried in smaller_covers(problem, np.minimum(problem.needs, problem.counts(taken)), taken):
                checks -= 1
                self._report(1.0 - (1.0 - COVERING) * checks / self._options.checks, "doing with fewer")
                if self._is_as_good(tried, state, judged=judged, changed=tried ^ taken):
                    taken, found = tried, True
                    break
                if checks <= 0:
                    break
        return taken

    def _state(self, taken: BoolArray) -> _State:
        """What a layout achieves."""
        covers = [*self._covers, self._distinction.sees]
        needs = [self._base] * len(self._covers) + [self._distinction.need]
        seen = [np.minimum(need, each[:, taken].sum(axis=1)) for need, each in zip(needs, covers, strict=True)]
        return _State(seen, self._over(taken), self._distinction.rivals(taken))

    def _sees_enough(self, taken: BoolArray, state: _State) -> bool:
        """Whether scans and places see as many reflectors as in another layout, as far as demanded."""
        covers = [*self._covers, self._distinction.sees]
        return all(np.all(each[:, taken].sum(axis=1) >= seen) for each, seen in zip(covers, state.seen, strict=True))

    def _is_as_good(
        self,
        taken: BoolArray,
        state: _State,
        *,
        judged: dict[tuple[int, bytes], bool] | None = None,
        changed: BoolArray | None = None,
    ) -> bool:
        """Whether a layout sees enough, passes no further limit and leaves no place more ambiguous than another one.

        What is found of each route is kept in `judged`, by the route and what of the layout it sees, for as long as the
        state's `over` stays; `changed` are the reflectors by which it differs from a layout that was good.
        """
        if not self._sees_enough(taken, state):
            return False
        judged = {} if judged is None else judged
        for index, before in enumerate(state.over):
            key = index, taken[self._seen[index]].tobytes()
            if key not in judged:
                # The first damage that is too much decides.
                judged[key] = not any(np.any(over & ~before) for over in self._over_on(index, taken, changed))
            if not judged[key]:
                return False
        return bool(np.all(self._distinction.rivals(taken) <= state.rivals))

    def _step(self, number: int) -> Callable[[float], None]:
        return lambda done: self._report(COVERING * (number + done) / ROUNDS, "choosing reflectors")

    def _report(self, fraction: float | None, what: str) -> None:
        """Tell how far the search is; without a fraction only give the chance to cancel."""
        if fraction is not None:
            self._fraction = fraction
        self._progress(self._fraction, what)


def _conflicts(centers: FloatArray, spacing: float) -> tuple[IntArray, ...]:
    """For each reflector those that are too near to be taken beside it."""
    near = cKDTree(centers).query_ball_point(centers, spacing) if len(centers) else []
    return tuple(np.array([b for b in others if b != a], dtype=np.int64) for a, others in enumerate(near))


def _limits(route: PlannedRoute, site: Equipped, demands: Demands) -> FloatArray:
    """(K, 3) largest 2-sigma of x [m], y [m] and heading [rad] at each scan."""
    supervisor = site.parameters.supervisor
    position = supervisor.position_limit if demands.position_limit is None else demands.position_limit
    heading = supervisor.heading_limit if demands.heading_limit is None else demands.heading_limit
    limits = np.tile((position, position, heading), (len(route.drive), 1))
    for station, scans in station_scans(route.drive, site.stations):
        limits[scans, :2] = np.minimum(limits[scans, :2], station.required_accuracy)
    return limits
