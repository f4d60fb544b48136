"""Cold start among anonymous reflectors: the spots from which another pose sees the same constellation.

Reflectors carry no names, so that a constellation can be told from another one by its shape alone. Mirror images are
no danger: a scanner knows left from right. What happens while the pose is tracked is in `association_risk`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.angles import difference, wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.se2 import compose
from commission.planning.coverage import Lattice
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import VisibleReflectors
from commission.progress import Progress, silent
from commission.site.checks import above, between
from commission.site.scanner import Scanner

DEFAULT_HEADINGS = 8
GROUPS_AT_ONCE = 256
"""Constellations whose images are looked at together: visibility costs little per pose and much per call."""


@dataclass(frozen=True, slots=True)
class AmbiguityOptions:
    """When two poses count as alike, and as different places."""

    tolerance: float = 0.1
    """Largest distance at which a reflector still counts as where the constellation wants it [m]."""
    separation: float = 0.5
    """Distance from which two poses are different places [m]."""
    turn: float = math.radians(15.0)
    """Difference of heading from which two poses at one place are different [rad]."""
    headings: int = DEFAULT_HEADINGS
    """Evenly spaced headings that are tried at each spot; scanners that see all around need one."""

    def __post_init__(self) -> None:
        above(self.tolerance, 0.0, "ambiguity.tolerance", "m")
        above(self.separation, 0.0, "ambiguity.separation", "m")
        above(self.turn, 0.0, "ambiguity.turn", "rad")
        between(self.headings, (1, 360), "ambiguity.headings")


@dataclass(frozen=True, slots=True, kw_only=True)
class AmbiguousPair:
    """Two groups of reflectors that look the same."""

    constellation: tuple[int, ...]
    """Indices into the reflector map."""
    image: tuple[int, ...]
    """Indices of the reflectors that look like them, in the same order; maybe the same ones, turned round."""
    poses: int
    """Number of poses that take one for the other."""
    example: tuple[float, float, float]
    """One of them: x [m], y [m], heading [rad] of base."""
    partner: tuple[float, float, float]
    """Where the vehicle would believe to be then."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ColdStart:
    """What a vehicle that is switched on at each of N poses can know of where it is."""

    poses: FloatArray
    """(N, 3) `T_map_base` [m, m, rad]."""
    visible: IntArray
    """(N,) number of visible reflectors."""
    ambiguous: BoolArray
    """(N,) whether another pose sees the same; always with fewer than two reflectors."""
    partners: FloatArray
    """(N, 3) such a pose [m, m, rad]; NaN where there is none, or a whole circle of them (one reflector) or more."""
    pairs: tuple[AmbiguousPair, ...]
    """The groups that are taken for each other, the most frequent first."""


class Motions(NamedTuple):
    """Rigid motions that lay a constellation onto other reflectors."""

    transforms: FloatArray
    """(T, 3) pose of the moved map in the map [m, m, rad]."""
    images: IntArray
    """(T, n) reflector on which each one of the constellation comes to lie."""


