"""Figures of a fix for a vehicle with one scanner or several: where they stand about a point, and what they add up to.

Of one scanner this is the arithmetic of `dilution`. The measurements of several are independent, so that their
information adds up; a reflector that two of them see is still one reflector.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import compose
from commission.planning import dilution_kernels, view_kernels, visibility
from commission.planning.dilution import Fixes, FixOptions, Heading, as_fixes, fix_model, survey_sigmas
from commission.planning.dilution_kernels import BEST, FULL_TURN, SINGLE, WORST, Counts, FixModel
from commission.planning.vehicle_visibility import VehicleVisibility, vehicle_visibility
from commission.planning.view_kernels import ViewMask, ViewTables
from commission.planning.visibility import VisibilityModel, field_of_view, mask_words, unpack
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Views:
    """How the scanners of a vehicle look at the floor about a point: a view for each place at which one stands.

    A single scanner has one view whatever the headings, since the point is then its own place. Of several scanners the
    point is that of the base, so that each stands somewhere else in every heading.
    """

    scanners: tuple[int, ...]
    """(V,) which scanner each view is of."""
    tables: ViewTables
    """Levers, headings and fields of view."""
    model: FixModel
    """Measurement model of the first scanner; of a single one its headings and field of view, too."""

    def __len__(self) -> int:
        """Return the number of views."""
        return len(self.scanners)

    def places(self, points: FloatArray) -> FloatArray:
        """Where the scanners of the views stand about points (N, 2) [m]: (V, N, 2) array, map frame."""
        return points + self.tables.levers[:, np.newaxis]

    def stands(self, places: FloatArray, walls: RayCaster) -> BoolArray:
        """Whether the vehicle can stand so: (N, H) array. A heading that puts a scanner into a wall is none."""
        if len(self) == 1:
            return np.ones((places.shape[1], 1), dtype=np.bool_)
        in_wall = np.stack([walls.grid.is_occupied(of_view) for of_view in places])
        # The point itself is judged by whoever asks: in a wall, each figure is that of nothing seen.
        return np.logical_not(in_wall[self.tables.view_of].any(axis=1).T)

    def sight(self, models: Sequence[VisibilityModel], places: FloatArray) -> ViewMask:
        """Which reflectors each view sees, all around, from its places (V, N, 2) [m]: (V, N, ceil(M / 64)) array."""
        mask = np.empty((*places.shape[:2], mask_words(len(models[0].reflectors))), dtype=np.uint64)
        for view, scanner in enumerate(self.scanners):
            mask[view] = models[scanner].visible(places[view])
        return mask

    def fill(
        self,
        reflectors: ReflectorMap,
        seen: FloorSight,
        rows: IntArray,
        *,
        counts: Counts,
        figures: FloatArray,
    ) -> None:
        """Fill the figures of some points.

        Parameters
        ----------
        reflectors : the M reflectors.
        seen : what is seen from N points.
        rows : which of them.
        counts, figures : (N,) and (N, FIGURES) outputs.
        """
        centers, sigmas = np.array(reflectors.centers), survey_sigmas(reflectors)
        if len(self) == 1:
            places, mask = seen.places[0], seen.mask[0]
            dilution_kernels.fill_fixes(centers, sigmas, places, rows, mask, self.model, counts, figures)
        else:
            view_kernels.fill_view_fixes(
                centers, sigmas, seen.points, rows, seen.mask, seen.stands, self.tables, self.model, counts, figures
            )


@dataclass(frozen=True, slots=True, eq=False)
class FloorSight:
    """What the views of a vehicle see from N points."""

    points: FloatArray
    """(N, 2) [m], map frame."""
    places: FloatArray
    """(V, N, 2) where the scanners of the views stand [m], map frame."""
    mask: ViewMask
    """(V, N, ceil(M / 64)) which of the M reflectors each view sees."""
    stands: BoolArray
    """(N, H) whether the vehicle can stand there in each heading."""


def views_of(scanners: Sequence[Scanner], options: FixOptions) -> Views:
    """Views of a vehicle's scanners for what is asked.

    Parameters
    ----------
    scanners : of the vehicle.
    options : measurement model and headings.
    """
    if len(scanners) == 1:
        model = fix_model(scanners[0], options)
        lever = np.array([[model.lever_x, model.lever_y]])
        return Views(scanners=(0,), tables=_tables(scanners, options, np.zeros((1, 1)), lever), model=model)
    count, model = len(scanners), fix_model(scanners[0], replace(options, heading=Heading.ALL_ROUND))
    # Bearings from two places make up for a third reflector; whether they do is seen from the sums.
    model = model._replace(fewest=min(model.fewest, 2))
    if options.heading is Heading.ALL_ROUND:
        model = fix_model(scanners[0], options)
        tables = _tables(scanners, options, np.zeros((1, count)), np.zeros((count, 2)), all_round=True)
        return Views(scanners=tuple(range(count)), tables=tables, model=model)
    headings, combine = np.array([options.given_heading]), SINGLE
    if options.heading is not Heading.GIVEN:
        headings = np.arange(options.headings, dtype=np.float64) * (2.0 * math.pi / options.headings)
        combine = WORST if options.heading is Heading.WORST else BEST
    bases = np.column_stack((np.zeros((len(headings), 2)), headings))
    # Heading by heading, scanner by scanner.
    stand = np.stack([compose(bases, scanner.mounting) for scanner in scanners], axis=1)
    levers = np.ascontiguousarray(stand[..., :2].reshape(-1, 2))
    return Views(
        scanners=tuple(range(count)) * len(headings),
        tables=_tables(scanners, options, stand[..., 2], levers),
        model=model._replace(combine=combine),
    )


def _tables(
    scanners: Sequence[Scanner],
    options: FixOptions,
    headings: FloatArray,
    levers: FloatArray,
    *,
    all_round: bool = False,
) -> ViewTables:
    """Tables of S scanners for the kernels, for headings (H, S) and levers (V, 2)."""
    fields = [(-math.pi, 2.0 * math.pi) if all_round else field_of_view(scanner) for scanner in scanners]
    models = [fix_model(scanner, options) for scanner in scanners]
    variances = np.array([(model.range_variance, model.bearing_variance) for model in models])
    return ViewTables(
        levers=levers,
        view_of=np.arange(headings.size).reshape(headings.shape),
        facing=_facing(headings, fields),
        cosine=np.array([-2.0 if width >= FULL_TURN else math.cos(0.5 * width) for _, width in fields]),
        blind=_blind(() if all_round else scanners),
        once=all_round,
        variances=variances,
        weights=1.0 / variances,
    )


def _blind(scanners: Sequence[Scanner]) -> FloatArray:
    """(S, B, 2) blind sectors from the middle of each field of view, filled up with such as hold nothing."""
    sectors = [scanner.blind_sectors for scanner in scanners]
    table = np.full((len(sectors), max(map(len, sectors), default=0), 2), -1.0)
    for row, scanner, own in zip(table, scanners, sectors, strict=True):
        first, width = field_of_view(scanner)
        row[: len(own)] = own - (first + 0.5 * width, 0.0)
    return table


def _facing(headings: FloatArray, fields: Sequence[tuple[float, float]]) -> FloatArray:
    """(..., S, 2) unit vectors to the middles of fields of view (first bearing, width), of headings (..., S) [rad]."""
    middles = headings + np.array([first + 0.5 * width for first, width in fields])
    return np.stack((np.cos(middles), np.sin(middles)), axis=-1)


def fixes(visible: VehicleVisibility, points: ArrayLike, options: FixOptions) -> Fixes:
    """Figures of a fix from points of the floor.

    Parameters
    ----------
    visible : reflectors, scanners and walls.
    points : (N, 2) array [m], map frame: positions of the base, or of the scanner where there is one only and no
        heading is given. (Seen from a base, it would stand elsewhere for each heading.) All round, several scanners
        stand at the point, too.
    options : measurement model and headings.

    Returns
    -------
    fixes : N of each figure; infinite where the geometry is singular.
    """
    xy = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 2))
    views = views_of(visible.scanners, options)
    places = views.places(xy)
    seen = FloorSight(xy, places, views.sight(visible.models, places), views.stands(places, visible.caster))
    counts, figures = np.empty(len(xy), dtype=np.int32), np.empty((len(xy), dilution_kernels.FIGURES))
    views.fill(visible.reflectors, seen, np.arange(len(xy)), counts=counts, figures=figures)
    return as_fixes(counts, figures)


def fix_covariances(visible: VehicleVisibility, T_map_base: ArrayLike, options: FixOptions) -> FloatArray:
    """Covariance of a fix from poses of the vehicle, with mounting and field of view of its scanners.

    Parameters
    ----------
    visible : reflectors, scanners and walls.
    T_map_base : (N, 3) array of poses [m, m, rad].
    options : measurement model; with `all-round` the field of view does not limit, with any other heading it does, and
        the heading itself is that of the pose.

    Returns
    -------
    covariances : (N, 3, 3) array of x, y and heading of the base, map axes [m, m, rad]; where the geometry is singular
        its diagonal is infinite and the rest zero.
    """
    poses = np.asarray(T_map_base, dtype=np.float64).reshape(-1, 3)
    if len(visible.models) == 1:
        return _covariances_of_one(visible.models[0], poses, options)
    all_round = options.heading is Heading.ALL_ROUND
    stand = np.stack([compose(poses, scanner.mounting) for scanner in visible.scanners], axis=1)
    count = len(visible.reflectors)
    sees = [unpack(model.visible(stand[:, s, :2]), count) for s, model in enumerate(visible.models)]
    model = fix_model(visible.scanners[0], replace(options, heading=Heading.ALL_ROUND))
    if not all_round:
        model = model._replace(fewest=min(model.fewest, 2))
    fields = [field_of_view(scanner) for scanner in visible.scanners]
    covariances = np.empty((len(poses), 3, 3))
    view_kernels.fill_view_covariances(
        np.array(visible.reflectors.centers),
        survey_sigmas(visible.reflectors),
        np.ascontiguousarray(poses[:, :2]),
        np.ascontiguousarray(stand[..., :2]),
        _facing(stand[..., 2], fields),
        np.stack(sees, axis=2),
        _tables(visible.scanners, options, np.zeros((1, len(fields))), np.zeros((len(fields), 2)), all_round=all_round),
        model,
        covariances,
    )
    return covariances


def _covariances_of_one(model: VisibilityModel, poses: FloatArray, options: FixOptions) -> FloatArray:
    """(N, 3, 3) covariances of poses (N, 3) with one scanner."""
    visible = model.visible_from_poses(poses, all_round=options.heading is Heading.ALL_ROUND)
    T_map_scanner = compose(poses, model.scanner.mounting)
    covariances = np.empty((len(poses), 3, 3))
    dilution_kernels.fill_covariances(
        model.targets.centers,
        survey_sigmas(model.reflectors),
        T_map_scanner,
        T_map_scanner[:, :2] - poses[:, :2],
        visible.offsets,
        visible.indices,
        fix_model(model.scanner, replace(options, heading=Heading.ALL_ROUND)),
        covariances,
    )
    return covariances


def warm_up() -> None:
    """Compile the kernels of a single scanner, and those of `visibility`."""
    visibility.warm_up()
    _warm_up((Scanner(),))


def warm_up_several() -> None:
    """Compile the kernels of several scanners, after those of `warm_up`."""
    _warm_up((Scanner(), Scanner(name="other")))


def _warm_up(scanners: tuple[Scanner, ...]) -> None:
    """Ask for fixes from one point."""
    reflectors = ReflectorMap((Reflector(id="1", x=2.0, y=0.0),))
    visible = vehicle_visibility(Project(reflectors=reflectors, scanners=scanners))
    fixes(visible, [[0.0, 0.0]], FixOptions())
    fix_covariances(visible, [[0.0, 0.0, 0.0]], FixOptions())
