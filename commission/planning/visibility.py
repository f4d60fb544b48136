"""Which reflectors the scanner sees from where: range, field of view, incidence, occlusion by the map.

Every answer is that of the exact ray between scanner and reflector; shadow maps (`shadow_kernels`) only make most of
the rays unnecessary. What the sight is worth for localization is in `dilution`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from commission.compiled import compiled
from commission.geometry.angles import within
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import compose
from commission.localization.beam_echo import LIT_SHARE, flagged_span, half_width_at
from commission.planning import shadow_kernels
from commission.planning.detection_noise import detection_table
from commission.planning.shadow_kernels import BLOCK, BitMask, Targets
from commission.site.checks import at_least, between
from commission.site.glued import depths_in_walls
from commission.site.parameters import DetectorParameters
from commission.site.parts import Sighted
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.walls import walls_of

# Points are handled in squares of this edge [m]: whether a whole square sees a reflector is often one answer.
BUCKET = 2.0
# Buckets along the edge of a block of them.
BLOCK_EDGE = 8
# Bearings this far outside the field of view still count [rad]: the last beam of a scan is rounded too.
BEARING_TOLERANCE = 1e-9
# A ray to a plate that is drawn inside a wall ends this far in front of the wall [m].
OUT_OF_WALL = 0.005
# Where a promise that holds from here on holds for good [m].
FARTHEST = 1e6


@dataclass(frozen=True, slots=True)
class VisibilityOptions:
    """What it takes for a reflector to count as visible, beyond a free line of sight."""

    min_beams: int = 1
    """Beams that a reflector must get for certain, so that it passes the detector filter (equation 3) [beams]."""
    max_incidence_deg: float = 60.0
    """Largest angle between a flat reflector's normal and the ray at which it still reflects [deg]."""

    detector: DetectorParameters | None = None
    """The detector, whose filter must pass a reflector in at least half of all scans; None: it passes all."""

    def __post_init__(self) -> None:
        at_least(self.min_beams, 1, "visibility.min_beams", "beams")
        between(self.max_incidence_deg, (0.0, 89.0), "visibility.max_incidence_deg", "deg")


class VisibleReflectors(NamedTuple):
    """Which reflectors are seen from each of N poses, as lists laid end to end."""

    offsets: IntArray
    """(N + 1,) the reflectors of pose n are `indices[offsets[n]:offsets[n + 1]]`."""
    indices: IntArray
    """(total,) indices into the reflector map, ascending for each pose unless said otherwise."""

    def of(self, pose: int) -> IntArray:
        """Indices of the reflectors that one pose sees."""
        return self.indices[self.offsets[pose] : self.offsets[pose + 1]]

    def counts(self) -> IntArray:
        """Return the number of visible reflectors of each pose: (N,) array."""
        return np.diff(self.offsets)

    def incidence(self, reflectors: int) -> BoolArray:
        """Whether each pose sees each of the M reflectors of the map: (N, M) array."""
        sees = np.zeros((len(self.offsets) - 1, reflectors), dtype=np.bool_)
        sees[np.repeat(np.arange(len(sees)), self.counts()), self.indices] = True
        return sees


# Asked for each reflector of a map, most of which are alike.
@functools.lru_cache(maxsize=1024)
def promised_range(
    radius: float, resolution: float, min_beams: int, beam_width: float = 0.0, aperture: float = 0.0
) -> float:
    """Range up to which a reflector gets at least `min_beams` beams wherever it stands between two of them.

    Parameters
    ----------
    radius : of the reflector [m].
    resolution : step between neighboring beams [rad].
    min_beams : number of beams, at least 1.
    beam_width : divergence of a beam [rad]; it widens the angle in which a reflector is met. With 0 this is
        equation 3 of Sobreira et al. 2016 as printed, floor(2 asin(radius / r) / resolution) >= min_beams.
    aperture : width of a beam where it leaves the scanner [m].

    Returns
    -------
    range : largest distance to the reflector's center [m]; inf when the beam width alone is enough.
    """
    needed = min_beams * resolution
    near, far = radius, FARTHEST
    if _flagged_span(far, radius, beam_width, aperture) >= needed:
        return math.inf
    # The span falls with the distance: halve to the last digit.
    while far - near > 1e-13 * far:
        middle = 0.5 * (near + far)
        if _flagged_span(middle, radius, beam_width, aperture) >= needed:
            near = middle
        else:
            far = middle
    return near