class _Suspect(NamedTuple):
    """Poses that see a constellation, and where they would be if it were its image."""

    constellation: tuple[int, ...]
    image: IntArray
    members: IntArray
    others: FloatArray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PairTable:
    """All ordered pairs of reflectors by their distance: the signature from which alike constellations are found."""

    centers: FloatArray
    """(M, 2) [m], map frame."""
    distances: FloatArray
    """(P,) distance of each pair [m], ascending."""
    first: IntArray
    """(P,) index of its first reflector."""
    second: IntArray
    """(P,) index of its second."""
    tree: cKDTree = field(repr=False)
    """Reflectors by place."""

    @staticmethod
    def of(centers: FloatArray, longest: float) -> PairTable:
        """Tabulate the pairs up to a distance [m]."""
        tree = cKDTree(centers)
        pairs = np.asarray(tree.query_pairs(longest, output_type="ndarray"), dtype=np.int64).reshape(-1, 2)
        pairs = np.concatenate((pairs, pairs[:, ::-1]))
        distances = np.hypot(*(centers[pairs[:, 0]] - centers[pairs[:, 1]]).T)
        order = np.argsort(distances, kind="stable")
        return PairTable(
            centers=centers,
            distances=distances[order],
            first=pairs[order, 0].copy(),
            second=pairs[order, 1].copy(),
            tree=tree,
        )

    def motions(self, constellation: IntArray, tolerance: float) -> Motions:
        """Rigid motions, the identity included, that bring each reflector of a constellation near to another one.

        The longest pair of the constellation is compared with all pairs of its length; a motion that the pair suggests
        is fitted to all reflectors before it is judged.

        Parameters
        ----------
        constellation : (n,) indices, n at least 2.
        tolerance : largest distance of any reflector from its image after the fit [m].
        """
        points = self.centers[constellation]
        deltas = points[:, np.newaxis] - points
        a, b = np.unravel_index(int(np.argmax(np.hypot(deltas[..., 0], deltas[..., 1]))), (len(points), len(points)))
        length = float(np.hypot(*(points[b] - points[a])))
        low, high = np.searchsorted(self.distances, (length - 2.0 * tolerance, length + 2.0 * tolerance))
        starts, ends = self.centers[self.first[low:high]], self.centers[self.second[low:high]]
        turns = np.arctan2(*(ends - starts).T[::-1]) - math.atan2(*(points[b] - points[a])[::-1])
        middles = 0.5 * (starts + ends)
        # Ends that err by the tolerance move the others by at most three of it, since the pair is the longest.
        moved = middles[:, np.newaxis] + _rotated(points - 0.5 * (points[a] + points[b]), turns)
        distances, images = self.tree.query(moved, distance_upper_bound=3.0 * tolerance)
        whole = np.isfinite(distances).all(axis=1)
        images = np.unique(np.asarray(images[whole], dtype=np.int64), axis=0)
        # Two reflectors cannot be one.
        distinct = np.diff(np.sort(images, axis=1), axis=1).all(axis=1)
        transforms, worst = _fits(points, self.centers[images[distinct]])
        return Motions(transforms[worst <= tolerance], images[distinct][worst <= tolerance])


def cold_start(
    visible: VehicleVisibility,
    lattice: Lattice,
    options: AmbiguityOptions | None = None,
    progress: Progress = silent,
) -> ColdStart:
    """Ask for every spot of a lattice that is not in a wall whether the vehicle could take it for another one.

    Parameters
    ----------
    visible : reflectors, scanners and walls.
    lattice : positions of the base; half a metre to a metre is fine enough.
    options : tolerance and headings; the defaults when None.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.

    Returns
    -------
    result : heading by heading the spots of the lattice that are free.
    """
    options = options or AmbiguityOptions()
    points = lattice.points()
    points = points[~visible.caster.grid.is_occupied(points)]
    headings = headings_tried(visible.scanners, options)
    count = len(headings)
    poses = np.column_stack((np.tile(points, (count, 1)), np.repeat(headings, len(points))))
    return ambiguous_poses(visible, poses, options, progress)


def headings_tried(scanners: Sequence[Scanner], options: AmbiguityOptions) -> FloatArray:
    """Headings [rad] that stand for all at a spot: evenly spaced ones, or one where the heading does not matter."""
    count = 1 if all(map(_sees_all_around, scanners)) else options.headings
    return np.arange(count, dtype=np.float64) * (2.0 * math.pi / count)


def ambiguous_poses(
    visible: VehicleVisibility,
    T_map_base: ArrayLike,
    options: AmbiguityOptions | None = None,
    progress: Progress = silent,
) -> ColdStart:
    """Ask for each pose whether another one sees the same constellation.

    The other pose must lie on the floor, and see those reflectors and no others. Poses that differ by less than the
    options' separation and turn are one.

    Parameters
    ----------
    visible : reflectors, scanners and walls.
    T_map_base : (N, 3) poses [m, m, rad].
    options : tolerance; the defaults when None.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.
    """
    options = options or AmbiguityOptions()
    poses = np.asarray(T_map_base, dtype=np.float64).reshape(-1, 3)
    seen = visible.visible_from_poses(poses)
    partners = np.full((len(poses), 3), np.nan)
    table = PairTable.of(visible.reflectors.centers, visible.widest)
    pairs: dict[tuple[tuple[int, ...], tuple[int, ...]], AmbiguousPair] = {}
    groups = [group for group in _groups(seen) if len(group[0]) >= 2]
    for start in range(0, len(groups), GROUPS_AT_ONCE):
        progress(start / len(groups), "ambiguity")
        suspects: list[_Suspect] = []
        for constellation, members in groups[start : start + GROUPS_AT_ONCE]:
            suspects += _suspects(table, poses, constellation, members, options)
        for suspect, alike in zip(suspects, _seen_exactly(visible, suspects), strict=True):
            if not alike.any():
                continue
            chosen = suspect.members[alike]
            partners[chosen] = suspect.others[alike]
            pair = AmbiguousPair(
                constellation=suspect.constellation,
                image=tuple(suspect.image.tolist()),
                poses=len(chosen),
                example=_plain(poses[chosen[0]]),
                partner=_plain(partners[chosen[0]]),
            )
            pairs[pair.constellation, pair.image] = pair
    progress(1.0, "ambiguity")
    counts = seen.counts()
    ambiguous = np.isfinite(partners[:, 0]) | (counts < 2)
    ranked = sorted(pairs.values(), key=lambda pair: (-pair.poses, pair.constellation, pair.image))
    return ColdStart(
        poses=read_only(poses),
        visible=read_only(counts),
        ambiguous=read_only(ambiguous),
        partners=read_only(partners),
        pairs=tuple(ranked),
    )


