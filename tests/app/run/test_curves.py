import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.app.run.curves import BINS, PlotCurve, binned

LEVELS = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=3000)


@given(LEVELS)
def test_no_peak_is_lost_however_long_the_drive(values: list[float]) -> None:
    times = np.linspace(0.0, 100.0, len(values))
    assert np.nanmax(binned(times, np.array(values), 100.0)) == max(values)


def test_unknown_values_leave_the_stretch_empty() -> None:
    assert np.isnan(binned(np.array([1.0]), np.array([np.nan]), 10.0)).all()
    assert np.isnan(binned(np.empty(0), np.empty(0), 10.0)).all()
    assert binned(np.array([1.0, 1.001]), np.array([np.nan, 3.0]), 10.0)[40] == 3.0


def test_a_stretch_without_a_cycle_has_the_value_of_the_one_before_and_one_of_unknown_values_none() -> None:
    times = np.array([0.5, 2.5, 5.5]) * (100.0 / BINS)
    levels = binned(times, np.array([1.0, np.nan, 4.0]), 100.0)
    np.testing.assert_array_equal(levels[:8], [1.0, 1.0, np.nan, np.nan, np.nan, 4.0, 4.0, 4.0])
    assert np.isnan(binned(times[1:], np.array([2.0, 4.0]), 100.0)[:2]).all()


@given(LEVELS, st.floats(0.0, 1.0))
def test_what_is_drawn_as_lived_comes_from_lived_cycles_alone(values: list[float], share: float) -> None:
    times = np.linspace(0.0, 100.0, len(values))
    cursor = 100.0 * share
    lived = int(np.searchsorted(times, cursor, side="right"))
    # What is not lived yet is larger than all: it would stand out at once.
    spoiled = np.array(values)
    spoiled[lived:] += 1e9
    before, behind = PlotCurve(times, spoiled, 100.0).cut(cursor, lived)
    known = before[np.isfinite(before)]
    assert set(known.tolist()) <= set(values[:lived])
    if lived:
        assert known.max() == max(values[:lived])
    here = min(int(share * BINS), BINS - 1)
    assert np.isnan(before[here + 1 :]).all()
    assert np.isnan(behind[:here]).all()
    assert np.isfinite(behind[here:]).all()


def test_a_curve_is_complete_from_the_first_moment() -> None:
    times = np.arange(0.0, 40.0, 0.1)
    before, behind = PlotCurve(times, times.copy(), 40.0).cut(0.0, 1)
    assert before[0] == 0.0
    assert np.isnan(before[1:]).all()
    assert behind[-1] == pytest.approx(39.9)
