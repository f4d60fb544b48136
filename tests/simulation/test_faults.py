"""Each fault touches what it should and nothing else, on single records and on streams."""

from __future__ import annotations

import numpy as np

from commission.simulation.faults import cover, covered, odometry_scaled, odometry_stuck, scans_dropped
from commission.site.records import Detections, Odometry, Record, ReferencePose, Scan


def stream() -> list[Record]:
    records: list[Record] = []
    for k in range(100):
        stamp = k * 40_000_000
        records.append(Odometry(stamp, np.array([0.02, 0.01, 0.001])))
        records.append(ReferencePose(stamp, np.zeros(3)))
        records.append(Detections(stamp, np.array([[3.0, 0.1]])))
        flags = np.array([True, False, True])
        records.append(
            Scan(
                stamp_ns=stamp,
                ranges=np.ones(3, np.float32),
                angle_min=-0.1,
                angle_increment=0.1,
                intensities=np.full(3, 7.0, np.float32),
                reflector=flags,
            )
        )
    return records


def test_covered_records_keep_ranges_and_lose_everything_that_shines() -> None:
    odometry, reference, detections, scan = (cover(record) for record in stream()[:4])
    assert odometry is not None
    assert isinstance(reference, ReferencePose)
    assert isinstance(detections, Detections)
    assert detections.range_bearing.shape == (0, 2)
    assert isinstance(scan, Scan)
    assert not scan.reflector.any()
    assert not scan.intensities.any()
    assert np.array_equal(scan.ranges, np.ones(3))


def test_covering_leaves_the_record_it_was_given_alone() -> None:
    scan = stream()[3]
    cover(scan)
    assert scan.reflector.any()


def test_covered_period_includes_its_start_and_excludes_its_end() -> None:
    scans = [r for r in covered(stream(), 1_000_000_000, 2_000_000_000) if isinstance(r, Scan)]
    dark = [r.stamp_ns for r in scans if not r.reflector.any()]
    assert dark[0] == 1_000_000_000
    assert dark[-1] == 1_960_000_000
    assert len(dark) == 25


def test_dropped_scans_leave_motion_and_reference() -> None:
    left = list(scans_dropped(stream(), 0.4, np.random.default_rng(0)))
    assert sum(isinstance(r, Odometry) for r in left) == 100
    assert sum(isinstance(r, ReferencePose) for r in left) == 100
    assert 40 < sum(isinstance(r, Scan) for r in left) < 80


def test_stuck_odometry_reports_rest_for_its_period_only() -> None:
    rows = [r for r in odometry_stuck(stream(), 0, 400_000_000) if isinstance(r, Odometry)]
    assert not any(r.displacement.any() for r in rows[:10])
    assert all(r.displacement.any() for r in rows[10:])


def test_scaled_odometry_stretches_the_way_and_not_the_turn() -> None:
    row = next(r for r in odometry_scaled(stream(), 1.1) if isinstance(r, Odometry))
    assert np.allclose(row.displacement, [0.022, 0.011, 0.001])
