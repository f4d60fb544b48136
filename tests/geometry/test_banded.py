"""Banded equations against dense ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import cholesky_banded

from commission.geometry.banded import solved


@pytest.mark.parametrize(("size", "width", "columns"), [(1, 1, 2), (3, 6, 1), (40, 6, 7), (25, 1, 3), (30, 30, 4)])
def test_banded_equations_have_the_solution_of_the_dense_ones(size: int, width: int, columns: int) -> None:
    rng = np.random.default_rng(size)
    lower = np.tril(np.triu(rng.normal(size=(size, size)), 1 - width)) + 3.0 * np.eye(size)
    dense, right = lower @ lower.T, rng.normal(size=(size, columns))
    banded = np.zeros((width, size))
    for below in range(min(width, size)):
        banded[below, : size - below] = np.diagonal(dense, -below)
    given = right.copy(order="F")
    found = solved(cholesky_banded(banded, lower=True), given)
    np.testing.assert_allclose(found, np.linalg.solve(dense, right), rtol=1e-9, atol=1e-12)
    assert (given == right).all()
    assert found.flags.c_contiguous
