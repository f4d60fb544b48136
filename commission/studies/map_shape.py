"""Whether reflectors lie to each other as the map says, by what single scans see of several of them at once.

Pose, odometry, mounting and clock have no part in it: whatever they are, they move all that a scan sees together. A
filter follows wrong places, and its gate passes what is near enough; what contradicts does not average out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.special import fdtrc  # pyright: ignore[reportMissingTypeStubs]

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.cross_covariance import survey_variance
from commission.localization.estimate import Mode, Status
from commission.localization.observation import residuals
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.quantity import FARTHEST

FALSE_ALARM = 1e-6
"""Probability that any reflector of a right map is named in a drive, if errors of different views are independent."""
LEAST_M = 0.03
"""A reflector that lies less beside its place is not named [m]: a part of what one hides moves its center as far."""
NEAR_M = 0.3
"""A rejected detection nearer to a reflector than this may be of it [m]."""
HEAP_SIGMAS = 3.0
"""What lies farther from the middle of all that is near a reflector is of something else, in 1-sigma of noise."""
FEWEST, FEWEST_VIEWS = 30, 3
"""Detections and views below which nothing is said of a reflector."""
VIEW_M, VIEW_RAD = 0.5, 0.3
"""Way [m] and turn [rad] after which a view counts as another one: within it errors may all be the same."""
STATED_VIEWS = 10.0
"""Degrees of freedom that the worst case counts for, all errors of a view being the same: few views tell little."""
MOST_SCANS = 20_000
"""Scans that are looked at, evenly over the drive."""
ANYWHERE_M = 0.5
"""1-sigma of the place of a reflector that is named [m]."""
ANY_SCANNER = (0.1, 0.05, 0.05)
"""1-sigma of range bias [m], scale of ranges and scale of bearings of a scanner: larger than any. The ranges of a real
robot grew by 1.4 % too much, which looks like a map that is too small; see tests of `lost_in_the_woods`."""
PER_SCANNER = len(ANY_SCANNER)
LEAST_SIGMA_M = 0.0005
"""1-sigma of a place, and of noise, that is taken for exact [m]."""
FARTHEST_M, ANY_HEADING = 100.0, 10.0
"""1-sigma of what a scan's own pose may be off [m], [rad]: it says nothing."""
_SMALL = 1e-6
"""Part of the largest eigenvalue below which one is zero."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MapShape:
    """What single scans say of the places of M reflectors."""

    judged: tuple[int, ...]
    """Indices of the reflectors that are seen often enough, and together with others."""
    wrong: tuple[int, ...]
    """Those of them that do not stand to the others as the map says, the surest first."""
    off: FloatArray
    """(M, 2) how far each one lies from its place [m], map axes: beside those that are not wrong, or where most are,
    once all are laid on the map as well as can be; 0 of those that are not judged."""
    scans: int
    """Scans that see several of them."""


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Detections of reflectors, in the order of their scans."""

    cycle: IntArray
    reflector: IntArray
    sensor: FloatArray
    """(n, 3) pose of the scanner."""
    measured: FloatArray
    """(n, 2) range and bearing."""

    def part(self, rows: NDArray[np.bool_] | IntArray) -> _Seen:
        return _Seen(self.cycle[rows], self.reflector[rows], self.sensor[rows], self.measured[rows])


@dataclass(slots=True, eq=False)
class _Equations:
    """Normal equations of the places of M reflectors along x and y, then of `ANY_SCANNER` of each, without any pose."""

    information: FloatArray
    vector: FloatArray
    views: IntArray
    """(M,) views of each reflector."""
    freedom: float
    """Degrees of freedom that the errors were measured with."""


