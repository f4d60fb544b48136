"""Position and heading from three bearings: intersection of circles, its covariance, which three landmarks tell most.

What Alenya et al. 2005, section II, build on (their references 2 and 6). All points that see two landmarks under one
angle lie on a circle through both, so that three bearings are three circles through the vehicle. On the circle through
all three landmarks they coincide: there is no fix, which is a result and no error.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray

LARGEST_COTANGENT = 1e9
"""Cotangent that stands for that of no angle: two landmarks in one direction."""
SINGULAR = 1e-9
"""Share of the size of its terms below which the determinant of a fix is none."""
NOWHERE = 1e150
"""Variance that stands for no information [m^2 for a bearing variance of 1]: finite, so that sums stay so."""


class Fix(NamedTuple):
    """A pose of the scanner from three bearings."""

    is_fix: bool
    """Whether there is one: the vehicle is not on the circle through the landmarks."""
    x: float
    y: float
    theta: float


@compiled_inline
def _cotangent(angle: float) -> float:
    """Cotangent of an angle, finite.

    Notes
    -----
    cos / sin, by definition; of a sine next to 0, `LARGEST_COTANGENT` with its sign.
    """
    s, c = math.sin(angle), math.cos(angle)
    if abs(s) * LARGEST_COTANGENT < abs(c):
        return LARGEST_COTANGENT if (s >= 0.0) == (c >= 0.0) else -LARGEST_COTANGENT
    return c / s


@compiled
def intersect_circles(landmarks: FloatArray, bearings: FloatArray) -> Fix:
    """Fix of the scanner from three bearings; all finite wherever it stands.

    Parameters
    ----------
    landmarks : (3, 2) [m], map frame.
    bearings : (3,) [rad], scanner frame.

    Notes
    -----
    x = x_2 + k_31 (y_12 - y_23) / D: centers of the circles by the cotangents of the angles between bearings, and the
    common point of their radical axes: Cohen and Koss 1992, in the form of Pierlot and Van Droogenbroeck 2014 (ToTal),
    algorithm 1.
    """
    x1, y1 = landmarks[0, 0] - landmarks[1, 0], landmarks[0, 1] - landmarks[1, 1]
    x3, y3 = landmarks[2, 0] - landmarks[1, 0], landmarks[2, 1] - landmarks[1, 1]
    t12 = _cotangent(bearings[1] - bearings[0])
    t23 = _cotangent(bearings[2] - bearings[1])
    t31 = _cotangent(bearings[0] - bearings[2])
    x12, y12 = x1 + t12 * y1, y1 - t12 * x1
    x23, y23 = x3 - t23 * y3, y3 + t23 * x3
    x31, y31 = x3 + x1 + t31 * (y3 - y1), y3 + y1 - t31 * (x3 - x1)
    k31 = x1 * x3 + y1 * y3 + t31 * (x1 * y3 - x3 * y1)
    one, other = (x12 - x23) * (y23 - y31), (y12 - y23) * (x23 - x31)
    determinant = one - other
    if not abs(determinant) > SINGULAR * (abs(one) + abs(other)):
        return Fix(False, landmarks[1, 0], landmarks[1, 1], 0.0)
    x = landmarks[1, 0] + k31 * (y12 - y23) / determinant
    y = landmarks[1, 1] + k31 * (x23 - x12) / determinant
    # The landmark that is farthest away tells the heading, which is well defined even on top of another one.
    farthest, distance = 0, -1.0
    for i in range(3):
        d = (landmarks[i, 0] - x) ** 2 + (landmarks[i, 1] - y) ** 2
        if d > distance:
            farthest, distance = i, d
    theta = math.atan2(landmarks[farthest, 1] - y, landmarks[farthest, 0] - x) - bearings[farthest]
    return Fix(True, x, y, wrap_scalar(theta))


@compiled
def fix_covariance(landmarks: FloatArray, x: float, y: float, variances: FloatArray) -> tuple[bool, FloatArray]:
    """Covariance of a fix from three bearings.

    Parameters
    ----------
    landmarks : (3, 2) [m], map frame.
    x, y : the scanner [m], map frame.
    variances : (3,) of the bearings [rad^2].

    Returns
    -------
    is_regular, covariance : (3, 3) of x, y and heading; zeros where there is none.

    Notes
    -----
    H^-1 diag(variances) H^-T with rows of H the derivative of a bearing, (d_y, -d_x) / d^2 and -1; the inverse by
    cofactors, by definition. det H is twice the area that the three points (d_y, -d_x) / d^2 span, and 0 on the circle.
    """
    a, b = np.empty(3), np.empty(3)
    covariance = np.zeros((3, 3))
    for i in range(3):
        dx, dy = landmarks[i, 0] - x, landmarks[i, 1] - y
        square = dx * dx + dy * dy
        if not square > 0.0:
            return False, covariance
        a[i], b[i] = dy / square, -dx / square
    determinant = 0.0
    size = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        part = a[j] * b[k] - a[k] * b[j]
        determinant -= part
        size += abs(part)
    if not abs(determinant) > SINGULAR * size:
        return False, covariance
    inverse = np.empty((3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        inverse[0, i] = (b[k] - b[j]) / determinant
        inverse[1, i] = (a[j] - a[k]) / determinant
        inverse[2, i] = (a[j] * b[k] - a[k] * b[j]) / determinant
    for i in range(3):
        for j in range(3):
            for k in range(3):
                covariance[i, j] += inverse[i, k] * variances[k] * inverse[j, k]
    return True, covariance


@compiled
def most_informative(points: FloatArray, variances: FloatArray) -> tuple[IntArray, float]:
    """Three landmarks whose bearings tell the position best, of all triples.

    Parameters
    ----------
    points : (N, 2) landmarks from the scanner, map axes [m].
    variances : (N,) of their bearings [rad^2].

    Returns
    -------
    chosen : (3,) indices, ascending; all -1 where no triple gives a fix.
    variance : of the position, sum of both axes [m^2].

    Notes
    -----
    argmin over i < j < k of sum of variances times ((b_k - b_j)^2 + (a_j - a_k)^2) / det^2 = trace of the position's
    block in `fix_covariance`, by definition.
    """
    N = len(points)
    a, b = np.empty(N), np.empty(N)
    usable = np.empty(N, dtype=np.bool_)
    for i in range(N):
        square = points[i, 0] ** 2 + points[i, 1] ** 2
        usable[i] = square > 0.0 and variances[i] < NOWHERE
        a[i] = points[i, 1] / square if usable[i] else 0.0
        b[i] = -points[i, 0] / square if usable[i] else 0.0
    chosen = np.full(3, -1)
    least = NOWHERE
    for i in range(N):
        for j in range(i + 1, N):
            for k in range(j + 1, N):
                if not (usable[i] and usable[j] and usable[k]):
                    continue
                u, v, w = a[j] * b[k] - a[k] * b[j], a[k] * b[i] - a[i] * b[k], a[i] * b[j] - a[j] * b[i]
                determinant = u + v + w
                if not abs(determinant) > SINGULAR * (abs(u) + abs(v) + abs(w)):
                    continue
                total = variances[i] * ((b[k] - b[j]) ** 2 + (a[j] - a[k]) ** 2)
                total += variances[j] * ((b[i] - b[k]) ** 2 + (a[k] - a[i]) ** 2)
                total += variances[k] * ((b[j] - b[i]) ** 2 + (a[i] - a[j]) ** 2)
                if total < least * determinant * determinant:
                    least = total / (determinant * determinant)
                    chosen[0], chosen[1], chosen[2] = i, j, k
    return chosen, least


def warm_up() -> None:
    """Compile the kernels of this module."""
    landmarks = np.array([[3.0, 0.0], [0.0, 3.0], [-3.0, 0.0]])
    intersect_circles(landmarks, np.array([0.0, 1.5, 3.0]))
    fix_covariance(landmarks, 0.0, 0.1, np.ones(3))
    most_informative(landmarks, np.ones(3))
