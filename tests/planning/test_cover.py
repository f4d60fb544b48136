"""Covering: never fewer than the bound, nearly always the fewest, and within the conflicts."""

import itertools

import numpy as np
import pytest

from commission.planning.cover import CoverProblem, cover, lower_bound, merged

NONE = np.empty(0, dtype=np.int64)


def problem_of(covers, needs, fixed=(), pairs=()):
    covers = np.array(covers, dtype=np.float32)
    count = covers.shape[1]
    conflicts = [[b for a, b in [*pairs, *((b, a) for a, b in pairs)] if a == column] for column in range(count)]
    taken = np.zeros(count, dtype=np.bool_)
    taken[list(fixed)] = True
    return CoverProblem(covers, np.array(needs), taken, tuple(np.array(each, dtype=np.int64) for each in conflicts))


def fewest(problem):
    """Size of the smallest cover, by trying all."""
    goal, count = problem.attainable(), problem.covers.shape[1]
    for size in range(count + 1):
        for chosen in itertools.combinations(range(count), size):
            taken = problem.fixed.copy()
            taken[list(chosen)] = True
            if np.all(problem.counts(taken) >= goal):
                return size
    raise AssertionError("attainable needs are attained by all columns")


def test_all_small_problems_are_solved_with_the_fewest_columns_or_one_more():
    rng = np.random.default_rng(3)
    extra = []
    for _ in range(60):
        covers = rng.random((rng.integers(5, 25), rng.integers(6, 12))) < rng.uniform(0.2, 0.6)
        problem = problem_of(covers, rng.integers(1, 4, len(covers)))
        taken = cover(problem, np.random.default_rng(0))
        assert np.all(problem.counts(taken) >= problem.attainable())
        best = fewest(problem)
        assert lower_bound(problem) <= best
        extra.append(taken.sum() - best)
    assert max(extra) <= 1
    assert np.mean(np.array(extra) == 0) >= 0.95


def test_fixed_columns_stay_and_cost_nothing():
    problem = problem_of([[1, 0, 1], [1, 1, 0]], [1, 1], fixed=[0])
    assert cover(problem, np.random.default_rng(0)).tolist() == [True, False, False]
    assert lower_bound(problem) == 0


def test_conflicting_columns_are_never_taken_together():
    problem = problem_of([[1, 1, 0], [0, 1, 1]], [2, 1], pairs=[(0, 1)])
    taken = cover(problem, np.random.default_rng(0))
    assert not (taken[0] and taken[1])
    # The first row then stays one short; the second is covered.
    assert problem.counts(taken).tolist() == [1, 1]


def test_needs_beyond_all_columns_are_met_as_far_as_possible():
    problem = problem_of([[1, 1], [0, 0]], [5, 1])
    assert problem.attainable().tolist() == [2, 0]
    assert cover(problem, np.random.default_rng(0)).all()


def test_rows_covered_by_the_same_columns_become_one_with_the_greatest_need():
    covers = np.array([[1, 0], [1, 1], [1, 0]], dtype=np.bool_)
    rows, needs = merged(covers, np.array([1, 2, 3]))
    assert {(tuple(row), need) for row, need in zip(rows.tolist(), needs.tolist(), strict=True)} == {
        ((True, False), 3),
        ((True, True), 2),
    }


def test_without_columns_nothing_is_taken():
    problem = CoverProblem(np.zeros((3, 0), np.float32), np.ones(3, np.int64), np.zeros(0, np.bool_), ())
    assert cover(problem, np.random.default_rng(0)).shape == (0,)
    assert lower_bound(problem) == 0


def test_a_step_may_cancel():
    def stop(fraction):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cover(problem_of([[1, 1]], [1]), np.random.default_rng(0), step=stop)
