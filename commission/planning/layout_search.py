"""The search for few reflectors among many: a covering problem that learns what the limits of the uncertainty ask for.

How often each scan must see a reflector is a covering problem (`cover`). Limits are not; but wherever a prediction over
a layout passes one, the shares of reflectors in a fix (`fix_shares`) say in a linear row what a layout must have more
than this one. The row joins the problem, reflectors are exchanged until all rows are fulfilled (`fulfilling`), and the
next layout is judged. Where a place has a rival, the row asks for a reflector that only one of the two sees. Of the
layouts that hold the smallest is kept, so that more effort never gives a larger one.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.errors import JobCancelled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning.ambiguity import AmbiguityOptions
from commission.planning.cover import CoverProblem, cover, lower_bound, merged
from commission.planning.fulfilling import Needs, exchanged, grown, pruned, with_one, without_one
from commission.planning.layout_limits import Excess, LayoutLimits
from commission.planning.pair_distances import PairDistances
from commission.planning.route_prediction import PlannedRoute, PredictionOptions
from commission.planning.telling_apart import ChosenPlace, Distinction, chosen_places, nearest_on_routes
from commission.planning.unmet import Unmet
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.wall_spread import WallSpread
from commission.progress import Progress
from commission.site.checks import at_least
from commission.site.layout_brief import CandidateOptions, Demands
from commission.site.parts import Equipped

FIRST_EXCHANGES = 120
"""Exchanges tried for the first layout, which only has to see enough."""
FIRST_ROUNDS = 1000
"""Layouts judged at most until one holds."""
PATIENCE = 5
"""Layouts of one size that are judged before one more reflector is spent to have one that holds soon."""
REPAIRING, SHRINKING = 40, 250
"""Exchanges tried to fulfil new rows: with room to grow, and with one reflector less."""
ROWS_AT_FIRST, ROWS_LATER = 2000, 48
"""What is asked for more of one layout: all that it lacks, as long as none holds; then to be done with it soon."""
RESTARTS = 4
"""How often the search begins elsewhere before a smaller layout counts as not to be found."""
MOST_PAIRS = 300
"""Pairs of reflectors that are taken out to tell places apart, at most."""
MOST_ALIKE = 8
"""Reflectors of a layout that another place is looked for at a time, those with the most alike pairs first."""
MOST_SIGHTINGS = 40_000_000
"""Sightings of reflectors that all predictions of a search go through at most: it comes to an end on any site, and for
the same input on any machine with the same layout."""
UNTIL_ONE_HOLDS = 0.4
"""Share of the progress until there is a layout that holds."""


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
    checks: int = 150
    """Layouts judged to do with fewer, once there is one that holds: more of them never give a larger layout."""
    seed: int = 1
    """Seed of what is tried: the same one gives the same layout."""
    ambiguity: AmbiguityOptions = field(default_factory=AmbiguityOptions)
    """When two poses count as alike, where the demands ask for places that are not ambiguous."""

    def __post_init__(self) -> None:
        at_least(self.checks, 0, "placement.checks")
        at_least(self.seed, 0, "placement.seed")


class LayoutSearch:
    """State of one search: rows grow until a layout that fulfils them is as demanded, then reflectors are saved.

    Parameters
    ----------
    planned : the routes, with all M reflectors that stay or could be taken.
    site : parameters, scanner and stations.
    visible : visibility of the site with these reflectors.
    kept : number of reflectors that stay; they come first.
    options : demands and effort.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel. From when there is a
        layout that holds, a `JobCancelled` or an interrupt from the keyboard ends the search with the best so far.
    """

    def __init__(
        self,
        planned: list[PlannedRoute],
        site: Equipped,
        visible: VehicleVisibility,
        *,
        kept: int,
        options: PlacementOptions,
        progress: Progress,
    ) -> None:
        self._planned, self._options, self._progress, self._fraction = planned, options, progress, 0.0
        demands = options.demands
        self._covers = [route.sees() for route in planned]
        self._base = demands.visible + int(demands.survive_failure)
        self._places = chosen_places(demands, planned, site.stations, site.scanners, options.ambiguity)
        self._distinction = Distinction(visible, self._places, demands.survive_failure, options.ambiguity)
        self._apart: dict[bytes, BoolArray] = {}
        self._limits = LayoutLimits(planned, site, demands, lambda: self._report(None, "predicting"))
        centers = visible.reflectors.centers
        self._pairs = PairDistances(planned, self._covers, centers, demands.pairs_differ)
        self._spread = WallSpread(planned, self._covers, centers, demands.wall_reach)
        self._cover = self._cover_problem(
            np.arange(len(visible.reflectors)) < kept, _conflicts(centers, demands.spacing)
        )
        self._system = Needs(self._cover)
        self._rivals_left: IntArray = np.zeros(len(self._places), np.int64)
        self.was_stopped = False
        """Whether the search was ended before its time."""

    def run(self) -> BoolArray:
        """Return which reflectors to take: (M,) array."""
        rng = np.random.default_rng(self._options.seed)
        best = self._first(rng)
        try:
            for smaller in self._ever_fewer(best, rng):
                best = smaller
            best = self._pairs_told_apart(best)
        except (JobCancelled, KeyboardInterrupt):
            self.was_stopped = True
        return best

    @property
    def is_spent(self) -> bool:
        """Whether predictions have gone through as many sightings as a search may take."""
        return self._limits.predicted_sightings >= MOST_SIGHTINGS

    def bound(self) -> int:
        """Fewest new reflectors that visibility and the information that limits ask for leave possible.

        Every layout that meets the demands fulfils these rows as well, so that the bound holds for it.
        """
        return lower_bound(self._cover, *self._limits.necessary)

    def unmet(self, taken: BoolArray) -> tuple[Unmet, ...]:
        """Metres of the routes and places where a demand does not hold with a layout (M,)."""
        found: list[Unmet] = []
        for route, covers, over in zip(self._planned, self._covers, self._limits.beyond(taken), strict=True):
            unseen = covers[:, taken].sum(axis=1) < self._base
            metres = np.unique(route.drive.metres[unseen].astype(np.int64))
            if len(metres):
                found.append(Unmet(route=route.name, metres=tuple(metres.tolist()), reason="visible"))
            if over is not None:
                found.append(Unmet(route=route.name, metres=over.metres, reason="uncertainty", beyond=over))
        for place, rivals in zip(self._places, self._distinction.rivals(taken).tolist(), strict=True):
            if rivals:
                found.append(self._ambiguous_at(place))
        return (*found, *self._pairs.unmet(taken), *self._spread.unmet(taken))

    def _ambiguous_at(self, place: ChosenPlace) -> Unmet:
        route, metres = nearest_on_routes(place.poses[0, :2], self._planned)
        return Unmet(route=route, metres=metres, reason="ambiguous", place=place.name)

    def _cover_problem(self, fixed: BoolArray, conflicts: tuple[IntArray, ...]) -> CoverProblem:
        """What must be visible whatever the predictions come to: covering of the routes' scans, and of the places."""
        places = self._distinction
        covers = [*self._covers, places.sees, self._spread.rows]
        counts = [np.full(len(each), self._base) for each in self._covers]
        counts += [np.full(len(places.sees), places.need), np.ones(len(self._spread.rows), np.int64)]
        rows, greatest = merged(np.concatenate(covers), np.concatenate(counts))
        return CoverProblem(rows.astype(np.float32), greatest, fixed, conflicts)

    def _first(self, rng: np.random.Generator) -> BoolArray:
        """Return a layout that holds, as far as any does."""
        self._report(0.0, "choosing reflectors")
        taken = cover(self._cover, rng, FIRST_EXCHANGES, lambda done: self._report(0.1 * done, "choosing reflectors"))
        self._limits.allow_what_little_keeps()
        found, taken = self._repaired(taken)
        if found:
            return taken
        # What is not met now stays so: it only must not become more.
        self._limits.allow(self._limits.kept(taken))
        self._rivals_left = self._distinction.rivals(taken)
        return self._cleared(taken)

    def _repaired(self, taken: BoolArray) -> tuple[bool, BoolArray]:
        """Exchange, add and take out reflectors until a layout holds, or nothing more can be asked for."""
        patience = PATIENCE
        for number in range(FIRST_ROUNDS):
            if self.is_spent:
                break
            self._report(0.1 + (UNTIL_ONE_HOLDS - 0.1) * number / (number + 20.0), "choosing reflectors")
            if self._holds(taken, ROWS_AT_FIRST):
                return True, taken
            next_one = exchanged(self._system, taken, REPAIRING, self._step)
            next_one = pruned(self._system, grown(self._system, next_one))
            # As few as the rows allow are often too few, and to find that out takes many rows.
            patience = patience - 1 if next_one.sum() <= taken.sum() else PATIENCE
            if patience == 0:
                next_one, patience = with_one(self._system, next_one, taken), PATIENCE
            if np.array_equal(next_one, taken):
                break
            taken = next_one
        return False, taken

    def _holds(self, taken: BoolArray, enough: int) -> bool:
        """Whether a layout that sees enough passes no limit and leaves no place ambiguous; adds rows for what does."""
        found = self._limits.excess(taken, enough)
        self._ask(found)
        if found:
            return False
        if np.all(self._distinction.rivals(taken) <= self._rivals_left):
            return not self._system.lacking(taken).any()
        fresh = [row for row in self._distinction.rows(taken) if row.any() and row.tobytes() not in self._apart]
        self._apart.update({row.tobytes(): row for row in fresh})
        if fresh:
            self._system.add(np.array(fresh, np.float64), np.full(len(fresh), float(self._distinction.apart)))
        return False

    def _ask(self, found: list[Excess]) -> None:
        if found:
            self._system.add(np.array([each.gains for each in found]), np.array([each.need for each in found]))

    def _ever_fewer(self, best: BoolArray, rng: np.random.Generator) -> Iterator[BoolArray]:
        """Yield layouts that hold, each smaller than the one before; the first is the given one."""
        yield best
        fewest, left = self.bound() + int(self._cover.fixed.sum()), self._options.checks
        # The rows know more by now than when the first layouts were chosen: many reflectors at once may be saved.
        while left > 0 and best.sum() > fewest:
            found, taken = self._repaired(self._reduced(best))
            left -= 1
            if not found or taken.sum() >= best.sum():
                break
            best = taken
            yield best
        while left > 0 and best.sum() > fewest:
            found, left = self._one_fewer(best, left, rng)
            if found is None:
                return
            best = found
            yield best

    def _reduced(self, taken: BoolArray) -> BoolArray:
        """Take out one reflector after the other as long as the others can be exchanged to fulfil all rows."""
        while True:
            tried = without_one(self._system, taken)
            tried = exchanged(self._system, tried, REPAIRING, self._step)
            if self._system.lacking(tried).any() or not np.any(tried & ~self._cover.fixed):
                return taken
            taken = tried

    def _one_fewer(self, best: BoolArray, left: int, rng: np.random.Generator) -> tuple[BoolArray | None, int]:
        """Look for a layout of one reflector less that holds, judging `left` of them at most; return those left."""
        taken, restarts = without_one(self._system, best), 0
        while left > 0 and not self.is_spent:
            self._report(1.0 - (1.0 - UNTIL_ONE_HOLDS) * left / self._options.checks, "doing with fewer")
            tried = exchanged(self._system, taken, SHRINKING, self._step)
            if self._system.lacking(tried).any():
                restarts += 1
                if restarts > RESTARTS:
                    return None, left
                taken = self._elsewhere(tried, rng)
                continue
            left -= 1
            if self._holds(tried, ROWS_LATER):
                return tried, left
            # Where nothing more can be asked for, the same layout would come again.
            taken = tried if self._system.lacking(tried).any() else self._elsewhere(tried, rng)
        return None, left

    def _elsewhere(self, taken: BoolArray, rng: np.random.Generator) -> BoolArray:
        """Replace every third reflector by any other one."""
        taken = taken.copy()
        movable = np.flatnonzero(taken & ~self._cover.fixed)
        for out in rng.choice(movable, size=min(len(movable), max(1, len(movable) // 3)), replace=False).tolist():
            taken[out] = False
            taken[rng.choice(np.flatnonzero(self._cover.allowed(taken)))] = True
        return taken

    def _cleared(self, taken: BoolArray) -> BoolArray:
        """Add or take out what leaves the chosen places fewer rivals where the rows have not done: they do not say all.

        Two reflectors that a row asks for may be each other's image, and tell nothing when both stand.
        """
        while self._rivals_left.any():
            best = taken
            for tried in self._neighbors(taken):
                self._report(None, "telling places apart")
                if self._sees_less(tried, taken):
                    continue
                rivals = self._distinction.rivals(tried)
                if rivals.sum() < self._rivals_left.sum() and not self._limits.excess(tried):
                    best, self._rivals_left = tried, rivals
            if best is taken:
                break
            taken = best
        return taken

    def _pairs_told_apart(self, taken: BoolArray) -> BoolArray:
        """Exchange reflectors one for one so that fewer pairs are alike, and all that held holds still."""
        best, fewest = taken, len(self._pairs.alike(taken).distances)
        left, judged, seen = fewest, 0, {taken.tobytes()}
        while fewest and judged < self._options.checks:
            found = None
            for count, tried in self._less_alike(taken, left):
                if tried.tobytes() in seen or judged >= self._options.checks:
                    continue
                self._report(None, "telling pairs apart")
                seen.add(tried.tobytes())
                judged += 1
                if self._holds(tried, 1):
                    found = count, tried
                    break
            if found is None:
                break
            left, taken = found
            if left < fewest:
                best, fewest = taken, left
        return best

    def _less_alike(self, taken: BoolArray, left: int) -> list[tuple[int, BoolArray]]:
        """Layouts with one reflector elsewhere and no more alike pairs, that fulfil all rows; the best first."""
        inside, four = np.flatnonzero(taken), self._pairs.alike(taken).reflectors
        loads = np.bincount(four.reshape(-1), minlength=len(inside))
        found: list[tuple[int, BoolArray]] = []
        for out in inside[np.argsort(-loads, kind="stable")[:MOST_ALIKE]].tolist():
            if self._cover.fixed[out]:
                continue
            without = taken.copy()
            without[out] = False
            lacking = self._system.lacking(without)
            rows = np.flatnonzero(lacking > 0.0)
            enough = np.all(self._system.gains[:, rows] >= lacking[rows], axis=1) & self._cover.allowed(without)
            enough[out] = False
            for into in np.flatnonzero(enough).tolist():
                self._step()
                tried = without.copy()
                tried[into] = True
                count = len(self._pairs.alike(tried).distances)
                if count <= left:
                    found.append((count, tried))
        return sorted(found, key=lambda each: each[0])

    def _neighbors(self, taken: BoolArray) -> Iterator[BoolArray]:
        """Layouts with a reflector more that tells a place from a rival, and layouts with one or two less."""
        wanted = np.logical_or.reduce(self._distinction.rows(taken) or [np.zeros_like(taken)])
        for column in np.flatnonzero(wanted & ~taken):
            tried = taken.copy()
            tried[self._cover.conflicts[column]] = False
            tried[column] = True
            if not np.any(self._cover.fixed & ~tried):
                yield tried
        movable = np.flatnonzero(taken & ~self._cover.fixed)
        pairs = itertools.islice(itertools.combinations(movable, 2), MOST_PAIRS)
        for out in itertools.chain(((each,) for each in movable), pairs):
            tried = taken.copy()
            tried[list(out)] = False
            yield tried

    def _sees_less(self, tried: BoolArray, taken: BoolArray) -> bool:
        """Whether a layout sees fewer reflectors than another one, as far as demanded."""
        rows = len(self._cover.needs)
        return bool(np.any(self._system.lacking(tried)[:rows] > self._system.lacking(taken)[:rows]))

    def _step(self) -> None:
        self._report(None, "exchanging reflectors")

    def _report(self, fraction: float | None, what: str) -> None:
        """Tell how far the search is; without a fraction only give the chance to cancel."""
        if self.was_stopped:
            return
        if fraction is not None:
            self._fraction = max(self._fraction, fraction)
        self._progress(self._fraction, what)


def _conflicts(centers: FloatArray, spacing: float) -> tuple[IntArray, ...]:
    """For each reflector those that are too near to be taken beside it."""
    near = cKDTree(centers).query_ball_point(centers, spacing) if len(centers) else []
    return tuple(np.array([b for b in others if b != a], dtype=np.int64) for a, others in enumerate(near))
