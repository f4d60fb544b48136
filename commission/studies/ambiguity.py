"""Ambiguity of a site: where on the floor a cold start may go wrong, and where on the routes a neighbor misleads.

The figures themselves come from `planning`; files and images are elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.planning.ambiguity import AmbiguityOptions, AmbiguousPair, ColdStart, cold_start
from commission.planning.association_risk import NeighborRisk, neighbor_risks
from commission.planning.coverage import Lattice, lattice_of
from commission.planning.route_prediction import PredictionOptions, plan_route, predict_route
from commission.planning.visibility import VisibilityModel, visibility_model
from commission.progress import Progress, part, silent
from commission.site.project import Project
from commission.studies.coverage import free_floor

Number = int | float | None

COLD_START = 0.9
"""Share of the time that the floor takes; the rest goes to the routes."""


@dataclass(frozen=True, slots=True)
class RouteRisks:
    """Neighbors that mislead along one route."""

    route: str
    """Name of the route."""
    risks: tuple[NeighborRisk, ...]
    """Pairs of reflectors, the most probable first."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FloorAmbiguity:
    """Cold start over the floor."""

    lattice: Lattice
    """The N points of the floor that were looked at."""
    drivable: BoolArray
    """(N,) whether each lies on floor that the map knows to be free; the others have no figures."""
    share: FloatArray
    """(N,) share of the headings from which another pose sees the same, or too little is seen [0..1]; NaN off floor."""
    visible: IntArray
    """(N,) fewest reflectors visible in any heading; -1 off floor."""
    partners: FloatArray
    """(N, 3) a pose for which one at the point may be taken [m, m, rad]; NaN where there is none."""
    cold: ColdStart
    """The poses that were looked at, and the pairs of constellations."""

    @property
    def ambiguous(self) -> BoolArray:
        """(N,) whether any heading is ambiguous; false off floor."""
        return np.asarray(np.nan_to_num(self.share) > 0.0, dtype=np.bool_)

    @property
    def has_twin(self) -> BoolArray:
        """(N,) whether another pose sees the same as some heading; false off floor."""
        return np.isfinite(self.partners[:, 0])


@dataclass(frozen=True, slots=True, eq=False)
class SiteAmbiguity:
    """Cold start over the floor, and tracking along the routes."""

    floor: FloorAmbiguity
    """Where a vehicle that is switched on may take its place for another one."""
    routes: tuple[RouteRisks, ...]
    """Tracking along each route that was asked for."""


def floor_ambiguity(
    project: Project,
    model: VisibilityModel,
    lattice: Lattice,
    options: AmbiguityOptions,
    progress: Progress = silent,
) -> FloorAmbiguity:
    """Ask for every spot of the floor, heading by heading, whether another pose sees the same.

    Parameters
    ----------
    project : the site.
    model : what is visible there.
    lattice : the spots; those in a wall or on floor that the map does not know to be free get no figures.
    options : when two poses count as alike.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.
    """
    cold = cold_start(model, lattice, options, progress)
    drivable = free_floor(project, lattice.points())
    share, partners = np.full(len(lattice), np.nan), np.full((len(lattice), 3), np.nan)
    visible = np.full(len(lattice), -1, dtype=np.int64)
    # The poses are the points outside walls, heading by heading.
    points = np.flatnonzero(~model.caster.grid.is_occupied(lattice.points()))
    if len(points):
        share[points] = cold.ambiguous.reshape(-1, len(points)).mean(axis=0)
        visible[points] = cold.visible.reshape(-1, len(points)).min(axis=0)
        for of_heading in cold.partners.reshape(-1, len(points), 3):
            known = np.isfinite(of_heading[:, 0])
            partners[points[known]] = of_heading[known]
    share[~drivable], visible[~drivable], partners[~drivable] = np.nan, -1, np.nan
    return FloorAmbiguity(
        lattice=lattice,
        drivable=read_only(drivable),
        share=read_only(share),
        visible=read_only(visible),
        partners=read_only(partners),
        cold=cold,
    )


def ambiguity_of(
    project: Project,
    options: AmbiguityOptions | None = None,
    *,
    spacing: float = 0.5,
    routes: tuple[str, ...] | None = None,
    progress: Progress = silent,
) -> SiteAmbiguity:
    """Ask where a site is ambiguous.

    Parameters
    ----------
    project : the site.
    options : when two poses count as alike; the defaults when None.
    spacing : distance between neighboring points of the floor [m].
    routes : names of the routes that are tracked; all when None.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.

    Raises
    ------
    UsageError
        unknown route.
    """
    options = options or AmbiguityOptions()
    names = tuple(route.name for route in project.routes) if routes is None else routes
    model, lattice = visibility_model(project), lattice_of(project, spacing)
    floor = floor_ambiguity(project, model, lattice, options, part(progress, 0.0, COLD_START))
    tracked: list[RouteRisks] = []
    for number, name in enumerate(names):
        progress(COLD_START + (1.0 - COLD_START) * number / len(names), "neighbors")
        planned = plan_route(project, name, PredictionOptions(), model)
        tracked.append(RouteRisks(name, neighbor_risks(planned, predict_route(planned))))
    progress(1.0, "neighbors")
    return SiteAmbiguity(floor, tuple(tracked))


def both_ways(pairs: tuple[AmbiguousPair, ...]) -> tuple[AmbiguousPair, ...]:
    """Merge pairs of the same two groups, whichever is taken for the other; the most frequent come first."""
    merged: dict[frozenset[tuple[int, ...]], AmbiguousPair] = {}
    for pair in pairs:
        key = frozenset((pair.constellation, tuple(sorted(pair.image))))
        first = merged.get(key)
        merged[key] = pair if first is None else replace(first, poses=first.poses + pair.poses)
    return tuple(sorted(merged.values(), key=lambda pair: -pair.poses))


def summary(found: SiteAmbiguity) -> dict[str, Number | list[dict[str, str | Number]]]:
    """Entries of `summary.json`, by their keys; shares are of the drivable floor, None where it has no area."""
    floor, on = found.floor, found.floor.drivable
    area = floor.lattice.spacing**2
    return {
        "points": int(on.sum()),
        "spacing_m": floor.lattice.spacing,
        "area_m2": float(on.sum() * area),
        "ambiguous_area_m2": float(floor.ambiguous.sum() * area),
        "share_ambiguous": float(floor.ambiguous[on].mean()) if on.any() else None,
        "share_with_rival": float(floor.has_twin[on].mean()) if on.any() else None,
        "share_fewer_than_2_visible": float((floor.visible[on] < 2).mean()) if on.any() else None,
        "pairs": len(floor.cold.pairs),
        "routes": [
            {
                "route": each.route,
                "neighbors": len(each.risks),
                "worst_probability": max((risk.worst for risk in each.risks), default=0.0),
                "metres": len(metres_at_risk(each.risks)),
            }
            for each in found.routes
        ],
    }


def metres_at_risk(risks: tuple[NeighborRisk, ...]) -> IntArray:
    """Numbers of the metres of the way at which any neighbor lies inside a gate."""
    return np.unique(np.concatenate([np.empty(0), *(risk.metres for risk in risks)]).astype(np.int64))
