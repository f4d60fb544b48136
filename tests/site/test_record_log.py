"""A log gives back the records that were put in, motion before what was seen after it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, ReferencePose, Scan


def scan(stamp_ns: int, beams: int = 5) -> Scan:
    ranges = np.linspace(1, 2, beams, dtype=np.float32)
    return Scan(stamp_ns=stamp_ns, ranges=ranges, angle_min=-1.0, angle_increment=0.5, reflector=ranges > 1.5)


def test_records_come_out_in_order_of_stamps_and_within_a_stamp_motion_comes_first():
    records = [
        Detections(20, [[3.0, 0.1], [4.0, -0.2]]),
        ReferencePose(20, [1.0, 2.0, np.nan]),
        scan(20),
        Odometry(20, [0.1, 0.0, 0.01]),
        Odometry(10, [0.0, 0.0, 0.0]),
        Detections(10, np.empty((0, 2))),
    ]
    delivered = list(RecordLog.collect(records[4:] + records[:4]).records())
    assert [(type(r).__name__, r.stamp_ns) for r in delivered] == [
        ("Odometry", 10),
        ("Detections", 10),
        ("Odometry", 20),
        ("ReferencePose", 20),
        ("Detections", 20),
        ("Scan", 20),
    ]
    assert delivered[4].range_bearing.tolist() == [[3.0, 0.1], [4.0, -0.2]]
    assert delivered[1].range_bearing.shape == (0, 2)
    assert delivered[5].reflector.tolist() == [False, False, False, True, True]


def test_a_scan_with_other_arrays_is_refused_by_its_index():
    with pytest.raises(ValueError, match="scan 1 has other arrays than scan 0"):
        RecordLog.collect([scan(0), replace(scan(1), reflector=None)])


def test_scans_of_different_lengths_come_out_as_long_as_they_were():
    scans = [scan(0), scan(1, beams=7), scan(2, beams=4)]
    delivered = list(RecordLog.collect(scans).records())
    for given, found in zip(scans, delivered, strict=True):
        assert found.ranges.tolist() == given.ranges.tolist()
        assert found.reflector.tolist() == given.reflector.tolist()


def test_an_empty_log_has_no_records():
    assert list(RecordLog.collect([]).records()) == []


def test_bearings_follow_angle_min_and_increment():
    np.testing.assert_allclose(scan(0).bearings, [-1.0, -0.5, 0.0, 0.5, 1.0])


def test_first_and_last_stamp_are_those_of_all_kinds():
    log = RecordLog.collect([Odometry(10, [0.0, 0.0, 0.0]), scan(7), Detections(25, [[3.0, 0.1]])])
    assert (log.first_ns, log.last_ns, len(log)) == (7, 25, 3)
