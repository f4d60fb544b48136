"""Prediction along a route: the filter's own covariance recursion over the planned drive, with nothing drawn at random.

The steps are those of `localization`, fed with the exact motion and exact measurements. With all reflectors as in the
map the predicted mean stays on the route; a moved reflector pulls it off, by the bias that it would cause.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.geometry.angles import difference
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.gaussian import chi_square_gate
from commission.localization.consider import PER_REFLECTOR, PER_SCANNER
from commission.localization.cross_covariance import survey_variance
from commission.localization.estimate import Belief, Mode
from commission.localization.observation import observation_model, observation_rows
from commission.localization.odometry import odometry_noise
from commission.localization.pose_gaussian import from_belief
from commission.localization.setup import consider_model
from commission.localization.supervisor import position_two_sigma, supervisor_limits
from commission.localization.zones import counts_at
from commission.planning.detection_noise import DetectionQuality, detection_quality
from commission.planning.detection_order import farthest_first
from commission.planning.nominal_drive import DrivePlan, NominalDrive, nominal_drive
from commission.planning.prediction_kernels import PredictionColumns, PredictionModel, predict_covariances
from commission.planning.visibility import VisibilityModel, VisibleReflectors, seen_in_turn, visibility_models
from commission.site.checks import above, between
from commission.site.parameters import Parameters, SupervisorParameters
from commission.site.parts import Driven
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.uncertainty import Uncertainty
from commission.site.zones import ObservationKind

AT_STATION = 0.2
"""Distance within which the vehicle is at a station [m]."""
FACING_STATION = math.radians(30.0)
"""Difference of heading within which it is [rad]; a route may pass the same place another way round."""


@dataclass(frozen=True, slots=True)
class PredictionOptions:
    """Where the prediction starts, and what it expects of the hall."""

    start_sigmas: tuple[float, float, float] = (0.02, 0.02, 0.01)
    """1-sigma of the start pose: x [m], y [m], heading [rad], map frame."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""
    dirty_range: float = 0.5
    """Share of its range up to which a dirty reflector is still seen [0..1]."""
    plan: DrivePlan = field(default_factory=DrivePlan)
    """Rests and limits of the drive."""

    def __post_init__(self) -> None:
        for sigma in self.start_sigmas:
            above(sigma, 0.0, "prediction.start_sigmas")
        between(self.blocked_per_m, (0.0, 1.0), "prediction.blocked_per_m", "per metre")
        between(self.dirty_range, (0.0, 1.0), "prediction.dirty_range")


@dataclass(frozen=True, slots=True)
class Damage:
    """What is wrong with reflectors while the map still says otherwise. Reflectors are indices into the map."""

    blocked: tuple[int, ...] = ()
    """Reflectors that nothing sees."""
    dirty: tuple[int, ...] = ()
    """Reflectors that are seen from near by only."""
    moved: tuple[tuple[int, float, float], ...] = ()
    """Reflectors that stand elsewhere, each with its displacement in x and y [m]."""


