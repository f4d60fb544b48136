"""What the contours of a floor map tell a single scan at every point of the floor: where no reflector is needed.

The scan is what the map itself would give, its information that of the localizer's own match (`localization.contour`).
Neither people nor boxes that the map lacks are in it, nor the map's own error, which does not average out.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.eigen import eigen_symmetric
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import compose
from commission.localization.contour import (
    COLUMNS,
    FEWEST_POINTS,
    MATCHED,
    ContourModel,
    contour_model,
    lever_of,
    rows_of_match,
    to_grid,
)
from commission.localization.pose_gaussian import PoseGaussian, larger_eigenvalue
from commission.planning.coverage import Lattice
from commission.planning.dilution import FixOptions, Heading
from commission.progress import Progress, silent
from commission.site.floor_map import OCCUPIED, FloorMap
from commission.site.parameters import ContourParameters
from commission.site.scanner import Scanner

CAST_RAD = math.radians(1.0)
"""Angle between the beams that are cast; each stands for those of the scanner that lie between."""
WHOLE_POSE = 3
"""Directions of a pose."""
SINGULAR = 1e-9
"""Share of the largest eigenvalue of an information below which it tells nothing along its direction."""
POINTS_AT_ONCE = 512
"""Points between two words of progress."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ContourCoverage:
    """What contours tell at each of N points of a lattice, at the heading, or the worst or best one, that is asked."""

    lattice: Lattice
    """The points: positions as in `vehicle_fixes.fixes`."""
    told: NDArray[np.int8]
    """(N,) directions that are told: 3 is place and heading, 2 all but one, as in a corridor."""
    position_sigma: FloatArray
    """(N,) 1-sigma along the worst direction [m]; inf where not all are told."""
    heading_sigma: FloatArray
    """(N,) 1-sigma [rad]; inf where not all are told."""
    beams: NDArray[np.int32]
    """(N,) beams that end on a contour."""

    def image(self, figure: str) -> NDArray[np.generic]:
        """One figure as a (rows, columns) array; row 0 is the lowest y."""
        return getattr(self, figure).reshape(self.lattice.rows, self.lattice.columns)


class _Stances(NamedTuple):
    """How the scanners of a vehicle look about a point: H headings, S scanners, D directions, V places."""

    levers: FloatArray
    """(V, 2) where scanners stand about a point [m], map axes."""
    headings: FloatArray
    """(H,) [rad]."""
    place_of: IntArray
    """(H, S) at which of the places each scanner stands."""
    seen: BoolArray
    """(H, S, D) whether it sees a direction."""
    scanner_of: IntArray
    """(S,) its number in the vehicle."""
    weights: FloatArray
    """(S,) its beams that each direction stands for."""


