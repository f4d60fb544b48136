"""Placement against all layouts there are: hardly ever one reflector too many, never two, and an honest bound."""

import numpy as np
import pytest

from tests.conftest import Seeds
from tests.planning.small_cases import KINDS, Verdict, judged, small_case


@pytest.fixture(scope="module")
def verdicts(seeds: Seeds) -> list[Verdict]:
    """Every kind of demand equally often. The bounds are the same for few cases and for all."""
    return [judged(small_case(seed)) for seed in seeds(3 * len(KINDS), 12 * len(KINDS))]


@pytest.mark.slow
def test_at_least_nine_in_ten_are_solved_with_the_fewest_reflectors_and_none_with_two_more(verdicts):
    possible = [each for each in verdicts if each.fewest is not None]
    assert {each.kind for each in possible} == set(KINDS)
    assert all(each.met for each in possible)
    extra = np.array([each.extra for each in possible])
    assert extra.min() >= 0
    assert extra.max() <= 1
    assert np.mean(extra == 0) >= 0.9


@pytest.mark.slow
def test_where_no_layout_meets_the_demands_it_says_so(verdicts):
    impossible = [each for each in verdicts if each.fewest is None]
    assert impossible
    assert not any(each.met for each in impossible)


@pytest.mark.slow
def test_the_bound_holds_for_every_kind_of_demand(verdicts):
    for each in verdicts:
        if each.fewest is not None:
            assert each.at_least <= each.fewest
