"""One displacement of the pose that explains what was rejected, against least squares of numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.localization.displacement import COHERENT, NO_PAIRS, Pairs, tell_of_a_displacement, with_pair

HARMLESS, HARMLESS_TURN = 0.04, math.radians(1.2)
NOISE = 0.02**2


def pairs_of(q: np.ndarray, e: np.ndarray, variances: np.ndarray) -> Pairs:
    pairs = NO_PAIRS
    for (qx, qy), (ex, ey), variance in zip(q, e, variances, strict=True):
        pairs = with_pair(pairs, qx, qy, ex, ey, variance)
    return pairs


def by_numpy(q: np.ndarray, e: np.ndarray, variances: np.ndarray) -> tuple[float, float]:
    """What is left of a degree of freedom, and the square of the displacement in units of what is harmless."""
    root = 1.0 / np.sqrt(np.repeat(variances, 2))
    rows = np.zeros((2 * len(q), 3))
    rows[0::2, 0] = rows[1::2, 1] = 1.0
    rows[0::2, 2], rows[1::2, 2] = -q[:, 1], q[:, 0]
    prior = np.diag((1.0 / HARMLESS, 1.0 / HARMLESS, 1.0 / HARMLESS_TURN))
    whole, sides = np.vstack((rows * root[:, None], prior)), np.concatenate((e.ravel() * root, np.zeros(3)))
    x = np.linalg.lstsq(whole, sides, rcond=None)[0]
    left = float(np.sum(((rows @ x - e.ravel()) * root) ** 2))
    return left / (2 * len(q) - 3), float(np.sum((prior @ x) ** 2))


@pytest.mark.parametrize("seed", range(40))
def test_it_is_least_squares_with_a_prior(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 7))
    q, variances = rng.uniform(-15.0, 15.0, (count, 2)), rng.uniform(1e-4, 1e-3, count)
    d, turn = rng.normal(0.0, 0.05, 2), rng.normal(0.0, 0.02)
    e = d + turn * np.column_stack((-q[:, 1], q[:, 0])) + rng.normal(0.0, rng.uniform(0.5, 4.0) * 0.02, (count, 2))
    left, square = by_numpy(q, e, variances)
    expected = left <= COHERENT and square > 2.0
    assert tell_of_a_displacement(pairs_of(q, e, variances), HARMLESS, HARMLESS_TURN) is expected


ALL_AROUND = np.array([(10.0, 2.0), (4.0, -6.0), (-3.0, 5.0)])
AHEAD = np.array([(9.9, -0.4), (10.1, 0.4)])
"""Of two reflectors beside each other a turn and a way to the side look alike."""


def turned(q: np.ndarray, angle: float) -> np.ndarray:
    return angle * np.column_stack((-q[:, 1], q[:, 0]))


@pytest.mark.parametrize(
    ("q", "e", "tells"),
    [
        (ALL_AROUND, np.tile((0.12, 0.0), (3, 1)), True),
        (ALL_AROUND, np.tile((0.03, 0.0), (3, 1)), False),
        (ALL_AROUND, turned(ALL_AROUND, math.radians(1.0)), False),
        (
            ALL_AROUND,
            np.array((0.04, 0.0)) + turned(ALL_AROUND, math.radians(1.2)),
            False,
        ),  # both as large as is harmless
        (ALL_AROUND, turned(ALL_AROUND, math.radians(2.0)), True),
        (AHEAD, np.tile((0.0, 0.12), (2, 1)), False),  # a turn of 0.7 degrees
        (AHEAD, np.tile((0.12, 0.0), (2, 1)), True),
        (ALL_AROUND, np.array([(0.12, 0.0), (0.0, -0.2), (-0.2, 0.1)]), False),  # three things, each of its own
        (ALL_AROUND[:1], np.array([(0.12, 0.0)]), False),
        (ALL_AROUND[:0], np.empty((0, 2)), False),
    ],
)
def test_several_tell_of_a_displacement_where_one_and_the_same_explains_them(
    q: np.ndarray, e: np.ndarray, tells: bool
) -> None:
    pairs = pairs_of(q, e, np.full(len(q), NOISE))
    assert tell_of_a_displacement(pairs, HARMLESS, HARMLESS_TURN) is tells
    assert not tell_of_a_displacement(pairs, 0.0, 0.0)
