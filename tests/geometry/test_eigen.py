"""Eigenvalues of symmetric three by three matrices against numpy's."""

# pyright: basic

import numpy as np
import pytest

from commission.geometry.eigen import eigen_symmetric


def test_eigenvalues_and_vectors_are_those_of_numpy():
    rng = np.random.default_rng(0)
    for _ in range(200):
        root = rng.standard_normal((3, 3)) * 10.0 ** rng.uniform(-3, 3, 3)
        matrix = root @ root.T
        values, vectors = eigen_symmetric(matrix)
        assert np.sort(values) == pytest.approx(np.linalg.eigvalsh(matrix), abs=1e-12 * np.trace(matrix))
        assert vectors @ np.diag(values) @ vectors.T == pytest.approx(matrix, abs=1e-12 * np.trace(matrix))
        assert vectors.T @ vectors == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize("diagonal", [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (3.0, 0.0, 2.0)])
def test_a_diagonal_matrix_is_its_own(diagonal):
    values, vectors = eigen_symmetric(np.diag(diagonal))
    assert values == pytest.approx(diagonal)
    assert vectors == pytest.approx(np.eye(3))
