"""Most likely poses, constants and noise of a drive, given all of it at once: sparse least squares, in rounds.

Between rounds detections are given to reflectors anew, and what fits none weighs less. It says nothing of whether a
value deserves to be used: that is judged elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve, cholesky_banded
from scipy.spatial import KDTree

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.banded import solved
from commission.progress import Progress, silent
from commission.studies.calibration_model import (
    MeasuredDrive,
    MotionRows,
    Point,
    SightRows,
    chosen,
    constant_columns,
    moments,
    motion_variances,
    move,
    see,
    track,
)
from commission.studies.calibration_track import WHEELS, twists_at

SparseMatrix = Any
"""A sparse matrix: scipy ships no types."""
ROUNDS = 12
"""Rounds at most."""
SETTLED = 0.02
"""A round that moves no constant by more than this share of its 1-sigma, and no noise by as much, is the last one."""
BEND = 3.0
"""Normalized distance from which a residual weighs less (Huber 1964)."""
GATE = 5.0
"""Normalized distance beyond which a detection is of nothing in the map."""
AMBIGUOUS = 0.5
"""A detection is of the nearest reflector only where the next one is at least twice as far."""
TAIL = 4.0
"""Degrees of freedom of the prior of a constant (Student): a project that is sure and wrong gives way to the data."""
NOISE_PRIOR = 2.0
"""1-sigma of the logarithm of a variance about what the project says: a factor of e in sigma."""
PROBES = 6
"""Random vectors by which redundancies are found (Hutchinson 1990)."""
NOISES = 8
"""Variances: range, bearing; forward per metre and second, lateral per metre, heading per metre, radian and second."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationProblem:
    """A drive, and what is believed before it."""

    drive: MeasuredDrive
    """What was measured."""
    start: Point
    """Where to begin: poses of a run, constants zero."""
    reflector: IntArray
    """(n,) reflector of each detection to begin with; -1: none."""
    prior: FloatArray
    """(p,) 1-sigma of each constant; 0: it is known exactly."""
    noise: FloatArray
    """(8,) variances by the project."""
    fixed_noise: bool = False
    """Whether the noise stays as it is."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationFit:
    """The most likely values."""

    point: Point
    """Poses and constants."""
    sigmas: FloatArray
    """(p,) 1-sigma of the constants; of correlated residuals the larger one that blocks of time show."""
    covariances: tuple[FloatArray, FloatArray]
    """(p, p) of the constants: if residuals were independent, and as blocks of time show it."""
    noise: FloatArray
    """(8,) variances, as in `CalibrationProblem.noise`."""
    noise_sigmas: FloatArray
    """(8,) 1-sigma of the logarithm of each variance."""
    reflector: IntArray
    """(n,) reflector of each detection; -1: none."""
    residuals: FloatArray
    """(n, 2) of the detections [m, rad]; NaN where they are of none."""
    ranges: FloatArray
    """(n,) expected range [m]; NaN where they are of none."""
    information: FloatArray
    """(p,) 1-sigma of each constant without its prior: large where the drive does not show it."""
    scores: FloatArray
    """(b, p) what each stretch of the drive says of each constant: shift of the estimate that is due to it."""
    rounds: int
    """Rounds that were made."""
    weights: FloatArray = field(repr=False)
    """(n,) weight of each detection [0..1]; 0: it is of none."""

    def sigma_of(self, share: FloatArray) -> float:
        """1-sigma of a sum of constants, each taken by its share: (p,)."""
        return float(np.sqrt(max(share @ each @ share for each in self.covariances)))


def fit(problem: CalibrationProblem, progress: Progress = silent) -> CalibrationFit:
    """Estimate poses, constants and noise.

    Parameters
    ----------
    problem : drive and prior.
    progress : told of each round; may raise to cancel.
    """
    drive, point, reflector = problem.drive, problem.start, problem.reflector
    noise, log_sigmas = problem.noise.copy(), np.full(NOISES, NOISE_PRIOR)
    rng = np.random.default_rng(0)
    system: _System | None = None
    rounds = 0
    for rounds in range(1, ROUNDS + 1):
        progress(rounds / (ROUNDS + 1), f"round {rounds}")
        before, noise_before = point.constants, noise
        system = _System.of(problem, point, reflector, noise)
        point = system.improved()
        if not problem.fixed_noise:
            noise, log_sigmas = _noise(system.at(point), noise, problem.noise, rng)
        reflector = _associated(drive, point, noise)
        shift = np.abs(point.constants - before) / np.where(system.sigmas > 0.0, system.sigmas, 1.0)
        if rounds > 3 and shift.max(initial=0.0) < SETTLED and np.abs(np.log(noise / noise_before)).max() < SETTLED:
            break
    system = _System.of(problem, point, reflector, noise)
    covariances, scores = system.covariances()
    residuals = np.full((len(reflector), 2), np.nan)
    ranges, weights = np.full(len(reflector), np.nan), np.zeros(len(reflector))
    rows = reflector >= 0
    residuals[rows], ranges[rows], weights[rows] = system.seen.residuals, system.seen.ranges, system.weights
    return CalibrationFit(
        point=point,
        sigmas=np.sqrt(np.maximum(*(np.diag(each) for each in covariances))) * system.free,
        covariances=covariances,
        noise=noise,
        noise_sigmas=log_sigmas,
        reflector=reflector,
        residuals=residuals,
        ranges=ranges,
        information=system.without_prior(),
        scores=scores,
        rounds=rounds,
        weights=weights,
    )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _System:
    """Normal equations about a point: a chain of poses, and constants that all of it shares."""

    problem: CalibrationProblem
    point: Point
    times: FloatArray
    twists: FloatArray
    seen: SightRows
    moved: MotionRows
    weights: FloatArray
    by_poses: SparseMatrix
    """(R, 3 K) whitened rows."""
    by_constants: SparseMatrix
    """(R, p)."""
    whitened: FloatArray
    """(R,) residuals."""
    row_cycle: IntArray
    """(R,) scan of each row."""
    banded: FloatArray
    """Cholesky factor of the poses' part."""
    cross: SparseMatrix
    """(3 K, p) information that poses and free constants share."""
    response: FloatArray
    """(3 K, p) how poses follow the constants."""
    schur: tuple[FloatArray, bool]
    """Factor of the constants' part after the poses are gone."""
    information: FloatArray
    """(p, p) of the constants without prior."""
    prior_precision: FloatArray
    """(p,)."""
    free: BoolArray
    """(p,) constants that may move."""

    @staticmethod
    def of(problem: CalibrationProblem, point: Point, reflector: IntArray, noise: FloatArray) -> _System:
        drive = problem.drive
        rows = reflector >= 0
        seeing = chosen(drive, rows)
        way, times = track(drive, point.constants), moments(drive, point.constants)
        twists = twists_at(way, times)
        seen = see(seeing, point, reflector[rows], twists)
        moved = move(drive, point, way, times)
        weights = _bent(np.sqrt((seen.residuals**2 / noise[:2]).sum(axis=1)))
        scale = np.sqrt(weights[:, np.newaxis] / noise[:2])
        variances = motion_variances(moved, noise[2:])
        motion_scale = np.sqrt(_bent(np.abs(moved.residuals) / np.sqrt(variances)) / variances)
        by_poses, by_constants, row_cycle = _rows(seeing, reflector[rows], seen, moved, scale, motion_scale)
        whitened = np.concatenate(((seen.residuals * scale).ravel(), (moved.residuals * motion_scale).ravel()))
        free = problem.prior > 0.0
        prior = np.where(free, problem.prior, 1.0)
        precision = np.where(free, 1.0 / (prior**2 * (1.0 + (point.constants / prior) ** 2 / TAIL)), 0.0)
        banded = _factor(by_poses)
        cross = (by_poses.T @ by_constants).tocsr()
        cross.data *= free[cross.indices]
        response = solved(banded, cross.toarray())
        # Sparse on purpose: the threads of a dense product wait for each other where the machine is busy.
        information = (by_constants.T @ by_constants).toarray() - cross.T @ response
        information[~free] = 0.0
        information[:, ~free] = 0.0
        schur = cho_factor(information + np.diag(np.where(free, precision, 1.0)))
        return _System(
            problem=problem,
            point=point,
            times=times,
            twists=twists,
            seen=seen,
            moved=moved,
            weights=weights,
            by_poses=by_poses,
            by_constants=by_constants,
            whitened=whitened,
            row_cycle=row_cycle,
            banded=banded,
            cross=cross,
            response=response,
            schur=schur,
            information=information,
            prior_precision=precision,
            free=free,
        )

    def at(self, point: Point) -> _System:
        """Return the same rows with residuals of another point near by (to first order)."""
        step = (point.poses - self.point.poses).copy()
        step[:, 2] = wrap(step[:, 2])
        left = (
            self.whitened - self.by_poses @ step.ravel() - self.by_constants @ (point.constants - self.point.constants)
        )
        return replace(self, whitened=left)

    @property
    def sigmas(self) -> FloatArray:
        """(p,) 1-sigma of the constants if the residuals were independent."""
        covariance = cho_solve(self.schur, np.eye(len(self.free)))
        return np.where(self.free, np.sqrt(np.diag(covariance)), 0.0)

    def solve(self, right_poses: FloatArray, right_constants: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Steps of poses and constants for right-hand sides of any number of columns."""
        followed = self.cross.T @ solved(self.banded, right_poses)
        right = np.where(self.free[:, np.newaxis], right_constants - followed, 0.0)
        constants = cho_solve(self.schur, right)
        return solved(self.banded, right_poses - self.cross @ constants), constants

    def improved(self) -> Point:
        """One Gauss-Newton step; poses are carried to the moments that the new clocks say."""
        right = (self.by_constants.T @ self.whitened - self.prior_precision * self.point.constants)[:, np.newaxis]
        poses, constants = self.solve((self.by_poses.T @ self.whitened)[:, np.newaxis], right)
        moved = self.point.poses + poses.reshape(-1, 3)
        changed = self.point.constants + constants[:, 0]
        seconds = (moments(self.problem.drive, changed) - self.times) * 1e-9
        return Point(se2.compose(moved, se2.exp(seconds[:, np.newaxis] * self.twists)), changed)

    def hat(self, probes: FloatArray) -> FloatArray:
        """(R, q) what fitted rows take over of given ones."""
        poses, constants = self.solve(self.by_poses.T @ probes, self.by_constants.T @ probes)
        return self.by_poses @ poses + self.by_constants @ constants

    def covariances(self) -> tuple[tuple[FloatArray, FloatArray], FloatArray]:
        """(p, p) covariances if residuals were independent, and if they are within a stretch, and what each one says.

        The scores of stretches of ten seconds are taken for independent (White 1980; clustered): their scatter is the
        variance of the score, whatever is correlated within them.
        """
        seconds = (self.times - self.times[0]) * 1e-9
        length = max(min(STRETCH_S, seconds[-1] / 30.0), 1e-3)
        stretch = (seconds / length).astype(np.int64)[self.row_cycle]
        count = int(stretch.max(initial=0)) + 1
        gather: Any = sparse.csr_array(
            (self.whitened, (stretch, np.arange(len(stretch)))), shape=(count, len(self.whitened))
        )
        scores = (gather @ self.by_constants).toarray() - (gather @ self.by_poses) @ self.response
        scores = np.where(self.free, scores, 0.0)
        inverse = cho_solve(self.schur, np.eye(len(self.free)))
        shifts = scores @ inverse
        centered = shifts - shifts.mean(axis=0)
        scatter = centered.T @ centered * count / max(count - 1, 1)
        scatter += (inverse * self.prior_precision) @ inverse
        free = self.free[:, np.newaxis] & self.free
        return (np.where(free, inverse, 0.0), np.where(free, scatter, 0.0)), shifts

    def without_prior(self) -> FloatArray:
        """(p,) 1-sigma of each constant by the drive alone, others with their priors; inf where it shows none."""
        found = np.full(len(self.free), np.inf)
        covariance = cho_solve(self.schur, np.eye(len(self.free)))
        variance = np.diag(covariance)
        with np.errstate(divide="ignore"):
            alone = 1.0 / variance - self.prior_precision
        good = self.free & (alone > 1e-9 / np.maximum(variance, 1e-300))
        found[good] = 1.0 / np.sqrt(alone[good])
        return found


STRETCH_S = 10.0
"""Residuals farther apart than this are taken for independent [s]."""


def _bent(distances: FloatArray) -> FloatArray:
    """Weights of normalized distances (Huber 1964)."""
    return np.minimum(1.0, BEND / np.maximum(distances, 1e-12))


def _rows(  # noqa: PLR0917 - the rows of both kinds, and how they are whitened
    drive: MeasuredDrive,
    reflector: IntArray,
    seen: SightRows,
    moved: MotionRows,
    scale: FloatArray,
    motion_scale: FloatArray,
) -> tuple[SparseMatrix, SparseMatrix, IntArray]:
    """Whitened Jacobians of all rows with respect to poses and constants, and the scan of each row."""
    n, steps, size = len(reflector), len(moved.residuals), drive.layout.size
    poses = steps + 1
    total = 2 * n + 3 * steps
    triple = np.arange(3)
    detection_rows = np.broadcast_to(np.arange(2 * n).reshape(n, 2, 1), (n, 2, 3))
    detection_columns = np.broadcast_to((3 * drive.cycle)[:, None, None] + triple, (n, 2, 3))
    motion_rows = np.broadcast_to(2 * n + np.arange(3 * steps).reshape(steps, 3, 1), (steps, 3, 3))
    before = np.broadcast_to(3 * np.arange(steps)[:, None, None] + triple, (steps, 3, 3))
    values = (
        seen.by_pose * scale[:, :, np.newaxis],
        moved.by_before * motion_scale[:, :, np.newaxis],
        moved.by_after * motion_scale[:, :, np.newaxis],
    )
    rows = np.concatenate([each.ravel() for each in (detection_rows, motion_rows, motion_rows)])
    columns = np.concatenate([each.ravel() for each in (detection_columns, before, before + 3)])
    by_poses = sparse.csr_array(
        (np.concatenate([each.ravel() for each in values]), (rows, columns)), shape=(total, 3 * poses)
    )
    each_constant = np.broadcast_to(np.arange(2 * n).reshape(n, 2, 1), (n, 2, 8))
    of_constant = np.broadcast_to(constant_columns(drive, reflector)[:, np.newaxis], (n, 2, 8))
    wheels = np.broadcast_to(drive.layout.wheels + np.arange(WHEELS), (steps, 3, WHEELS))
    rows = np.concatenate((each_constant.ravel(), motion_rows.ravel()))
    columns = np.concatenate((of_constant.ravel(), wheels.ravel()))
    entries = np.concatenate(
        (
            (seen.by_constants * scale[:, :, np.newaxis]).ravel(),
            (moved.by_wheels * motion_scale[:, :, np.newaxis]).ravel(),
        )
    )
    by_constants = sparse.csr_array((entries, (rows, columns)), shape=(total, size))
    cycle = np.concatenate((np.repeat(drive.cycle, 2), np.repeat(np.arange(steps), 3)))
    return by_poses, by_constants, cycle


def _factor(by_poses: SparseMatrix) -> FloatArray:
    """Cholesky factor of the information of the poses: block tridiagonal, five diagonals below the main one."""
    square = (by_poses.T @ by_poses).tocsr()
    size = square.shape[0]
    banded = np.zeros((6, size))
    for below in range(6):
        if below < size:
            banded[below, : size - below] = square.diagonal(-below)
    # A scan of which nothing is known but its neighbors: never singular, and nothing that anybody sees.
    banded[0] += 1e-6
    return cholesky_banded(banded, lower=True)


def _associated(drive: MeasuredDrive, point: Point, noise: FloatArray) -> IntArray:
    """(n,) reflector of each detection by the poses; -1 where it fits none, or two."""
    if not len(drive.places):
        return np.full(len(drive.cycle), -1, dtype=np.int64)
    layout, k = drive.layout, drive.cycle
    scanner, seen, ranges = places_of(drive, point)
    direction = scanner[:, 2] + drive.measured[:, 1]
    places = drive.places + point.constants[layout.places :].reshape(-1, 2)
    near: tuple[FloatArray, IntArray] = KDTree(places).query(seen, k=2)  # pyright: ignore[reportAssignmentType]
    distances, found = near
    ray = places[found[:, 0]] - scanner[:, :2]
    off_range = (ranges - np.hypot(ray[:, 0], ray[:, 1])) / np.sqrt(noise[0])
    off_bearing = wrap(direction - np.arctan2(ray[:, 1], ray[:, 0])) / np.sqrt(noise[1])
    good = (np.hypot(off_range, off_bearing) < GATE) & (distances[:, 0] < AMBIGUOUS * distances[:, 1])
    best = np.where(good, distances[:, 0], np.inf)
    # Of one scan, a reflector has one detection: the nearest.
    order = np.lexsort((best, found[:, 0], k))
    key = k[order] * len(places) + found[order, 0]
    first = np.concatenate(([True], np.diff(key) != 0)) if len(key) else np.zeros(0, dtype=np.bool_)
    nearest = np.zeros(len(k), dtype=np.bool_)
    nearest[order[first]] = True
    return np.where(good & nearest, found[:, 0], -1).astype(np.int64)


def places_of(drive: MeasuredDrive, point: Point) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where each detection was seen from, and where it lies.

    Parameters
    ----------
    drive : what was measured.
    point : what is assumed.

    Returns
    -------
    scanners : (n, 3) pose of the scanner at the time of each detection [m, m, rad], map frame.
    places : (n, 2) of what was seen [m], map frame.
    ranges : (n,) without bias [m].
    """
    layout, k = drive.layout, drive.cycle
    mounted = drive.mountings + np.stack([point.constants[layout.mounting(i)] for i in range(layout.scanners)])
    twists = twists_at(track(drive, point.constants), moments(drive, point.constants))
    moved = se2.compose(point.poses[k], se2.exp(drive.delays[:, np.newaxis] * twists[k]))
    scanners = se2.compose(moved, mounted[drive.scanners[k]])
    ranges = (drive.measured[:, 0] - point.constants[layout.bias]) / (1.0 + point.constants[layout.range_scale])
    direction = scanners[:, 2] + drive.measured[:, 1]
    ray = np.stack((np.cos(direction), np.sin(direction)), axis=1)
    return scanners, scanners[:, :2] + ranges[:, np.newaxis] * ray, ranges


def _noise(
    system: _System, noise: FloatArray, believed: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Variances by the squares of residuals and their redundancies, with a prior on their logarithms.

    Notes
    -----
    Fisher scoring of the restricted likelihood: score = q/2 (sum a e^2/Q^2 - sum a r/Q), information
    q q'/2 sum a a' r/Q^2, r the redundancy of a row (Förstner 1979; traces by Hutchinson 1990).
    """
    n = len(system.weights)
    probes = rng.choice(np.array([-1.0, 1.0]), size=(len(system.whitened), PROBES))
    redundancy = 1.0 - (probes * system.hat(probes)).mean(axis=1)
    squares = system.whitened**2
    way, turn, seconds = system.moved.growth.T
    parts = [np.zeros((2 * n + 3 * len(way),)) for _ in range(NOISES)]
    parts[0][0 : 2 * n : 2] = 1.0
    parts[1][1 : 2 * n : 2] = 1.0
    of_motion = ((0, way), (0, seconds), (1, way), (2, way), (2, turn), (2, seconds))
    for index, (axis, amount) in enumerate(of_motion, start=2):
        parts[index][2 * n + axis :: 3] = amount
    variances = np.concatenate(
        (np.broadcast_to(noise[:2], (n, 2)).ravel(), motion_variances(system.moved, noise[2:]).ravel())
    )
    # What each variance is of its row.
    shares = np.stack(parts) * noise[:, np.newaxis] / variances
    score = 0.5 * (shares @ (squares - redundancy))
    fisher = 0.5 * (shares * np.maximum(redundancy, 0.0)) @ shares.T
    precision = np.full(NOISES, 1.0 / NOISE_PRIOR**2)
    score -= precision * np.log(noise / believed)
    matrix = fisher + np.diag(precision)
    step = np.linalg.solve(matrix, score)
    sigmas = np.sqrt(np.diag(np.linalg.inv(matrix)))
    return noise * np.exp(np.clip(step, -1.0, 1.0)), sigmas
