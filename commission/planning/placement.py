"""Suggested reflectors: few of them, so that the localizer keeps to its limits on the routes, whichever one fails.

Candidates come from `candidates`, what is demanded from `demands`; the search itself is in `layout_search`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.planning.candidates import clear_of, mounting_heights, wall_candidates
from commission.planning.layout_search import LayoutSearch, PlacementOptions
from commission.planning.nominal_drive import nominal_drive
from commission.planning.route_prediction import plan_route
from commission.planning.unmet import Unmet
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import VisibilityOptions, build_visibility
from commission.progress import Progress, silent
from commission.site.layout_brief import CandidateOptions, Demands
from commission.site.parts import Equipped
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.walls import walls_of

__all__ = ["Demands", "Placement", "PlacementOptions", "Progress", "Unmet", "choose", "place"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
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
    was_ended: bool = False
    """Whether the search was ended before its time: then fewer reflectors might do."""


def place(
    site: Equipped,
    routes: tuple[str, ...] | None = None,
    options: PlacementOptions | None = None,
    progress: Progress = silent,
) -> Placement:
    """Suggest reflectors on walls and pillars.

    Parameters
    ----------
    site : a project, or all of it that stands in the hall and drives in it; without a floor map there is no wall to
        put a reflector on.
    routes : names of the routes that count; all when None.
    options : demands and candidates; the defaults when None.
    progress : called with the fraction done [0..1] and what is being done; may raise `JobCancelled` to end it: with
        the best layout so far, where one holds already.

    Raises
    ------
    UsageError
        unknown route.
    """
    options = options or PlacementOptions()
    names = tuple(route.name for route in site.routes) if routes is None else routes
    drives = [nominal_drive(site.route(name), site.vehicle, site.scanners, options.prediction.plan) for name in names]
    path = np.concatenate([np.empty((0, 2)), *(drive.poses[:, :2] for drive in drives)])
    return choose(site, names, _candidates(site, path, options), options, progress)


def choose(
    site: Equipped,
    routes: tuple[str, ...],
    centers: FloatArray,
    options: PlacementOptions,
    progress: Progress = silent,
) -> Placement:
    """Choose among given candidates; parameters as for `place`, and `centers`, (C, 2) places [m], map frame."""
    kept = _kept(site, options)
    everything = ReflectorMap((*kept, *_named(centers, kept, options.candidates)))
    walls = walls_of(site.floor_map)
    seen = VisibilityOptions(detector=site.parameters.detector)
    models = tuple(build_visibility(everything, scanner, walls, seen) for scanner in site.scanners)
    planned = [plan_route(site, name, options.prediction, models) for name in routes]
    search = LayoutSearch(planned, site, VehicleVisibility(models), kept=len(kept), options=options, progress=progress)
    taken = search.run()
    # Named anew, so that the new ones count without gaps.
    added = _named(everything.centers[len(kept) :][taken[len(kept) :]], kept, options.candidates)
    return Placement(
        reflectors=ReflectorMap((*kept, *added)),
        added=len(added),
        at_least=search.bound(),
        candidates=centers,
        unmet=search.unmet(taken),
        was_ended=search.was_stopped or search.is_spent,
    )


def _kept(site: Equipped, options: PlacementOptions) -> tuple[Reflector, ...]:
    """Reflectors that stay: all, or the locked ones where the layout starts empty."""
    return tuple(each for each in site.reflectors.reflectors if options.extend or each.locked)


def _candidates(site: Equipped, path: FloatArray, options: PlacementOptions) -> FloatArray:
    """Places on walls that no vehicle touches and that are not too near to a reflector that stays."""
    if site.floor_map is None:
        return np.empty((0, 2))
    given = options.candidates
    centers = wall_candidates(site.floor_map.occupancy(), given)
    half_width = max(abs(y) for _, y in site.vehicle.outline)
    clear = clear_of(centers, path, half_width + given.clearance + given.radius)
    stay = np.array([(each.x, each.y) for each in _kept(site, options)]).reshape(-1, 2)
    return centers[clear & clear_of(centers, stay, options.demands.spacing)]


def _named(centers: FloatArray, kept: tuple[Reflector, ...], options: CandidateOptions) -> tuple[Reflector, ...]:
    """Reflectors at places, with names that are not taken."""
    used = {reflector.id for reflector in kept}
    free = (name for name in (f"S{number}" for number in range(1, len(used) + len(centers) + 1)) if name not in used)
    # Places that the caller names may be where no height is allowed; they are his to answer for.
    heights = np.nan_to_num(mounting_heights(centers, options), nan=options.height)
    return tuple(
        Reflector(id=name, x=x, y=y, radius=options.radius, height=height, note="suggested")
        for name, (x, y), height in zip(free, centers.tolist(), heights.tolist(), strict=False)
    )
