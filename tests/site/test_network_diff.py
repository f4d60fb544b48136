from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.site.network_diff import Change, NamedDiff, course_shift, difference, merged, with_required_accuracy
from commission.site.routes import Route, Segment
from commission.site.stations import Station

LINE = Segment(control_points=np.array([[0.0, 0.0], [4.0, 0.0]]), degree=1)
LOOP, DOCK, PARK = Route("Loop", (LINE,)), Route("Dock", (LINE,), 0.3), Route("Park", (LINE,), 1.0)
METRES = st.integers(0, 10**4).map(lambda tenths: tenths / 1e4)
ONE = st.builds(Station, name=st.sampled_from("ABCDEFG"), x=METRES, y=METRES)
SEVERAL = st.lists(ONE, max_size=6, unique_by=lambda s: s.name).map(tuple)


def test_added_changed_and_removed_routes_are_told_apart() -> None:
    faster = replace(DOCK, speed=0.5)
    diff = difference((LOOP, DOCK), (PARK, faster))
    assert diff == NamedDiff((PARK,), (Change(DOCK, faster),), (LOOP,), 0)
    assert merged((LOOP, DOCK), diff, remove=False) == (LOOP, faster, PARK)
    assert merged((LOOP, DOCK), diff, remove=True) == (faster, PARK)


def test_what_a_file_rounds_away_is_no_change() -> None:
    exact = Station(name="A", x=5.640000000000006, y=0.1 + 0.2)
    assert not difference((exact,), (Station(name="A", x=5.64, y=0.3),))
    assert difference((exact,), (Station(name="A", x=5.6401, y=0.3),)).changed


@given(before=SEVERAL, after=SEVERAL)
def test_applying_a_difference_gives_the_later_stations(
    before: tuple[Station, ...], after: tuple[Station, ...]
) -> None:
    diff = difference(before, after)
    assert sorted(merged(before, diff, remove=True), key=lambda s: s.name) == sorted(after, key=lambda s: s.name)
    assert len(diff.added) + len(diff.changed) + diff.unchanged == len(after)
    assert bool(diff) == (sorted(before, key=lambda s: s.name) != sorted(after, key=lambda s: s.name))


def test_a_station_keeps_the_accuracy_that_no_layout_carries() -> None:
    known = Station(name="Dock", x=1.0, y=2.0, required_accuracy=0.01)
    read = (Station(name="Dock", x=1.5, y=2.0), Station(name="Wait", x=0.0, y=0.0))
    assert [s.required_accuracy for s in with_required_accuracy((known,), read)] == [0.01, 0.1]


def test_shift_of_a_course_is_the_distance_that_it_moves() -> None:
    aside = Segment(control_points=np.array([[0.0, 0.3], [4.0, 0.3]]), degree=1)
    assert course_shift(LINE, aside) == pytest.approx(0.3)
    # The same line with a control point more is driven the same.
    assert course_shift(LINE, Segment(control_points=np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]), degree=1)) < 1e-9
