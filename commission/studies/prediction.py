"""How well a vehicle will localize along a route: what the filter will say, how far off it will be, what misleads it.

The figures themselves come from `planning`; files and pictures are elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

from commission.compiled import warm_up
from commission.planning.association_risk import NeighborRisk, neighbor_risks
from commission.planning.error_budget import PredictedErrors, predict_errors
from commission.planning.route_prediction import PlannedRoute, PredictionOptions, RoutePrediction, predict_route
from commission.planning.station_accuracy import StationAccuracy, station_accuracies
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part, silent
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.stations import Station
from commission.studies.drives import DrivesInput, PlannedDrives, plan_drives
from commission.studies.inputs import StudyInput
from commission.studies.kernels import DRIVES, ERRORS

COMPILING, PLANNING, PREDICTING, ERRING = 0.4, 0.6, 0.7, 0.9
"""Shares of the time until which kernels are compiled, the drive planned, the filter predicted, and its error."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PredictionInput(StudyInput):
    """What a prediction along one route depends on."""

    drives: DrivesInput
    """The site and the route."""
    stations: tuple[Station, ...]
    """Where the vehicle has to stand accurately."""

    @staticmethod
    def of(
        project: Project,
        route: str,
        options: PredictionOptions | None = None,
        visibility: VisibilityOptions | None = None,
    ) -> PredictionInput:
        """Take what the study reads from a project.

        Parameters
        ----------
        project : the site.
        route : name of the route.
        options : where the prediction starts, and what it expects of the hall; the defaults when None.
        visibility : what counts as visible; the defaults when None.

        Raises
        ------
        UsageError
            unknown route.
        """
        return PredictionInput(drives=DrivesInput.of(project, (route,), options, visibility), stations=project.stations)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PredictionResult:
    """A prediction along one route."""

    drives: PlannedDrives
    """The drive and what is seen on it."""
    prediction: RoutePrediction
    """What the filter will say, scan by scan."""
    errors: PredictedErrors
    """How far off it will be, scan by scan."""
    stations: tuple[StationAccuracy, ...]
    """The stations on the route."""
    risks: tuple[NeighborRisk, ...]
    """Neighbors that detections may be taken for, the most probable mistake first."""

    @property
    def planned(self) -> PlannedRoute:
        """The drive and what is seen on it."""
        return self.drives.planned[0]

    @property
    def reflectors(self) -> ReflectorMap:
        """The reflectors that were there."""
        return self.planned.reflectors

    @property
    def name(self) -> str:
        """Name of the route."""
        return self.planned.name


def prediction(inputs: PredictionInput, progress: Progress = silent) -> PredictionResult:
    """Predict the localizer along a route.

    Parameters
    ----------
    inputs : the site and the route.
    progress : told how far it is; may raise to cancel.
    """
    warm_up((*DRIVES, ERRORS), part(progress, 0.0, COMPILING))
    drives = plan_drives(inputs.drives, part(progress, COMPILING, PLANNING))
    (planned,) = drives.planned
    progress(PLANNING, "prediction")
    said = predict_route(planned)
    progress(PREDICTING, "error budget")
    errors = predict_errors(planned, said)
    progress(ERRING, "neighbors")
    stations = station_accuracies(said, errors, inputs.stations)
    return PredictionResult(
        drives=drives, prediction=said, errors=errors, stations=stations, risks=neighbor_risks(planned, said)
    )
