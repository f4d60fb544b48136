"""What is wrong with a site while it is being edited: quick checks, each with its place, after every edit.

Only what can be told in milliseconds from geometry; what the localizer makes of a site is for coverage and prediction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from commission.compiled import warm_up
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import chi_square_gate
from commission.planning.route_check import FloorDistances, Way, outline_points, room_along
from commission.planning.route_prediction import AT_STATION, FACING_STATION
from commission.progress import Progress, silent
from commission.site.floor_map import FloorMap
from commission.site.glued import depths_in_walls
from commission.site.parameters import Parameters
from commission.site.parts import Told
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES, PLAIN_DEGREES
from commission.site.reflectors import (
    RANGE_PER_RADIUS,
    UNKNOWN_RADII,
    UNKNOWN_RADIUS_SIGMA,
    Reflector,
    ReflectorMap,
)
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import Vehicle
from commission.site.zones import Zone
from commission.studies.detector_problems import detector_findings
from commission.studies.inputs import StudyInput, is_same
from commission.studies.kernels import ROOM
from commission.studies.passed_stations import Passed, passed_stations
from commission.studies.violations import CheckedRoute, Violation, ViolationKind, check_route
from commission.studies.zone_problems import idle_zones

MOST_OF_A_KIND = 50
"""Problems of one kind that are listed; the rest is counted."""
MOST_NAMED = 10
"""Reflectors that one line names."""
PREPARING = 0.3
"""Share of the time until which the floor map is prepared."""
SAME_PLACE = 0.001
"""Two reflectors this close are one that was entered twice [m]."""
BRIDGED_BEAMS = 2
"""Beams without a reflector between two reflectors that separate their clusters: the detector bridges one."""
_RIM_POINTS = 16
_SLIT = 0.1
"""A scanner this deep inside the outline looks out through a slit in the vehicle's body [m]."""


class Severity(StrEnum):
    """How bad a problem is."""

    ERROR = "error"
    """Will not work."""
    WARNING = "warning"
    """Will work badly, or only sometimes."""
    NOTE = "note"
    """Worth knowing."""


class Subject(StrEnum):
    """What a problem is about, for selecting it."""

    REFLECTOR = "reflector"
    ROUTE = "route"
    STATION = "station"
    SCANNER = "scanner"
    FLOOR_MAP = "floor map"
    ZONE = "zone"


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """One thing that is wrong."""

    severity: Severity
    """How bad it is."""
    text: str
    """One line: what was found and what is expected, with units."""
    subject: Subject
    """What kind of thing it is about."""
    ids: tuple[str, ...] = ()
    """Ids of reflectors, names of routes, stations or zones."""
    place: tuple[float, float] | None = None
    """Where to look [m, m], map frame; None: nowhere in particular."""


