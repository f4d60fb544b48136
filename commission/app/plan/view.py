"""What the step Plan has found, as panels and layers draw it: frozen, newest wins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from commission.app.ambiguity.cold_start import Ambiguity
from commission.app.base.view import PageView
from commission.app.coverage.scale import Scale
from commission.app.placement.suggestion import Suggestion
from commission.app.plan.settings import Figure, Place
from commission.geometry.arrays import BoolArray, FloatArray
from commission.planning.coverage import Lattice
from commission.planning.dependence import Dependence
from commission.planning.route_prediction import PerMetre, RoutePrediction
from commission.planning.station_accuracy import StationAccuracy

Pose: TypeAlias = tuple[float, float, float]
"""x, y and heading of base, map frame [m, m, rad]."""


@dataclass(frozen=True, slots=True)
class Reading:
    """Values at one place of the floor."""

    place: tuple[float, float]
    """Where [m], map frame."""
    values: dict[Figure, float]
    """Every figure, SI."""
    on_floor: bool
    """Whether a vehicle could stand there."""


@dataclass(frozen=True, slots=True, eq=False)
class HeatView:
    """A heatmap."""

    lattice: Lattice
    """Its points."""
    scale: Scale
    """Its classes."""
    classes: NDArray[np.uint8]
    """(rows, columns) class of each point; row 0 is the lowest y."""
    shares: FloatArray
    """Share of the floor in each class, from `NO_FIX` on [0..1]."""
    outdated: bool
    """Whether the site has changed since, and it is being computed anew."""


@dataclass(frozen=True, slots=True, eq=False)
class EllipseView:
    """Ellipses of a fix."""

    centers: FloatArray
    """(N, 2) where [m], map frame."""
    covariances: FloatArray
    """(N, 2, 2) of the position [m^2]."""
    factor: float
    """At which they are drawn."""
    without_fix: int
    """Number of chosen points where there is no fix, and so no ellipse."""
    too_large: int
    """Number of those on the grid that would hide the others, and are not drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class RiskView:
    """A reflector that may be taken for a neighbor inside its gate."""

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


@dataclass(frozen=True, slots=True, eq=False)
class RouteView:
    """What is expected along a route."""

    name: str
    """Name of the route."""
    prediction: RoutePrediction
    """Scan by scan."""
    metres: PerMetre
    """The worst of each metre."""
    errors: FloatArray
    """(B, 3) largest 2-sigma of the true error of x [m], y [m] and heading [rad] in each metre."""
    loads: FloatArray
    """(B,) largest share of the supervisor's limit in each metre [1]."""
    risk: FloatArray
    """(B,) largest chance of a wrong association in each metre [0..0.5]."""
    risks: tuple[RiskView, ...]
    """Neighbors that may be taken for each other, the most probable first."""
    stations: tuple[StationAccuracy, ...]
    """Stations on the route, and whether what they require is met."""
    outdated: bool
    """Whether the site has changed since, and it is being predicted anew."""


@dataclass(frozen=True, slots=True, eq=False)
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


@dataclass(frozen=True, slots=True, eq=False)
class TwinsView:
    """One pair of look-alikes: two groups of reflectors, and two poses that see the same."""

    groups: tuple[FloatArray, FloatArray]
    """(n, 2) places of the reflectors of each group [m], in the same order."""
    poses: tuple[Pose, Pose]
    """A pose that sees the first group, and the one that sees the second alike [m, m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class ColdStartView:
    """Where a vehicle could take its place for another one."""

    ambiguity: Ambiguity
    """Map and pairs."""
    twins: TwinsView | None
    """The pair that is shown on the floor."""
    is_drawn: bool
    """Whether its map is: where a heatmap is, it is not."""
    outdated: bool
    """Whether the site or the tolerance has changed since."""


@dataclass(frozen=True, slots=True, eq=False)
class LayoutView:
    """A suggested layout."""

    suggestion: Suggestion
    """What was found."""
    outdated: bool
    """Whether the site has changed since."""
    wished_otherwise: bool
    """Whether something else is wished for by now."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanView:
    """Everything the step Plan has found so far."""

    heat: HeatView | None = None
    """The heatmap."""
    reading: Reading | None = None
    """Values at the place that was clicked."""
    ellipses: EllipseView | None = None
    """Ellipses on the heatmap."""
    route: RouteView | None = None
    """The prediction."""
    failures: FailureView | None = None
    """The ranking."""
    cold_start: ColdStartView | None = None
    """The ambiguous places."""
    layout: LayoutView | None = None
    """The suggested layout."""
    waiting: bool = False
    """Whether something is wanted that is not there yet."""


NOTHING = PlanView()


def plan_of(view: PageView) -> PlanView:
    """Return what the step Plan has found; nothing before its service has followed."""
    return view.part(PlanView) or NOTHING


def stretches(points: FloatArray, chosen: BoolArray) -> tuple[FloatArray, ...]:
    """Cut the chosen ones of (K, 2) points in a row into pieces without gaps."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    return tuple(points[start:end] for start, end in zip(edges[::2], edges[1::2], strict=True))
