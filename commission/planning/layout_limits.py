"""Whether a layout keeps to the limits of the uncertainty on all routes, and what it lacks where it does not."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.planning.error_budget import larger_variances, predict_errors
from commission.planning.fix_shares import fix_shares
from commission.planning.information import tangent_at
from commission.planning.route_prediction import (
    PlannedRoute,
    RoutePrediction,
    predict_route,
    restricted,
    station_scans,
)
from commission.planning.unmet import Beyond, beyond
from commission.site.layout_brief import Demands
from commission.site.parts import Equipped

CORES = os.cpu_count() or 1
NOTHING = -1
"""Number of the reflector that fails where none does."""
PER_DAMAGE = 8
"""Scans of one route that a row each is made of: the worst ones, apart from each other."""
APART_M = 2.0
LEAST_MORE = 1e-3
"""What is asked for more at least, of the information that there is: more than rounding hides."""
NECESSARY = 600
"""Rows that the bound rests on, at most."""
NEARLY = 0.9
"""Share of a limit from which, with all places, it is looked at which failing ones cost most."""
DEAREST = 2
"""Reflectors at one place of a route whose failing is predicted with all others standing."""
MOST_FAILING = 40
"""Such predictions at most: they are the slowest of all, and with very many reflectors one is worth little."""


@dataclass(frozen=True, slots=True, eq=False)
class Excess:
    """A limit that a layout passes, and what the layout lacks: a row that it does not fulfil."""

    gains: FloatArray
    """(M,) what each reflector adds."""
    need: float
    """Sum of them at which the limit is kept, as far as shares in a fix say."""


@dataclass(frozen=True, slots=True)
class _Dearest:
    """What is missed most at one scan of a route when all M reflectors stand."""

    scan: int
    """Of the drive."""
    reflectors: tuple[int, ...]
    """Those with the largest part in the information."""
    factor: float
    """By which the sigma grows at least without the first of them."""


class LayoutLimits:
    """The limits of one site, asked for one layout after the other.

    Parameters
    ----------
    planned : the routes, with all M reflectors that could be taken.
    site : parameters and stations.
    demands : limits, and whether any reflector may fail.
    step : called with every prediction; may raise to cancel.
    """

    def __init__(self, planned: list[PlannedRoute], site: Equipped, demands: Demands, step: Callable[[], None]) -> None:
        self._planned, self._step, self._survives = planned, step, demands.survive_failure
        self._count = len(planned[0].reflectors) if planned else 0
        self._demanded = [_limits(route, site, demands) for route in planned]
        self._allowed = [limits.copy() for limits in self._demanded]
        self._leeway = 1.0 + demands.leeway
        self._best: list[FloatArray] = []
        """Per route, (K, 3) 2-sigma with all M reflectors, whichever single one fails; empty until asked for."""
        self._hard: dict[tuple[int, int], None] = {}
        """Route and reflector failing that were too much of late, the latest last."""
        self._necessary: list[tuple[FloatArray, float]] = []
        self._last: tuple[BoolArray, list[FloatArray]] | None = None
        self.predicted_sightings = 0
        """Sightings of reflectors that predictions went through so far: what they cost, whatever the machine."""

    @property
    def necessary(self) -> tuple[FloatArray, FloatArray]:
        """Rows (K, M) and needs (K,) that every layout fulfils that keeps the limits."""
        gains = np.array([gains for gains, _ in self._necessary]).reshape(len(self._necessary), self._count)
        return gains, np.array([need for _, need in self._necessary])

    def kept(self, taken: BoolArray) -> list[FloatArray]:
        """Per route, (K, 3) largest 2-sigma with nothing broken or with any single reflector failing."""
        # Of the last layout it is asked again, when it has become the result.
        if self._last is None or not np.array_equal(self._last[0], taken):
            result = [np.zeros_like(limits) for limits in self._demanded]
            for (index, _), _, variances in self._predicted(taken, self._damages(taken)):
                result[index] = np.maximum(result[index], 2.0 * np.sqrt(variances))
            self._last = taken.copy(), result
        return self._last[1]

    def beyond(self, taken: BoolArray) -> list[Beyond | None]:
        """Per route, the metres on which a limit is passed, and how near to it all M reflectors would come."""
        best = self._best or self._attainable()
        return [
            beyond(route, kept, limits, there)
            for route, kept, limits, there in zip(self._planned, self.kept(taken), self._demanded, best, strict=True)
        ]

    def allow(self, kept: list[FloatArray]) -> None:
        """Ask no more of scans than what a layout keeps there: nothing that could be put up has kept their limits."""
        for allowed, there in zip(self._allowed, kept, strict=True):
            np.copyto(allowed, np.inf, where=np.any(there > allowed, axis=1, keepdims=True))

    def allow_what_little_keeps(self) -> None:
        """Ask of each scan no more than what all M reflectors give there, and the leeway of the demands."""
        self._best = self._attainable()
        for allowed, best in zip(self._allowed, self._best, strict=True):
            np.maximum(allowed, self._leeway * best, out=allowed)

    def _attainable(self) -> list[FloatArray]:
        """Per route, (K, 3) 2-sigma with all M reflectors; near a limit, without those that cost most there as well."""
        everything, result = np.ones(self._count, np.bool_), [np.zeros_like(limits) for limits in self._demanded]
        damages: list[tuple[int, int]] = []
        places: list[tuple[int, _Dearest]] = []
        for key, prediction, variances in self._predicted(everything, [(i, NOTHING) for i in range(len(result))]):
            result[key[0]] = 2.0 * np.sqrt(variances)
            if self._survives:
                dearest = self._dearest(key[0], prediction, result[key[0]])
                places += [(key[0], each) for each in dearest]
                damages += [(key[0], gone) for gone in sorted({gone for each in dearest for gone in each.reflectors})]
        if len(damages) > MOST_FAILING:
            for index, each in places:
                metres = self._planned[index].drive.metres
                result[index][np.abs(metres - metres[each.scan]) < APART_M] *= each.factor
            return result
        for (index, _), _, variances in self._predicted(everything, damages):
            result[index] = np.maximum(result[index], 2.0 * np.sqrt(variances))
        return result

    def _dearest(self, index: int, prediction: RoutePrediction, two_sigma: FloatArray) -> list[_Dearest]:
        """Reflectors that have the largest part in the information wherever even all together are near a limit."""
        route, shares = self._planned[index], two_sigma / self._demanded[index]
        everything = np.ones(self._count, np.bool_)
        found: list[_Dearest] = []
        for scan, axis in _worst_apart(route, shares, NEARLY, len(shares)):
            gains = fix_shares(route, prediction, scan, axis, everything).gains
            reflectors = np.argsort(-gains, kind="stable")[:DEAREST]
            # A part of the information is at least so much of the variance: the share says no less (`fix_shares`).
            factor = 1.0 / np.sqrt(max(1.0 - float(gains.max(initial=0.0)), LEAST_MORE))
            found.append(_Dearest(scan, tuple(reflectors.tolist()), float(factor)))
        return found

    def excess(self, taken: BoolArray, enough: int = 1) -> list[Excess]:
        """Return rows that a layout does not fulfil: none when it keeps all limits.

        Parameters
        ----------
        taken : (M,) the layout.
        enough : number of rows from which it is not looked at any further.
        """
        found: list[Excess] = []
        damages = self._damages(taken)
        # Those that were too much before are the likeliest to be so again.
        for key, prediction, variances in self._predicted(taken, damages):
            rows = list(self._rows(taken, key, prediction, variances))
            if rows:
                self._hard.pop(key, None)
                self._hard[key] = None
            found += rows
            if len(found) >= enough:
                break
        return found

    def _damages(self, taken: BoolArray) -> list[tuple[int, int]]:
        """Route and reflector failing: all that there are, the hardest first."""
        every = [(index, NOTHING) for index in range(len(self._planned))]
        if self._survives:
            for index, route in enumerate(self._planned):
                seen = np.unique(route.visible.indices)
                every += [(index, int(gone)) for gone in seen[taken[seen]]]
        rank = {key: number for number, key in enumerate(self._hard)}
        return sorted(every, key=lambda key: -rank.get(key, -1))

    def _predicted(
        self, taken: BoolArray, damages: list[tuple[int, int]]
    ) -> Iterator[tuple[tuple[int, int], RoutePrediction, FloatArray]]:
        """Predict damages in turn: each with (K, 3) variances, of the filter or of its error, whichever is larger."""
        # First without all that is not taken, which is most.
        routes = [restricted(route, taken) for route in self._planned]
        cost = [len(route.visible.indices) + len(route.drive) for route in routes]

        def predicted(key: tuple[int, int]) -> tuple[tuple[int, int], RoutePrediction, FloatArray]:
            route = restricted(routes[key[0]], _without(taken, key[1]))
            prediction = predict_route(route)
            return key, prediction, larger_variances(prediction, predict_errors(route, prediction))

        # Some at a time: the kernels run side by side, and whoever has seen enough asks for no more of them.
        with ThreadPoolExecutor(CORES) as pool:
            for start in range(0, len(damages), CORES):
                self._step()
                some = damages[start : start + CORES]
                self.predicted_sightings += sum(cost[index] for index, _ in some)
                yield from pool.map(predicted, some)

    def _rows(
        self, taken: BoolArray, key: tuple[int, int], prediction: RoutePrediction, variances: FloatArray
    ) -> Iterator[Excess]:
        """Rows at the worst scans of a route."""
        index, gone = key
        route, limits, left = self._planned[index], self._allowed[index], _without(taken, gone)
        shares = 4.0 * variances / limits**2
        for scan, axis in _worst_apart(route, shares, 1.0, PER_DAMAGE):
            share = float(shares[scan, axis])
            fix = fix_shares(route, prediction, scan, axis, left)
            gains = np.where(np.arange(len(left)) == gone, 0.0, fix.gains)
            # Neither what a fix leaves out nor chance is in the gains: they are held against themselves.
            yield Excess(gains, float(gains[left].sum()) + max(share - 1.0, LEAST_MORE))
            if len(self._necessary) < NECESSARY:
                tangent = tangent_at(route, prediction, scan, axis)
                needed = np.where(np.arange(len(left)) == gone, 0.0, tangent.gains)
                self._necessary.append((needed, tangent.need(0.25 * limits[scan, axis] ** 2)))


def _worst_apart(route: PlannedRoute, shares: FloatArray, least: float, most: int) -> Iterator[tuple[int, int]]:
    """Scan and axis of the largest (K, 3) shares of a limit above a least one, some way apart from each other."""
    axes, worst, metres = shares.argmax(axis=1), shares.max(axis=1), route.drive.metres
    for _ in range(most):
        scan = int(worst.argmax())
        if worst[scan] <= least:
            return
        yield scan, int(axes[scan])
        worst[np.abs(metres - metres[scan]) < APART_M] = 0.0


def _without(taken: BoolArray, gone: int) -> BoolArray:
    left = taken.copy()
    if gone != NOTHING:
        left[gone] = False
    return left


def _limits(route: PlannedRoute, site: Equipped, demands: Demands) -> FloatArray:
    """(K, 3) largest 2-sigma of x [m], y [m] and heading [rad] at each scan, from when the vehicle sets off."""
    supervisor = site.parameters.supervisor
    position = supervisor.position_limit if demands.position_limit is None else demands.position_limit
    heading = supervisor.heading_limit if demands.heading_limit is None else demands.heading_limit
    limits = np.tile((position, position, heading), (len(route.drive), 1))
    for station, scans in station_scans(route.drive, site.stations):
        limits[scans, :2] = np.minimum(limits[scans, :2], station.required_accuracy)
    limits[: route.drive.sets_off] = np.inf
    return limits
