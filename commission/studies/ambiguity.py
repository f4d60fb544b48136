"""Ambiguity of a site: where on the floor a cold start may go wrong, and where on the routes a neighbor misleads.

The figures themselves come from `planning`; files and images are elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from commission.compiled import warm_up
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.planning.ambiguity import AmbiguityOptions, AmbiguousPair, ColdStart, cold_start
from commission.planning.association_risk import NeighborRisk, neighbor_risks
from commission.planning.coverage import Lattice, lattice_of
from commission.planning.route_prediction import predict_route
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.studies.coverage import free_floor
from commission.studies.drives import DrivesInput, plan_drives
from commission.studies.inputs import StudyInput
from commission.studies.kernels import DRIVES, SIGHT

Number = int | float | None

COMPILING, PREPARING, PLANNING = 0.1, 0.15, 0.5
"""Shares of the time until which kernels are compiled, walls and reflectors prepared, and drives planned."""
SPACINGS = (0.25, 0.5, 1.0, 2.0)
"""Distances between points where they are not chosen [m]: the first that keeps their number."""
MOST_POINTS = 8000
"""Points then, of the floor and its surroundings together: the time is about proportional to them."""


@dataclass(frozen=True, slots=True)
class RouteRisks:
    """Neighbors that mislead along one route."""

    route: str
    """Name of the route."""
    risks: tuple[NeighborRisk, ...]
    """Pairs of reflectors, the most probable first."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AmbiguityResult:
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

    floor: AmbiguityResult
    """Where a vehicle that is switched on may take its place for another one."""
    routes: tuple[RouteRisks, ...]
    """Tracking along each route that was asked for."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AmbiguityInput(StudyInput):
    """What the ambiguous places of a floor depend on."""

    reflectors: ReflectorMap
    """The reflector map."""
    floor_map: FloorMap | None
    """Walls and free floor."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    routes: tuple[Route, ...]
    """Planned routes, where there is no map: they say how far the floor reaches. Else none."""
    options: AmbiguityOptions
    """When two poses count as alike."""
    visibility: VisibilityOptions
    """What counts as visible."""
    spacing: float | None
    """Distance between neighboring points [m]. None: as fine as the number of points allows."""

    @staticmethod
    def of(
        project: Project,
        options: AmbiguityOptions | None = None,
        *,
        visibility: VisibilityOptions | None = None,
        spacing: float | None = None,
    ) -> AmbiguityInput:
        """Take what the study reads from a project.

        Parameters
        ----------
        project : the site.
        options : when two poses count as alike; the defaults when None.
        visibility : what counts as visible; the defaults when None.
        spacing : distance between neighboring points [m]; None: as fine as the number of points allows.
        """
        return AmbiguityInput(
            reflectors=project.reflectors,
            floor_map=project.floor_map,
            scanners=project.scanners,
            routes=project.routes if project.floor_map is None else (),
            options=options or AmbiguityOptions(),
            visibility=replace(visibility or VisibilityOptions(), detector=project.parameters.detector),
            spacing=spacing,
        )

    def lattice(self) -> Lattice:
        """The points that are looked at."""
        if self.spacing is not None:
            return lattice_of(self, self.spacing)
        lattices = (lattice_of(self, spacing) for spacing in SPACINGS)
        return next((lattice for lattice in lattices if len(lattice) <= MOST_POINTS), lattice_of(self, SPACINGS[-1]))


def ambiguity(inputs: AmbiguityInput, progress: Progress = silent) -> AmbiguityResult:
    """Ask for every spot of the floor, heading by heading, whether another pose sees the same.

    Spots in a wall, or on floor that the map does not know to be free, get no figures.

    Parameters
    ----------
    inputs : the site, and when two poses count as alike.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    ValueError
        the spacing is not above 0.
    """
    lattice = inputs.lattice()
    warm_up((SIGHT,), part(progress, 0.0, COMPILING))
    progress(COMPILING, "sight of each reflector")
    seen = vehicle_visibility(inputs, inputs.visibility)
    cold = cold_start(seen, lattice, inputs.options, part(progress, PREPARING, 1.0))
    drivable = free_floor(inputs, lattice.points())
    share, partners = np.full(len(lattice), np.nan), np.full((len(lattice), 3), np.nan)
    visible = np.full(len(lattice), -1, dtype=np.int64)
    # The poses are the points outside walls, heading by heading.
    points = np.flatnonzero(~seen.caster.grid.is_occupied(lattice.points()))
    if len(points):
        share[points] = cold.ambiguous.reshape(-1, len(points)).mean(axis=0)
        visible[points] = cold.visible.reshape(-1, len(points)).min(axis=0)
        for of_heading in cold.partners.reshape(-1, len(points), 3):
            known = np.isfinite(of_heading[:, 0])
            partners[points[known]] = of_heading[known]
    share[~drivable], visible[~drivable], partners[~drivable] = np.nan, -1, np.nan
    return AmbiguityResult(
        lattice=lattice,
        drivable=read_only(drivable),
        share=read_only(share),
        visible=read_only(visible),
        partners=read_only(partners),
        cold=cold,
    )


def misleading_neighbors(inputs: DrivesInput, progress: Progress = silent) -> tuple[RouteRisks, ...]:
    """Find along each route the neighbors that detections may be taken for.

    Parameters
    ----------
    inputs : the site and the routes.
    progress : told how far it is; may raise to cancel.
    """
    warm_up(DRIVES, part(progress, 0.0, COMPILING))
    drives = plan_drives(inputs, part(progress, COMPILING, PLANNING))
    tracked: list[RouteRisks] = []
    for number, planned in enumerate(drives.planned):
        progress(PLANNING + (1.0 - PLANNING) * number / len(drives.planned), "neighbors")
        tracked.append(RouteRisks(planned.name, neighbor_risks(planned, predict_route(planned))))
    progress(1.0, "neighbors")
    return tuple(tracked)


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
    """Numbers of the metres of the way at which a detection may be taken for any neighbor."""
    return np.unique(np.concatenate([np.empty(0), *(risk.metres for risk in risks)]).astype(np.int64))