@dataclass(frozen=True, slots=True)
class CheckLimits:
    """What is expected of a site."""

    clearance: float = 0.1
    """Smallest room between the vehicle's outline and a wall along a route [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProblemsInput(StudyInput):
    """What the problems of a site depend on: all that stands in the hall and drives in it."""

    floor_map: FloorMap | None
    """Walls and free floor."""
    reflectors: ReflectorMap
    """The reflector map."""
    routes: tuple[Route, ...]
    """Planned routes."""
    stations: tuple[Station, ...]
    """Where the vehicle has to stand accurately."""
    vehicle: Vehicle
    """Wheels and outline."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    parameters: Parameters
    """Tunables of the localizer."""
    tags: tuple[Tag, ...] = ()
    """Landmarks that tell place and heading at once."""
    zones: tuple[Zone, ...] = ()
    """Where which kinds of observation correct the pose."""
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    """How well the constants of the site and the vehicle are known."""
    limits: CheckLimits = field(default_factory=CheckLimits)
    """What is expected."""

    @staticmethod
    def of(project: Project, limits: CheckLimits | None = None) -> ProblemsInput:
        """Take what the study reads from a project."""
        return ProblemsInput(
            floor_map=project.floor_map,
            reflectors=project.reflectors,
            routes=project.routes,
            stations=project.stations,
            vehicle=project.vehicle,
            scanners=project.scanners,
            parameters=project.parameters,
            tags=project.tags,
            zones=project.zones,
            uncertainty=project.uncertainty,
            limits=limits or CheckLimits(),
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProblemsResult:
    """Problems of a site, and what the next check needs not find again."""

    problems: tuple[Problem, ...]
    """Errors first."""
    inputs: ProblemsInput
    """What was checked."""
    floor: FloorDistances | None
    """Its walls; none without a floor map."""
    by_route: tuple[CheckedRoute, ...]
    """Each of its routes."""
    passed: Passed
    """Which of its stations its routes pass."""


def problems(
    inputs: ProblemsInput, progress: Progress = silent, before: ProblemsResult | None = None
) -> ProblemsResult:
    """Check a site.

    Parameters
    ----------
    inputs : what to check, and what is expected.
    progress : told how far it is; may raise to cancel.
    before : result of an earlier state: a route that is still the same object is not checked again.
    """
    progress(0.0, "preparing the floor map")
    warm_up((ROOM,))
    floor = _floor_of(inputs, before)
    known: dict[int, CheckedRoute] = {}
    if before is not None and _same_conditions(before, inputs, floor):
        known = dict(zip(map(id, before.inputs.routes), before.by_route, strict=True))
    by_route: list[CheckedRoute] = []
    for number, route in enumerate(inputs.routes):
        progress(PREPARING + (1.0 - PREPARING) * number / len(inputs.routes), f"checking route {route.name}")
        checked = known.get(id(route))
        by_route.append(checked or check_route(route, inputs.vehicle, floor, inputs.limits.clearance))
    passed = passed_stations(inputs.stations, tuple(by_route), None if before is None else before.passed)
    found = [
        *_map_problems(inputs, floor),
        *_scanner_problems(inputs),
        *_detector_problems(inputs),
        *_zone_problems(inputs),
        *_exact_constants(inputs),
        *_unknown_values(inputs),
        *_close_reflectors(inputs),
        *_reflectors_and_walls(inputs, floor),
        *_station_problems(inputs, floor),
        *_missed_stations(inputs, passed),
        *(problem for route in by_route for problem in route_problems(route.violations)),
    ]
    return ProblemsResult(
        problems=errors_first(found), inputs=inputs, floor=floor, by_route=tuple(by_route), passed=passed
    )


def errors_first(found: Iterable[Problem]) -> tuple[Problem, ...]:
    """Sort problems by how bad they are; equally bad ones stay in their order."""
    order = list(Severity)
    return tuple(sorted(found, key=lambda problem: order.index(problem.severity)))


def _floor_of(inputs: ProblemsInput, before: ProblemsResult | None) -> FloorDistances | None:
    """Walls of the floor map, prepared; those of the earlier check where they are the same."""
    if inputs.floor_map is None:
        return None
    if before is not None and before.floor is not None and before.floor.floor_map is inputs.floor_map:
        return before.floor
    return FloorDistances(inputs.floor_map)


def route_problems(violations: Iterable[Violation]) -> Iterable[Problem]:
    """Say what a route asks too much: one problem for each stretch of its way, the first ones of many."""
    found = tuple(violations)
    return _limited(map(_route_problem, found[:MOST_OF_A_KIND]), len(found))


def _route_problem(violation: Violation) -> Problem:
    """One stretch of a route in words."""
    x, y, _ = (float(value) for value in violation.where.worst_pose)
    text = f"Route {violation.route!r}: {_asked_too_much(violation)}"
    severity = Severity.ERROR if violation.is_fatal else Severity.WARNING
    return Problem(severity=severity, text=text, subject=Subject.ROUTE, ids=(violation.route,), place=(x, y))


def _asked_too_much(violation: Violation) -> str:
    """What is too much, and what is expected."""
    found, expected, length = violation.found, violation.expected, violation.where.length
    match violation.kind:
        case ViolationKind.CURVE:
            return (
                f"a curve of {found:.2f} m radius over {length:.2f} m; expected {expected:.2f} m or more, "
                "the least that the vehicle can drive"
            )
        case ViolationKind.CORNER:
            is_fatal = violation.is_fatal
            remedy = "a curve: it cannot do that" if is_fatal else "a stop there: a segment of its own"
            return f"the vehicle turns by {PLAIN_DEGREES.text(found)} on the spot; expected {remedy}"
        case ViolationKind.WALL:
            return f"the vehicle's outline cuts a wall over {length:.2f} m"
        case ViolationKind.ROOM:
            return (
                f"{MILLIMETRES.text(found)} between the vehicle's outline and a wall; "
                f"expected {MILLIMETRES.text(expected)} or more"
            )


def _same_conditions(before: ProblemsResult, inputs: ProblemsInput, floor: FloorDistances | None) -> bool:
    """Whether routes are checked as they were."""
    return (
        before.floor is floor
        and before.inputs.limits == inputs.limits
        and is_same(before.inputs.vehicle, inputs.vehicle)
    )


def _map_problems(site: ProblemsInput, floor: FloorDistances | None) -> Iterable[Problem]:
    if site.floor_map is None:
        text = (
            "No floor map: nothing blocks the line of sight and nothing stands in the way; expected a map of the hall"
        )
        yield Problem(severity=Severity.WARNING, text=text, subject=Subject.FLOOR_MAP)
    elif floor is not None and not floor.grid.occupied.any():
        yield Problem(
            severity=Severity.WARNING,
            text="The floor map has no walls; expected occupied cells",
            subject=Subject.FLOOR_MAP,
        )
    if not len(site.reflectors):
        yield Problem(
            severity=Severity.WARNING,
            text="No reflectors; expected at least 3 around every route",
            subject=Subject.REFLECTOR,
        )


def _zone_problems(site: ProblemsInput) -> Iterable[Problem]:
    """Zones in which nothing corrects the pose."""
    for zone, text in idle_zones(site):
        x, y = np.mean(zone.outline, axis=0).tolist()
        yield Problem(severity=Severity.ERROR, text=text, subject=Subject.ZONE, ids=(zone.name,), place=(x, y))


def _exact_constants(site: ProblemsInput) -> Iterable[Problem]:
    """What is taken for exact: a budget that leaves something out says so."""
    for text in site.uncertainty.taken_for_exact():
        yield Problem(severity=Severity.NOTE, text=text, subject=Subject.SCANNER)


def _unknown_values(site: ProblemsInput) -> Iterable[Problem]:
    """Reflectors of which nobody knows how large they are, or which way they face."""
    every = site.reflectors.reflectors
    undirected = tuple(r for r in every if r.lacks_direction)
    sizeless = tuple(r for r in every if r.radius is None)
    low, high = (MILLIMETRES.number(radius) for radius in UNKNOWN_RADII)
    for found, text in (
        (
            undirected,
            "are plates of unknown direction and count as seen from every free side; expected it, or the wall's",
        ),
        (
            sizeless,
            f"have an unknown radius: what {low} to {high} mm show passes the detector, and each counts as off by "
            f"{MILLIMETRES.text(RANGE_PER_RADIUS * UNKNOWN_RADIUS_SIGMA)} more; expected it",
        ),
    ):
        if found:
            yield Problem(
                severity=Severity.WARNING,
                text=f"{len(found)} of {len(every)} reflectors {text} ({_named(found)})",
                subject=Subject.REFLECTOR,
                ids=tuple(r.id for r in found),
                place=(found[0].x, found[0].y),
            )


def _named(reflectors: tuple[Reflector, ...]) -> str:
    """The first ids, and how many more there are."""
    ids = ", ".join(r.id for r in reflectors[:MOST_NAMED])
    return ids if len(reflectors) <= MOST_NAMED else f"{ids} and {len(reflectors) - MOST_NAMED} more"


def _scanner_problems(site: ProblemsInput) -> Iterable[Problem]:
    """Beams that meet the vehicle's own outline, scanner by scanner."""
    alone = len(site.scanners) == 1
    for scanner in site.scanners:
        if not len(scanner.views):
            text = (
                f"The scanner{'' if alone else f' {scanner.name!r}'} is wholly blind: its blind sectors cover the "
                "field of view; expected a part of it that sees"
            )
            yield Problem(severity=Severity.ERROR, text=text, subject=Subject.SCANNER)
            continue
        yield from _outline_problems(scanner, site.vehicle, "" if alone else f" {scanner.name!r}")


def _outline_problems(scanner: Scanner, vehicle: Vehicle, name: str) -> Iterable[Problem]:
    """Beams of one scanner that meet the outline; its name is said where there are others."""
    outline, position = np.asarray(vehicle.outline, dtype=np.float64), scanner.mounting[:2]
    depth = float(np.hypot(*(outline_points(outline, 0.01) - position).T).min())
    if depth > 0.01 and _inside(position, outline):
        if depth > _SLIT:
            text = (
                f"The scanner{name} is {MILLIMETRES.text(depth)} inside the vehicle's outline; "
                "expected at its edge, unless it stands above the body"
            )
            yield Problem(severity=Severity.NOTE, text=text, subject=Subject.SCANNER)
        return
    bearings = scanner.angle_min + np.arange(scanner.beam_count, dtype=np.float64) * scanner.angle_increment
    upright = scanner.upright(np.asarray(bearings, dtype=np.float64))
    blocked = np.flatnonzero(_crosses(position, upright + scanner.mounting[2], outline))
    if len(blocked):
        low, high = (float(bearings[index]) for index in (blocked[0], blocked[-1]))
        text = (
            f"The vehicle's own outline blocks {len(blocked)} of {scanner.beam_count} beams"
            f"{name and f' of the scanner{name}'}, between "
            f"{PLAIN_DEGREES.number(low, '.1f')} and {PLAIN_DEGREES.text(high, '.1f')}; "
            "expected a field of view that leaves the vehicle out"
        )
        severity = Severity.ERROR if len(blocked) == scanner.beam_count else Severity.WARNING
        yield Problem(severity=severity, text=text, subject=Subject.SCANNER)


def _detector_problems(site: ProblemsInput) -> Iterable[Problem]:
    """Reflectors that the detector does not pass, or that the scanner hardly resolves."""
    farthest = math.inf
    if site.floor_map is not None:
        farthest = site.floor_map.resolution * math.hypot(*site.floor_map.cells.shape)
    for scanner in site.scanners:
        called = f" (scanner {scanner.name!r})" if len(site.scanners) > 1 else ""
        for finding in detector_findings(site.reflectors, scanner, site.parameters.detector, farthest):
            severity = Severity.WARNING if finding.is_loss else Severity.NOTE
            yield Problem(severity=severity, text=finding.text + called, subject=Subject.SCANNER)


def _close_reflectors(site: ProblemsInput) -> Iterable[Problem]:
    """Reflectors that are one, touch, or cannot be told apart by the detector or by the association."""
    reflectors = site.reflectors
    if len(reflectors) < 2:
        return ()
    apart, gap = separation_needed(site)
    farthest = max(apart, gap + 2.0 * float(reflectors.radii.max()))
    from scipy.spatial import KDTree

    pairs = np.asarray(KDTree(reflectors.centers).query_pairs(farthest, output_type="ndarray"))
    if len(pairs) == 0:
        return ()
    first, second = pairs[:, 0], pairs[:, 1]
    distances = np.hypot(*(reflectors.centers[first] - reflectors.centers[second]).T)
    needed = np.maximum(apart, gap + reflectors.radii[first] + reflectors.radii[second])
    near = np.flatnonzero(distances < needed)
    near = near[np.argsort(distances[near], kind="stable")]
    values = reflectors.reflectors
    found = (_pair_problem(values[first[i]], values[second[i]], float(distances[i]), float(needed[i])) for i in near)
    return _limited(islice(found, MOST_OF_A_KIND), len(near))


def separation_needed(site: Told) -> tuple[float, float]:
    """Distances at which two reflectors are told apart wherever the vehicle is.

    Returns
    -------
    apart : between centers, so that a detection of one cannot fall nearer to the other and still be accepted while the
        supervisor is content: twice the gate's radius at the alarm limit, but for the reflectors' own uncertainty [m].
    gap : between their edges, so that the detector sees two clusters up to each scanner's range for reflectors [m].
    """
    parameters = site.parameters
    noise = parameters.observation
    # Wherever the vehicle is, by whichever scanner: the one with the largest noise.
    largest = max(each.detection_sigmas(noise.range_sigma, noise.bearing_sigma)[0] for each in site.scanners)
    sigma = math.hypot(0.5 * parameters.supervisor.position_limit, largest)
    apart = 2.0 * math.sqrt(chi_square_gate(parameters.association.gate_probability, 2)) * sigma
    return apart, max(map(_gap_needed, site.scanners))


def _gap_needed(scanner: Scanner) -> float:
    """Distance between the edges of two reflectors that a scanner tells apart as far as it sees them [m]."""
    angle = BRIDGED_BEAMS * scanner.angle_increment + math.radians(scanner.beam_width_deg)
    return min(scanner.range[1], scanner.reflector_range) * angle


def _pair_problem(first: Reflector, second: Reflector, distance: float, needed: float) -> Problem:
    names, place = f"{first.id!r} and {second.id!r}", (0.5 * (first.x + second.x), 0.5 * (first.y + second.y))
    ids = (first.id, second.id)
    if distance <= SAME_PLACE:
        text = f"Reflectors {names} are at the same place; expected one of them"
        return Problem(severity=Severity.ERROR, text=text, subject=Subject.REFLECTOR, ids=ids, place=place)
    touch = first.reckoned_radius + second.reckoned_radius
    is_one = distance < touch
    expected = f"expected {needed:.2f} m or more to tell them apart at any range"
    text = f"Reflectors {names} are {MILLIMETRES.text(distance)} apart{' and overlap' if is_one else ''}; {expected}"
    return Problem(
        severity=Severity.ERROR if is_one else Severity.WARNING,
        text=text,
        subject=Subject.REFLECTOR,
        ids=ids,
        place=place,
    )


def _reflectors_and_walls(site: ProblemsInput, floor: FloorDistances | None) -> Iterable[Problem]:
    """Reflectors that stand inside walls, where no ray reaches them, or beside the map."""
    reflectors = site.reflectors
    if floor is None or not len(reflectors):
        return ()
    grid = floor.grid
    angles = np.linspace(0.0, 2.0 * math.pi, _RIM_POINTS, endpoint=False)
    reach = 1.001 * reflectors.radii[:, np.newaxis, np.newaxis]
    rims = reflectors.centers[:, np.newaxis] + reach * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    # A plate is seen from the side that it faces, if that is known.
    turns = np.cos(angles - reflectors.headings[:, np.newaxis])
    seen = ~reflectors.is_directed[:, np.newaxis] | (turns > 0.0)
    # A plate up to a cell behind the surface of a wall is glued to it.
    walled = (grid.is_occupied(rims) | ~seen).all(axis=1) & (depths_in_walls(reflectors, grid) == 0.0)
    outside = ~grid.contains(reflectors.centers)
    found: list[Problem] = []
    for indices, severity, text in (
        (walled, Severity.ERROR, "is inside a wall; expected where a ray can reach it"),
        (outside, Severity.WARNING, "is outside of the floor map; expected on it"),
    ):
        some = [_of_reflector(severity, reflectors.reflectors[i], text) for i in np.flatnonzero(indices)]
        found.extend(_limited(some))
    return found


def _station_problems(site: ProblemsInput, floor: FloorDistances | None) -> Iterable[Problem]:
    """Stations where the vehicle does not fit."""
    if floor is None or not site.stations:
        return ()
    poses = np.array([station.pose for station in site.stations])
    way = Way(poses, np.zeros(len(poses)), np.zeros(len(poses), np.int64), np.zeros(len(poses) - 1))
    room = room_along(way, site.vehicle.outline, floor)
    return [
        Problem(
            severity=Severity.ERROR,
            text=f"Station {station.name!r}: the vehicle's outline cuts a wall; expected room for it",
            subject=Subject.STATION,
            ids=(station.name,),
            place=(station.x, station.y),
        )
        for station, left in zip(site.stations, room, strict=True)
        if left <= 0.0
    ]


def _of_reflector(severity: Severity, reflector: Reflector, text: str) -> Problem:
    place = (reflector.x, reflector.y)
    return Problem(
        severity=severity,
        text=f"Reflector {reflector.id!r} {text}",
        subject=Subject.REFLECTOR,
        ids=(reflector.id,),
        place=place,
    )


def _limited(found: Iterable[Problem], count: int | None = None) -> list[Problem]:
    """The first problems of a kind, and how many more there are."""
    problems = list(found)
    more = (len(problems) if count is None else count) - MOST_OF_A_KIND
    if more > 0:
        worst = problems[0]
        rest = Problem(
            severity=worst.severity,
            text=f"... and {more} more like {worst.text!r}",
            subject=worst.subject,
            ids=worst.ids,
            place=worst.place,
        )
        return [*problems[:MOST_OF_A_KIND], rest]
    return problems


def _missed_stations(site: ProblemsInput, passed: Passed) -> Iterable[Problem]:
    """Stations whose accuracy nobody checks, since no route passes them."""
    return _limited(
        Problem(
            severity=Severity.WARNING,
            text=f"Station {station.name!r}: no route passes it; expected one within "
            f"{MILLIMETRES.text(AT_STATION)} that looks its way to "
            f"{PLAIN_DEGREES.text(FACING_STATION)}, else its accuracy is not checked",
            subject=Subject.STATION,
            ids=(station.name,),
            place=(station.x, station.y),
        )
        for station in site.stations
        if station.name not in passed.names
    )


def _inside(point: FloatArray, outline: FloatArray) -> bool:
    """Whether a point is inside a polygon (K, 2): it is surrounded an odd number of times."""
    ahead = np.roll(outline, -1, axis=0)
    straddles = (outline[:, 1] > point[1]) != (ahead[:, 1] > point[1])
    rise = np.where(straddles, ahead[:, 1] - outline[:, 1], 1.0)
    at = outline[:, 0] + (point[1] - outline[:, 1]) / rise * (ahead[:, 0] - outline[:, 0])
    return bool((straddles & (point[0] < at)).sum() % 2)


def _crosses(position: FloatArray, directions: FloatArray, outline: FloatArray) -> NDArray[np.bool_]:
    """(B,) whether rays [rad] from a place outside of a polygon, or on its edge, meet its inside."""
    c, s = np.cos(directions)[:, np.newaxis], np.sin(directions)[:, np.newaxis]
    edges = np.roll(outline, -1, axis=0) - outline
    offsets = outline - position
    across = c * edges[:, 1] - s * edges[:, 0]
    safe = np.where(np.abs(across) > 1e-12, across, np.inf)
    along = (offsets[:, 0] * edges[:, 1] - offsets[:, 1] * edges[:, 0]) / safe
    share = (offsets[:, 0] * s - offsets[:, 1] * c) / safe
    hits = (np.abs(across) > 1e-12) & (along > 1e-3) & (share >= 0.0) & (share < 1.0)
    # A ray that goes inside from the edge comes out again through another one.
    return np.asarray(hits.any(axis=1))
