"""Which reflectors the routes depend on, as panels and layers draw it: frozen, newest wins. Unranked, none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.stretches import stretches_of
from commission.planning.dependence import Dependence
from commission.studies.failures import FailuresResult


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FailureView:
    """Which reflectors the routes depend on."""

    ranking: tuple[Dependence, ...]
    """The one on which most depends first."""
    names: tuple[str, ...]
    """Id of the reflector of each."""
    fallen: tuple[str, ...]
    """Ids of those that have failed before, in their order."""
    fallen_places: FloatArray
    """(N, 2) where they stand [m]."""
    failed: str
    """Id of the reflector that is shown on the floor; empty: none."""
    chosen: Dependence | None
    """What depends on it; none when no route sees it."""
    place: tuple[float, float] | None
    """Where it stands [m]."""
    failing: tuple[FloatArray, ...]
    """Stretches of the routes that fail with it, (N, 2) points each [m]."""
    outdated: bool
    """Whether the site has changed since."""


def failure_view(ranked: FailuresResult, failed: str, *, outdated: bool) -> FailureView:
    """Find the reflector that is shown, and the stretches of the routes that depend on it.

    Parameters
    ----------
    ranked : the reflectors, ranked.
    failed : id of the one that is shown; empty: none.
    outdated : whether the site has changed since.
    """
    reflectors = ranked.reflectors
    names = tuple(reflectors.reflectors[each.reflector].id for each in ranked.ranking)
    chosen = ranked.ranking[names.index(failed)] if failed in names else None
    places = {reflector.id: (reflector.x, reflector.y) for reflector in reflectors.reflectors}
    failing = list[FloatArray]()
    if chosen is not None:
        for planned, part in zip(ranked.planned, chosen.routes, strict=True):
            fails = np.isin(planned.drive.metres.astype(np.int64), part.metres)
            failing.extend(stretches(planned.drive.poses[:, :2], fails))
    return FailureView(
        ranking=ranked.ranking,
        names=names,
        fallen=tuple(reflectors.reflectors[index].id for index in ranked.fallen),
        fallen_places=reflectors.centers[list(ranked.fallen)],
        failed=failed,
        chosen=chosen,
        place=places.get(failed),
        failing=tuple(failing),
        outdated=outdated,
    )


def stretches(points: FloatArray, chosen: BoolArray) -> tuple[FloatArray, ...]:
    """Cut the chosen ones of (K, 2) points in a row into pieces without gaps."""
    return tuple(points[start:end] for start, end in stretches_of(chosen))
