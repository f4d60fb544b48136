"""Visibility and dilution over a lattice on the floor: computed as a whole, or kept while single reflectors move.

Both give the same numbers to the last bit. Coloring, files and summaries are elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.raycast import RayTables
from commission.planning import vehicle_fixes
from commission.planning.dilution import Fixes, FixOptions, as_fixes
from commission.planning.dilution_kernels import FIGURES
from commission.planning.shadow_kernels import ALL_CLEAR, ALL_HIDDEN, BitMask, Targets, see_points, sight_of_disc
from commission.planning.vehicle_fixes import FloorSight, views_of
from commission.planning.vehicle_visibility import VehicleVisibility, vehicle_visibility
from commission.planning.view_kernels import ViewMask
from commission.planning.visibility import build_visibility, copied, mask_words, replace_target
from commission.progress import Progress, silent
from commission.site.checks import above
from commission.site.parts import Extended
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap

POINTS_PER_TILE = 1 << 17
"""A tile is a band of whole rows; its masks and its grouping take about 40 bytes per point and 8 more for every 64
reflectors, and view: some 14 MB with 500 reflectors, however large the floor."""
SQUARE = 8
"""Points of the lattice along a square of which a whole is often in sight of a moved reflector, or out of it."""
MARGIN = 5.0
"""Floor around reflectors and routes where there is no map [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lattice:
    """Points on the floor, row by row from the lowest y."""

    x: float
    """First column, map frame [m]."""
    y: float
    """First row, map frame [m]."""
    spacing: float
    """Distance between neighbors [m]."""
    rows: int
    """Number of rows."""
    columns: int
    """Number of columns."""

    def __post_init__(self) -> None:
        above(self.spacing, 0.0, "lattice.spacing", "m")
        if self.rows < 1 or self.columns < 1:
            raise ValueError(f"lattice has {self.rows} x {self.columns} points; expected 1 or more each way")

    def __len__(self) -> int:
        """Return the number of points."""
        return self.rows * self.columns

    @property
    def middle(self) -> tuple[float, float]:
        """Middle of the first and the last point [m], map frame."""
        return self.x + 0.5 * (self.columns - 1) * self.spacing, self.y + 0.5 * (self.rows - 1) * self.spacing

    def points(self) -> FloatArray:
        """All points: (rows * columns, 2) array [m], map frame."""
        grid_y, grid_x = np.mgrid[: self.rows, : self.columns].astype(np.float64)
        return np.stack((self.x + self.spacing * grid_x, self.y + self.spacing * grid_y), axis=-1).reshape(-1, 2)

    def index_near(self, x: float, y: float) -> int | None:
        """Index of the point nearest to a place [m, map frame]; None beside the lattice."""
        column, row = round((x - self.x) / self.spacing), round((y - self.y) / self.spacing)
        if not (0 <= row < self.rows and 0 <= column < self.columns):
            return None
        return row * self.columns + column


class Window(NamedTuple):
    """Rows and columns of a lattice, the last ones not included."""

    first_row: int
    last_row: int
    first_column: int
    last_column: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Coverage:
    """Figures of a fix at every point of a lattice."""

    lattice: Lattice
    """The points."""
    options: FixOptions
    """What was asked for."""
    fixes: Fixes = field(repr=False)
    """One of each figure per point; as images: `image`."""
    floor: BoolArray = field(repr=False)
    """(N,) whether a point is on the floor and not in a wall."""
    counts: BoolArray = field(repr=False)
    """(N,) whether reflectors correct the pose there; elsewhere none is visible."""
    sight: ViewMask = field(repr=False)
    """(V, N, ceil(M / 64)) which of the M reflectors each view sees, as in `VisibilityModel.visible`; a single scanner
    has one view, several have one each, for each heading that is looked at."""

    def image(self, figure: str) -> NDArray[np.generic]:
        """One figure as a (rows, columns) array; row 0 is the lowest y."""
        return getattr(self.fixes, figure).reshape(self.lattice.rows, self.lattice.columns)


def lattice_of(site: Extended, spacing: float = 0.25) -> Lattice:
    """Lattice over the floor map, or over reflectors and routes where there is none.

    Parameters
    ----------
    site : a project, or what of it says how far it reaches; its routes count where there is no map.
    spacing : distance between neighbors [m]; the points are the centers of squares of that size.
    """
    above(spacing, 0.0, "spacing", "m")
    if site.floor_map is not None:
        x_min, y_min, x_max, y_max = site.floor_map.occupancy().bounds()
    else:
        control_points = [segment.control_points for route in site.routes for segment in route.segments]
        places = np.concatenate([site.reflectors.centers, *control_points, np.empty((0, 2))])
        places = places if len(places) else np.zeros((1, 2))
        (x_min, y_min), (x_max, y_max) = places.min(axis=0) - MARGIN, places.max(axis=0) + MARGIN
    # A hair less, so that a floor of a whole number of squares gets no extra row by rounding.
    columns = max(1, math.ceil((x_max - x_min) / spacing - 1e-9))
    rows = max(1, math.ceil((y_max - y_min) / spacing - 1e-9))
    return Lattice(
        x=float(x_min) + 0.5 * spacing, y=float(y_min) + 0.5 * spacing, spacing=spacing, rows=rows, columns=columns
    )


def coverage(
    visible: VehicleVisibility,
    lattice: Lattice,
    options: FixOptions,
    progress: Progress = silent,
    counts_there: BoolArray | None = None,
) -> Coverage:
    """Visibility and dilution at every point of a lattice.

    Memory: about 100 bytes per point of the lattice, and 8 more for every view and 64 reflectors; time is linear in the
    area.

    Parameters
    ----------
    visible : reflectors, scanners and walls.
    lattice : positions as in `vehicle_fixes.fixes`.
    options : measurement model and headings.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.
    counts_there : (N,) whether reflectors correct the pose at each point; None: everywhere.
    """
    there = np.ones(len(lattice), dtype=np.bool_) if counts_there is None else counts_there
    points, counts, figures = lattice.points(), np.empty(len(lattice), np.int32), np.empty((len(lattice), FIGURES))
    floor = ~visible.caster.grid.is_occupied(points)
    views = views_of(visible.scanners, options)
    sight = np.empty((len(views), len(lattice), mask_words(len(visible.reflectors))), dtype=np.uint64)
    for tile in tiles(lattice):
        progress(tile.start / len(lattice), "coverage")
        places = views.places(points[tile])
        sight[:, tile] = views.sight(visible.models, places)
        sight[:, tile][:, ~there[tile]] = 0
        mask, stands = np.ascontiguousarray(sight[:, tile]), views.stands(places, visible.caster)
        seen = FloorSight(points[tile], places, mask, stands)
        every = np.arange(len(seen.points))
        views.fill(visible.reflectors, seen, every, counts=counts[tile], figures=figures[tile])
    progress(1.0, "coverage")
    return Coverage(
        lattice=lattice, options=options, fixes=as_fixes(counts, figures), floor=floor, counts=there, sight=sight
    )


def tiles(lattice: Lattice) -> list[slice]:
    """Bands of whole rows, as slices of the points."""
    step = max(1, POINTS_PER_TILE // lattice.columns) * lattice.columns
    return [slice(start, min(start + step, len(lattice))) for start in range(0, len(lattice), step)]


class LiveCoverage:
    """Coverage that follows reflectors while they are dragged.

    It changes in place, unlike the frozen values around it: to copy a floor's figures takes longer than to update
    them. It keeps which reflectors each view sees (8 bytes per point for every 64 reflectors), and sums a changed
    point anew from those bits; nothing is subtracted, so nothing drifts.

    Parameters
    ----------
    visible : reflectors, scanners and walls.
    found : the coverage under them, from which it sets out; it stays as it is.
    """

    def __init__(self, visible: VehicleVisibility, found: Coverage) -> None:
        lattice, fixes = found.lattice, found.fixes
        self._lattice = lattice
        self._models = [replace(model, targets=copied(model.targets)) for model in visible.models]
        self._views = views_of(visible.scanners, found.options)
        points = lattice.points()
        places = self._views.places(points)
        stands = self._views.stands(places, visible.caster)
        self._seen = FloorSight(points, places, found.sight.copy(), stands)
        self._counts, self._figures = fixes.visible.copy(), np.stack(fixes[1:], axis=-1)
        self._is_listed = np.zeros(len(lattice), dtype=np.bool_)
        self._coverage = replace(found, fixes=as_fixes(self._counts, self._figures), sight=self._seen.mask)

    @property
    def coverage(self) -> Coverage:
        """The current figures; the arrays change with the next `move`."""
        return self._coverage

    @property
    def visible(self) -> VehicleVisibility:
        """The current reflectors, scanners and walls; its shadow maps change with the next `move`."""
        return VehicleVisibility(tuple(self._models))

    @property
    def reflectors(self) -> ReflectorMap:
        """The current reflectors."""
        return self._models[0].reflectors

    def sees(self, reflector: int) -> BoolArray:
        """Whether any view of each point sees a reflector, all around: (N,) array."""
        words = self._seen.mask[:, :, reflector >> 6]
        return ((words >> np.uint64(reflector & 63)) & np.uint64(1) == 1).any(axis=0)

    def move(self, index: int, reflector: Reflector) -> list[Window]:
        """Put a reflector elsewhere, or change it.

        Parameters
        ----------
        index : of the reflector in the map.
        reflector : its new value.

        Returns
        -------
        windows : parts of the lattice outside which nothing changed: around the old and around the new place.
        """
        changed = list(self.reflectors.reflectors)
        changed[index] = reflector
        reflectors = ReflectorMap(tuple(changed))
        if any(model.bins_for(reflector) > model.targets.clear.shape[1] for model in self._models):
            self._models = [
                build_visibility(reflectors, before.scanner, before.caster, before.options) for before in self._models
            ]
            self._fill_all()
            return [Window(0, self._lattice.rows, 0, self._lattice.columns)]
        before, saw = self._seen_from(index)
        for model in self._models:
            replace_target(model.targets, index, reflector, model)
        self._models = [replace(model, reflectors=reflectors) for model in self._models]
        after, sees = self._seen_from(index)
        rows = [
            _change_bits(index, old, new, mask, self._is_listed)
            for old, new, mask in zip(saw, sees, self._seen.mask, strict=True)
        ]
        changed = rows[0] if len(rows) == 1 else np.unique(np.concatenate(rows))
        changed = changed[self._coverage.counts[changed]]
        self._views.fill(reflectors, self._seen, changed, counts=self._counts, figures=self._figures)
        return [*before, *after]

    def _seen_from(self, index: int) -> tuple[list[Window], list[IntArray]]:
        """Of each view, the part of the lattice within reach of a reflector, and the points that see it."""
        windows = [self._window_around(index, view) for view in range(len(self._views))]
        seen = [
            _points_that_see(
                self._models[scanner].caster.tables,
                self._models[scanner].targets,
                index,
                np.array(window),
                self._lattice.columns,
                places,
            )
            for window, scanner, places in zip(windows, self._views.scanners, self._seen.places, strict=True)
        ]
        return windows, seen

    def _fill_all(self) -> None:
        """Compute every point anew."""
        self._seen.mask[:] = self._views.sight(self._models, self._seen.places)
        self._seen.mask[:, ~self._coverage.counts] = 0
        every = np.arange(len(self._lattice))
        self._views.fill(self.reflectors, self._seen, every, counts=self._counts, figures=self._figures)

    def _window_around(self, index: int, view: int) -> Window:
        """Part of the lattice within reach of a reflector in one view."""
        lattice, targets = self._lattice, self._models[self._views.scanners[view]].targets
        reach = targets.farthest[index] / lattice.spacing + 1.0
        column = (targets.centers[index, 0] - self._seen.places[view, 0, 0]) / lattice.spacing
        row = (targets.centers[index, 1] - self._seen.places[view, 0, 1]) / lattice.spacing
        return Window(
            min(max(0, math.floor(row - reach)), lattice.rows),
            max(0, min(lattice.rows, math.ceil(row + reach) + 1)),
            min(max(0, math.floor(column - reach)), lattice.columns),
            max(0, min(lattice.columns, math.ceil(column + reach) + 1)),
        )


@compiled
def _points_that_see(  # noqa: PLR0917 - one reflector, a window of the lattice
    tables: RayTables, targets: Targets, m: int, window: IntArray, columns: int, points: FloatArray
) -> IntArray:
    """Rows of `points` within a window of the lattice that see reflector m all around, square by square."""
    found = np.empty(max(0, (window[1] - window[0]) * (window[3] - window[2])), dtype=np.int64)
    members, seen = np.empty(SQUARE * SQUARE, dtype=np.int64), np.empty(SQUARE * SQUARE, dtype=np.bool_)
    count = 0
    for row in range(window[0], window[1], SQUARE):
        for column in range(window[2], window[3], SQUARE):
            last_row, last_column = min(row + SQUARE, window[1]), min(column + SQUARE, window[3])
            low, high = points[row * columns + column], points[(last_row - 1) * columns + last_column - 1]
            dx, dy = 0.5 * (low[0] + high[0]) - targets.centers[m, 0], 0.5 * (low[1] + high[1]) - targets.centers[m, 1]
            spread = 0.5 * math.hypot(high[0] - low[0], high[1] - low[1]) + 1e-9
            if dx * dx + dy * dy > (targets.farthest[m] + spread) ** 2:
                continue
            sight = sight_of_disc(targets, m, dx, dy, spread)
            if sight == ALL_HIDDEN:
                continue
            size = 0
            for r in range(row, last_row):
                for c in range(column, last_column):
                    members[size] = r * columns + c
                    size += 1
            if sight == ALL_CLEAR:
                seen[:size] = True
            else:
                see_points(tables, targets, m, points, members[:size], seen)
            for i in range(size):
                if seen[i]:
                    found[count] = members[i]
                    count += 1
    return found[:count].copy()


@compiled
def _change_bits(m: int, saw: IntArray, sees: IntArray, mask: BitMask, is_listed: BoolArray) -> IntArray:
    """Set the bits of reflector m anew; list the points that saw it or see it now, each once.

    `is_listed` (N,) is scratch: False on entry and again on return.
    """
    word, bit = m >> 6, np.uint64(1) << np.uint64(m & 63)
    changed = np.empty(len(saw) + len(sees), dtype=np.int64)
    changed[: len(saw)] = saw
    count = len(saw)
    for n in saw:
        mask[n, word] &= ~bit
        is_listed[n] = True
    for n in sees:
        mask[n, word] |= bit
        if not is_listed[n]:
            changed[count] = n
            count += 1
    for n in saw:
        is_listed[n] = False
    return changed[:count].copy()


def warm_up() -> None:
    """Compile the kernels of this module and of `vehicle_fixes`."""
    vehicle_fixes.warm_up()
    project = Project(reflectors=ReflectorMap((Reflector(id="1", x=2.0, y=0.0),)))
    visible = vehicle_visibility(project)
    live = LiveCoverage(visible, coverage(visible, Lattice(x=0.0, y=0.0, spacing=1.0, rows=2, columns=2), FixOptions()))
    live.move(0, Reflector(id="1", x=1.0, y=0.0))
