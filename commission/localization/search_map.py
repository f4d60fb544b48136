"""What a search for the vehicle reads of site and scanners: made once for a setup, when it is first needed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from commission.geometry.arrays import FloatArray, read_only
from commission.geometry.ray_kernels import RayTables
from commission.localization.contour import ContourModel
from commission.localization.contour_search import ScoredFloor, scored_floor
from commission.localization.lasting import HARMLESS
from commission.localization.odometry import OdometryNoise
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import ReflectorIndex
from commission.localization.setup import LocalizerSetup
from commission.localization.start import MARGIN, DistanceTable, pair_table
from commission.site.floor_map import FloorMap
from commission.site.reflectors import ReflectorKind
from commission.site.walls import walls_of

CLOSE = 0.5
"""Reflectors nearer to each other than that [m] are one place: what is seen of one may be of the other."""


class ContourFloor(NamedTuple):
    """The contours of the hall, for a search by them."""

    model: ContourModel
    floor: ScoredFloor
    sweep_rows: FloatArray
    """See `LocalizerSetup`."""


class SearchMap(NamedTuple):
    """Reflectors, what hides them, and how scanners see."""

    table: DistanceTable
    """All pairs of reflectors."""
    reflectors: ReflectorIndex
    facings: FloatArray
    """(N,) direction that the reflector of each row of `places` faces [rad]; NaN: seen from all sides."""
    eyes: FloatArray
    """(E, 5) scanner, first bearing and width of a stretch of its field of view [rad], smallest and largest range of a
    reflector [m]."""
    walls: RayTables
    """Of the floor map."""
    walled: bool
    """Whether there is one."""
    odometry: OdometryNoise
    anywhere: PoseGaussian
    """A belief as wide as the floor."""
    models: FloatArray
    """(S, 6) of the observation by each scanner, see `observation_rows`."""
    crowd: FloatArray
    """(N,) one over the reflectors within `CLOSE` of each row of `places`, itself among them."""
    harmless: float
    """What is seen of a reflector may lie that far beside it [m], see `contradiction`."""
    area: float
    """Of the floor on which the vehicle may be [m^2]."""
    has_reflectors: bool
    """Whether there are enough of them to be found by: then nothing else of a scan is a confirmation by itself."""
    contours: ContourFloor | None
    """Contours that a place is looked for by; None: they are not looked at."""


def search_map(setup: LocalizerSetup) -> SearchMap:
    """Return what a search with this setup reads."""
    index, reflectors = setup.index, setup.reflectors.reflectors
    rows = index.places[:, 3].astype(np.int64).tolist()
    facings = np.full(len(rows), np.nan)
    for row, at in enumerate(rows):
        each = reflectors[at]
        if each.kind is ReflectorKind.FLAT and each.heading is not None:
            facings[row] = each.heading
    eyes = [
        (number, first, last - first, scanner.range[0], min(scanner.range[1], scanner.reflector_range))
        for number, scanner in enumerate(setup.scanners)
        for first, last in scanner.views.tolist()
    ]
    close = KDTree(index.places[:, :2]).query_ball_point(index.places[:, :2], CLOSE) if len(rows) else []
    has_reflectors = setup.finds_by_reflectors
    floor = setup.contour_floor
    wide = anywhere(index.places, floor)
    longest = 2.0 * max((eye[4] for eye in eyes), default=1.0)
    table, contour = pair_table(index.places, longest), setup.contour
    return SearchMap(
        table,
        index,
        read_only(facings),
        read_only(np.array(eyes, dtype=np.float64).reshape(-1, 5)),
        walls_of(setup.floor).tables,
        setup.floor is not None,
        setup.filter.odometry,
        wide,
        setup.observation_rows,
        read_only(1.0 / np.array([len(each) for each in close], dtype=np.float64)),
        HARMLESS * setup.parameters.supervisor.position_limit,
        table.area if has_reflectors else 12.0 * math.sqrt(wide.xx * wide.yy),
        has_reflectors,
        None if contour is None or floor is None else ContourFloor(contour, scored_floor(floor), setup.sweep_rows),
    )


def anywhere(places: FloatArray, floor: FloorMap | None = None) -> PoseGaussian:
    """Belief of a vehicle that may be anywhere: variances of a rectangle around all reflectors, and of any heading.

    Parameters
    ----------
    places : (N, 2) or more columns: x, y of the reflectors [m], map frame.
    floor : a floor map whose contours are looked at: the rectangle then holds it, too.
    """
    if len(places) == 0 and floor is None:
        return PoseGaussian(0.0, 0.0, 0.0, MARGIN**2, 0.0, 0.0, MARGIN**2, 0.0, math.pi**2 / 3.0)
    corners = [] if floor is None else [floor.occupancy().corners()]
    if len(places):
        corners += [places[:, :2] - MARGIN, places[:, :2] + MARGIN]
    within = np.concatenate(corners)
    low, high = within.min(axis=0), within.max(axis=0)
    x, y = (0.5 * (low + high)).tolist()
    xx, yy = (np.square(high - low) / 12.0).tolist()
    return PoseGaussian(x, y, 0.0, xx, 0.0, 0.0, yy, 0.0, math.pi**2 / 3.0)
