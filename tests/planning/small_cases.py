"""Placement small enough to look at all layouts: random candidates, every kind of demand, and an exhaustive search."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from commission.planning.ambiguity import ambiguous_poses
from commission.planning.error_budget import predict_errors
from commission.planning.placement import Placement, PlacementOptions, choose
from commission.planning.route_prediction import PlannedRoute, plan_route, predict_route
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.planning.visibility import VisibleReflectors
from commission.site.layout_brief import Demands
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.uncertainty import Uncertainty
from tests.planning.sites import room

ROUTE = "Through"
KINDS = ("sight", "failure", "position", "heading", "station", "spacing", "ambiguity", "everything")


@dataclass(frozen=True, slots=True)
class SmallCase:
    """A hall, ten places on its walls, and what is demanded."""

    kind: str
    project: Project
    centers: np.ndarray
    demands: Demands

    def solved(self) -> Placement:
        """What the search comes to."""
        return choose(self.project, (ROUTE,), self.centers, PlacementOptions(demands=self.demands, extend=False))

    def layouts_that_hold(self, size: int) -> bool:
        """Whether any layout of that many of the candidates meets the demands."""
        every = ReflectorMap(tuple(Reflector(id=f"C{i}", x=x, y=y) for i, (x, y) in enumerate(self.centers.tolist())))
        site = replace(self.project, reflectors=every)
        planned = plan_route(site, ROUTE, models=vehicle_visibility(site).models)
        layouts = itertools.combinations(range(len(self.centers)), size)
        return any(self._holds(site, planned, chosen) for chosen in layouts)

    def _holds(self, site: Project, planned: PlannedRoute, chosen: tuple[int, ...]) -> bool:
        demands, centers = self.demands, self.centers[list(chosen)]
        apart = np.hypot(*(centers[:, np.newaxis] - centers).transpose(2, 0, 1))
        if apart[np.triu_indices(len(chosen), 1)].min(initial=99.0) <= demands.spacing:
            return False
        seen = np.array([np.isin(planned.visible.of(k), chosen).sum() for k in range(len(planned.drive))])
        if seen.min() < demands.visible + demands.survive_failure:
            return False
        failures = [(), *((each,) for each in chosen if demands.survive_failure)]
        return all(self._within_limits(site, planned, set(chosen) - set(failed)) for failed in failures) and all(
            self._clear(site, set(chosen) - set(failed)) for failed in failures
        )

    def _within_limits(self, site: Project, planned: PlannedRoute, left: set[int]) -> bool:
        supervisor, demands, drive = site.parameters.supervisor, self.demands, planned.drive
        position = demands.position_limit or supervisor.position_limit
        limits = np.tile((position, position, demands.heading_limit or supervisor.heading_limit), (len(drive), 1))
        for station in site.stations:
            there = np.hypot(*(drive.poses[:, :2] - (station.x, station.y)).T) <= 0.2
            limits[there, :2] = np.minimum(limits[there, :2], station.required_accuracy)
        limits[: np.flatnonzero(drive.metres == 0.0).max()] = np.inf
        few = only(planned, left)
        prediction = predict_route(few)
        said, true = prediction.covariances, predict_errors(few, prediction).squares
        variances = np.maximum(*(np.diagonal(each, axis1=1, axis2=2) for each in (said, true)))
        return bool(np.all(2.0 * np.sqrt(variances) <= limits))

    def _clear(self, site: Project, left: set[int]) -> bool:
        poses = [plan_route(site, ROUTE).drive.poses[0]] if self.demands.unambiguous_starts else []
        poses += [(*spot, 0.0) for spot in self.demands.unambiguous_spots]
        if not poses:
            return True
        layout = ReflectorMap(tuple(site.reflectors.reflectors[i] for i in sorted(left)))
        return not ambiguous_poses(vehicle_visibility(replace(site, reflectors=layout)), poses).ambiguous.any()


def only(planned: PlannedRoute, left: set[int]) -> PlannedRoute:
    """A planned route that sees no other reflectors than these."""
    stays = np.isin(planned.visible.indices, list(left))
    scans = np.repeat(np.arange(len(planned.drive)), planned.visible.counts())[stays]
    offsets = np.searchsorted(scans, np.arange(len(planned.drive) + 1))
    return replace(planned, visible=VisibleReflectors(offsets, planned.visible.indices[stays]))


def small_case(seed: int) -> SmallCase:
    """Ten candidates on the long walls, and the kind of demand whose turn it is."""
    rng, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    x = rng.uniform(0.5, 17.5, 10)
    if kind in {"ambiguity", "everything"}:
        # Half of them is the other half turned round in the middle of the hall, so that rivals abound.
        x[5:] = 18.0 - x[:5]
    centers = np.column_stack((x, np.repeat((0.2, 7.8), 5)))
    demands = Demands(visible=1, survive_failure=False, spacing=0.2, leeway=0.0)
    all_of_it = kind == "everything"
    if kind == "failure" or all_of_it:
        demands = replace(demands, survive_failure=True)
    if kind in {"position", "station"} or all_of_it:
        demands = replace(demands, position_limit=float(rng.choice([0.03, 0.04, 0.06])))
    if kind == "heading" or all_of_it:
        demands = replace(demands, heading_limit=float(rng.choice([0.012, 0.02, 0.03])))
    if kind == "spacing" or all_of_it:
        demands = replace(demands, visible=2, spacing=float(rng.uniform(0.5, 2.0)))
    if kind == "ambiguity" or all_of_it:
        demands = replace(demands, unambiguous_starts=True, unambiguous_spots=((9.0 + float(rng.uniform(-4, 4)), 3.0),))
    station = Station(name="Dock", x=9.0, y=4.0, required_accuracy=float(rng.choice([0.015, 0.02, 0.03])))
    route = Route(ROUTE, (Segment(control_points=np.array([[2.0, 4.0], [16.0, 4.0]]), degree=1),), 1.0)
    project = Project(
        floor_map=room(18.0, 8.0),
        # Five scans a second keep the enumeration of all layouts short; sight all around and from the middle of the
        # vehicle makes one heading stand for all.
        scanners=(Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=8.0, rate=5.0),),
        routes=(route,),
        # So poor odometry that two distant reflectors do not hold the pose.
        parameters=Parameters(odometry=OdometryParameters(heading_per_sqrt_m=0.03, forward_per_sqrt_m=0.03)),
        # Constants that are known to a sigma would hold nearly every limit down; the search is what is judged here.
        uncertainty=Uncertainty(survey=0.0, mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, clock=0.0),
        stations=(station,) if kind == "station" or all_of_it else (),
    )
    return SmallCase(kind, project, centers, demands)


@dataclass(frozen=True, slots=True)
class Verdict:
    """A solved case beside the best there is."""

    kind: str
    added: int
    """Reflectors of the suggestion."""
    at_least: int
    """Its bound."""
    fewest: int | None
    """Fewest reflectors of any layout that meets the demands; None when there is none."""
    met: bool
    """Whether the suggestion meets them."""

    @property
    def extra(self) -> int:
        """Reflectors more than needed."""
        assert self.fewest is not None
        return self.added - self.fewest


def judged(case: SmallCase) -> Verdict:
    """Solve a case, and look at all layouts from the smallest on."""
    found = case.solved()
    sizes = range(len(case.centers) + 1)
    fewest = next((size for size in sizes if case.layouts_that_hold(size)), None)
    return Verdict(case.kind, found.added, found.at_least, fewest, found.unmet == ())
