"""What if a reflector fails: which metres of which routes depend on it. Predictions with damage, compared."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from commission.geometry.arrays import IntArray
from commission.planning.route_prediction import NO_DAMAGE, Damage, PlannedRoute, predict_route
from commission.progress import Progress, part, silent
from commission.site.checks import above

DIRECTIONS = 4
"""Directions in which a reflector is moved; the metres that fail are those of all directions together."""


class Failure(StrEnum):
    """What may happen to a reflector."""

    BLOCKED = "blocked"
    """Nothing sees it: something stands in front of it, or it has fallen off."""
    DIRTY = "dirty"
    """It is seen from near by only."""
    MOVED = "moved"
    """It stands elsewhere than the map says."""


@dataclass(frozen=True, slots=True, eq=False)
class RouteDependence:
    """What one failure does to one route."""

    route: str
    """Name of the route."""
    metres: IntArray
    """Metres of the way that fail with it and do not fail without it."""
    limit_share: float
    """Largest bias plus 2-sigma on the route with it, as a share of the supervisor's limit [1]; above 1 fails."""


@dataclass(frozen=True, slots=True, eq=False)
class Dependence:
    """What depends on one reflector."""

    reflector: int
    """Index into the reflector map."""
    failure: Failure
    """What happens to it."""
    routes: tuple[RouteDependence, ...]
    """Each route that was asked about, in their order."""

    @property
    def failing_metres(self) -> int:
        """Metres of all routes together that fail with it and do not fail without it."""
        return sum(len(route.metres) for route in self.routes)

    @property
    def limit_share(self) -> float:
        """Largest share of the limit on any route [1]."""
        return max((route.limit_share for route in self.routes), default=0.0)


@dataclass(frozen=True, slots=True)
class FailureOptions:
    """Which failure, and beside which other damage."""

    failure: Failure = Failure.BLOCKED
    """`blocked`, `dirty` or `moved`."""
    distance: float = 0.05
    """How far a moved reflector has moved [m]."""
    given: Damage = field(default_factory=lambda: NO_DAMAGE)
    """Damage that is there already: then the answer is about the next failure."""

    def __post_init__(self) -> None:
        above(self.distance, 0.0, "failure.distance", "m")


def dependences(
    routes: Sequence[PlannedRoute],
    options: FailureOptions | None = None,
    progress: Progress = silent,
) -> tuple[Dependence, ...]:
    """Let each reflector in turn fail, and rank the reflectors by what depends on them.

    Parameters
    ----------
    routes : planned routes of one project.
    options : which failure; blocked when None.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.

    Returns
    -------
    dependences : one for each reflector that any route sees and that is not blocked already. The one with the most
        failing metres comes first; of equals the one that brings the routes closest to a limit.
    """
    options = options or FailureOptions()
    intact = [predict_route(route, options.given).failing_metres() for route in routes]
    seen = np.unique(np.concatenate([np.empty(0, np.int64), *(route.visible.indices for route in routes)]))
    found: list[Dependence] = []
    for number, reflector in enumerate(seen.tolist()):
        progress(number / len(seen), "failures")
        if reflector in options.given.blocked:
            continue
        damages = _damages(reflector, options)
        parts = [_on_route(route, damages, fails) for route, fails in zip(routes, intact, strict=True)]
        found.append(Dependence(reflector, options.failure, tuple(parts)))
    progress(1.0, "failures")
    return tuple(sorted(found, key=lambda each: (-each.failing_metres, -each.limit_share, each.reflector)))


def worst_failures(
    routes: Sequence[PlannedRoute],
    count: int,
    options: FailureOptions | None = None,
    progress: Progress = silent,
) -> tuple[Dependence, ...]:
    """Block reflectors one after the other, each time the one on which most depends then.

    Parameters
    ----------
    routes : planned routes of one project.
    count : number of failures.
    options : damage that is there already; its failure is not read, since all are blocked.
    progress : as for `dependences`.

    Returns
    -------
    failures : in the order of failing, at most `count`. Greedy: another set of `count` may do more harm.
    """
    options = replace(options or FailureOptions(), failure=Failure.BLOCKED)
    failures: list[Dependence] = []
    for done in range(count):
        ranked = dependences(routes, options, part(progress, done / count, (done + 1) / count))
        if not ranked:
            break
        failures.append(ranked[0])
        given = replace(options.given, blocked=(*options.given.blocked, ranked[0].reflector))
        options = replace(options, given=given)
    return tuple(failures)


def _damages(reflector: int, options: FailureOptions) -> list[Damage]:
    """Damage by one failure of one reflector: several where the failure has a direction."""
    given = options.given
    if options.failure is Failure.BLOCKED:
        return [replace(given, blocked=(*given.blocked, reflector))]
    if options.failure is Failure.DIRTY:
        return [replace(given, dirty=(*given.dirty, reflector))]
    angles = [2.0 * math.pi * direction / DIRECTIONS for direction in range(DIRECTIONS)]
    shifts = [(reflector, options.distance * math.cos(angle), options.distance * math.sin(angle)) for angle in angles]
    return [replace(given, moved=(*given.moved, shift)) for shift in shifts]


def _on_route(route: PlannedRoute, damages: Sequence[Damage], intact: IntArray) -> RouteDependence:
    """Compare a route with each of the damages to the route as it is."""
    predictions = [predict_route(route, damage) for damage in damages]
    failing = np.unique(np.concatenate([prediction.failing_metres() for prediction in predictions]))
    share = max(float(prediction.limit_share.max()) for prediction in predictions)
    return RouteDependence(route.name, np.setdiff1d(failing, intact), share)
