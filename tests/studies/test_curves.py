"""Curves of a run: both extremes survive at any zoom, gaps are gaps, and hours are cut quickly."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.studies.curves import BINS, bins_of, extremes, longest_regular, warm_up

LEVELS = st.lists(st.one_of(st.floats(-1e6, 1e6), st.just(math.nan)), min_size=1, max_size=600)


@given(LEVELS, st.floats(0.0, 100.0), st.floats(0.0, 100.0), st.integers(2, 50))
def test_both_extremes_survive_at_any_zoom_whatever_the_number_of_stretches(
    levels: list[float], one: float, other: float, count: int
) -> None:
    values, times = np.array(levels), np.linspace(0.0, 100.0, len(levels))
    begin, end = sorted((one, other))
    bins = bins_of(times, (begin, end), math.inf, count)
    lows, highs = extremes(values, bins.firsts, bins.afters)
    # By hand: every stretch from its own rows, one after the other without a hole.
    assert bins.firsts[1:].tolist() == bins.afters[:-1].tolist()
    for low, high, first, after, at in zip(lows, highs, bins.firsts, bins.afters, bins.times, strict=True):
        known = [value for value in levels[first:after] if not math.isnan(value)]
        assert at == times[first]
        assert math.isnan(low) if not known else (low, high) == (min(known), max(known))
    inside = (times >= begin) & (times <= end)
    # What lies in the span, with one scan before and one after it, is there, and nothing else.
    shown = np.zeros(len(times), dtype=bool)
    shown[bins.firsts[0] : bins.afters[-1]] = True
    assert (shown[inside]).all()
    assert np.count_nonzero(shown & ~inside) <= 2
    # Neither of the two outside is in a stretch with what lies inside.
    for first, after in zip(bins.firsts, bins.afters, strict=True):
        assert len(set(inside[first:after].tolist())) == 1 or len(shown) <= count
    assert len(bins) <= max(count + 2, min(count, len(times)))


def test_few_cycles_have_a_stretch_each() -> None:
    times = np.arange(100) * 0.04
    bins = bins_of(times, (1.0, 2.0), 1.0)
    assert bins.firsts.tolist() == list(range(24, 52))
    assert bins.afters.tolist() == list(range(25, 53))


def test_a_stretch_may_hold_no_detection() -> None:
    # Three scans with two, no and one detection.
    firsts, afters = np.array([0, 2, 2]), np.array([2, 2, 3])
    lows, highs = extremes(np.array([4.0, 1.0, 7.0]), firsts, afters)
    np.testing.assert_array_equal(lows, [1.0, math.nan, 7.0])
    np.testing.assert_array_equal(highs, [4.0, math.nan, 7.0])


@pytest.mark.parametrize(("pause", "is_gap"), [(0.29, False), (0.31, True)])
def test_a_pause_is_a_gap_from_three_times_the_usual_on(pause: float, is_gap: bool) -> None:
    times = np.concatenate((np.arange(50) * 0.1, 4.9 + pause + np.arange(50) * 0.1))
    bins = bins_of(times, (0.0, 20.0), longest_regular(times))
    assert np.flatnonzero(bins.follows_gap).tolist() == ([50] if is_gap else [])


def test_two_scanners_that_follow_each_other_closely_make_no_gaps() -> None:
    times = np.sort(np.concatenate((np.arange(100) * 0.08, np.arange(100) * 0.08 + 0.001)))
    assert not bins_of(times, (0.0, 8.0), longest_regular(times)).follows_gap.any()


def test_a_gap_is_one_however_many_cycles_a_stretch_holds() -> None:
    times = np.concatenate((np.arange(50_000) * 0.04, 2100.0 + np.arange(50_000) * 0.04))
    bins = bins_of(times, (0.0, 4100.0), longest_regular(times))
    (gap,) = np.flatnonzero(bins.follows_gap).tolist()
    assert bins.times[gap] == 2100.0
    assert bins.times[gap - 1] < 2000.0


def test_a_single_scan_has_no_gap_and_no_scan_no_stretch() -> None:
    assert longest_regular(np.array([3.0])) == math.inf
    assert len(bins_of(np.array([3.0]), (0.0, 10.0), math.inf)) == 1
    assert len(bins_of(np.empty(0), (0.0, 10.0), math.inf)) == 0


def test_six_hours_are_cut_in_a_tenth_of_the_time_that_a_redraw_may_take() -> None:
    warm_up()
    times, values = np.arange(540_000) * 0.04, np.random.default_rng(1).normal(size=540_000)
    took: list[float] = []
    for _ in range(5):
        begin = time.perf_counter()
        bins = bins_of(times, (0.0, 21_600.0), 1.0)
        lows, highs = extremes(values, bins.firsts, bins.afters)
        took.append(time.perf_counter() - begin)
    assert min(took) < 0.01  # ten curves in 100 ms; about 1 ms each on the machine that this was written on
    assert BINS <= len(bins) <= BINS + 2
    assert (np.nanmin(lows), np.nanmax(highs)) == (values.min(), values.max())