def _flagged_span(distance: float, radius: float, beam_width: float, aperture: float) -> float:
    """Angle within which the beams lie that a reflector flags [rad]."""
    half_width = half_width_at(distance, 0.5 * beam_width, 0.5 * aperture)
    return flagged_span(math.asin(radius / distance), half_width, LIT_SHARE)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VisibilityModel:
    """Reflectors, scanner and walls, prepared so that lines of sight cost one comparison each.

    Memory: 8 bytes per reflector and bin of direction (16 MB for 500 reflectors at 30 m and cells of 0.05 m), besides
    the eight bytes per cell of the ray caster; a mask of N points adds 8 bytes per point for every 64 reflectors.
    """

    reflectors: ReflectorMap
    """The M reflectors."""
    scanner: Scanner
    """The scanner whose field of view, mounting and ranges apply."""
    options: VisibilityOptions
    """What counts as visible."""
    caster: RayCaster
    """The walls."""
    targets: Targets = field(repr=False)
    """The reflectors with their shadow maps, for kernels; nobody writes into them."""

    def visible(self, points: ArrayLike) -> BitMask:
        """Reflectors seen by a scanner that looks all around.

        Parameters
        ----------
        points : (N, 2) array [m], map frame: positions of the scanner.

        Returns
        -------
        mask : (N, ceil(M / 64)) uint64 array; bit m % 64 of word m // 64 is set when reflector m is seen.
        """
        xy = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 2))
        mask = np.zeros((len(xy), mask_words(len(self.reflectors))), dtype=np.uint64)
        if len(xy) and len(self.reflectors):
            order, starts = buckets(xy)
            shadow_kernels.visible_mask(self.caster.tables, self.targets, xy, order, starts, mask)
        return mask

    def visible_from_poses(self, poses: ArrayLike, *, all_round: bool = False) -> VisibleReflectors:
        """Reflectors inside the field of view from poses of the vehicle, with their centers in no blind sector.

        Parameters
        ----------
        poses : (N, 3) array `T_map_base` [m, m, rad]; the scanner's mounting is added here.
        all_round : whether to look all around, whatever the field of view.

        Returns
        -------
        visible : the reflectors of each pose.
        """
        T_map_scanner = compose(np.asarray(poses, dtype=np.float64).reshape(-1, 3), self.scanner.mounting)
        mask = self.visible(T_map_scanner[:, :2])
        first, width = (-math.pi, 2.0 * math.pi) if all_round else field_of_view(self.scanner)
        blind = np.empty((0, 2)) if all_round else self.scanner.blind_sectors
        offsets = np.zeros(len(mask) + 1, dtype=np.int64)
        # Two passes over the bits: the first counts, so that the second writes into an array of the right size.
        _keep_visible(mask, T_map_scanner, self.targets.centers, first, width, blind, offsets)
        np.cumsum(offsets, out=offsets)
        indices = np.empty(offsets[-1], dtype=np.int64)
        _list_bits(mask, indices)
        return VisibleReflectors(offsets, indices)

    def with_reflector(self, index: int, reflector: Reflector) -> VisibilityModel:
        """Return the model after one reflector was moved or changed; only its own shadow map is made anew."""
        changed = list(self.reflectors.reflectors)
        changed[index] = reflector
        reflectors = ReflectorMap(tuple(changed))
        if self.bins_for(reflector) > self.targets.clear.shape[1]:
            return build_visibility(reflectors, self.scanner, self.caster, self.options)
        targets = copied(self.targets)
        replace_target(targets, index, reflector, self)
        return replace(self, reflectors=reflectors, targets=targets)

    def restricted(self, kept: BoolArray) -> VisibilityModel:
        """Return the model of some of its reflectors: those of a mask (M,), in their order. No shadow is cast anew."""
        chosen = zip(self.reflectors.reflectors, kept.tolist(), strict=True)
        reflectors = ReflectorMap(tuple(reflector for reflector, is_kept in chosen if is_kept))
        return replace(self, reflectors=reflectors, targets=_each_array(self.targets, lambda array: array[kept]))

    def bins_for(self, reflector: Reflector) -> int:
        """Bins of direction that a reflector needs; one that is seen from farther away needs more."""
        return _bins(_limits(reflector, self.scanner, self.options)[1], self.caster.grid)