NO_DAMAGE = Damage()


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlannedRoute:
    """A planned drive and what it sees: all that a prediction needs, whatever reflectors fail."""

    name: str
    """Name of the route."""
    drive: NominalDrive
    """The K scans."""
    visible: VisibleReflectors
    """Reflectors visible at each scan, the farthest first."""
    places: FloatArray
    """(M, 4) x, y [m], map frame, of each reflector; variance of its place as the filter has it, and as it is [m^2]."""
    farthest: FloatArray
    """(M,) largest distance from which each reflector is seen by any scanner [m]."""
    reflectors: ReflectorMap
    """The M reflectors."""
    scanners: tuple[Scanner, ...]
    """Mounting, and noise of their beams."""
    parameters: Parameters
    """Tunables of the localizer."""
    uncertainty: Uncertainty
    """How well the constants of the site and the vehicle are known."""
    options: PredictionOptions
    """Start and hall."""
    without_reflectors: BoolArray
    """(K,) whether reflectors correct nothing at a scan, because a zone leaves them out: none is visible there."""
    quality: DetectionQuality
    """How likely each reflector is detected, and what its detections are worth."""

    @property
    def way_without_reflectors(self) -> float:
        """Way on which zones leave reflectors out, so that odometry alone is reckoned with [m]."""
        return float(np.diff(self.drive.metres, prepend=self.drive.metres[0])[self.without_reflectors].sum())

    def sees(self) -> BoolArray:
        """Whether each of the M reflectors is seen at each scan, by it or the newest of another scanner: (K, M)."""
        alone = self.visible.incidence(len(self.reflectors))
        if len(self.scanners) == 1:
            return alone
        together = np.zeros_like(alone)
        for scanner in range(len(self.scanners)):
            rows = np.flatnonzero(self.drive.scanners == scanner)
            # Before its first scan, that one: the vehicle rests.
            newest = np.maximum(np.searchsorted(rows, np.arange(len(alone)), side="right") - 1, 0)
            together |= alone[rows[newest]]
        return together

    def model(self) -> PredictionModel:
        """Numbers of the recursion."""
        association = self.parameters.association
        # The range bias is left out: measurements here are without it, and the filter takes it off.
        unbiased = replace(self.parameters.observation, range_bias=0.0)
        return PredictionModel(
            odometry_noise(self.parameters.odometry),
            observation_rows([observation_model(scanner, unbiased) for scanner in self.scanners]),
            supervisor_limits(self.parameters.supervisor),
            chi_square_gate(association.gate_probability, 2) if association.enabled else math.inf,
            association.gate_probability if association.enabled else 1.0,
            1.0 - self.options.blocked_per_m,
            self.quality.noise,
            self.quality.classes,
            consider_model(self.uncertainty),
        )

    def constants(self) -> tuple[FloatArray | None, IntArray]:
        """(3, 2 B + 5 S) zeros for the covariance with what the filter considers, and (M,) the columns of reflectors.

        Only the B reflectors that are seen have columns; None where nothing is considered.
        """
        blocks = np.zeros(len(self.places), dtype=np.int64)
        seen = np.unique(self.visible.indices)
        blocks[seen] = np.arange(len(seen))
        if not self.parameters.filter.consider:
            return None, blocks
        return np.zeros((3, PER_REFLECTOR * len(seen) + PER_SCANNER * len(self.scanners))), blocks


class PerMetre(NamedTuple):
    """The worst of each metre of a route; B bins of one metre, the last one maybe shorter."""

    metre: IntArray
    """(B,) number of the metre: from `metre` to `metre + 1` m of the way."""
    first: IntArray
    """(B,) first scan of each metre."""
    two_sigma: FloatArray
    """(B, 3) largest 2-sigma of x [m], y [m] and heading [rad]."""
    bias: FloatArray
    """(B, 3) largest absolute bias of x [m], y [m] and heading [rad]."""
    seen: IntArray
    """(B,) fewest visible reflectors."""
    on_odometry: FloatArray
    """(B,) longest way driven on odometry alone [m]."""
    fails: BoolArray
    """(B,) whether the supervisor is in fail mode anywhere in it."""
    position: FloatArray
    """(B,) largest 2-sigma of the position, as the supervisor takes it [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RoutePrediction:
    """Expected course of the localizer along a route, after each of K scans. All arrays are read-only."""

    drive: NominalDrive
    """The planned drive."""
    limits: SupervisorParameters
    """Limits of 2-sigma."""
    prior_covariances: FloatArray
    """(K, 3, 3) before the detections of each scan, of x [m], y [m] and heading [rad]."""
    means: FloatArray
    """(K, 3) expected `T_map_base` [m, m, rad]: the drive's own pose unless a reflector has moved."""
    covariances: FloatArray
    """(K, 3, 3) of x [m], y [m] and heading [rad]: what the filter will say. How far off it will be is in
    `error_budget`."""
    modes: NDArray[np.int8]
    """(K,) a `Mode` each."""
    seen: IntArray
    """(K,) reflectors in sight that are detected in at least half of all scans, and inside the gate."""
    on_odometry: FloatArray
    """(K,) way driven since a reflector was seen last [m]."""
    innovations: FloatArray
    """(N, 3) covariance S of the innovation of every visible reflector, in the order of `PlannedRoute.visible`: S_rr,
    w = S_rb / S_rr, S_bb - w S_rb. With what the filter considers."""

    @property
    def two_sigma(self) -> FloatArray:
        """(K, 3) 2-sigma of x [m], y [m] and heading [rad]."""
        return 2.0 * np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))

    @property
    def position_two_sigma(self) -> FloatArray:
        """(K,) 2-sigma of the position that the supervisor holds against its limit [m]."""
        return position_two_sigma(self.covariances, self.limits)

    @property
    def bias(self) -> FloatArray:
        """(K, 3) expected error of x [m], y [m] and heading [rad]."""
        deviations = self.means - self.drive.poses
        deviations[:, 2] = difference(self.means[:, 2], self.drive.poses[:, 2])
        return deviations

    @property
    def limit_share(self) -> FloatArray:
        """(K,) bias and 2-sigma together as a share of the supervisor's limit, where that is largest [1].

        Of the position by axes: along the worse axis. By the largest in any direction: as if the bias lay along it.
        """
        bias, two_sigma = np.abs(self.bias), self.two_sigma
        by_axes = self.limits.position_sigma == "axes"
        together = (bias + two_sigma)[:, :2].max(axis=1)
        position = together if by_axes else np.hypot(bias[:, 0], bias[:, 1]) + self.position_two_sigma
        heading = bias[:, 2] + two_sigma[:, 2]
        return np.maximum(position / self.limits.position_limit, heading / self.limits.heading_limit)

    def over_limit(self) -> BoolArray:
        """(K,) whether the share of the limit is above 1, or the supervisor is in fail mode."""
        return (self.limit_share > 1.0) | (self.modes == Mode.FAIL)

    def trips(self) -> FloatArray:
        """Metres of the way at which the supervisor stops the vehicle [m]."""
        return self._changes_to(Mode.FAIL)

    def recoveries(self) -> FloatArray:
        """Metres of the way at which the vehicle may drive again [m]."""
        return self._changes_to(Mode.OPERATIONAL)

    def failing_metres(self) -> IntArray:
        """Numbers of the metres of the way in which `over_limit` holds anywhere."""
        return np.unique(self.drive.metres[self.over_limit()].astype(np.int64))

    def per_metre(self) -> PerMetre:
        """Gather the worst of each metre."""
        metre, first = np.unique(self.drive.metres.astype(np.int64), return_index=True)
        largest = np.maximum.reduceat
        return PerMetre(
            metre,
            first,
            largest(self.two_sigma, first, axis=0),
            largest(np.abs(self.bias), first, axis=0),
            np.minimum.reduceat(self.seen, first),
            largest(self.on_odometry, first),
            largest(self.modes == Mode.FAIL, first),
            largest(self.position_two_sigma, first),
        )

    def _changes_to(self, mode: Mode) -> FloatArray:
        before = np.concatenate(([int(Mode.OPERATIONAL)], self.modes[:-1]))
        return self.drive.metres[(self.modes == mode) & (before != mode)]


