"""How accurately the vehicle stands at the stations of a route, against what each of them requires."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from commission.planning.error_budget import PredictedErrors
from commission.planning.route_prediction import RoutePrediction, station_scans
from commission.site.stations import Station


@dataclass(frozen=True, slots=True, kw_only=True)
class StationAccuracy:
    """What is predicted at a station."""

    station: str
    """Name of the station."""
    metre: float
    """Way driven until there [m]."""
    two_sigma: float
    """Largest 2-sigma of x or y that the filter says while there [m]."""
    error: float
    """Largest 2-sigma of the error of x or y to be expected while there [m]."""
    parts: tuple[float, ...]
    """2-sigma that each of `CONTRIBUTIONS` has in it [m]: their squares add up to that of `error`."""
    required: float
    """Largest 2-sigma that the station allows [m]."""

    @property
    def expected(self) -> float:
        """The larger one of what the filter says and of its error [m]."""
        return max(self.two_sigma, self.error)

    @property
    def is_met(self) -> bool:
        """Whether both keep to what is required."""
        return self.expected <= self.required


def station_accuracies(
    prediction: RoutePrediction, errors: PredictedErrors, stations: Sequence[Station]
) -> tuple[StationAccuracy, ...]:
    """Compare what is predicted with what each station on the route requires.

    Parameters
    ----------
    prediction, errors : along a route.
    stations : of the project; those beside the route are left out.
    """
    found: list[StationAccuracy] = []
    for station, scans in station_scans(prediction.drive, stations):
        error = errors.two_sigma[scans, :2]
        worst, axis = np.unravel_index(int(error.argmax()), error.shape)
        found.append(
            StationAccuracy(
                station=station.name,
                metre=float(prediction.drive.metres[scans[0]]),
                two_sigma=float(prediction.two_sigma[scans, :2].max()),
                error=float(error[worst, axis]),
                parts=tuple((2.0 * np.sqrt(errors.parts[scans[worst], :, axis, axis])).tolist()),
                required=station.required_accuracy,
            )
        )
    return tuple(found)
