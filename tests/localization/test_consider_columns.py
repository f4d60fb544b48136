"""Columns of the covariance with constants: carried in chunks as if they were carried all at once."""

from __future__ import annotations

import numpy as np
import pytest

from commission.localization.consider import Considering, ConsiderModel, ConstantsRoom
from commission.localization.consider_columns import CHUNK, NOTHING, RECHECKED, busy_chunks, put_back, put_block

REFLECTORS = 100
COLUMNS = 2 * REFLECTORS + 5
NOTHING_KNOWN = ConsiderModel(0.0, 0.0, 0.0, 0.0)


def considering(cross: np.ndarray, work: np.ndarray, busy: np.ndarray | None) -> Considering:
    """A scan of a vehicle at rest, worked out already."""
    return Considering(NOTHING_KNOWN, 0.0, 0.0, 0.0, 0.0, 0.0, ConstantsRoom(cross, work, busy))


def scan(rng: np.random.Generator) -> np.ndarray:
    """(3, 10) a transition that shrinks, columns of the scanner, and those of one reflector."""
    work = rng.normal(size=(3, 10))
    work[:, :3] = 0.8 * np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    return work


def test_columns_in_chunks_are_what_they_are_all_at_once_to_the_last_bit() -> None:
    rng = np.random.default_rng(0)
    cross = np.zeros((3, COLUMNS))
    cross[:, 70:80] = rng.normal(size=(3, 10))
    other, busy = cross.copy(), busy_chunks(cross)
    for _ in range(600):
        work, entry = scan(rng), int(rng.integers(REFLECTORS // 3))
        for each, chunks in ((cross, busy), (other, None)):
            given = considering(each, work, chunks)
            put_back(given, REFLECTORS, 0)
            put_block(given, 8, entry)
        assert cross.tobytes() == other.tobytes()


def test_a_chunk_rests_once_nothing_is_left_in_it_and_wakes_with_its_reflector() -> None:
    rng = np.random.default_rng(1)
    cross = np.zeros((3, COLUMNS))
    cross[:, CHUNK + 2] = 1.0
    busy = busy_chunks(cross)
    assert busy.tolist() == [0, RECHECKED, 0, 0, 0, 0, 0]
    for _ in range(8 * RECHECKED):
        put_back(considering(cross, scan(rng), busy), REFLECTORS, 0)
    assert not cross[:, :-5].any()
    # The scanner's columns are written at each scan.
    assert (busy > 0).tolist() == [False, False, False, False, False, False, True]
    put_block(considering(cross, scan(rng), busy), 8, CHUNK // 2 + 1)
    assert (busy > 0).tolist() == [False, True, False, False, False, False, True]


def test_what_is_smaller_than_nothing_is_zero() -> None:
    work = np.zeros((3, 10))
    work[:, :3] = np.eye(3)
    cross = np.full((3, COLUMNS), 2.0 * NOTHING)
    put_back(considering(cross, work, None), REFLECTORS, 0)
    assert cross[0, 0] == pytest.approx(2.0 * NOTHING, rel=1e-12)
    work[:, :3] *= 0.4
    put_back(considering(cross, work, None), REFLECTORS, 0)
    assert cross[0, 0] == 0.0
