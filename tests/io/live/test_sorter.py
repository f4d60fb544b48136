from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.io.live.sorter import PATIENCE_NS, WAITING_LIMIT, Sorter
from commission.io.protocols.message import OdometryPose, Sent
from commission.site.records import ORDER_WITHIN_A_STAMP, Detections, Odometry, Record

MS = 1_000_000


def moved(stamp_ms: float, dx: float = 0.1) -> Odometry:
    return Odometry(round(stamp_ms * MS), np.array([dx, 0.0, 0.0]))


def at(stamp_ms: float, x: float) -> OdometryPose:
    return OdometryPose(round(stamp_ms * MS), np.array([x, 0.0, 0.0]))


def seen(stamp_ms: float, scanner: int = 0) -> Detections:
    return Detections(round(stamp_ms * MS), np.array([[2.0, 0.0]]), scanner)


def pushed(sorter: Sorter, records: list[tuple[int, Sent]], late_ms: float = 0.0) -> list[Record]:
    """Records that come at their stamps, or later."""
    found: list[Record] = []
    for source, record in records:
        now = record.stamp_ns + round(late_ms * MS)
        sorter.push(source, record, now)
        found += sorter.due(now)
    return found


def keys(records: list[Record]) -> list[tuple[int, int]]:
    return [(record.stamp_ns, ORDER_WITHIN_A_STAMP[type(record)]) for record in records]


def test_odometry_of_a_stamp_goes_before_the_scan_that_overtook_it() -> None:
    sorter = Sorter()
    pushed(sorter, [(0, moved(0)), (0, seen(0))])
    found = []
    for record in (seen(40), moved(40)):
        sorter.push(0, record, 41 * MS)
        found += list(sorter.due(41 * MS))
    assert [type(record) for record in found] == [Odometry, Detections]
    assert sorter.told["records came after a later one and are sorted"] == 1


def test_a_scan_goes_on_at_once_when_odometry_of_its_stamp_is_there() -> None:
    sorter = Sorter()
    drive = [
        (0, record) for step in range(40) for record in (moved(step * 20), *([seen(step * 20)] if step % 2 else []))
    ]
    pushed(sorter, drive)
    found = pushed(sorter, [(0, moved(800)), (0, seen(800))])
    assert keys(found)[-1] == (800 * MS, ORDER_WITHIN_A_STAMP[Detections])


def test_a_record_waits_for_an_earlier_one_for_the_stated_patience_and_no_longer() -> None:
    sorter = Sorter()
    pushed(sorter, [(0, moved(step * 20)) for step in range(20)])
    pushed(sorter, [(1, seen(380))])
    list(sorter.due(400 * MS))
    # Odometry of 400 is due before this scan and does not come.
    sorter.push(1, seen(410), 410 * MS)
    assert list(sorter.due(410 * MS + PATIENCE_NS - 1)) == []
    assert keys(list(sorter.due(410 * MS + PATIENCE_NS))) == [(410 * MS, ORDER_WITHIN_A_STAMP[Detections])]


def test_a_record_that_comes_too_late_is_left_out_and_counted() -> None:
    sorter = Sorter()
    sorter.push(1, seen(100), 100 * MS)
    assert len(list(sorter.due(100 * MS + PATIENCE_NS))) == 1
    sorter.push(1, seen(99), 210 * MS)
    assert list(sorter.due(400 * MS)) == []
    assert sorter.too_late == {(1, Detections): 1}


def test_the_motion_of_odometry_that_came_too_late_is_not_forgotten() -> None:
    sorter = Sorter()
    found = pushed(sorter, [(0, moved(0, 0.0)), (0, moved(20, 0.1)), (0, moved(60, 0.3))])
    found += list(sorter.due(60 * MS + PATIENCE_NS))
    sorter.push(0, moved(40, 0.2), 170 * MS)
    found += list(sorter.due(170 * MS + PATIENCE_NS))
    found += pushed(sorter, [(0, moved(300, 0.4))])
    found += list(sorter.rest())
    assert sum(record.displacement[0] for record in found) == pytest.approx(1.0)


def test_a_lost_pose_of_odometry_loses_no_motion() -> None:
    sorter = Sorter()
    found = pushed(sorter, [(0, at(0, 5.0)), (0, at(20, 5.1)), (0, at(80, 5.4))]) + list(sorter.rest())
    assert [record.displacement[0] for record in found] == pytest.approx([0.0, 0.1, 0.3])


def test_odometry_whose_sender_began_again_does_not_jump() -> None:
    sorter = Sorter()
    sorter.push(0, at(0, 25.0), 0, conversation=1)
    sorter.push(0, at(100, 0.0), 100 * MS, conversation=2)
    sorter.push(0, at(120, 0.1), 120 * MS, conversation=2)
    # The same where nobody says so.
    sorter.push(0, at(140, 9.0), 140 * MS, conversation=2)
    found = list(sorter.rest())
    assert [record.displacement[0] for record in found] == pytest.approx([0.0, 0.0, 0.1, 0.0])


def test_a_channel_that_fell_silent_is_not_waited_for() -> None:
    sorter = Sorter()
    pushed(sorter, [(0, moved(step * 20)) for step in range(10)])
    pushed(sorter, [(1, seen(step * 40)) for step in range(45)])
    sorter.push(1, seen(1800), 1800 * MS)
    assert keys(list(sorter.due(1800 * MS))) == [(1800 * MS, ORDER_WITHIN_A_STAMP[Detections])]


def test_what_waits_is_bounded() -> None:
    sorter = Sorter(patience_ns=10**18)
    sorter.push(0, moved(0), 0)
    found = 0
    for step in range(10_000):
        sorter.push(1, seen(1 + step), step)
        found += len(list(sorter.due(step)))
    assert found >= 10_000 - WAITING_LIMIT


@given(
    st.lists(st.tuples(st.integers(0, 400), st.integers(0, 120), st.booleans()), max_size=60),
)
def test_whatever_comes_is_delivered_in_order_and_once(coming: list[tuple[int, int, bool]]) -> None:
    sorter = Sorter()
    arrivals = sorted((stamp + late, stamp, is_scan) for stamp, late, is_scan in coming)
    found: list[Record] = []
    for arrived, stamp, is_scan in arrivals:
        sorter.push(0, seen(stamp) if is_scan else moved(stamp), arrived * MS)
        found += sorter.due(arrived * MS)
    found += sorter.rest()
    assert keys(found) == sorted(set(keys(found)))
    late = sorter.too_late.total()
    assert len(found) + late == len(coming)
