"""Eigenvalues and eigenvectors of a symmetric three by three matrix, for kernels."""

from __future__ import annotations

import math

import numpy as np

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray

SWEEPS = 12
"""Sweeps of Jacobi at most; it converges quadratically, mostly in four."""


@compiled
def eigen_symmetric(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (3,), in no order, and eigenvectors (3, 3) in columns of a symmetric matrix (3, 3).

    Notes
    -----
    A = V diag(values) V^T by Jacobi's rotations, each of which makes one element zero: Golub and Van Loan 2013, section
    8.5.
    """
    a, vectors = matrix.copy(), np.eye(3)
    for _ in range(SWEEPS):
        off = a[0, 1] * a[0, 1] + a[0, 2] * a[0, 2] + a[1, 2] * a[1, 2]
        scale = a[0, 0] * a[0, 0] + a[1, 1] * a[1, 1] + a[2, 2] * a[2, 2]
        if not off > 1e-30 * scale:
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                tau = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                t = math.copysign(1.0, tau) / (abs(tau) + math.sqrt(1.0 + tau * tau))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = t * c
                for k in range(3):
                    akp, akq = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * akp - s * akq, s * akp + c * akq
                for k in range(3):
                    apk, aqk = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * apk - s * aqk, s * apk + c * aqk
                for k in range(3):
                    vkp, vkq = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * vkp - s * vkq, s * vkp + c * vkq
    return np.array((a[0, 0], a[1, 1], a[2, 2])), vectors