def map_shape(columns: RunColumns, setup: LocalizerSetup) -> MapShape:
    """Hold what scans see of several reflectors against their places in the map.

    Parameters
    ----------
    columns : a run with this setup alone.
    setup : reflectors, scanners and what is known of both.

    Returns
    -------
    shape : none are judged where too little is seen.

    Notes
    -----
    Least squares with a pose of its own for each scan, and outlier tests on the places one by one (Baarda 1968, "data
    snooping"): t_r = w_r^T K_rr^-1 w_r, K = (Sigma + Lambda^-1)^-1, w = K theta, of 2 degrees of freedom. What errors
    of one view have in common, and noise that is not as stated, are measured: Lambda is divided by the mean square of
    what the views differ by, and the quantile is that of F.
    """
    nothing = MapShape(judged=(), wrong=(), off=read_only(np.zeros((len(setup.reflectors), 2))), scans=0)
    if len(setup.reflectors) < 2:
        return nothing
    seen = _together(_seen(columns, setup))
    if not len(seen.cycle):
        return nothing
    sums = _equations(columns, setup, seen)
    judged = np.flatnonzero(sums.views >= FEWEST_VIEWS)
    if sums.freedom <= 0.0 or len(judged) < 2:
        return nothing
    wrong, off = _snoop(sums, setup, judged)
    if 2 * len(wrong) >= len(judged):
        off = _laid(off, setup.reflectors.centers, judged)
    return MapShape(judged=tuple(judged.tolist()), wrong=wrong, off=read_only(off), scans=len(np.unique(seen.cycle)))


class DriveSightings(NamedTuple):
    """Detections that passed the detector while the vehicle knew where it was, of some cycles evenly over a drive."""

    every: int
    """One of so many cycles is looked at."""
    rows: IntArray
    """(n,) rows of the run."""
    cycle: IntArray
    """(n,) cycle of each."""
    sensor: FloatArray
    """(n, 3) pose of the scanner [m, m, rad], map frame."""
    measured: FloatArray
    """(n, 2) range [m] and bearing [rad], scanner frame, without the range bias that is known."""
    places: FloatArray
    """(n, 2) where each lies [m], map frame."""


