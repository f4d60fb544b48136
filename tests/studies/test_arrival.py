"""Clocks by arrival: what was put in is found, by numbers made here."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from commission.geometry.arrays import IntArray
from commission.studies.arrival import arrival_offset, floor_of, ticks_of

S = 1_000_000_000


def arrivals(rng: np.random.Generator, period_s: float, seconds: float, jitter_s: float) -> tuple[IntArray, IntArray]:
    """Times of measurement and of arrival [ns]: the least way takes 0.3 ms, most take longer, some much."""
    measured = np.arange(0.0, seconds, period_s)
    late = 0.0003 + rng.exponential(jitter_s, len(measured)) + 0.05 * (rng.random(len(measured)) < 0.02)
    arrived = np.maximum.accumulate(measured + late)
    return np.round(measured * 1e9).astype(np.int64), np.round(arrived * 1e9).astype(np.int64) + 5 * S


@pytest.mark.parametrize("offset_ms", [-37.0, 0.0, 12.0, 60.0])
def test_what_one_clock_shows_more_is_found_through_jitter_and_drift(offset_ms: float) -> None:
    rng = np.random.default_rng(5)
    seen, seen_at = arrivals(rng, 0.04, 60.0, 0.004)
    driven, driven_at = arrivals(rng, 0.02, 60.0, 0.002)
    # It goes too fast by 30 us in a second, about the middle of the minute.
    clock = np.round(seen + offset_ms * 1e6 + 30e-6 * (seen - 30 * S)).astype(np.int64)
    found = arrival_offset("front", (clock, seen_at), (driven, driven_at))
    assert found is not None
    assert found.clocks is not None
    assert found.clocks * 1e3 == pytest.approx(offset_ms, abs=0.5)
    assert found.drift == pytest.approx(-30e-6, abs=5e-6)
    assert found.sigma < 0.001
    # Live stamps are placed by the quickest arrivals: arrival knows of nothing that is left, and would overrule motion.
    assert found.offset is None
    assert not found.differs_from(0.02)


def test_scans_without_a_time_are_late_by_what_their_arrivals_are_later_than_the_quickest() -> None:
    rng = np.random.default_rng(8)
    measured, at = arrivals(rng, 0.04, 40.0, 0.006)
    lost = rng.random(len(at)) < 0.05
    driven, driven_at = arrivals(rng, 0.02, 40.0, 0.0005)
    found = arrival_offset("front", (None, at[~lost]), (driven, driven_at))
    assert found is not None
    assert found.clocks is None
    truth = float(np.median(at[~lost] - 5 * S - measured[~lost])) * 1e-9 - 0.0003
    assert found.offset == pytest.approx(truth, abs=0.001)
    assert found.differs_from(0.0)
    assert not found.differs_from(found.offset)


def test_the_line_below_the_delays_is_that_of_linear_programming() -> None:
    rng = np.random.default_rng(3)
    measured, at = arrivals(rng, 0.05, 20.0, 0.003)
    clock = np.round(measured * (1.0 + 80e-6)).astype(np.int64)
    found = floor_of(clock, at)
    assert found is not None
    seconds, delays = (clock - clock[0]) * 1e-9, (at - clock - 5 * S) * 1e-9
    # Least sum of what is above the line, no point below it.
    cost = [float(seconds.sum()), float(len(seconds))]
    lines = np.column_stack((seconds, np.ones_like(seconds)))
    best = linprog([-each for each in cost], A_ub=lines, b_ub=delays, bounds=[(None, None)] * 2)
    assert found.drift == pytest.approx(best.x[0], abs=1e-7)
    assert (found.offset_ns - 5 * S) * 1e-9 == pytest.approx(best.x[1], abs=1e-6)


def test_nothing_is_said_of_too_few_arrivals_or_uneven_ones() -> None:
    rng = np.random.default_rng(2)
    measured, at = arrivals(rng, 0.04, 40.0, 0.001)
    assert floor_of(measured[:40], at[:40]) is None
    chance = np.sort(rng.integers(0, 40 * S, 1_000))
    assert ticks_of(chance) is None
    assert arrival_offset("front", (None, chance), (measured, at)) is None
