"""What a layout of reflectors comes to: accuracy along routes and at stations, failures, ambiguous places.

Figures of one layout, so that two can be held against each other; what is demanded of one is not known here.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.planning.ambiguity import AmbiguityOptions, ambiguous_poses
from commission.planning.error_budget import larger_variances, predict_errors
from commission.planning.route_prediction import (
    PlannedRoute,
    PredictionOptions,
    plan_route,
    predict_route,
    restricted,
    station_scans,
)
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import VisibilityOptions, build_visibility
from commission.progress import Progress, silent
from commission.site.parts import Equipped
from commission.site.quantity import MILLIMETRES, PLAIN_DEGREES, Shown, counted_text
from commission.site.reflectors import ReflectorMap
from commission.site.walls import walls_of

CORES = os.cpu_count() or 1
NOTHING = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Worst:
    """Largest 2-sigma from when the vehicle sets off: what the filter says or its error, whichever is larger."""

    position: float
    """Of x or y [m]."""
    heading: float
    """[rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteFigures:
    """Of one route."""

    name: str
    """Its name."""
    intact: Worst
    """With all reflectors."""
    failing: Worst
    """With any single one blocked."""
    visible: int
    """Fewest reflectors in sight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StationFigures:
    """Of one station that a route passes."""

    name: str
    """Its name."""
    required: float
    """Largest 2-sigma that it allows [m]."""
    intact: float
    """Largest 2-sigma of x or y there with all reflectors [m]."""
    failing: float
    """The same with any single one blocked [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutFigures:
    """Of one layout."""

    reflectors: int
    """Number of reflectors."""
    routes: tuple[RouteFigures, ...]
    """Each route that counts."""
    stations: tuple[StationFigures, ...]
    """Each station that one of them passes."""
    stopping: int
    """Reflectors whose failing alone lets the supervisor stop the vehicle where it does not otherwise."""
    ambiguous: int
    """Starts of routes and stations at which another pose sees the same, or fewer than two are in sight."""
    places: int
    """Starts and stations that were looked at."""


def layout_figures(
    site: Equipped,
    reflectors: ReflectorMap,
    routes: tuple[str, ...],
    options: PredictionOptions | None = None,
    progress: Progress = silent,
    *,
    visibility: VisibilityOptions | None = None,
) -> LayoutFigures:
    """Find out what a layout comes to.

    Parameters
    ----------
    site : all that stands in the hall and drives in it; its own reflectors do not count.
    reflectors : the layout.
    routes : names of the routes that count.
    options : how they are predicted.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.
    visibility : what counts as visible; what the project's detector passes when None.
    """
    walls, seen = walls_of(site.floor_map), visibility or VisibilityOptions(detector=site.parameters.detector)
    models = tuple(build_visibility(reflectors, scanner, walls, seen) for scanner in site.scanners)
    planned = [plan_route(site, name, options, models) for name in routes]
    found: list[RouteFigures] = []
    at_stations: dict[str, StationFigures] = {}
    stopping: set[int] = set()
    for number, route in enumerate(planned):
        progress(number / len(planned), f"what the layout comes to on {route.name}")
        intact, failing, stops = _with_failures(route)
        moving = slice(route.drive.sets_off, None)
        visible = int(route.sees().sum(axis=1)[moving].min(initial=len(reflectors)))
        worst, worse = _worst(intact[moving]), _worst(failing[moving])
        found.append(RouteFigures(name=route.name, intact=worst, failing=worse, visible=visible))
        stopping |= stops
        for station, scans in station_scans(route.drive, site.stations):
            before = at_stations.get(station.name)
            at_stations[station.name] = StationFigures(
                name=station.name,
                required=station.required_accuracy,
                intact=max(float(intact[scans, :2].max()), 0.0 if before is None else before.intact),
                failing=max(float(failing[scans, :2].max()), 0.0 if before is None else before.failing),
            )
    poses = [route.drive.poses[0] for route in planned] + [station.pose for station in site.stations]
    progress(1.0, "what the layout comes to")
    return LayoutFigures(
        reflectors=len(reflectors),
        routes=tuple(found),
        stations=tuple(at_stations.values()),
        stopping=len(stopping),
        ambiguous=_ambiguous(VehicleVisibility(models), np.array(poses)) if poses else 0,
        places=len(poses),
    )


def _ambiguous(visible: VehicleVisibility, poses: FloatArray) -> int:
    """Count the poses at which another one sees the same, or fewer than two reflectors are in sight."""
    alike = ambiguous_poses(visible, poses, AmbiguityOptions())
    return int(np.count_nonzero(alike.ambiguous | (visible.visible_from_poses(poses).counts() < 2)))


def _with_failures(route: PlannedRoute) -> tuple[FloatArray, FloatArray, set[int]]:
    """(K, 3) 2-sigma, the same with any one reflector blocked, and those whose failing alone stops the vehicle."""

    def predicted(gone: int) -> tuple[int, FloatArray, bool]:
        left = restricted(route, np.arange(len(route.reflectors)) != gone)
        prediction = predict_route(left)
        variances = larger_variances(prediction, predict_errors(left, prediction))
        return gone, 2.0 * np.sqrt(variances), bool(prediction.over_limit()[route.drive.sets_off :].any())

    _, intact, stands = predicted(NOTHING)
    failing, stops = intact.copy(), set[int]()
    # Side by side: kernels leave the interpreter free.
    with ThreadPoolExecutor(CORES) as pool:
        for gone, two_sigma, is_over in pool.map(predicted, np.unique(route.visible.indices).tolist()):
            failing = np.maximum(failing, two_sigma)
            if is_over and not stands:
                stops.add(gone)
    return intact, failing, stops


def _worst(two_sigma: FloatArray) -> Worst:
    return Worst(position=float(two_sigma[:, :2].max()), heading=float(two_sigma[:, 2].max()))


def compared(before: LayoutFigures, after: LayoutFigures) -> tuple[tuple[str, str], ...]:
    """Say what one layout comes to and what another one, line by line: what it is, and `before -> after`.

    Parameters
    ----------
    before, after : of the same routes and stations.
    """

    def both(shown: Shown, one: float, other: float, form: str) -> str:
        return f"{shown.number(one, form)} -> {shown.text(other, form)}"

    lines = [("Reflectors", f"{before.reflectors} -> {after.reflectors}")]
    for one, other in zip(before.routes, after.routes, strict=True):
        position = both(MILLIMETRES, one.intact.position, other.intact.position, ".1f")
        heading = both(PLAIN_DEGREES, one.intact.heading, other.intact.heading, ".2f")
        lines.append((one.name, f"2-sigma {position}, {heading}; {one.visible} -> {other.visible} in sight"))
        position = both(MILLIMETRES, one.failing.position, other.failing.position, ".1f")
        heading = both(PLAIN_DEGREES, one.failing.heading, other.failing.heading, ".2f")
        lines.append(("... any one failing", f"2-sigma {position}, {heading}"))
    for one, other in zip(before.stations, after.stations, strict=True):
        place = both(MILLIMETRES, one.intact, other.intact, ".1f")
        lost = both(MILLIMETRES, one.failing, other.failing, ".1f")
        allowed = MILLIMETRES.text(one.required, ".0f")
        lines.append((one.name, f"2-sigma {place} of {allowed}; any one failing {lost}"))
    lines.append(("Stop if failing", f"{before.stopping} -> {counted_text(after.stopping, 'reflector')}"))
    lines.append(("Ambiguous", f"{before.ambiguous} -> {after.ambiguous} of {after.places} starts and stations"))
    return tuple(lines)
