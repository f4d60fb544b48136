"""Rows of needs fulfilled by exchanges, against all sets there are."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from commission.planning.cover import CoverProblem
from commission.planning.fulfilling import Needs, exchanged, grown, pruned, without_one

COLUMNS = 9


def system_of(seed: int) -> tuple[Needs, CoverProblem]:
    """Rows of a cover, and rows with any gains."""
    rng = np.random.default_rng(seed)
    covers = (rng.random((6, COLUMNS)) < 0.5).astype(np.float32)
    fixed = np.zeros(COLUMNS, np.bool_)
    fixed[0] = seed % 3 == 0
    conflicts = [np.empty(0, np.int64)] * COLUMNS
    if seed % 2:
        conflicts[3], conflicts[4] = np.array([4]), np.array([3])
    problem = CoverProblem(covers, np.ones(6, np.int64), fixed, tuple(conflicts))
    system = Needs(problem)
    gains = rng.uniform(0.0, 1.0, (8, COLUMNS))
    system.add(gains, rng.uniform(0.5, 1.5, 8))
    return system, problem


def allowed(choice: CoverProblem, size: int) -> list[np.ndarray]:
    sets = [np.isin(np.arange(COLUMNS), chosen) for chosen in itertools.combinations(range(COLUMNS), size)]
    return [
        each
        for each in sets
        if not np.any(choice.fixed & ~each)
        and not any(each[a] and np.any(each[choice.conflicts[a]]) for a in range(COLUMNS))
    ]


def fewest(system: Needs, choice: CoverProblem) -> int:
    return next(
        size
        for size in range(COLUMNS + 1)
        if any(np.all(system.gains[each].sum(axis=0) >= system.needs - 1e-5) for each in allowed(choice, size))
    )


def test_a_set_of_the_fewest_columns_is_found_by_exchanges_from_any_other_of_that_size() -> None:
    """In at least nine of ten of all small systems; what is found is allowed and has as many columns."""
    found: list[bool] = []
    for seed in range(30):
        system, choice = system_of(seed)
        size = fewest(system, choice)
        for start in allowed(choice, size)[:: max(1, len(allowed(choice, size)) // 5)]:
            result = exchanged(system, start, 60)
            assert any(np.array_equal(result, each) for each in allowed(choice, size))
            found.append(bool(np.all(system.gains[result].sum(axis=0) >= system.needs - 1e-5)))
    assert np.mean(found) >= 0.9


def test_what_is_lacking_is_grown_and_what_is_not_needed_is_pruned() -> None:
    for seed in range(0, 30, 2):
        system, choice = system_of(seed)
        full = grown(system, choice.fixed)
        assert not system.lacking(full).any()
        few = pruned(system, full)
        assert np.all(full[few])
        assert np.all(few[choice.fixed])
        assert not system.lacking(few).any()
        # No column of what is left can go.
        for column in np.flatnonzero(few & ~choice.fixed):
            left = few.copy()
            left[column] = False
            assert system.lacking(left).any()


def test_the_column_that_is_missed_least_goes_first() -> None:
    problem = CoverProblem(
        np.array([[1, 0, 1], [0, 1, 1]], np.float32),
        np.array([1, 1]),
        np.zeros(3, np.bool_),
        (np.empty(0, np.int64),) * 3,
    )
    system = Needs(problem)
    system.add(np.array([[0.0, 0.4, 1.0]]), np.array([1.2]))
    assert np.flatnonzero(without_one(system, np.ones(3, np.bool_))).tolist() == [1, 2]


def test_needs_that_no_set_meets_are_asked_for_as_far_as_all_columns_reach() -> None:
    system, choice = system_of(2)
    system.add(np.full((1, COLUMNS), 0.1), np.array([5.0]))
    assert system.needs[-1] == pytest.approx(0.1 * COLUMNS, rel=2e-3)
    everything = grown(system, choice.fixed)
    assert everything.all()
    assert not system.lacking(everything).any()


@pytest.mark.parametrize(("gain", "need"), [(np.nan, 1.0), (np.inf, 1.0), (-np.inf, 1.0), (1.0, np.nan)])
def test_rows_that_hold_no_numbers_are_refused(gain: float, need: float) -> None:
    system, _ = system_of(0)
    gains = np.ones((1, COLUMNS))
    gains[0, 3] = gain
    with pytest.raises(ValueError, match="expected finite gains"):
        system.add(gains, np.array([need]))
    system.add(np.ones((1, COLUMNS)), np.array([np.inf]))
    assert np.isfinite(system.lacking(np.zeros(COLUMNS, np.bool_))).all()