def _groups(visible: VisibleReflectors) -> list[tuple[tuple[int, ...], IntArray]]:
    """Poses that see the same reflectors, together: those reflectors, and the indices of the poses."""
    members: dict[tuple[int, ...], list[int]] = {}
    for n in range(len(visible.offsets) - 1):
        members.setdefault(tuple(visible.of(n).tolist()), []).append(n)
    return [(constellation, np.array(poses)) for constellation, poses in members.items()]


def _different(poses: FloatArray, others: FloatArray, options: AmbiguityOptions) -> BoolArray:
    """Whether pairs of poses are different places, or different headings."""
    apart = np.hypot(*(poses[:, :2] - others[:, :2]).T) > options.separation
    return apart | (np.abs(difference(poses[:, 2], others[:, 2])) > options.turn)


def _suspects(
    table: PairTable,
    poses: FloatArray,
    constellation: tuple[int, ...],
    members: IntArray,
    options: AmbiguityOptions,
) -> list[_Suspect]:
    """Poses that see one constellation, laid onto each image of it that is somewhere else."""
    found: list[_Suspect] = []
    motions = table.motions(np.array(constellation), options.tolerance)
    for transform, image in zip(motions.transforms, motions.images, strict=True):
        others = compose(transform, poses[members])
        different = _different(poses[members], others, options)
        if different.any():
            found.append(_Suspect(constellation, image, members[different], others[different]))
    return found


def _seen_exactly(visible: VehicleVisibility, suspects: list[_Suspect]) -> list[BoolArray]:
    """Whether the other poses of each suspect are on the floor, and see its image and no other reflectors."""
    if not suspects:
        return []
    poses = np.concatenate([suspect.others for suspect in suspects])
    grid = visible.caster.grid
    on_floor = ~grid.is_occupied(poses[:, :2])
    # An open field has a grid of one free cell, and no end.
    if grid.occupied.any():
        on_floor &= grid.contains(poses[:, :2])
    seen = visible.visible_from_poses(poses)
    results: list[BoolArray] = []
    first = 0
    for suspect in suspects:
        wanted = np.sort(suspect.image)
        rows = range(first, first + len(suspect.others))
        results.append(np.array([bool(on_floor[n]) and np.array_equal(seen.of(n), wanted) for n in rows]))
        first = rows.stop
    return results


def _fits(points: FloatArray, images: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rigid motions of least squares from (n, 2) points to (T, n, 2) images, and the largest distance left [m].

    The turn in the plane that least squares wants is the angle of the summed products (Umeyama 1991, in two dimensions
    and without scale).
    """
    center, centers = points.mean(axis=0), images.mean(axis=1)
    p, q = points - center, images - centers[:, np.newaxis]
    dots = np.einsum("ni,tni->t", p, q)
    crosses = np.einsum("n,tn->t", p[:, 0], q[..., 1]) - np.einsum("n,tn->t", p[:, 1], q[..., 0])
    turns = np.arctan2(crosses, dots)
    left = _rotated(p, turns) - q
    shifts = centers - _rotated(center[np.newaxis], turns)[:, 0]
    worst = np.hypot(left[..., 0], left[..., 1]).max(axis=1, initial=0.0)
    return np.column_stack((shifts, wrap(turns))), worst


def _rotated(points: FloatArray, turns: FloatArray) -> FloatArray:
    """(T, n, 2) points (n, 2) turned by each of T angles [rad]."""
    c, s = np.cos(turns)[:, np.newaxis], np.sin(turns)[:, np.newaxis]
    return np.stack((c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]), axis=-1)


def _sees_all_around(scanner: Scanner) -> bool:
    """Whether the heading of the base does not matter: a full turn, in the middle of the base."""
    return scanner.is_full_turn and not np.any(scanner.mounting[:2])


def _plain(pose: FloatArray) -> tuple[float, float, float]:
    """Pose as plain numbers."""
    return float(pose[0]), float(pose[1]), float(pose[2])