def plan_route(
    site: Driven,
    route_name: str,
    options: PredictionOptions | None = None,
    models: Sequence[VisibilityModel] | None = None,
) -> PlannedRoute:
    """Plan a drive and find what it sees and may use: where a zone leaves reflectors out, it is as if none were there.

    Parameters
    ----------
    site : a project, or what of it says how a vehicle drives and what it sees.
    route_name : which route.
    options : start and hall; the defaults when None.
    models : of the scanners of the same site, when they are at hand; made here when None.

    Raises
    ------
    UsageError
        unknown route.
    """
    options = options or PredictionOptions()
    models = models or visibility_models(site)
    drive, model = nominal_drive(site.route(route_name), site.vehicle, site.scanners, options.plan), models[0]
    reflectors = model.reflectors
    counts = counts_at(site.zones, ObservationKind.REFLECTORS, drive.poses[:, :2])
    seen = _seen_at(seen_in_turn(models, drive.poses, drive.scanners), counts)
    surveyed = np.array([survey_variance(each, site.uncertainty) for each in reflectors.reflectors])
    own = np.array([each.sigma**2 + each.radius_sigma**2 for each in reflectors.reflectors])
    believed = surveyed if site.parameters.filter.consider else own
    places = np.column_stack((reflectors.centers, believed, surveyed))
    return PlannedRoute(
        name=route_name,
        drive=drive,
        visible=farthest_first(seen, reflectors.centers, drive.poses, (site.scanners, drive.scanners)),
        places=read_only(places),
        farthest=read_only(np.max([each.targets.farthest for each in models], axis=0)),
        reflectors=model.reflectors,
        scanners=site.scanners,
        parameters=site.parameters,
        uncertainty=site.uncertainty,
        options=options,
        without_reflectors=read_only(~counts),
        quality=detection_quality(model.reflectors, site.scanners, site.parameters.detector),
    )