def visibility_models(site: Sighted, options: VisibilityOptions | None = None) -> tuple[VisibilityModel, ...]:
    """Prepare the reflectors and walls of a site for each of its scanners; one without a floor map is an open field.

    Parameters
    ----------
    site : a project, or what of it says which reflectors are seen from where.
    options : what counts as visible; the defaults when None.
    """
    caster, chosen = walls_of(site.floor_map), options or VisibilityOptions()
    return tuple(build_visibility(site.reflectors, scanner, caster, chosen) for scanner in site.scanners)


def seen_in_turn(models: Sequence[VisibilityModel], poses: FloatArray, scanners: IntArray) -> VisibleReflectors:
    """Reflectors that scanners see which take turns.

    Parameters
    ----------
    models : of each scanner.
    poses : (N, 3) array `T_map_base` [m, m, rad].
    scanners : (N,) which scanner looks from each pose.
    """
    if len(models) == 1:
        return models[0].visible_from_poses(poses)
    found = [model.visible_from_poses(poses[scanners == index]) for index, model in enumerate(models)]
    counts = np.empty(len(poses), dtype=np.int64)
    for index, each in enumerate(found):
        counts[scanners == index] = each.counts()
    offsets = np.concatenate(([0], np.cumsum(counts)))
    indices = np.empty(int(offsets[-1]), dtype=np.int64)
    is_of = np.repeat(scanners, counts)
    for index, each in enumerate(found):
        # Of one scanner, poses stand in their order: so do its entries.
        indices[is_of == index] = each.indices
    return VisibleReflectors(offsets, indices)


