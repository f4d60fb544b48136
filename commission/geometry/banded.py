"""Equations whose matrix is banded, for many right-hand sides at once: all columns of a row go together.

LAPACK takes one column after the other, and waits for each number. The factor itself is scipy's.
"""

from __future__ import annotations

import numpy as np

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray, read_only


def solved(factor: FloatArray, right: FloatArray) -> FloatArray:
    """Solve A x = b for a banded matrix A = L L^T.

    Parameters
    ----------
    factor : (w, n) L as `scipy.linalg.cholesky_banded` gives it with `lower`: row d holds its d-th diagonal below.
    right : (n, p) array, b of each of p equations.

    Returns
    -------
    x : (n, p) array.
    """
    x = np.array(right, dtype=np.float64, order="C")
    _substitute(read_only(factor), x)
    return x


@compiled
def _substitute(factor: FloatArray, x: FloatArray) -> None:
    """Forward and back substitution in place.

    Notes
    -----
    L y = b, then L^T x = y: Golub, Van Loan, "Matrix Computations", 2013, algorithms 4.3.2 and 4.3.3, row by row.
    """
    n, p = x.shape
    for i in range(n):
        for d in range(1, min(len(factor), i + 1)):
            for c in range(p):
                x[i, c] -= factor[d, i - d] * x[i - d, c]
        for c in range(p):
            x[i, c] /= factor[0, i]
    for i in range(n - 1, -1, -1):
        for d in range(1, min(len(factor), n - i)):
            for c in range(p):
                x[i, c] -= factor[d, i] * x[i + d, c]
        for c in range(p):
            x[i, c] /= factor[0, i]