def _seen_at(seen: VisibleReflectors, counts: BoolArray) -> VisibleReflectors:
    """Drop what is seen at scans (K,) that do not count."""
    stays = np.repeat(counts, seen.counts())
    offsets = np.concatenate(([0], np.cumsum(np.where(counts, seen.counts(), 0))))
    return VisibleReflectors(offsets, seen.indices[stays])


def restricted(planned: PlannedRoute, kept: BoolArray) -> PlannedRoute:
    """Drop from a planned route all reflectors but those of a mask (M,); they keep their indices."""
    stays = kept[planned.visible.indices]
    offsets = np.concatenate(([0], np.cumsum(stays, dtype=np.int64)))[planned.visible.offsets]
    return replace(planned, visible=VisibleReflectors(offsets, planned.visible.indices[stays]))


def station_scans(drive: NominalDrive, stations: Sequence[Station]) -> Iterator[tuple[Station, IntArray]]:
    """Scans of a drive at which the vehicle is at a station, for each station that the route passes.

    A vehicle is at a station within `AT_STATION` of it and with less than `FACING_STATION` between the headings. At one
    where the route starts it counts from when the vehicle sets off: how sure it was of its pose before was assumed.
    """
    for station in stations:
        distance = np.hypot(*(drive.poses[:, :2] - station.pose[:2]).T)
        turned = np.abs(difference(drive.poses[:, 2], station.pose[2]))
        scans = np.flatnonzero((distance <= AT_STATION) & (turned < FACING_STATION))
        scans = scans[scans >= drive.sets_off]
        if len(scans):
            yield station, scans


def predict_route(planned: PlannedRoute, damage: Damage = NO_DAMAGE) -> RoutePrediction:
    """Predict the localizer's belief along a planned drive.

    A visible reflector is detected inside the gate with the probability P_G (and with that of a free ray among
    people); the covariance after it is the mean of that with and without it (Sinopoli et al. 2004, equation 13), of
    one reflector after the other, the farthest first: whatever order they have in the map.

    Parameters
    ----------
    planned : drive and visible reflectors.
    damage : reflectors that are not as the map says. A moved one is seen from where the one of the map would be; where
        its expected innovation lies outside the gate it counts as not seen.

    Returns
    -------
    prediction : one row per scan.
    """
    count = len(planned.drive)
    # A hair more than visibility allows, so that rounding loses nothing it has found.
    reach, shifts = planned.farthest + 1e-6, np.zeros((len(planned.places), 2))
    reach[list(damage.dirty)] *= planned.options.dirty_range
    reach[list(damage.blocked)] = -1.0
    for index, dx, dy in damage.moved:
        shifts[index] += dx, dy
        reach[index] += math.hypot(dx, dy)
    columns = PredictionColumns(
        np.empty((count, 3, 3)),
        np.empty((count, 3)),
        np.empty((count, 3, 3)),
        np.empty(count, np.int8),
        np.empty(count, np.int64),
        np.empty(count),
        np.empty((len(planned.visible.indices), 3)),
    )
    cross, blocks = planned.constants()
    start = Belief(0, planned.drive.poses[0], np.diag(np.square(planned.options.start_sigmas)))
    predict_covariances(
        planned.drive.stamps_ns,
        planned.drive.poses,
        planned.drive.metres,
        planned.drive.scanners,
        read_only(planned.visible.offsets),
        read_only(planned.visible.indices),
        planned.places,
        read_only(shifts),
        read_only(reach),
        from_belief(start),
        cross,
        blocks,
        planned.model(),
        columns,
    )
    return RoutePrediction(
        drive=planned.drive,
        limits=planned.parameters.supervisor,
        prior_covariances=read_only(columns.prior_covariances),
        means=read_only(columns.means),
        covariances=read_only(columns.covariances),
        modes=read_only(columns.modes),
        seen=read_only(columns.seen),
        on_odometry=read_only(columns.on_odometry),
        innovations=read_only(columns.innovations),
    )


def smallest_route() -> PlannedRoute:
    """Plan a drive of 0.1 m past one reflector: something to compile the kernels with."""
    route = Route("Line", (Segment(control_points=np.array([[0.0, 0.0], [0.1, 0.0]]), degree=1),))
    project = Project(reflectors=ReflectorMap((Reflector(id="1", x=2.0, y=0.0),)), routes=(route,))
    return plan_route(project, "Line")


def warm_up() -> None:
    """Compile the recursion."""
    predict_route(smallest_route())
