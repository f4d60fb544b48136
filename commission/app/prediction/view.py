"""What is expected along a route, as panels and layers draw it: frozen, newest wins. Without a prediction, none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.planning.association_risk import NeighborRisk
from commission.planning.route_prediction import PerMetre, RoutePrediction
from commission.planning.station_accuracy import StationAccuracy
from commission.site.parameters import HELD_LEVEL
from commission.studies.kinds_prediction import KindsPrediction
from commission.studies.prediction import PredictionResult

Place: TypeAlias = tuple[float, float]
"""A place on the floor [m, m], map frame."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RiskView:
    """A reflector that may be taken for a neighbor."""

    reflector: str
    """Id of the one that is detected."""
    neighbor: str
    """Id of the one that it may be taken for."""
    chance: float
    """Largest probability that a detection fits the neighbor better [0..0.5]."""
    metres: tuple[int, ...]
    """Metres of the way where they are that near to each other."""
    points: FloatArray
    """(N, 2) where the vehicle is then [m]."""
    worst: Place
    """Where the vehicle is when it is most probable [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RouteView:
    """What is expected along a route."""

    name: str
    """Name of the route."""
    prediction: RoutePrediction
    """Scan by scan."""
    metres: PerMetre
    """The worst of each metre."""
    errors: FloatArray
    """(B, 2) largest 2-sigma of the error to be expected of position [m] and heading [rad] in each metre."""
    position_shares: FloatArray
    """(B, 5) share of each of `CONTRIBUTIONS` in the square of that of the position [0..1]."""
    heading_shares: FloatArray
    """(B, 5) the same of the heading."""
    alone: FloatArray
    """(B, 5) largest 2-sigma of the position that each of `CONTRIBUTIONS` alone has in each metre [m]."""
    limit_shares: FloatArray
    """(B,) largest share of the supervisor's limit in each metre [1]."""
    risk: FloatArray
    """(B,) largest chance of a wrong association in each metre [0..0.5]."""
    risks: tuple[RiskView, ...]
    """Neighbors that may be taken for each other, the most probable first."""
    stations: tuple[StationAccuracy, ...]
    """Stations on the route, and whether what they require is met."""
    way_without_reflectors: float
    """Way on which zones leave reflectors out [m]."""
    by_two_sigma: bool
    """Whether 2-sigma is predicted though the supervisor holds the protection level."""
    outdated: bool
    """Whether the site has changed since, and it is being predicted anew."""
    driven: KindsPrediction | None = None
    """What is expected by every kind; none where there is none beside ranges of reflectors, or not yet."""


def route_view(predicted: PredictionResult, driven: KindsPrediction | None = None, *, outdated: bool) -> RouteView:
    """Gather the worst of each metre.

    Parameters
    ----------
    predicted : what is expected, scan by scan.
    driven : what is expected by every kind, where that is known.
    outdated : whether the site has changed since.
    """
    prediction = predicted.prediction
    metres = prediction.per_metre()
    chances = np.zeros(len(prediction.drive))
    for risk in predicted.risks:
        chances[risk.scans] = np.maximum(chances[risk.scans], risk.probability)
    (position, position_shares), (heading, heading_shares) = (
        predicted.errors.position_per_metre(metres),
        predicted.errors.heading_per_metre(metres),
    )
    return RouteView(
        name=predicted.name,
        prediction=prediction,
        metres=metres,
        errors=np.column_stack((position, heading)),
        position_shares=position_shares,
        heading_shares=heading_shares,
        alone=predicted.errors.parts_per_metre(metres),
        limit_shares=np.maximum.reduceat(prediction.limit_share, metres.first),
        risk=np.maximum.reduceat(chances, metres.first),
        risks=tuple(_risk_view(predicted, risk) for risk in predicted.risks),
        stations=predicted.stations,
        way_without_reflectors=predicted.planned.way_without_reflectors,
        by_two_sigma=prediction.limits.held == HELD_LEVEL,
        outdated=outdated,
        driven=driven,
    )


def _risk_view(predicted: PredictionResult, risk: NeighborRisk) -> RiskView:
    """Name two neighbors, and the places from which one may be taken for the other."""
    reflectors, poses = predicted.reflectors.reflectors, predicted.prediction.drive.poses
    worst = poses[risk.scans[int(np.argmax(risk.probability))]]
    return RiskView(
        reflector=reflectors[risk.reflector].id,
        neighbor=reflectors[risk.neighbor].id,
        chance=risk.worst,
        metres=tuple(np.unique(risk.metres.astype(np.int64)).tolist()),
        points=poses[risk.scans, :2],
        worst=(float(worst[0]), float(worst[1])),
    )