def build_visibility(
    reflectors: ReflectorMap, scanner: Scanner, caster: RayCaster, options: VisibilityOptions
) -> VisibilityModel:
    """Prepare reflectors, one shadow map each.

    Parameters
    ----------
    reflectors : M reflectors.
    scanner : its ranges and resolution limit the range of sight.
    caster : the walls.
    options : what counts as visible.
    """
    count = len(reflectors)
    limits = np.array([_limits(r, scanner, options) for r in reflectors.reflectors]).reshape(-1, 3)
    bins = _bins(float(limits[:, 1].max(initial=1.0)), caster.grid)
    normals = np.stack((np.cos(reflectors.headings), np.sin(reflectors.headings)), axis=-1)
    targets = Targets(
        centers=np.array(reflectors.centers),
        radii=_arrival(reflectors, caster.grid, options),
        normals=np.where(reflectors.is_directed[:, np.newaxis], normals, 0.0),
        nearest=np.ascontiguousarray(limits[:, 0]),
        farthest=np.ascontiguousarray(limits[:, 1]),
        promised=np.ascontiguousarray(limits[:, 2]),
        cosine_limit=math.cos(math.radians(options.max_incidence_deg)),
        clear=np.empty((count, bins), dtype=np.float32),
        hidden=np.empty((count, bins), dtype=np.float32),
        clear_blocks=np.empty((count, bins // BLOCK), dtype=np.float32),
        hidden_blocks=np.empty((count, bins // BLOCK), dtype=np.float32),
    )
    shadow_kernels.cast_shadows(caster.tables, targets)
    return VisibilityModel(reflectors=reflectors, scanner=scanner, options=options, caster=caster, targets=targets)


def copied(targets: Targets) -> Targets:
    """Targets with arrays of their own, to be written into."""
    return _each_array(targets, np.copy)


def _each_array(targets: Targets, changed: Callable[[NDArray[Any]], NDArray[Any]]) -> Targets:
    """Targets with each array changed; its first axis is that of the reflectors."""
    arrays = {name: changed(value) for name, value in targets._asdict().items() if isinstance(value, np.ndarray)}
    return targets._replace(**arrays)


def replace_target(targets: Targets, index: int, reflector: Reflector, model: VisibilityModel) -> None:
    """Write one reflector and its shadow map into a table of reflectors.

    Parameters
    ----------
    targets : the table, changed in place.
    index : row of the reflector.
    reflector : the new one; it must need no more bins than the table has.
    model : scanner, walls and options.
    """
    nearest, farthest, promised = _limits(reflector, model.scanner, model.options)
    heading = reflector.heading if reflector.kind == "flat" else None
    targets.centers[index] = reflector.x, reflector.y
    targets.radii[index] = _arrival(ReflectorMap((reflector,)), model.caster.grid, model.options)[0]
    targets.normals[index] = (0.0, 0.0) if heading is None else (math.cos(heading), math.sin(heading))
    targets.nearest[index], targets.farthest[index], targets.promised[index] = nearest, farthest, promised
    shadow_kernels.cast_shadow(model.caster.tables, targets, index)


def field_of_view(scanner: Scanner) -> tuple[float, float]:
    """First bearing and width [rad], scanner frame, widened by a rounding tolerance; a full turn sees everything."""
    if scanner.is_full_turn:
        return -math.pi, 2.0 * math.pi
    first, last = scanner.field_of_view
    return first - BEARING_TOLERANCE, last - first + 2.0 * BEARING_TOLERANCE


def faces(scanner: Scanner, bearings: FloatArray) -> BoolArray:
    """(...) whether a scanner looks that way: (...) bearings [rad] in its frame, in the field of view and not blind."""
    return within(bearings, np.array([field_of_view(scanner)])) & ~within(bearings, scanner.blind_sectors)


def mask_words(reflectors: int) -> int:
    """Length of the second axis of a mask: words of 64 reflectors, at least one."""
    return max(1, -(-reflectors // 64))


def unpack(mask: BitMask, reflectors: int) -> BoolArray:
    """Mask as a (N, M) boolean array, for small numbers of points."""
    index = np.arange(reflectors)
    return (mask[:, index >> 6] >> (index & 63).astype(np.uint64)) & np.uint64(1) == 1


def buckets(points: FloatArray) -> tuple[IntArray, IntArray]:
    """Group points (N, 2) by squares of the plane: their indices bucket by bucket, and where each bucket starts.

    Buckets come block by block: what is near to a block and looked at for each of its buckets then stays in the caches,
    however wide the floor is.
    """
    cells = np.floor((points - points.min(axis=0)) / BUCKET).astype(np.int64)
    blocks, within_block = cells // BLOCK_EDGE, cells % BLOCK_EDGE
    keys = blocks[:, 1] * (blocks[:, 0].max() + 1) + blocks[:, 0]
    keys = (keys * BLOCK_EDGE + within_block[:, 1]) * BLOCK_EDGE + within_block[:, 0]
    order = np.argsort(keys, kind="stable")
    changes = np.flatnonzero(np.diff(keys[order])) + 1
    return order, np.concatenate(([0], changes, [len(points)])).astype(np.int64)


def _limits(reflector: Reflector, scanner: Scanner, options: VisibilityOptions) -> tuple[float, float, float]:
    """Nearest, farthest and promised distance between scanner and center [m]."""
    # A scanner measures to the surface, which a cylinder has one radius before its center and a plate at its center.
    is_flat = reflector.kind == "flat"
    depth = 0.0 if is_flat else reflector.reckoned_radius
    promised = promised_range(
        reflector.radii[0],
        scanner.angle_increment,
        options.min_beams,
        math.radians(scanner.beam_width_deg),
        scanner.beam_aperture,
    )
    nearest = scanner.range[0] + depth
    farthest = min(min(scanner.range[1], scanner.reflector_range) + depth, promised)
    if options.detector is None or not options.detector.enabled:
        return nearest, farthest, promised
    # Of the reflector alone, so that it does not depend on what other reflectors there are.
    likely = detection_table(ReflectorMap((reflector,)), scanner, options.detector).likely_between(0)
    return max(nearest, likely[0]), min(farthest, likely[1]), promised


def _arrival(reflectors: ReflectorMap, grid: OccupancyGrid, options: VisibilityOptions) -> FloatArray:
    """(M,) how near to each center a ray has arrived [m]: its radius, or out of the wall that a plate is drawn into."""
    depths = depths_in_walls(reflectors, grid) / math.cos(math.radians(options.max_incidence_deg))
    return np.maximum(reflectors.radii, np.where(depths > 0.0, depths + OUT_OF_WALL, 0.0))


def _bins(farthest: float, grid: OccupancyGrid) -> int:
    """Bins of direction, so that even the widest is narrower than a cell at that range."""
    yaw = float(grid.origin[2])
    per_bin = shadow_kernels.trusted_range(grid.resolution, math.sin(yaw), math.cos(yaw), 1)
    # What is hit a cell's diagonal beyond the range still matters.
    return BLOCK * max(1, math.ceil((farthest + 2.0 * grid.resolution) / (per_bin * BLOCK)))


@compiled
def in_field_of_view(bearing: float, first: float, width: float) -> bool:
    """Whether a bearing lies within a field of view.

    Parameters
    ----------
    bearing : of any turn [rad].
    first, width : first bearing of the field of view, and its width counterclockwise [rad].

    Notes
    -----
    (bearing - first) mod 2 pi <= width, by definition.
    """
    offset = bearing - first
    return offset - 2.0 * math.pi * math.floor(offset / (2.0 * math.pi)) <= width


@compiled
def is_blind(bearing: float, blind: FloatArray) -> bool:
    """Whether a bearing lies in a blind sector.

    Parameters
    ----------
    bearing : of any turn [rad].
    blind : (S, 2) first bearing and width of each sector [rad].

    Notes
    -----
    (bearing - first) mod 2 pi <= width for any of them, by definition.
    """
    for s in range(len(blind)):
        if in_field_of_view(bearing, blind[s, 0], blind[s, 1]):
            return True
    return False


@compiled
def _keep_visible(  # noqa: PLR0917 - bits, poses and where they look
    mask: BitMask,
    poses: FloatArray,
    centers: FloatArray,
    first: float,
    width: float,
    blind: FloatArray,
    counts: IntArray,
) -> None:
    """Clear the bits of reflectors that lie outside of the field of view; count those that stay, one row further on.

    Notes
    -----
    No formula: `in_field_of_view` of each bit that is set.
    """
    for n in range(len(poses)):
        found = 0
        for word in range(mask.shape[1]):
            bits, kept, m = mask[n, word], mask[n, word], word << 6
            while bits:
                if bits & np.uint64(1):
                    bearing = math.atan2(centers[m, 1] - poses[n, 1], centers[m, 0] - poses[n, 0]) - poses[n, 2]
                    if in_field_of_view(bearing, first, width) and not is_blind(bearing, blind):
                        found += 1
                    else:
                        kept &= ~(np.uint64(1) << np.uint64(m & 63))
                bits >>= np.uint64(1)
                m += 1
            mask[n, word] = kept
        counts[n + 1] = found


@compiled
def _list_bits(mask: BitMask, out: IntArray) -> None:
    """Write the number of each bit that is set, row by row.

    Notes
    -----
    No formula: it lists.
    """
    at = 0
    for n in range(len(mask)):
        for word in range(mask.shape[1]):
            bits, m = mask[n, word], word << 6
            while bits:
                if bits & np.uint64(1):
                    out[at] = m
                    at += 1
                bits >>= np.uint64(1)
                m += 1


def warm_up() -> None:
    """Compile the kernels of this module and of `shadow_kernels`."""
    grid = OccupancyGrid(np.eye(3, dtype=np.bool_), 1.0)
    reflectors = ReflectorMap((Reflector(id="1", x=2.5, y=0.5), Reflector(id="2", x=0.5, y=2.5)))
    model = build_visibility(reflectors, Scanner(), RayCaster(grid), VisibilityOptions())
    model.visible_from_poses([[1.5, 0.5, 0.0]])
    model.with_reflector(0, reflectors.reflectors[0])
