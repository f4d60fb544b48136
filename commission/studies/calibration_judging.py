"""Whether a value deserves to be used: the project's own localizer over a part of the drive that did not make it.

Innovations judge constants. The noise of a detection is judged by two localizers that see different reflectors: how far
they differ is what their covariances have to say, whatever is correlated in time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization import whole_run
from commission.localization.detection_log import DetectionLog
from commission.localization.detector import INLIER
from commission.localization.estimate import Belief
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import AssociationParameters, FilterParameters
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.studies.innovations import innovations

FARTHEST_D2 = 25.0
"""A detection counts no more than this: false ones weigh the same under every value."""
BLOCK_S = 10.0
"""Innovations within this time are taken for one: they are correlated [s]."""
OPEN_GATE = 0.9999
"""Gate of the two localizers: their detections are given to reflectors beforehand."""
FACTORS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)
"""Multiples of the noise of a detection that are tried."""
FEWEST_REFLECTORS = 4
"""Two reflectors for each of two localizers."""


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """Log-likelihood of the innovations of a run."""

    blocks: FloatArray
    """(B,) sum over the detections of each stretch of `BLOCK_S`; 0 where there is none."""
    counts: FloatArray
    """(B,) detections of each stretch."""
    nis: float
    """Mean squared Mahalanobis distance of all detections, clipped at `FARTHEST_D2`."""

    def part(self, rows: BoolArray) -> Score:
        """Return the score of some stretches."""
        return Score(self.blocks[rows], self.counts[rows], self.nis)

    def half(self, half: int) -> Score:
        """Return the score of the first half of the drive, or of the second."""
        later = np.arange(len(self.blocks)) >= len(self.blocks) // 2
        return self.part(later if half else ~later)

    @property
    def mean(self) -> float:
        """Log-likelihood per detection."""
        return float(self.blocks.sum() / max(self.counts.sum(), 1.0))


def gain(better: Score, worse: Score) -> tuple[float, float]:
    """Log-likelihood per detection that one run has more than another, and its 1-sigma by the scatter of stretches."""
    difference = better.blocks - worse.blocks
    count = max(float(worse.counts.sum()), 1.0)
    scatter = float(np.sqrt(((difference - difference.mean()) ** 2).sum())) if len(difference) > 1 else 0.0
    return float(difference.sum()) / count, scatter / count


def score(log: RecordLog, setup: LocalizerSetup, start: Belief, detected: DetectionLog) -> Score:
    """Localize with a setup, and say how likely what was seen is.

    Parameters
    ----------
    log : the recording.
    setup : what is to be judged.
    start : belief before the first record.
    detected : detections of the recording.

    Notes
    -----
    -(nu^T S^-1 nu + log det S) / 2 of each detection against its likeliest reflector, S = H P H^T + R and what the
    project's uncertainty adds, P from before its scan.
    """
    run = whole_run.run(log, setup, start, detected=detected)
    d2, log_det = _innovations(run, setup)
    judged = detected.status == INLIER
    d2 = np.minimum(np.where(np.isfinite(d2), d2, FARTHEST_D2), FARTHEST_D2)
    known = np.isfinite(log_det) & judged
    log_det = np.where(known, log_det, float(np.median(log_det[known])) if known.any() else 0.0)
    likelihood = np.where(judged, -0.5 * (d2 + log_det), 0.0)
    block, size = np.repeat(_blocks(run), np.diff(run.offsets)), int(_blocks(run)[-1]) + 1
    return Score(
        np.bincount(block, likelihood, size).astype(np.float64),
        np.bincount(block, judged.astype(np.float64), size).astype(np.float64),
        float(d2[judged].mean()) if judged.any() else math.nan,
    )


def _innovations(run: RunColumns, setup: LocalizerSetup) -> tuple[FloatArray, FloatArray]:
    """(n,) squared Mahalanobis distance and log det S of each detection; NaN where it has no reflector."""
    found = innovations(run, setup)
    nu, S, nobody = found.residuals, found.covariances, np.isnan(found.residuals[:, 0])
    det = S[:, 0, 0] * S[:, 1, 1] - S[:, 0, 1] ** 2
    d2 = (S[:, 1, 1] * nu[:, 0] ** 2 - 2.0 * S[:, 0, 1] * nu[:, 0] * nu[:, 1] + S[:, 0, 0] * nu[:, 1] ** 2) / det
    return d2, np.where(nobody, math.nan, np.log(det))


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """How two localizers that see different reflectors agree, for one noise of a detection."""

    factor: float
    """Multiple of the noise."""
    likelihood: float
    """Mean log-likelihood of their differences."""
    ratio: float
    """Mean squared difference over its expectation: 1 is consistent, more is too sure."""
    score: Score
    """Log-likelihood of the differences, stretch by stretch; a cycle counts as a detection there."""
    ratios: tuple[float, float]
    """`ratio` of the first half of the drive, and of the second."""


def agreements(
    log: RecordLog,
    setup: LocalizerSetup,
    start: Belief,
    detected: DetectionLog,
    reflector: IntArray,
    *,
    factors: Sequence[float] = FACTORS,
) -> tuple[Agreement, ...]:
    """Try multiples of the noise of a detection.

    Parameters
    ----------
    log : the recording.
    setup : with the noise that residuals show.
    start : belief before the first record.
    detected : detections of the recording.
    reflector : (n,) reflector of each, by the calibration; -1: none, it is left out.
    factors : multiples of the noise.

    Returns
    -------
    agreements : one for each of them; none where there are too few reflectors.
    """
    seen = np.unique(reflector[reflector >= 0])
    if len(seen) < FEWEST_REFLECTORS:
        return ()
    halves = (seen[::2], seen[1::2])
    parts = [(_map_of(setup, half), _detections_of(detected, np.isin(reflector, half))) for half in halves]
    found: list[Agreement] = []
    for factor in factors:
        runs = [whole_run.run(log, _plain(part, factor), start, detected=own) for part, own in parts]
        found.append(_agreement(runs[0], runs[1], factor))
    return tuple(found)


def best_factor(found: Sequence[Agreement], half: int | None = None) -> float:
    """Least multiple of the noise with which two localizers differ as much as they say; 1 where nothing was tried.

    Parameters
    ----------
    found : what was tried, ascending.
    half : 0 or 1, the half of the drive that says so; None: all of it.
    """
    ratios = np.array([each.ratio if half is None else each.ratios[half] for each in found])
    if not found or ratios[0] <= 1.0:
        return 1.0
    if ratios.min() > 1.0:
        return found[-1].factor
    after = int(np.argmax(ratios <= 1.0))
    share = (ratios[after - 1] - 1.0) / (ratios[after - 1] - ratios[after])
    return float(found[after - 1].factor + share * (found[after].factor - found[after - 1].factor))


def _map_of(setup: LocalizerSetup, reflectors: IntArray) -> LocalizerSetup:
    """Return the setup with some of its reflectors alone."""
    return replace(setup, reflectors=ReflectorMap(tuple(setup.reflectors.reflectors[i] for i in reflectors)))


def _plain(setup: LocalizerSetup, factor: float) -> LocalizerSetup:
    """Return the setup without constants and with an open gate, its noise multiplied."""
    given, noise = setup.parameters, setup.parameters.observation
    parameters = replace(
        given,
        observation=replace(noise, range_sigma=factor * noise.range_sigma, bearing_sigma=factor * noise.bearing_sigma),
        filter=FilterParameters(consider=False),
        association=AssociationParameters(gate_probability=OPEN_GATE),
    )
    return replace(setup, parameters=parameters)


def _detections_of(detected: DetectionLog, kept: BoolArray) -> DetectionLog:
    """Return the log with some of its detections alone."""
    before = np.concatenate(([0], np.cumsum(kept)))
    return DetectionLog(
        stamps_ns=detected.stamps_ns,
        scanners=detected.scanners,
        offsets=read_only(before[detected.offsets].astype(np.int64)),
        range_bearing=read_only(detected.range_bearing[kept]),
        beams=read_only(detected.beams[kept]),
        expected=read_only(detected.expected[kept]),
        status=read_only(detected.status[kept]),
        tags=detected.tags,
        bearings=detected.bearings,
    )


def _agreement(one: RunColumns, other: RunColumns, factor: float) -> Agreement:
    """Compare the poses of two runs over one odometry.

    Notes
    -----
    Both predict with the same noise of odometry, so that their errors are correlated: C = A (F C F^T + Q) B^T, with
    A = P P_prior^-1 = I - K H of the one and B of the other, and Q = P_prior - F P F^T; var(x - y) = P + P' - C - C^T.
    """
    priors = (one.priors.rows(), other.priors.rows())
    start = one.initial
    before = np.concatenate((start.mean[np.newaxis], one.means[:-1]))
    spread = np.concatenate((start.covariance[np.newaxis], one.covariances[:-1]))
    F = np.broadcast_to(np.eye(3), (len(one), 3, 3)).copy()
    F[:, 0, 2], F[:, 1, 2] = before[:, 1] - priors[0].means[:, 1], priors[0].means[:, 0] - before[:, 0]
    Q = priors[0].covariances - F @ spread @ np.swapaxes(F, 1, 2)
    A, B = (
        np.swapaxes(np.asarray(np.linalg.solve(prior.covariances, run.covariances), dtype=np.float64), 1, 2)
        for prior, run in zip(priors, (one, other), strict=True)
    )
    shared = np.empty((len(one), 3, 3))
    _share(A, B, F, Q, read_only(np.array(start.covariance)), shared)
    # Where neither has seen anything yet the two are one: a floor of 0.1 mm.
    V = one.covariances + other.covariances - shared - np.swapaxes(shared, 1, 2) + 1e-8 * np.eye(3)
    difference = one.means - other.means
    difference[:, 2] = wrap(difference[:, 2])
    d2 = np.einsum("ki,ki->k", difference, np.linalg.solve(V, difference[:, :, np.newaxis])[:, :, 0])
    _, log_det = np.linalg.slogdet(V)
    likelihood, middle = -0.5 * (np.minimum(d2, 3.0 * FARTHEST_D2) + log_det), len(d2) // 2
    block = _blocks(one)
    return Agreement(
        factor=factor,
        likelihood=float(likelihood.mean()),
        ratio=float(d2.mean() / 3.0),
        score=Score(np.bincount(block, likelihood).astype(np.float64), np.bincount(block).astype(np.float64), math.nan),
        ratios=(float(d2[:middle].mean() / 3.0), float(d2[middle:].mean() / 3.0)),
    )


@compiled
def _share(A: FloatArray, B: FloatArray, F: FloatArray, Q: FloatArray, begin: FloatArray, shared: FloatArray) -> None:  # noqa: PLR0917
    """Write the covariance of two runs with each other, cycle by cycle.

    Notes
    -----
    C = A (F C F^T + Q) B^T, see `_agreement`; derived.
    """
    common, left, right = begin.copy(), np.empty((3, 3)), np.empty((3, 3))
    for k in range(len(shared)):
        _product(F[k], common, left)
        _product(left, F[k].T, right)
        for i in range(3):
            for j in range(3):
                right[i, j] += Q[k, i, j]
        _product(A[k], right, left)
        _product(left, B[k].T, common)
        shared[k] = common


@compiled_inline
def _product(left: FloatArray, right: FloatArray, product: FloatArray) -> None:
    """Write the product of two 3 x 3 matrices.

    Notes
    -----
    P_ij = sum of L_ik R_kj, by definition.
    """
    for i in range(3):
        for j in range(3):
            product[i, j] = left[i, 0] * right[0, j] + left[i, 1] * right[1, j] + left[i, 2] * right[2, j]


def _blocks(run: RunColumns) -> IntArray:
    """(K,) stretch of `BLOCK_S` that each cycle lies in."""
    return ((run.stamps_ns - run.stamps_ns[0]) * 1e-9 / BLOCK_S).astype(np.int64)
