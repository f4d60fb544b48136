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

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, read_only
from commission.geometry.eigen import eigen_symmetric
from commission.geometry.raycast import RayCaster
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
    """The points, positions of the scanner."""
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
    scanners : of the vehicle; at each point, as if each stood there.
    given : noise of a beam and the least share of beams that tell a direction, whether contours are switched on or not.
    lattice : the points.
    options : which headings are looked at; of several, what each figure is at the worst or best of them.
    progress : told how far it is; may raise to cancel.
    """
    model = _model(floor, scanners, given)
    caster = RayCaster(floor.occupancy())
    directions = np.arange(-math.pi, math.pi - 0.5 * CAST_RAD, CAST_RAD)
    headings, seen, weights = _views(scanners, options, directions)
    points, best = lattice.points(), options.heading is Heading.BEST
    found = np.empty((len(points), 4))
    farthest = max(scanner.range[1] for scanner in scanners)

    def tell(first: int) -> int:
        here = slice(first, min(first + POINTS_AT_ONCE, len(points)))
        rays = np.empty((here.stop - first, len(directions), 3))
        rays[..., :2], rays[..., 2] = points[here, np.newaxis], directions
        ranges = caster.cast(rays, farthest)
        _tell(points[here], ranges, directions, headings, seen, weights, model, best, found[here])
        return here.stop

    # Kernels hold no lock, so that threads use all cores; no parallel kernel takes the tables of a map.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in pool.map(tell, range(0, len(points), POINTS_AT_ONCE)):
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


def _views(
    scanners: Sequence[Scanner], options: FixOptions, directions: FloatArray
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """(H,) headings, (H, S, D) directions that each scanner sees then, and (S,) its beams that each stands for."""
    heading = options.heading.seen_by(scanners)
    if heading is Heading.ALL_ROUND:
        headings = np.zeros(1)
    elif heading is Heading.GIVEN:
        headings = np.array([options.given_heading])
    else:
        headings = np.arange(options.headings, dtype=np.float64) * (2.0 * math.pi / options.headings)
    seen = np.ones((len(headings), len(scanners), len(directions)), dtype=np.bool_)
    for s, scanner in enumerate(scanners):
        if heading is Heading.ALL_ROUND:
            continue
        low, high = scanner.field_of_view
        for h, turned in enumerate(headings):
            bearings = np.mod(directions - turned - scanner.mounting[2] - low, 2.0 * math.pi) + low
            seen[h, s] = bearings <= high + 1e-9
            for begin, width in scanner.blind_sectors.reshape(-1, 2):
                seen[h, s] &= np.mod(bearings - begin, 2.0 * math.pi) > width
    weights = np.array([CAST_RAD / abs(scanner.angle_increment) for scanner in scanners])
    return headings, seen, weights


@compiled
def _tell(  # noqa: PLR0917 - points, beams, headings
    points: FloatArray,
    ranges: FloatArray,
    directions: FloatArray,
    headings: FloatArray,
    seen: BoolArray,
    weights: FloatArray,
    model: ContourModel,
    best: bool,
    out: FloatArray,
) -> None:
    """Write directions that are told, 1-sigma of position and heading, and beams of each point.

    Information of a scan is the sum over its scanners of H^T H / sigma^2 by the rows of a match at the truth.
    """
    for n in range(len(points)):
        told, position, heading, beams = (0.0, math.inf, math.inf, 0.0) if best else (3.0, 0.0, 0.0, math.inf)
        for h in range(len(headings)):
            information, count = _information(points[n], ranges[n], directions, headings[h], seen[h], weights, model)
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
    point: FloatArray,
    ranges: FloatArray,
    directions: FloatArray,
    heading: float,
    seen: BoolArray,
    weights: FloatArray,
    model: ContourModel,
) -> tuple[FloatArray, float]:
    """(3, 3) information of x, y and heading, and beams that end on a contour, of a vehicle that looks somewhere."""
    information, count = np.zeros((3, 3)), 0.0
    pose = PoseGaussian(point[0], point[1], heading, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    ends, figures = np.empty((len(ranges), 2)), np.empty(COLUMNS)
    per_cell = 1.0 / model.tables.resolution
    for s in range(len(weights)):
        n = 0
        for i in range(len(ranges)):
            if seen[s, i] and model.limits[s, 0] <= ranges[i] <= model.limits[s, 1]:
                bearing = directions[i] - heading
                ends[n, 0], ends[n, 1] = (
                    per_cell * ranges[i] * math.cos(bearing),
                    per_cell * ranges[i] * math.sin(bearing),
                )
                n += 1
        if n * weights[s] < FEWEST_POINTS:
            continue
        points = ends[:n]
        rows = rows_of_match(
            pose, to_grid(pose, model.tables), model.rule.largest_error, lever_of(points), points, model, figures
        )
        if figures[MATCHED] < model.least_matched * n:
            continue
        count += figures[MATCHED] * weights[s]
        for k in range(len(rows.variances)):
            for a in range(3):
                for b in range(3):
                    told = rows.jacobians[k, a] * rows.jacobians[k, b]
                    information[a, b] += weights[s] * told / rows.variances[k]
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
