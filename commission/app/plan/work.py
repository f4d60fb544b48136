"""What the step Plan has computed in the background: plain values in, a result out, progress and cancel in between."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.plan.settings import PlanSettings
from commission.geometry.arrays import BoolArray
from commission.planning import coverage, dependence, route_prediction, true_error
from commission.planning.association_risk import NeighborRisk, neighbor_risks
from commission.planning.coverage import Lattice, LiveCoverage, lattice_of
from commission.planning.dependence import Dependence, FailureOptions
from commission.planning.dilution import FixOptions, fix_options, odometry_prior
from commission.planning.route_prediction import (
    Damage,
    PlannedRoute,
    PredictionOptions,
    RoutePrediction,
)
from commission.planning.station_accuracy import StationAccuracy, station_accuracies
from commission.planning.true_error import PredictedErrors, predict_errors
from commission.planning.visibility import VisibilityModel, VisibilityOptions, visibility_model
from commission.progress import Progress, part
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.studies.coverage import drivable

LONGEST_SIDE = 400
"""Points of the lattice along the longer side: as many as the floor has pixels on a small screen."""
FINEST = 0.1
"""Smallest distance between points [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Covered:
    """A coverage that can be kept up to date."""

    live: LiveCoverage
    """The figures; whoever holds this result may move reflectors."""
    floor: BoolArray
    """(N,) where a vehicle could stand."""


@dataclass(frozen=True, slots=True, eq=False)
class Predicted:
    """A prediction along one route."""

    name: str
    """Name of the route."""
    reflectors: ReflectorMap
    """The reflectors that were there."""
    prediction: RoutePrediction
    """What the filter will say, scan by scan."""
    errors: PredictedErrors
    """How far off it will be, scan by scan."""
    stations: tuple[StationAccuracy, ...]
    """The stations on it."""
    risks: tuple[NeighborRisk, ...]
    """Neighbors inside each other's gate, the most probable mistake first."""


@dataclass(frozen=True, slots=True, eq=False)
class Ranked:
    """Reflectors ranked by what depends on them."""

    reflectors: ReflectorMap
    """The reflectors that were ranked."""
    planned: tuple[PlannedRoute, ...]
    """The routes, in the order of each dependence's parts."""
    fallen: tuple[int, ...]
    """Indices of the reflectors that have failed before, in their order."""
    ranking: tuple[Dependence, ...]
    """The one on which most depends first."""


def fix_options_of(project: Project, settings: PlanSettings) -> FixOptions:
    """Return what a heatmap asks of each spot; the noise is what the project's localizer assumes."""
    speed = project.routes[0].speed if project.routes else 0.5
    position, heading = odometry_prior(project.parameters.odometry, settings.on_odometry, speed)
    return fix_options(
        project.parameters.observation,
        measurement=settings.measurement,
        heading=settings.heading,
        given_heading=settings.given_heading,
        blocked_per_m=settings.blocked_per_m,
        prior_position_sigma=max(position, 1e-6),
        prior_heading_sigma=max(heading, 1e-6),
    )


def spacing_of(project: Project) -> float:
    """Return the distance between the lattice's points [m]: a round one that keeps the picture small."""
    longest = max(_size(lattice_of(project, 1.0)))
    wanted = max(FINEST, longest / LONGEST_SIDE)
    return next((step for step in (0.1, 0.2, 0.25, 0.5, 1.0, 2.0) if step >= wanted), wanted)


def cover(project: Project, settings: PlanSettings, progress: Progress) -> Covered:
    """Compute the coverage of the floor, and keep what it takes to follow reflectors."""
    progress(0.0, "compiling")
    coverage.warm_up()
    progress(0.05, "sight of each reflector")
    model = _model(project, settings)
    lattice = lattice_of(project, spacing_of(project))
    live = LiveCoverage(model, lattice, fix_options_of(project, settings), part(progress, 0.3, 0.95))
    progress(0.95, "floor")
    return Covered(live, drivable(project, live.coverage))


def predict(project: Project, settings: PlanSettings, progress: Progress) -> Predicted:
    """Predict the localizer along the chosen route."""
    progress(0.0, "compiling")
    true_error.warm_up()
    progress(0.2, "sight of each reflector")
    options = PredictionOptions(blocked_per_m=settings.blocked_per_m)
    model = _model(project, settings)
    progress(0.5, "route")
    planned = route_prediction.plan_route(project, settings.route, options, model)
    prediction = route_prediction.predict_route(planned)
    progress(0.7, "true error")
    errors = predict_errors(planned, prediction)
    progress(0.9, "neighbors")
    return Predicted(
        settings.route,
        project.reflectors,
        prediction,
        errors,
        station_accuracies(prediction, errors, project.stations),
        neighbor_risks(planned, prediction),
    )


def rank(
    project: Project, settings: PlanSettings, progress: Progress, planned: tuple[PlannedRoute, ...] | None = None
) -> Ranked:
    """Let each reflector in turn fail on every route, beside those that have failed already.

    Parameters
    ----------
    project, settings : the site, and which failure.
    progress : told how far it is.
    planned : the routes of this very site, where they are at hand.
    """
    progress(0.0, "compiling")
    route_prediction.warm_up()
    planned = planned or _planned(project, settings, part(progress, 0.05, 0.3))
    names = [reflector.id for reflector in project.reflectors.reflectors]
    blocked = tuple(names.index(name) for name in settings.fallen if name in names)
    options = FailureOptions(settings.failure, given=Damage(blocked=blocked))
    ranking = dependence.dependences(planned, options, part(progress, 0.3, 1.0))
    return Ranked(project.reflectors, planned, blocked, ranking)


def _planned(project: Project, settings: PlanSettings, progress: Progress) -> tuple[PlannedRoute, ...]:
    """Plan all routes of a site."""
    progress(0.0, "sight of each reflector")
    options = PredictionOptions(blocked_per_m=settings.blocked_per_m)
    model = _model(project, settings)
    planned: list[PlannedRoute] = []
    for number, route in enumerate(project.routes):
        progress(0.2 + 0.8 * number / len(project.routes), "routes")
        planned.append(route_prediction.plan_route(project, route.name, options, model))
    return tuple(planned)


def _model(project: Project, settings: PlanSettings) -> VisibilityModel:
    return visibility_model(project, VisibilityOptions(min_beams=settings.min_beams))


def _size(lattice: Lattice) -> tuple[float, float]:
    return lattice.columns * lattice.spacing, lattice.rows * lattice.spacing