def sightings(columns: RunColumns, setup: LocalizerSetup) -> DriveSightings:
    """Look at a drive's detections: of hours of it, at so many that they need little memory.

    Parameters
    ----------
    columns : a run with this setup alone.
    setup : its scanners.
    """
    every = max(1, -(-len(columns) // MOST_SCANS))
    cycles = np.arange(0, len(columns), every)
    modes = columns.modes[cycles]
    cycles = cycles[(modes == Mode.OPERATIONAL) | (modes == Mode.FAIL)]
    counts = columns.offsets[cycles + 1] - columns.offsets[cycles]
    cycle = np.repeat(cycles, counts)
    rows = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts - columns.offsets[cycles], counts)
    passed = columns.status[rows] != Status.OUTLIER_DETECTOR
    rows, cycle = rows[passed], cycle[passed]
    mountings = np.array([each.mounting for each in setup.scanners])
    sensor = se2.compose(columns.means[cycle], mountings[columns.detected.scanners[cycle]])
    measured = columns.range_bearing[rows] - (setup.parameters.observation.range_bias, 0.0)
    direction = sensor[:, 2] + measured[:, 1]
    places = sensor[:, :2] + measured[:, :1] * np.stack((np.cos(direction), np.sin(direction)), axis=1)
    # An estimate that has run away sees nothing that can be looked up.
    on_floor = (np.abs(places) <= FARTHEST).all(axis=1)
    return DriveSightings(
        every, rows[on_floor], cycle[on_floor], sensor[on_floor], measured[on_floor], places[on_floor]
    )


def _seen(columns: RunColumns, setup: LocalizerSetup) -> _Seen:
    """Detections that are of a reflector: accepted, or near one that hardly anything else is near of."""
    _, rows, cycle, sensor, measured, places = sightings(columns, setup)
    status = columns.status[rows]
    centers = setup.reflectors.centers
    apart, nearest = KDTree(centers).query(places) if len(rows) else (np.empty(0), np.empty(0, dtype=np.int64))
    # Where several poses are kept, what is accepted may be of more than one reflector.
    accepted = (status == Status.INLIER) & (columns.reflector[rows] >= 0)
    reflector = np.where(accepted, columns.reflector[rows], nearest)
    # Of one reflector a scan has one detection: the accepted one, else the nearest.
    order = np.lexsort((apart, ~accepted, reflector, cycle))
    order = order[(accepted | (apart < NEAR_M))[order]]
    pairs = np.stack((cycle[order], reflector[order]), axis=1)
    order = order[np.append(True, (np.diff(pairs, axis=0) != 0).any(axis=1))[: len(order)]]
    found = _Seen(cycle[order], reflector[order], sensor[order], measured[order])
    beside = places[order] - centers[found.reflector]
    sigmas = _noise(columns, setup, found)
    return found.part(_of_the_heap(found.reflector, beside, HEAP_SIGMAS * np.hypot(sigmas[:, 0], sigmas[:, 1])))


def _noise(columns: RunColumns, setup: LocalizerSetup, seen: _Seen) -> FloatArray:
    """(n, 2) 1-sigma of noise along the beam and across it [m]."""
    variances = setup.observation_rows[columns.detected.scanners[seen.cycle], 3:5]
    noise = np.sqrt(variances) * np.stack((np.ones(len(seen.cycle)), seen.measured[:, 0]), axis=1)
    return np.maximum(noise, LEAST_SIGMA_M)


def _of_the_heap(reflector: IntArray, beside: FloatArray, widths: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether each detection lies where most of those near its reflector do, of reflectors seen often enough."""
    kept = np.zeros(len(reflector), dtype=np.bool_)
    order = np.argsort(reflector, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(reflector[order])) + 1):
        if len(rows) < FEWEST:
            continue
        off = beside[rows] - np.median(beside[rows], axis=0)
        near = np.hypot(off[:, 0], off[:, 1]) < widths[rows]
        if np.count_nonzero(near) >= FEWEST:
            kept[rows[near]] = True
    return kept


def _together(seen: _Seen) -> _Seen:
    """Keep what scans see of several reflectors: of one alone, its pose explains all."""
    _, which, counts = np.unique(seen.cycle, return_inverse=True, return_counts=True)
    return seen.part(counts[which] > 1) if len(seen.cycle) else seen


def _equations(columns: RunColumns, setup: LocalizerSetup, seen: _Seen) -> _Equations:
    """Normal equations of all views, divided by how much they differ."""
    count, scanners = len(setup.reflectors), len(setup.scanners)
    size = 2 * count + PER_SCANNER * scanners
    sums = _Equations(np.zeros((size, size)), np.zeros(size), np.zeros(count, dtype=np.int64), 0.0)
    views = [
        (_columns_of(part, columns, count), *_of_a_view(part, setup, _noise(columns, setup, part)))
        for part in _views(columns, seen)
    ]
    for own, information, vector in views:
        sums.information[np.ix_(own, own)] += information
        sums.vector[own] += vector
        np.add.at(sums.views, own[:-PER_SCANNER:2] // 2, 1)
    free = sums.information + np.eye(size) / ANYWHERE_M**2
    theta = np.linalg.solve(free, sums.vector)
    squares, freedom = 0.0, -_rank(sums.information)
    for own, information, vector in views:
        values, directions = np.linalg.eigh(information)
        known = values > _SMALL * values[-1]
        rest = directions[:, known].T @ (vector - information @ theta[own])
        squares += float(np.sum(rest**2 / values[known]))
        freedom += int(np.count_nonzero(known))
    worst = len(np.unique(seen.cycle)) / len(views)
    factor = (squares + STATED_VIEWS * worst) / (max(freedom, 0) + STATED_VIEWS)
    sums.information /= factor
    sums.vector /= factor
    sums.freedom = max(freedom, 0) + STATED_VIEWS
    return sums


def _rank(matrix: FloatArray) -> int:
    values = np.linalg.eigvalsh(matrix)
    return int(np.count_nonzero(values > _SMALL * values[-1]))


def _views(columns: RunColumns, seen: _Seen) -> Iterator[_Seen]:
    """Detections of each stretch of the way; of each scanner apart."""
    cycles = np.unique(seen.cycle)
    moved = np.diff(columns.means[cycles], axis=0)
    way = np.hypot(moved[:, 0], moved[:, 1]) / VIEW_M + np.abs(wrap(moved[:, 2])) / VIEW_RAD
    view = np.append(0.0, np.floor(np.cumsum(way)))[np.searchsorted(cycles, seen.cycle)]
    order = np.lexsort((seen.cycle, columns.detected.scanners[seen.cycle], view))
    keys = np.stack((view[order], columns.detected.scanners[seen.cycle][order]), axis=1)
    for rows in np.split(order, np.flatnonzero((np.diff(keys, axis=0) != 0).any(axis=1)) + 1):
        yield seen.part(rows)


def _columns_of(seen: _Seen, columns: RunColumns, count: int) -> IntArray:
    """Columns of the reflectors of a view, along x and y in turn, then those of its scanner."""
    own = np.unique(seen.reflector)
    scanner = 2 * count + PER_SCANNER * int(columns.detected.scanners[seen.cycle[0]]) + np.arange(PER_SCANNER)
    return np.append(np.stack((2 * own, 2 * own + 1), axis=1).ravel(), scanner)


def _of_a_view(seen: _Seen, setup: LocalizerSetup, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normal equations of one view: of x and y of each of its reflectors in turn, and of its scanner.

    Notes
    -----
    W = R^-1 - R^-1 H (H^T R^-1 H)^-1 H^T R^-1 of each scan leaves out what its pose can explain, by definition.
    """
    own, local = np.unique(seen.reflector, return_inverse=True)
    found, distances = residuals(seen.sensor, setup.reflectors.centers[seen.reflector], seen.measured)
    distances = np.maximum(distances, 1e-3)
    along = (setup.reflectors.centers[seen.reflector] - seen.sensor[:, :2]) / distances[:, np.newaxis]
    across = np.stack((-along[:, 1], along[:, 0]), axis=1)
    n, zeros = len(local), np.zeros(len(local))
    # Rows of each detection along the beam and across it, in 1-sigma: what they are, by its pose and by the rest.
    y = np.stack((found[:, 0], found[:, 1] * distances), axis=1) / noise
    by_pose = np.stack((np.column_stack((-along, zeros)), np.column_stack((-across, -distances))), axis=1)
    by_rest = np.zeros((n, 2, 2 * len(own) + PER_SCANNER))
    for axis in range(2):
        by_rest[np.arange(n), 0, 2 * local + axis] = along[:, axis]
        by_rest[np.arange(n), 1, 2 * local + axis] = across[:, axis]
    by_rest[:, 0, -3], by_rest[:, 0, -2] = 1.0, distances
    by_rest[:, 1, -1] = distances * seen.measured[:, 1]
    by_pose /= noise[:, :, np.newaxis]
    by_rest /= noise[:, :, np.newaxis]
    scan = np.unique(seen.cycle, return_inverse=True)[1]
    firsts = np.flatnonzero(np.append(True, np.diff(scan) != 0))
    poses = np.add.reduceat(np.einsum("nki,nkj->nij", by_pose, by_pose), firsts)
    poses += np.diag((FARTHEST_M**-2, FARTHEST_M**-2, ANY_HEADING**-2))
    both = np.add.reduceat(np.einsum("nki,nkj->nij", by_pose, by_rest), firsts)
    said = np.add.reduceat(np.einsum("nki,nk->ni", by_pose, y), firsts)
    solved = np.linalg.solve(poses, np.concatenate((both, said[:, :, np.newaxis]), axis=2))
    information = np.einsum("nki,nkj->ij", by_rest, by_rest) - np.einsum("ski,skj->ij", both, solved[:, :, :-1])
    vector = np.einsum("nki,nk->i", by_rest, y) - np.einsum("ski,sk->i", both, solved[:, :, -1])
    return information, vector


def _snoop(sums: _Equations, setup: LocalizerSetup, judged: IntArray) -> tuple[tuple[int, ...], FloatArray]:
    """Reflectors that contradict the others, the surest first, and (M, 2) where all of them lie beside their places."""
    count, known = len(setup.reflectors), setup.uncertainty
    # A reflector may have a range bias of its own, by its tape or its radius.
    places = [survey_variance(each, known) + known.range_bias**2 for each in setup.reflectors.reflectors]
    variances = np.maximum(np.repeat(places, 2), LEAST_SIGMA_M**2)
    variances = np.append(variances, np.tile(np.square(ANY_SCANNER), len(setup.scanners)))
    wrong, left = list[int](), judged
    while len(left):
        chances, off = _tests(sums, variances, left)
        chances = np.where(np.hypot(off[:, 0], off[:, 1]) < LEAST_M, 1.0, chances)
        surest = int(np.argmin(chances))
        if chances[surest] * len(judged) > FALSE_ALARM:
            break
        variances[2 * left[surest] : 2 * left[surest] + 2] = ANYWHERE_M**2
        wrong.append(int(left[surest]))
        left = np.delete(left, surest)
    solution = np.linalg.solve(sums.information + np.diag(1.0 / variances), sums.vector)
    off = solution[: 2 * count].reshape(-1, 2)
    return tuple(wrong), np.where(np.isin(np.arange(count), judged)[:, np.newaxis], off, 0.0)


def _tests(sums: _Equations, variances: FloatArray, left: IntArray) -> tuple[FloatArray, FloatArray]:
    """How likely chance contradicts each of the reflectors `left` that much (m,), and where it would lie (m, 2) [m].

    Notes
    -----
    K = Lambda - Lambda (Lambda + Sigma^-1)^-1 Lambda, w alike; its place is K_rr^-1 w_r: Baarda 1968; Woodbury.
    """
    joint = np.column_stack((sums.information, sums.vector))
    joint -= sums.information @ np.linalg.solve(sums.information + np.diag(1.0 / variances), joint)
    columns = np.stack((2 * left, 2 * left + 1), axis=1)
    K, w = joint[columns[:, :, np.newaxis], columns[:, np.newaxis, :]], joint[columns, -1]
    values, directions = np.linalg.eigh(K)
    known = values > _SMALL * np.maximum(values[:, 1:], _SMALL)
    along = np.where(known, np.einsum("mji,mj->mi", directions, w), 0.0)
    scaled = np.where(known, along / np.where(known, values, 1.0), 0.0)
    of = np.maximum(known.sum(axis=1), 1)
    chances = fdtrc(of, sums.freedom, (along * scaled).sum(axis=1) / of)
    return np.asarray(chances, dtype=np.float64), np.einsum("mij,mj->mi", directions, scaled)


def _laid(off: FloatArray, centers: FloatArray, judged: IntArray) -> FloatArray:
    """(M, 2) how far each place is off once all that are judged are shifted and turned together as well as can be."""
    x, y = (centers[judged] - centers[judged].mean(axis=0)).T
    ones, zeros = np.ones(len(judged)), np.zeros(len(judged))
    rows = np.concatenate((np.column_stack((ones, zeros, -y)), np.column_stack((zeros, ones, x))))
    moved = rows @ np.linalg.lstsq(rows, off[judged].T.ravel(), rcond=None)[0]
    laid = off.copy()
    laid[judged] -= moved.reshape(2, -1).T
    return laid
