"""Rows of what tells a pose, a contour match or a tag: residual, Jacobian and variance of each, and their correction.

Considered constants (mounting and clock of the sensor, the map where the vehicle is) stand beside the rows as columns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.eigen import eigen_symmetric
from commission.localization.consider_columns import carry_over, mark_busy
from commission.localization.invariant import about_elsewhere, carry_along
from commission.localization.pose_gaussian import PoseGaussian


class PoseRows(NamedTuple):
    """Up to three rows: each says how far the pose is from what was found, along one direction."""

    residuals: FloatArray
    """(n,) of what was found less the pose."""
    jacobians: FloatArray
    """(n, 3) direction, with respect to x, y and heading of base."""
    variances: FloatArray
    """(n,) noise of what was found; what is constant stands in `constants`."""
    constants: FloatArray
    """(n, M) with respect to the considered constants."""


@compiled
def told_directions(second: FloatArray, lever: float, fewest: float) -> tuple[FloatArray, FloatArray]:
    """Directions that contours tell, and how many beams tell each.

    Parameters
    ----------
    second : (3, 3) sum of the squared gradients of the distances, of x, y and heading times `lever`.
    lever : length that a radian counts for [m].
    fewest : beams that must tell a direction; those told by fewer are left out: they get no information at all.

    Returns
    -------
    beams : (n,) eigenvalues, with n from 0 to 3.
    jacobians : (n, 3) with respect to x, y and heading.

    Notes
    -----
    second = V diag(beams) V^T, rows V^T with the heading's column times lever: by definition.
    """
    values, vectors = eigen_symmetric(second)
    count = 0
    beams, jacobians = np.empty(3), np.empty((3, 3))
    for k in range(3):
        if values[k] > fewest:
            beams[count] = values[k]
            jacobians[count, 0], jacobians[count, 1] = vectors[0, k], vectors[1, k]
            jacobians[count, 2] = lever * vectors[2, k]
            count += 1
    return beams[:count], jacobians[:count]


@compiled
def nis_of_rows(belief: PoseGaussian, cross: FloatArray, considered: FloatArray, rows: PoseRows) -> float:
    """NIS of all rows together.

    Parameters
    ----------
    belief : before it.
    cross : (3, M) covariance of the pose with the considered constants.
    considered : (M,) their variances.
    rows : of the match.

    Notes
    -----
    v^T S^-1 v with S = H P H^T + H C J^T + (H C J^T)^T + J B J^T + R: Sobreira et al. 2015, equations 5 and 7, with
    constants considered (Schmidt 1966). Solved by Cholesky's factors.
    """
    count = len(rows.residuals)
    P = _matrix(belief)
    S = np.empty((count, count))
    for i in range(count):
        for j in range(count):
            S[i, j] = rows.variances[i] if i == j else 0.0
            for a in range(3):
                for b in range(3):
                    S[i, j] += rows.jacobians[i, a] * P[a, b] * rows.jacobians[j, b]
                for m in range(len(considered)):
                    S[i, j] += rows.jacobians[i, a] * cross[a, m] * rows.constants[j, m]
                    S[i, j] += rows.jacobians[j, a] * cross[a, m] * rows.constants[i, m]
            for m in range(len(considered)):
                S[i, j] += rows.constants[i, m] * considered[m] * rows.constants[j, m]
    total = 0.0
    solved = np.empty(count)
    for i in range(count):
        for j in range(i):
            for k in range(j):
                S[i, j] -= S[i, k] * S[j, k]
            S[i, j] /= S[j, j]
            S[i, i] -= S[i, j] * S[i, j]
        S[i, i] = math.sqrt(max(S[i, i], 1e-18))
        solved[i] = rows.residuals[i]
        for k in range(i):
            solved[i] -= S[i, k] * solved[k]
        solved[i] /= S[i, i]
        total += solved[i] * solved[i]
    return total


@compiled
def corrected_by_rows(
    belief: PoseGaussian, cross: FloatArray, considered: FloatArray, rows: PoseRows, transition: FloatArray
) -> PoseGaussian:
    """Correct a belief by rows, one after the other.

    Parameters
    ----------
    belief : before it.
    cross : (3, M) covariance of the pose with the considered constants, corrected in place.
    considered : (M,) their variances.
    rows : of the match.
    transition : (3, 3) out: what the covariance with any other constant is multiplied by.

    Notes
    -----
    W = (P h + C j) / S, X = X + W V, P = A P A^T - A c W^T - W c^T A^T + W (j B j + R) W^T with A = I - W h^T, c = C j:
    Sobreira et al. 2015, equations 7 to 9, in Joseph's form, of a state with constants that are considered (Schmidt
    1966); C = A C - W j B. With no constants it is equations 7 to 9 row by row.
    """
    covariance = _matrix(belief)
    mean = np.array((belief.x, belief.y, belief.theta))
    start = mean.copy()
    for i in range(3):
        for j in range(3):
            transition[i, j] = 1.0 if i == j else 0.0
    count, width = len(rows.residuals), len(considered)
    for row in range(count):
        h, j = rows.jacobians[row], rows.constants[row]
        c, Ph, W = np.zeros(3), np.zeros(3), np.empty(3)
        constant, spread, moved = 0.0, rows.variances[row], 0.0
        for m in range(width):
            constant += j[m] * considered[m] * j[m]
            for a in range(3):
                c[a] += cross[a, m] * j[m]
        for a in range(3):
            for b in range(3):
                Ph[a] += covariance[a, b] * h[b]
        for a in range(3):
            spread += h[a] * (Ph[a] + 2.0 * c[a])
            moved += h[a] * (mean[a] - start[a])
        spread = max(spread + constant, rows.variances[row])
        for a in range(3):
            W[a] = (Ph[a] + c[a]) / spread
        A = np.eye(3) - _outer(W, h)
        Ac = _times(A, c)
        noise = constant + rows.variances[row]
        covariance = _product(_product(A, covariance), A.T) - _outer(Ac, W) - _outer(W, Ac) + noise * _outer(W, W)
        innovation = rows.residuals[row] - moved
        for a in range(3):
            mean[a] += W[a] * innovation
        for m in range(width):
            column = _times(A, cross[:, m])
            for a in range(3):
                cross[a, m] = column[a] - W[a] * j[m] * considered[m]
        transition[:, :] = _product(A, transition)
    P = covariance
    return PoseGaussian(mean[0], mean[1], wrap_scalar(mean[2]), P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2])


@compiled_inline
def correct_all_by_rows(  # noqa: PLR0917 - the filter's state around a few rows
    belief: PoseGaussian,
    columns: FloatArray,
    considered: FloatArray,
    rows: PoseRows,
    stretches: tuple[tuple[int, int], tuple[int, int]],
    cross: FloatArray | None,
    busy: IntArray | None,
    invariant: bool,
) -> PoseGaussian:
    """Correct a belief by rows, and its covariance with all constants, also those that are none of theirs.

    Parameters
    ----------
    belief, considered, rows : as in `corrected_by_rows`.
    columns : (3, M) its covariance with the constants of the rows, corrected in place.
    stretches : first column in `cross`, and number, of each of the two stretches that `columns` are of.
    cross : covariance of the pose with all constants at `belief`, written in place, or None.
    busy : see `busy_chunks`.
    invariant : whether the covariance is that of a right-invariant error.

    Notes
    -----
    No formula: `corrected_by_rows`; of a right-invariant error then `about_elsewhere` with the way of the mean.
    """
    transition = np.empty((3, 3))
    corrected = corrected_by_rows(belief, columns, considered, rows, transition)
    if invariant:
        # Rows tell a pose, so that the mean needs no exponential; the covariance is about where the mean was.
        way_x, way_y = corrected.x - belief.x, corrected.y - belief.y
        corrected = about_elsewhere(corrected, way_x, way_y)
        carry_along(columns, columns.shape[1], way_x, way_y)
        carry_along(transition, 3, way_x, way_y)
    if cross is not None and busy is not None:
        carry_over(cross, transition, busy)
        at = 0
        for first, count in stretches:
            for row in range(3):
                for i in range(count):
                    cross[row, first + i] = columns[row, at + i]
            mark_busy(busy, first, first + count)
            at += count
    return corrected


@compiled_inline
def _matrix(belief: PoseGaussian) -> FloatArray:
    """Covariance of a belief as a matrix."""
    b = belief
    return np.array(((b.xx, b.xy, b.xt), (b.xy, b.yy, b.yt), (b.xt, b.yt, b.tt)))


@compiled_inline
def _outer(a: FloatArray, b: FloatArray) -> FloatArray:
    """Outer product of two triples."""
    result = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            result[i, j] = a[i] * b[j]
    return result


@compiled_inline
def _times(A: FloatArray, b: FloatArray) -> FloatArray:
    """A b of three rows."""
    result = np.zeros(3)
    for i in range(3):
        for j in range(3):
            result[i] += A[i, j] * b[j]
    return result


@compiled_inline
def _product(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B of three by three."""
    result = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                result[i, j] += A[i, k] * B[k, j]
    return result
