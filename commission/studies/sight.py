"""Where a vehicle that localizes on reflectors sees too few of them: along its routes and at its stations.

Every route and station of a project is driven on reflectors, so that all of them are looked at. How accurate the pose
is there is for prediction; that nothing can be said of it without reflectors is told here, while the site is edited.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from commission.compiled import warm_up
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.stretches import stretches_of
from commission.planning.candidates import wall_candidates
from commission.planning.route_check import way_of
from commission.planning.vehicle_visibility import VehicleVisibility, vehicle_visibility
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.layout_brief import LayoutBrief
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.studies.inputs import StudyInput
from commission.studies.kernels import CURVES, SIGHT
from commission.studies.layout_problems import ENOUGH, SeenAlong, lacking_along, lacking_at_walls
from commission.studies.problems import MOST_OF_A_KIND, Problem, Severity, Subject, errors_first

LEAST = 2
"""Reflectors that fix a pose."""
STEP = 0.25
"""Distance between the poses along a route that are looked at [m]."""
JOINED = 1.0
"""Stretches with less than this between them are told as one [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SightInput(StudyInput):
    """What decides how many reflectors a vehicle sees."""

    floor_map: FloorMap | None
    """Walls."""
    reflectors: ReflectorMap
    """The reflector map."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    parameters: Parameters
    """Tunables of the localizer: what the detector passes."""
    routes: tuple[Route, ...]
    """Planned routes."""
    stations: tuple[Station, ...]
    """Where the vehicle has to stand accurately."""
    layout: LayoutBrief
    """What the project demands of a layout."""

    @staticmethod
    def of(project: Project) -> SightInput:
        """Take what the study reads from a project."""
        return SightInput(
            floor_map=project.floor_map,
            reflectors=project.reflectors,
            scanners=project.scanners,
            parameters=project.parameters,
            routes=project.routes,
            stations=project.stations,
            layout=project.layout,
        )


@dataclass(frozen=True, slots=True, eq=False)
class SightResult:
    """Where too few reflectors are seen."""

    inputs: SightInput
    """What was looked at."""
    problems: tuple[Problem, ...]
    """Those with less than it takes to fix a pose first."""


def sight(inputs: SightInput, progress: Progress = silent) -> SightResult:
    """Count the reflectors in sight along all routes and at all stations.

    A site without reflectors is told of elsewhere: not again for each of its routes.

    Parameters
    ----------
    inputs : what stands in the hall and drives in it.
    progress : told how far it is; may raise to cancel.
    """
    found: list[Problem] = []
    if len(inputs.reflectors) and (inputs.routes or inputs.stations):
        warm_up((SIGHT, CURVES), part(progress, 0.0, 0.3))
        visible = vehicle_visibility(inputs, VisibilityOptions(detector=inputs.parameters.detector))
        counted = inputs.layout.counted(inputs.routes)
        demanded: list[SeenAlong] = []
        for number, route in enumerate(inputs.routes):
            progress(0.3 + 0.7 * number / len(inputs.routes), f"reflectors in sight along {route.name}")
            along = _seen_along(route, visible)
            found += _along(along)
            if route.name in counted:
                demanded.append(along)
                found += lacking_along(along, inputs.reflectors, inputs.layout.demands)
        found += _at_stations(inputs.stations, visible)
        found += _at_walls(inputs, demanded)
    progress(1.0, "reflectors in sight")
    return SightResult(inputs, errors_first(found))


def _seen_along(route: Route, visible: VehicleVisibility) -> SeenAlong:
    poses = way_of(route, STEP).poses
    metres = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))))
    return SeenAlong(route.name, poses, metres, visible.visible_from_poses(poses).incidence(len(visible.reflectors)))


def _at_walls(inputs: SightInput, along: list[SeenAlong]) -> Iterator[Problem]:
    """Places along the walls that are far from any reflector, where that is demanded."""
    brief = inputs.layout
    if not brief.demands.wall_reach or inputs.floor_map is None or not along:
        return
    places = wall_candidates(inputs.floor_map.occupancy(), brief.candidates)
    if not len(places):
        return
    put_up = tuple(
        Reflector(id=str(number), x=x, y=y, radius=brief.candidates.radius)
        for number, (x, y) in enumerate(places.tolist())
    )
    everywhere = replace(inputs, reflectors=ReflectorMap(put_up))
    visible = vehicle_visibility(everywhere, VisibilityOptions(detector=inputs.parameters.detector))
    poses = np.concatenate([each.poses for each in along])
    in_sight = visible.visible_from_poses(poses).incidence(len(places)).any(axis=0)
    useful = np.concatenate([each.sees for each in along]).any(axis=0)
    yield from lacking_at_walls(places[in_sight], inputs.reflectors.centers[useful], brief.demands)


def _along(along: SeenAlong) -> Iterator[Problem]:
    """Stretches of a route on which fewer than `LEAST` are seen; and how much of it has fewer than `ENOUGH`."""
    name, poses, metres = along.name, along.poses, along.metres
    seen = along.sees.sum(axis=1)
    without = _joined(seen, metres)
    for first, end in without[:MOST_OF_A_KIND]:
        worst = first + int(seen[first:end].argmin())
        yield _problem(
            Severity.WARNING,
            Subject.ROUTE,
            name,
            poses[worst],
            f"{_count(int(seen[worst]))} in sight at worst from {metres[first]:.1f} to {metres[end - 1]:.1f} m; "
            f"expected {ENOUGH} or more, and {LEAST} at least: with fewer the pose is lost little by little",
        )
    if len(without) > MOST_OF_A_KIND:
        first, _ = without[MOST_OF_A_KIND]
        more = f"... and {len(without) - MOST_OF_A_KIND} more stretches with fewer than {LEAST} reflectors in sight"
        yield _problem(Severity.WARNING, Subject.ROUTE, name, poses[first], more)
    few = seen == LEAST
    if few.any():
        # Every pose stands for half of the way to its neighbors.
        share = np.gradient(metres) if len(metres) > 1 else np.zeros(1)
        yield _problem(
            Severity.NOTE,
            Subject.ROUTE,
            name,
            poses[int(few.argmax())],
            f"{LEAST} reflectors in sight on {share[few].sum():.1f} m, first at {metres[few.argmax()]:.1f} m; expected "
            f"{ENOUGH} or more, so that one may fail",
        )


def _joined(seen: IntArray, metres: FloatArray) -> list[tuple[int, int]]:
    """First pose, and the one after the last, of stretches with fewer than `LEAST`, those close together as one."""
    found: list[tuple[int, int]] = []
    for first, end in stretches_of(seen < LEAST).tolist():
        if found and metres[first] - metres[found[-1][1] - 1] < JOINED:
            found[-1] = (found[-1][0], end)
        else:
            found.append((first, end))
    return found


def _at_stations(stations: tuple[Station, ...], visible: VehicleVisibility) -> Iterator[Problem]:
    """Stations from which fewer than `ENOUGH` are seen."""
    if not stations:
        return
    poses = np.array([station.pose for station in stations])
    counts = visible.visible_from_poses(poses).counts().tolist()
    for station, pose, count in zip(stations, poses, counts, strict=True):
        if count < ENOUGH:
            severity = Severity.WARNING if count < LEAST else Severity.NOTE
            reason = f"and {LEAST} at least" if count < LEAST else "so that one may fail"
            text = f"{_count(count)} in sight; expected {ENOUGH} or more, {reason}"
            yield _problem(severity, Subject.STATION, station.name, pose, text)


def _count(number: int) -> str:
    return f"{number or 'no'} reflector{'' if number == 1 else 's'}"


def _problem(severity: Severity, subject: Subject, name: str, pose: FloatArray, text: str) -> Problem:
    place = (float(pose[0]), float(pose[1]))
    called = subject.value.capitalize()
    return Problem(severity=severity, text=f"{called} {name!r}: {text}", subject=subject, ids=(name,), place=place)
