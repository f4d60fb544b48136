import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from commission.app.run.history import PointStore, episodes


@given(st.lists(st.integers(0, 9), max_size=60), st.integers(4, 16))
def test_points_stay_within_their_memory_and_come_from_what_was_added(sizes: list[int], capacity: int) -> None:
    store = PointStore(capacity)
    total = 0
    for size in sizes:
        store.add(np.arange(total, total + size, dtype=float)[:, np.newaxis] * [1.0, 1.0])
        total += size
    kept = store.points()[:, 0]
    assert len(kept) <= capacity
    assert (np.diff(kept) > 0).all()
    assert len(kept) == total or len(kept) >= min(total, capacity // 2) - 9


def test_episodes_are_the_stretches_in_fail_mode() -> None:
    times = np.arange(8) * 0.5
    failed = np.array([0, 1, 1, 0, 0, 1, 1, 1], bool)
    assert episodes(times, failed) == ((0.5, 1.5), (2.5, 3.5))


def test_a_run_without_cycles_has_no_episodes() -> None:
    assert episodes(np.empty(0), np.empty(0, bool)) == ()
