"""What a layout of reflectors comes to, so that two of them can be held against each other: figures and the floor.

Each layout is a study of its own: of two that are compared, only the one that has changed is computed anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from commission.compiled import warm_up
from commission.errors import UsageError
from commission.geometry.arrays import BoolArray, FloatArray, read_only
from commission.planning.coverage import Lattice
from commission.planning.layout_figures import LayoutFigures, layout_figures
from commission.planning.route_prediction import PredictionOptions
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route, route_named
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import Vehicle
from commission.site.zones import Zone
from commission.studies.ambiguity import AmbiguityInput, ambiguity
from commission.studies.coverage import CoverageInput, CoverageOptions, CoverageResult, coverage
from commission.studies.inputs import StudyInput
from commission.studies.kernels import DRIVES, ERRORS, INFORMATION, SHARES

COMPILING, COVERED, FIGURED = 0.1, 0.2, 0.7
"""Shares of the time until which kernels are compiled, the floor is covered, and the figures are known."""


class FloorFigure(StrEnum):
    """What of two floors is compared; the names are those of `planning.dilution.Fixes`."""

    POSITION_SIGMA = "position_sigma"
    HEADING_SIGMA = "heading_sigma"
    VISIBLE = "visible"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LayoutInput(StudyInput):
    """What the figures of one layout depend on."""

    reflectors: ReflectorMap
    """The layout."""
    floor_map: FloorMap | None
    """Walls and free floor."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    vehicle: Vehicle
    """Wheels and outline."""
    parameters: Parameters
    """Tunables of the localizer."""
    uncertainty: Uncertainty
    """How well the constants of the site and the vehicle are known."""
    zones: tuple[Zone, ...]
    """Where which kinds of observation correct the pose."""
    routes: tuple[Route, ...]
    """The routes that count."""
    stations: tuple[Station, ...]
    """Where the vehicle has to stand accurately."""
    prediction: PredictionOptions
    """Where a prediction starts, and what it expects of the hall."""
    floor: CoverageInput
    """What is asked of every point of the floor."""
    starts: AmbiguityInput
    """What is asked of a vehicle that is switched on."""

    @staticmethod
    def of(
        project: Project,
        reflectors: ReflectorMap | None = None,
        prediction: PredictionOptions | None = None,
        visibility: VisibilityOptions | None = None,
    ) -> LayoutInput:
        """Take what the study reads from a project.

        Parameters
        ----------
        project : the site.
        reflectors : the layout; the project's own when None.
        prediction : where a prediction starts, and what it expects of the hall; the defaults when None.
        visibility : what counts as visible; the defaults when None.
        """
        prediction, visibility = prediction or PredictionOptions(), visibility or VisibilityOptions()
        site = project if reflectors is None else replace(project, reflectors=reflectors)
        options = CoverageOptions(blocked_per_m=prediction.blocked_per_m, visibility=visibility)
        return LayoutInput(
            reflectors=site.reflectors,
            floor_map=site.floor_map,
            scanners=site.scanners,
            vehicle=site.vehicle,
            parameters=site.parameters,
            uncertainty=site.uncertainty,
            zones=site.zones,
            routes=tuple(map(site.route, site.layout.counted(site.routes))),
            stations=site.stations,
            prediction=prediction,
            floor=CoverageInput.of(site, options),
            starts=AmbiguityInput.of(site, visibility=visibility),
        )

    def route(self, name: str) -> Route:
        """Return the route of that name; raises UsageError that lists the names there are."""
        return route_named(self.routes, name)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LayoutResult:
    """What one layout comes to."""

    inputs: LayoutInput
    """The layout and its site."""
    figures: LayoutFigures
    """Along the routes, at the stations, with failures."""
    floor: CoverageResult
    """Visibility and a fix at every point of the floor."""
    ambiguous_area: float
    """Floor on which a vehicle that is switched on may not know its place [m^2]; NaN without a floor map, for then the
    reflectors themselves say how far the floor reaches."""


def layout(inputs: LayoutInput, progress: Progress = silent) -> LayoutResult:
    """Find out what a layout comes to.

    Parameters
    ----------
    inputs : the layout and its site.
    progress : told how far it is; may raise to cancel.
    """
    warm_up((*DRIVES, ERRORS, INFORMATION, SHARES), part(progress, 0.0, COMPILING))
    floor = coverage(inputs.floor, part(progress, COMPILING, COVERED))
    names = tuple(route.name for route in inputs.routes)
    figures = layout_figures(
        inputs,
        inputs.reflectors,
        names,
        inputs.prediction,
        part(progress, COVERED, FIGURED),
        visibility=inputs.floor.visibility,
    )
    area = math.nan
    if inputs.floor_map is not None:
        cold = ambiguity(inputs.starts, part(progress, FIGURED, 1.0))
        area = float(np.count_nonzero(cold.ambiguous)) * cold.lattice.spacing**2
    return LayoutResult(inputs=inputs, figures=figures, floor=floor, ambiguous_area=area)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FloorDifference:
    """How much better a fix is with one layout than with another one, at each of N points of the floor."""

    lattice: Lattice
    """The points."""
    figure: FloorFigure
    """What is compared."""
    gains: FloatArray
    """(N,) how much better it is, SI: by how much smaller a sigma, by how many more reflectors are visible; NaN where
    one of the two has no fix, and beside the floor."""
    gained: BoolArray
    """(N,) whether there is a fix only with the one layout."""
    lost: BoolArray
    """(N,) whether there is a fix only with the other one."""
    neither: BoolArray
    """(N,) whether there is floor, and a fix with none of the two."""


def floor_difference(one: LayoutResult, other: LayoutResult, figure: FloorFigure) -> FloorDifference:
    """Hold a layout against another one, point by point.

    Parameters
    ----------
    one : the layout that is judged.
    other : what it is compared with.
    figure : what is compared.

    Raises
    ------
    UsageError
        without a floor map, where the two floors do not reach equally far.
    """
    lattice = one.floor.coverage.lattice
    if other.floor.coverage.lattice != lattice:
        raise UsageError("without a floor map the two layouts reach over different floors; expected a floor map")
    on = one.floor.drivable & other.floor.drivable
    mine, theirs = (np.asarray(getattr(r.floor.coverage.fixes, figure), dtype=np.float64) for r in (one, other))
    more_is_better = figure is FloorFigure.VISIBLE
    fixed, was_fixed = ((values > 0.0) if more_is_better else np.isfinite(values) for values in (mine, theirs))
    both = on & fixed & was_fixed
    gains = np.full(len(lattice), np.nan)
    gains[both] = (mine[both] - theirs[both]) * (1.0 if more_is_better else -1.0)
    return FloorDifference(
        lattice=lattice,
        figure=figure,
        gains=read_only(gains),
        gained=read_only(on & fixed & ~was_fixed),
        lost=read_only(on & was_fixed & ~fixed),
        neither=read_only(on & ~fixed & ~was_fixed),
    )
