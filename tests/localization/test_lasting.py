"""What is remembered of a reflector's bearings: weighted sums without a recursion, and what is forgotten in time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.localization.lasting import KNOWN, NOISE, REMEMBERED, SUM, WEIGHT, LastingRule, lasts, remember

RULE = LastingRule(window_s=4.0, limit=5.0, lateral=0.025, turned=0.013)
VARIANCE, R = 2e-6, 1.5e-6


def test_older_bearings_count_less_by_the_time_that_has_passed() -> None:
    rng = np.random.default_rng(8)
    times = np.cumsum(rng.exponential(1.5, 30))
    innovations, variances, constants = rng.normal(0.0, 1e-3, 30), rng.uniform(2e-6, 5e-6, 30), rng.uniform(0, 3e-6, 30)
    row = np.zeros(REMEMBERED)
    for time, innovation, variance, constant in zip(times, innovations, variances, constants, strict=True):
        remember(row, round(time * 1e9), innovation, variance, R, constant, 5.0, RULE)
    weights = np.exp((times - times[-1]) / 4.0) * R / variances
    assert row[WEIGHT] == pytest.approx(weights.sum(), rel=1e-6)
    assert row[SUM] == pytest.approx((weights * innovations).sum(), rel=1e-6)
    assert row[NOISE] == pytest.approx((weights**2 * np.maximum(variances - constants, R)).sum(), rel=1e-6)
    assert row[KNOWN] == pytest.approx((weights * constants).sum(), rel=1e-6)


def test_a_reflector_that_is_back_in_its_place_is_forgotten_after_some_windows() -> None:
    """The last of four is 20 mrad off for 10 s: 0.1 m at 5 m."""
    rows, held = np.zeros((4, REMEMBERED)), False
    lasting = []
    for k in range(2000):  # 40 a second, 50 s
        time, off = 0.025 * k, 0.02 if k % 4 == 3 and k < 400 else 0.0
        remember(rows[k % 4], round(time * 1e9), off, VARIANCE, R, 0.0, 5.0, RULE)
        held = lasts(rows, round(time * 1e9), held, RULE)
        lasting.append(held)
    assert lasting[100]
    assert lasting[399]
    # The share of the 10 s in the mean is 1 / (1 + (exp(t / 4) - 1) / (1 - exp(-10 / 4))): less than what is cleared,
    # half of 25 mm, off from the mean of the four by 3/4 of 0.1 m, from 6.9 s on.
    share = 0.0125 / (0.75 * 5.0 * 0.02)
    until = 10.0 + 4.0 * math.log(1.0 + (1.0 / share - 1.0) * (1.0 - math.exp(-2.5)))
    last = 0.025 * int(np.flatnonzero(lasting)[-1])
    assert last == pytest.approx(until, abs=0.3)
