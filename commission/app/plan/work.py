"""What the step Plan has computed in the background: from its settings to the inputs of studies and their results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.plan.settings import PlanSettings
from commission.geometry.arrays import BoolArray
from commission.planning import coverage as coverage_kernels
from commission.planning.coverage import LiveCoverage
from commission.planning.route_prediction import PredictionOptions
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part
from commission.site.project import Project
from commission.studies.coverage import CoverageInput, CoverageOptions, coverage
from commission.studies.drives import PlannedDrives
from commission.studies.failures import FailuresInput, FailuresResult, failures
from commission.studies.prediction import PredictionInput, PredictionResult, prediction

Predicted: TypeAlias = PredictionResult
Ranked: TypeAlias = FailuresResult


@dataclass(frozen=True, slots=True, eq=False)
class Covered:
    """A coverage that can be kept up to date."""

    live: LiveCoverage
    """The figures; whoever holds this result may move reflectors."""
    floor: BoolArray
    """(N,) where a vehicle could stand."""


def cover(project: Project, settings: PlanSettings, progress: Progress) -> Covered:
    """Compute the coverage of the floor, and keep what it takes to follow reflectors."""
    options = CoverageOptions(
        measurement=settings.measurement,
        heading=settings.heading,
        given_heading=settings.given_heading,
        on_odometry=settings.on_odometry,
        blocked_per_m=settings.blocked_per_m,
        visibility=_visibility(settings),
    )
    found = coverage(CoverageInput.of(project, options), part(progress, 0.0, 0.95))
    progress(0.95, "compiling moved reflectors")
    coverage_kernels.warm_up()
    return Covered(LiveCoverage(found.model, found.coverage), found.drivable)


def predict(project: Project, settings: PlanSettings, progress: Progress) -> PredictionResult:
    """Predict the localizer along the chosen route."""
    options = PredictionOptions(blocked_per_m=settings.blocked_per_m)
    return prediction(PredictionInput.of(project, settings.route, options, _visibility(settings)), progress)


def rank(
    project: Project, settings: PlanSettings, progress: Progress, known: PlannedDrives | None = None
) -> FailuresResult:
    """Let each reflector in turn fail on every route, beside those that have failed already.

    Parameters
    ----------
    project, settings : the site, and which failure.
    progress : told how far it is.
    known : drives that are at hand.
    """
    inputs = FailuresInput.of(
        project,
        settings.failure,
        settings.fallen,
        prediction=PredictionOptions(blocked_per_m=settings.blocked_per_m),
        visibility=_visibility(settings),
    )
    return failures(inputs, progress, known)


def _visibility(settings: PlanSettings) -> VisibilityOptions:
    return VisibilityOptions(min_beams=settings.min_beams)