def contour_coverage(  # noqa: PLR0917 - the site, and what is asked
    floor: FloorMap,
    scanners: Sequence[Scanner],
    given: ContourParameters,
    lattice: Lattice,
    options: FixOptions,
    progress: Progress = silent,
) -> ContourCoverage:
    """Compute what contours tell over the floor.

    Parameters
    ----------
    floor : the map.
    scanners : of the vehicle. Where they stand about a point is as in `vehicle_fixes.fixes`: the point is that of base,
        or of the scanner where there is one only and no heading is given. All round, several share the turn at the
        point: no direction counts twice.
    given : noise of a beam and the least share of beams that tell a direction, whether contours are switched on or not.
    lattice : the points.
    options : which headings are looked at; of several, what each figure is at the worst or best of them. One that puts
        one of several scanners into a wall is none.
    progress : told how far it is; may raise to cancel.
    """
    model, caster = _model(floor, scanners, given), RayCaster(floor.occupancy())
    directions = np.arange(-math.pi, math.pi - 0.5 * CAST_RAD, CAST_RAD)
    stances = _stances(scanners, options, directions)
    points, best = lattice.points(), options.heading is Heading.BEST
    found = np.empty((len(points), 4))
    farthest = max(scanner.range[1] for scanner in scanners)
    at_once = max(POINTS_AT_ONCE // len(stances.levers), 1)

    def tell(first: int) -> int:
        here = slice(first, min(first + at_once, len(points)))
        places = points[here, np.newaxis] + stances.levers
        rays = np.empty((*places.shape[:2], len(directions), 3))
        rays[..., :2], rays[..., 2] = places[:, :, np.newaxis], directions
        ranges = caster.cast(rays, farthest)
        stands = np.ones((len(places), len(stances.headings)), dtype=np.bool_)
        if len(scanners) > 1:
            in_wall = np.asarray(caster.grid.is_occupied(places))
            stands = np.logical_not(in_wall[:, stances.place_of].any(axis=2))
        _tell(points[here], ranges, stands, directions, stances, model, best, found[here])
        return here.stop

    # Kernels hold no lock, so that threads use all cores; no parallel kernel takes the tables of a map.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in pool.map(tell, range(0, len(points), at_once)):
            progress(done / len(points), "contours over the floor")
    return ContourCoverage(
        lattice=lattice,
        told=read_only(found[:, 0].astype(np.int8)),
        position_sigma=read_only(found[:, 1].copy()),
        heading_sigma=read_only(found[:, 2].copy()),
        beams=read_only(found[:, 3].astype(np.int32)),
    )


def _model(floor: FloorMap, scanners: Sequence[Scanner], given: ContourParameters) -> ContourModel:
    """Return what a match reads."""
    model = contour_model(floor, scanners, replace(given, enabled=True))
    if model is None:
        raise ValueError("contours need a floor map; expected one")
    return model


def _stances(scanners: Sequence[Scanner], options: FixOptions, directions: FloatArray) -> _Stances:
    """Where the scanners stand for what is asked, and what they see of (D,) directions."""
    heading = options.heading.seen_by(scanners)
    numbers = list(range(len(scanners)))
    if heading is Heading.ALL_ROUND and len(scanners) > 1:
        widths = [scanner.field_of_view[1] - scanner.field_of_view[0] for scanner in scanners]
        numbers = [int(np.argmax(widths))]
    if heading is Heading.ALL_ROUND:
        headings = np.zeros(1)
    elif heading is Heading.GIVEN:
        headings = np.array([options.given_heading])
    else:
        headings = np.arange(options.headings, dtype=np.float64) * (2.0 * math.pi / options.headings)
    seen = np.ones((len(headings), len(numbers), len(directions)), dtype=np.bool_)
    levers = np.zeros((len(headings), len(numbers), 2))
    for s, scanner in enumerate([scanners[number] for number in numbers]):
        if heading is Heading.ALL_ROUND:
            continue
        low, high = scanner.field_of_view
        for h, turned in enumerate(headings):
            bearings = np.mod(directions - turned - scanner.mounting[2] - low, 2.0 * math.pi) + low
            seen[h, s] = bearings <= high + 1e-9
            for begin, width in scanner.blind_sectors.reshape(-1, 2):
                seen[h, s] &= np.mod(bearings - begin, 2.0 * math.pi) > width
            if len(scanners) > 1 or heading is Heading.GIVEN:
                levers[h, s] = compose(np.array((0.0, 0.0, turned)), scanner.mounting)[:2]
    places, place_of = np.unique(levers.reshape(-1, 2), axis=0, return_inverse=True)
    weights = np.array([CAST_RAD / abs(scanners[number].angle_increment) for number in numbers])
    return _Stances(places, headings, place_of.reshape(levers.shape[:2]), seen, np.array(numbers), weights)


@compiled
def _tell(  # noqa: PLR0917 - points, beams, headings
    points: FloatArray,
    ranges: FloatArray,
    stands: BoolArray,
    directions: FloatArray,
    stances: _Stances,
    model: ContourModel,
    best: bool,
    out: FloatArray,
) -> None:
    """Write directions that are told, 1-sigma of position and heading, and beams of each point.

    Information of a scan is the sum over its scanners of H^T H / sigma^2 by the rows of a match at the truth.
    """
    for n in range(len(points)):
        told, position, heading, beams = (0.0, math.inf, math.inf, 0.0) if best else (3.0, 0.0, 0.0, math.inf)
        if not stands[n].any():
            told, position, heading, beams = 0.0, math.inf, math.inf, 0.0
        for h in range(len(stances.headings)):
            if not stands[n, h]:
                continue
            information, count = _information(points[n], ranges[n], directions, h, stances, model)
            rank, s_position, s_heading = _sigmas(information)
            if best:
                told, beams = max(told, rank), max(beams, count)
                position, heading = min(position, s_position), min(heading, s_heading)
            else:
                told, beams = min(told, rank), min(beams, count)
                position, heading = max(position, s_position), max(heading, s_heading)
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = told, position, heading, beams


@compiled
def _information(  # noqa: PLR0917 - a point, its beams, and who sees them
    point: FloatArray, ranges: FloatArray, directions: FloatArray, h: int, stances: _Stances, model: ContourModel
) -> tuple[FloatArray, float]:
    """(3, 3) information of x, y and heading, and beams that end on a contour, of a vehicle that looks one way."""
    heading = stances.headings[h]
    c, s = math.cos(heading), math.sin(heading)
    information, count = np.zeros((3, 3)), 0.0
    pose = PoseGaussian(point[0], point[1], heading, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    ends, figures = np.empty((ranges.shape[1], 2)), np.empty(COLUMNS)
    per_cell = 1.0 / model.tables.resolution
    for k in range(len(stances.weights)):
        weight, place, limits = stances.weights[k], stances.place_of[h, k], model.limits[stances.scanner_of[k]]
        lever_x = c * stances.levers[place, 0] + s * stances.levers[place, 1]
        lever_y = c * stances.levers[place, 1] - s * stances.levers[place, 0]
        n = 0
        for i in range(ranges.shape[1]):
            distance = ranges[place, i]
            if stances.seen[h, k, i] and limits[0] <= distance <= limits[1]:
                bearing = directions[i] - heading
                ends[n, 0] = per_cell * (lever_x + distance * math.cos(bearing))
                ends[n, 1] = per_cell * (lever_y + distance * math.sin(bearing))
                n += 1
        if n * weight < FEWEST_POINTS:
            continue
        points = ends[:n]
        tables, farthest = model.tables, model.rule.largest_error
        rows = rows_of_match(pose, to_grid(pose, tables), farthest, lever_of(points), points, tables, model, figures)
        if figures[MATCHED] < model.least_matched * n:
            continue
        count += figures[MATCHED] * weight
        for r in range(len(rows.variances)):
            for a in range(3):
                for b in range(3):
                    information[a, b] += weight * rows.jacobians[r, a] * rows.jacobians[r, b] / rows.variances[r]
    return information, count


@compiled
def _sigmas(information: FloatArray) -> tuple[float, float, float]:
    """Directions that are told, and 1-sigma of position (its worst direction) and heading; inf where not all are.

    C = V diag(1 / values) V^T, the inverse by the eigenvalues of the information.
    """
    values, vectors = eigen_symmetric(information)
    largest = values.max()
    rank, xx, xy, yy, tt = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(WHOLE_POSE):
        if values[k] > SINGULAR * largest:
            rank += 1.0
            xx += vectors[0, k] * vectors[0, k] / values[k]
            xy += vectors[0, k] * vectors[1, k] / values[k]
            yy += vectors[1, k] * vectors[1, k] / values[k]
            tt += vectors[2, k] * vectors[2, k] / values[k]
    if rank < WHOLE_POSE:
        return rank, math.inf, math.inf
    return rank, math.sqrt(larger_eigenvalue(xx, xy, yy)), math.sqrt(tt)


def warm_up() -> None:
    """Compile the kernels of this module."""
    floor = FloorMap(cells=np.full((3, 3), OCCUPIED, dtype=np.int8), resolution=0.5, origin=np.zeros(3))
    lattice = Lattice(x=0.5, y=0.5, spacing=1.0, rows=1, columns=1)
    contour_coverage(floor, (Scanner(),), ContourParameters(), lattice, FixOptions(heading=Heading.ALL_ROUND))
