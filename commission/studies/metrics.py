"""How good a run was: errors against reference poses, consistency of the filter, and what the supervisor said.

It judges arrays of a finished run and runs nothing itself. An error is estimate minus reference, map frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.angles import difference, wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.stretches import stretches_of
from commission.localization.estimate import Mode

LONGEST_GAP_NS = 1_000_000_000
"""Reference poses farther apart than this are never joined by a line [ns]."""
ROWS_AT_ONCE = 16_384
"""Rows whose NEES is computed at once: a part of every covariance is copied for it."""
SINGULAR = 1e-12
"""Determinant of a correlation matrix below which the covariance claims to know something exactly."""


def reference_gap_ns(reference_stamps_ns: IntArray) -> int:
    """Longest interval between two reference poses across which a pose is interpolated.

    It is one and a half times the median interval, so that one missing pose already is a gap, and at most one second.

    Parameters
    ----------
    reference_stamps_ns : (R,) array [ns], ascending.

    Returns
    -------
    gap : [ns]; 0 for fewer than two poses.
    """
    if len(reference_stamps_ns) < 2:
        return 0
    return min(round(1.5 * float(np.median(np.diff(reference_stamps_ns)))), LONGEST_GAP_NS)


def reference_at(
    stamps_ns: IntArray,
    reference_stamps_ns: IntArray,
    reference_poses: FloatArray,
    max_gap_ns: int | None = None,
) -> FloatArray:
    """Reference pose at given times: linear in x and y, along the shorter turn in heading, never extrapolated.

    A time has a pose when a reference pose has exactly that stamp, or when the two around it are at most `max_gap_ns`
    apart. Elsewhere the row is NaN. A heading is NaN where one of the headings that it depends on is.

    Parameters
    ----------
    stamps_ns : (K,) array [ns].
    reference_stamps_ns : (R,) array [ns], ascending; of equal stamps the last one counts.
    reference_poses : (R, 3) array [m, m, rad], map frame; NaN where unknown.
    max_gap_ns : [ns]; that of `reference_gap_ns` when None.

    Returns
    -------
    poses : (K, 3) array [m, m, rad], map frame.
    """
    poses = np.full((len(stamps_ns), 3), np.nan)
    if len(reference_stamps_ns) == 0:
        return poses
    gap = reference_gap_ns(reference_stamps_ns) if max_gap_ns is None else max_gap_ns
    before = np.searchsorted(reference_stamps_ns, stamps_ns, side="right") - 1
    exact = (before >= 0) & (reference_stamps_ns[np.maximum(before, 0)] == stamps_ns)
    poses[exact] = reference_poses[before[exact]]

    between = np.flatnonzero(~exact & (before >= 0) & (before < len(reference_stamps_ns) - 1))
    first = before[between]
    interval = reference_stamps_ns[first + 1] - reference_stamps_ns[first]
    between, first, interval = (column[interval <= gap] for column in (between, first, interval))
    share = (stamps_ns[between] - reference_stamps_ns[first]) / interval
    start, end = reference_poses[first], reference_poses[first + 1]
    poses[between, :2] = start[:, :2] + share[:, np.newaxis] * (end[:, :2] - start[:, :2])
    poses[between, 2] = start[:, 2] + share * difference(end[:, 2], start[:, 2])
    poses[:, 2] = wrap(poses[:, 2])
    return poses


def without_reference(stamps_ns: IntArray, reference_stamps_ns: IntArray, errors: FloatArray) -> tuple[int, int]:
    """Count the cycles that nothing can be compared with, by the reason.

    Parameters
    ----------
    stamps_ns : (K,) array [ns].
    reference_stamps_ns : (R,) array [ns], ascending.
    errors : (K, 3) what `pose_errors` found for them; NaN without a reference.

    Returns
    -------
    outside, in_gap : cycles before the first or after the last reference pose, and cycles between two of them that are
        too far apart to be joined by a line.
    """
    missing = np.isnan(errors[:, 0])
    if len(reference_stamps_ns) == 0:
        return int(missing.sum()), 0
    outside = (stamps_ns < reference_stamps_ns[0]) | (stamps_ns > reference_stamps_ns[-1])
    return int(np.count_nonzero(missing & outside)), int(np.count_nonzero(missing & ~outside))


def pose_errors(means: FloatArray, references: FloatArray) -> FloatArray:
    """Estimate minus reference.

    Parameters
    ----------
    means : (K, 3) array [m, m, rad], estimated poses, map frame.
    references : (K, 3) array [m, m, rad], map frame; NaN where unknown.

    Returns
    -------
    errors : (K, 3) array [m, m, rad], map frame, heading wrapped; NaN where unknown.
    """
    errors = means - references
    errors[:, 2] = difference(means[:, 2], references[:, 2])
    return errors


def nees(errors: FloatArray, covariances: FloatArray) -> FloatArray:
    """Normalized estimation error squared e^T P^-1 e (Bar-Shalom et al. 2001, section 5.4).

    Parameters
    ----------
    errors : (K, n) array; angles wrapped; NaN where unknown.
    covariances : (K, n, n) array.

    Returns
    -------
    nees : (K,) array; NaN where the error is unknown, infinite where the covariance is singular: the filter claims to
        know exactly what it does not.
    """
    return nees_of_leading(errors, covariances)[:, -1]


def nees_of_leading(errors: FloatArray, covariances: FloatArray) -> FloatArray:
    """`nees` of the first of n axes, of the first two, and so on: of a pose, that of its place is the second.

    Parameters
    ----------
    errors, covariances : as in `nees`.

    Returns
    -------
    nees : (K, n) array.
    """
    result = np.empty(errors.shape)
    for rows in (slice(first, first + ROWS_AT_ONCE) for first in range(0, len(errors), ROWS_AT_ONCE)):
        _nees(read_only(errors[rows]), read_only(covariances[rows]), result[rows])
    return result


@compiled
def _nees(errors: FloatArray, covariances: FloatArray, result: FloatArray) -> None:
    """e^T P^-1 e of the leading axes by the Cholesky factor of the correlations, row by row.

    Scaled to correlations, metres and radians are comparable and the determinant tells a singular matrix. The factor
    of the leading axes is the leading part of the factor.
    """
    count, n = errors.shape
    factor = np.zeros((n, n))
    solved = np.zeros(n)
    sigmas = np.zeros(n)
    for k in range(count):
        known, certain, determinant, total = True, True, 1.0, 0.0
        for i in range(n):
            known = known and math.isfinite(errors[k, i])
            sigmas[i] = math.sqrt(max(covariances[k, i, i], 0.0))
            certain = certain and sigmas[i] > 0.0
            result[k, i] = math.inf if known else math.nan
            if not known or not certain:
                continue
            for j in range(i + 1):
                rest = covariances[k, i, j] / (sigmas[i] * sigmas[j])
                for m in range(j):
                    rest -= factor[i, m] * factor[j, m]
                if i == j:
                    determinant *= rest if rest > 0.0 else 0.0
                    factor[i, i] = math.sqrt(rest) if rest > 0.0 else 0.0
                else:
                    factor[i, j] = rest / factor[j, j]
            value = errors[k, i] / sigmas[i]
            for m in range(i):
                value -= factor[i, m] * solved[m]
            solved[i] = value / factor[i, i]
            total += solved[i] * solved[i]
            if determinant > SINGULAR:
                result[k, i] = total


def largest_jump(errors: FloatArray) -> float:
    """Largest change of the position error from one cycle to the next.

    The motion itself is not a jump: only what the estimate moves and the vehicle does not. Cycles without a reference
    are not bridged.

    Parameters
    ----------
    errors : (K, 3) array [m, m, rad], as `pose_errors` gives.

    Returns
    -------
    jump : [m]; NaN when no two consecutive cycles have a reference.
    """
    largest = -np.inf
    for first in range(0, len(errors), ROWS_AT_ONCE):
        steps = np.hypot(*np.diff(errors[first : first + ROWS_AT_ONCE + 1, :2], axis=0).T)
        largest = max(largest, float(steps.max(initial=-np.inf, where=np.isfinite(steps))))
    return largest if largest >= 0.0 else float("nan")


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorStatistics:
    """Errors of one run against its reference, over the cycles that have one."""

    compared: int
    """Cycles that have a reference pose."""
    position_rmse: float
    """Root mean square of the distance to the reference [m]."""
    position_median: float
    """Median of that distance [m]."""
    position_p95: float
    """95th percentile of that distance [m]."""
    position_max: float
    """Largest such distance [m]."""
    heading_rmse: float
    """Root mean square of the heading error [rad]; NaN when the reference has no heading."""
    anees: float
    """Mean NEES of x, y and heading, divided by 3; 1 is consistent. NaN when the reference has no heading."""
    anees_position: float
    """Mean NEES of x and y, divided by 2; 1 is consistent."""
    largest_jump: float
    """Largest change of the position error between two consecutive cycles [m]; NaN when there are no two."""
    wrong_while_operational: int
    """Cycles whose position error exceeds the alarm limit while the mode is `operational`: the dangerous ones."""


def error_statistics(
    errors: FloatArray, covariances: FloatArray, operational: BoolArray, position_limit: float | FloatArray
) -> ErrorStatistics | None:
    """Judge a run by its errors.

    Parameters
    ----------
    errors : (K, 3) array [m, m, rad], as `pose_errors` gives; NaN where unknown.
    covariances : (K, 3, 3) array of the estimates.
    operational : (K,) whether the mode after each cycle is `operational`.
    position_limit : alarm limit of the supervisor, Err_p [m]; or (K,) array, where it changes on the way.

    Returns
    -------
    statistics : None when no cycle has a reference pose.
    """
    known = np.isfinite(errors[:, 0]) & np.isfinite(errors[:, 1])
    if not known.any():
        return None
    # Of hours each column is large: the largest one goes before others come.
    anees_position, anees = _anees(errors, covariances)
    distance = np.hypot(errors[:, 0], errors[:, 1])
    distances = distance[known]
    return ErrorStatistics(
        compared=len(distances),
        position_rmse=float(np.sqrt(np.mean(distances**2))),
        position_median=float(np.median(distances)),
        position_p95=float(np.quantile(distances, 0.95)),
        position_max=float(distances.max()),
        heading_rmse=float(np.sqrt(_mean_of_known(errors[known, 2] ** 2))),
        anees=anees,
        anees_position=anees_position,
        largest_jump=largest_jump(errors),
        wrong_while_operational=int(np.count_nonzero(operational & (distance > position_limit))),
    )


def _anees(errors: FloatArray, covariances: FloatArray) -> tuple[float, float]:
    """Mean NEES of the place and of the pose, by their degrees of freedom."""
    _, position_nees, pose_nees = nees_of_leading(errors, covariances).T
    return _mean_of_known(position_nees) / 2.0, _mean_of_known(pose_nees) / 3.0


def _mean_of_known(values: FloatArray) -> float:
    """Mean of what is not NaN; NaN when nothing is known."""
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")


@dataclass(frozen=True, slots=True)
class FailEpisode:
    """One stretch of cycles in which the vehicle may not drive: the mode is `fail` or `lost`."""

    start_ns: int
    """Stamp of the first of them [ns]."""
    end_ns: int
    """Stamp of the first operational cycle after it; of the run's last cycle when it did not recover [ns]."""
    recovered: bool
    """Whether the run became operational again."""


def fail_episodes(stamps_ns: IntArray, modes: NDArray[np.integer]) -> tuple[FailEpisode, ...]:
    """Stretches of a run in which the vehicle may not drive, in order.

    Parameters
    ----------
    stamps_ns : (K,) stamp of each cycle [ns].
    modes : (K,) `Mode` after each cycle.
    """
    count = len(stamps_ns)
    return tuple(
        FailEpisode(int(stamps_ns[first]), int(stamps_ns[min(after, count - 1)]), bool(after < count))
        for first, after in stretches_of(modes != Mode.OPERATIONAL)
    )
