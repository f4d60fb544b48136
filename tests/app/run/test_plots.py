import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from commission.app.run.plots import BINS, binned, carried


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=3000))
def test_no_peak_is_lost_however_long_the_drive(values: list[float]) -> None:
    times = np.linspace(0.0, 100.0, len(values))
    assert np.nanmax(binned(times, np.array(values), 100.0)) == max(values)


def test_the_typical_value_of_a_stretch_ignores_a_single_peak() -> None:
    times, values = np.linspace(0.0, 1e-3, 5), np.array([1.0, 1.0, 900.0, 1.0, 1.0])
    assert binned(times, values, 100.0, typical=True)[0] == 1.0


def test_nothing_is_drawn_ahead_of_the_play_clock() -> None:
    curve = carried(binned(np.array([0.0, 10.0]), np.array([1.0, 2.0]), 40.0), 10.0, 40.0)
    assert np.isfinite(curve[: BINS // 4]).all()
    assert np.isnan(curve[BINS // 4 + 1 :]).all()


def test_unknown_values_leave_the_stretch_empty() -> None:
    assert np.isnan(binned(np.array([1.0]), np.array([np.nan]), 10.0)).all()
