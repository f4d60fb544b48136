"""Covering: never fewer than the bound, nearly always the fewest, and within the conflicts."""

import itertools

import numpy as np
import pytest

from commission.planning import cover as solver
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


def fewest_with(problem, gains, needs):
    """Size of the smallest set that covers all rows and gains what the further ones need, by trying all; None: none."""
    count = problem.covers.shape[1]
    for size in range(count + 1):
        for chosen in itertools.combinations(range(count), size):
            taken = problem.fixed.copy()
            taken[list(chosen)] = True
            if np.all(problem.counts(taken) >= problem.attainable()) and np.all(gains[:, taken].sum(axis=1) >= needs):
                return size
    return None


def information_rows(rng, count):
    """Rows as information gives them: gains over fourteen decades, some of them losses, needs that some sets meet."""
    gains = 10.0 ** rng.uniform(-10.0, 4.0, (6, count)) * (rng.random((6, count)) < 0.7)
    gains[:2] *= rng.choice((-1.0, 1.0), (2, count), p=(0.2, 0.8))
    return gains, gains[:, rng.random(count) < 0.6].sum(axis=1) * rng.uniform(0.3, 1.0, 6)


def test_the_bound_holds_where_the_gains_span_fourteen_decades():
    rng = np.random.default_rng(11)
    told = 0
    for _ in range(60):
        covers = rng.random((rng.integers(3, 8), 9)) < 0.4
        problem = problem_of(covers, rng.integers(0, 3, len(covers)), fixed=[0] if rng.random() < 0.3 else ())
        gains, needs = information_rows(rng, 9)
        best = fewest_with(problem, gains, needs)
        if best is not None:
            told += 1
            assert lower_bound(problem) <= lower_bound(problem, gains, needs) <= best
    assert told >= 30


def test_a_column_that_gains_more_than_needed_counts_as_one_and_not_as_many():
    # Two rows, each met by a column of its own that gains a thousand times what is needed.
    problem = problem_of(np.zeros((1, 2)), [0])
    assert lower_bound(problem, np.array([[1e6, 0.0], [0.0, 1e6]]), np.array([1e3, 1e3])) == 2


def test_a_program_that_is_not_solved_in_time_leaves_the_bound_of_the_rows_of_sight(monkeypatch):
    problem = problem_of([[1, 1, 0], [0, 0, 1]], [1, 1])
    gains, needs = np.array([[1.0, 1.0, 1.0]]), np.array([3.0])
    assert lower_bound(problem, gains, needs) == 3
    solve = solver.linprog

    def only_short_ones(costs, **keys):
        solved = solve(costs, **keys)
        if keys["A_ub"].shape[0] > 2:
            solved.status = 1
        return solved

    monkeypatch.setattr(solver, "linprog", only_short_ones)
    assert lower_bound(problem, gains, needs) == 2
