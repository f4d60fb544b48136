"""Whole drives: the records of a real vehicle, the same for the same seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.errors import UsageError
from commission.localization.detection_log import extract_detections
from commission.localization.setup import LocalizerSetup
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import records, start_of, virtual_drive
from commission.site.disturbances import CoveredPeriod, Disturbances
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, ReferencePose, Scan
from commission.site.scanner import Scanner
from tests.simulation.halls import hall

ROUTE = "Out and back"
COARSE = Scanner(resolution_deg=1.0, rate=25.0)
EVERYTHING = Disturbances(people=5, glints_per_scan=1.0, slips_per_100_m=30.0, dropped_scans=0.1)


def project(disturbances: Disturbances = EVERYTHING, scanner: Scanner = COARSE) -> Project:
    return replace(hall(scanner=scanner), disturbances=disturbances)


def same(one: RecordLog, other: RecordLog) -> bool:
    return (
        np.array_equal(one.order, other.order)
        and np.array_equal(one.stamps_ns, other.stamps_ns)
        and np.array_equal(one.displacements, other.displacements)
        and np.array_equal(one.reference_poses, other.reference_poses)
        and np.array_equal(one.scans[0].ranges, other.scans[0].ranges, equal_nan=True)
        and np.array_equal(one.scans[0].reflector, other.scans[0].reflector)
    )


def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not() -> None:
    one, again, other = (virtual_drive(project(), ROUTE, seed) for seed in (7, 7, 8))
    assert same(one, again)
    assert not np.array_equal(one.displacements[:100], other.displacements[:100])


def test_stream_and_log_hold_the_same_records() -> None:
    stream = list(records(project(), ROUTE, 3))
    log = virtual_drive(project(), ROUTE, 3)
    assert len(stream) == len(log)
    for streamed, logged in zip(stream, log.records(), strict=True):
        assert type(streamed) is type(logged)
        assert streamed.stamp_ns == logged.stamp_ns
        if isinstance(streamed, Scan):
            assert np.array_equal(streamed.ranges, logged.ranges, equal_nan=True)


def test_people_change_neither_the_motion_nor_the_odometry() -> None:
    alone = virtual_drive(project(Disturbances()), ROUTE, 3)
    crowded = virtual_drive(project(Disturbances(people=10)), ROUTE, 3)
    assert np.array_equal(alone.displacements, crowded.displacements)
    assert np.array_equal(alone.reference_poses, crowded.reference_poses)
    assert not np.array_equal(alone.scans[0].ranges, crowded.scans[0].ranges, equal_nan=True)


def test_records_come_in_order_and_scans_meet_odometry_where_rates_divide() -> None:
    stream = list(records(project(Disturbances()), ROUTE, 0))
    stamps = [record.stamp_ns for record in stream]
    assert stamps == sorted(stamps)
    assert isinstance(stream[0], Odometry)
    assert not stream[0].displacement.any()
    odometry = {r.stamp_ns for r in stream if isinstance(r, Odometry)}
    assert all(r.stamp_ns in odometry for r in stream if isinstance(r, Scan))
    assert sum(isinstance(r, Scan) for r in stream) == sum(isinstance(r, ReferencePose) for r in stream)


def test_rates_that_do_not_divide_still_give_the_truth_at_each_scan() -> None:
    log = virtual_drive(project(Disturbances(), Scanner(resolution_deg=1.0, rate=15.0)), ROUTE, 0)
    assert np.array_equal(log.reference_stamps_ns, log.scans[0].stamps_ns)
    assert np.count_nonzero(np.isin(log.scans[0].stamps_ns, log.odometry_stamps_ns)) < len(log.scans[0].stamps_ns)
    steps = np.hypot(*np.diff(log.reference_poses[:, :2], axis=0).T)
    assert steps.max() < 0.5 / 15.0 * 1.02


def test_vehicle_starts_at_rest_near_the_start_of_the_route() -> None:
    start = start_of(project(), ROUTE)
    assert start.pose == pytest.approx([2.0, 2.0, 0.0], abs=1e-9)
    offsets = []
    for seed in range(10):
        log = virtual_drive(project(Disturbances(), Scanner(resolution_deg=10.0, rate=1.0)), ROUTE, seed)
        assert np.array_equal(log.reference_poses[0], log.reference_poses[1])
        offsets.append((log.reference_poses[0] - start.pose) / start.sigmas)
    # 30 standard normal numbers.
    assert 0.6 < np.sqrt(np.mean(np.square(offsets))) < 1.5
    exact = DriveOptions(start_sigma=(0.0, 0.0, 0.0))
    log = virtual_drive(project(Disturbances(), Scanner(resolution_deg=10.0)), ROUTE, 0, options=exact)
    assert log.reference_poses[0] == pytest.approx(start.pose)


def test_covered_period_has_no_flags() -> None:
    log = virtual_drive(project(Disturbances(covered=(CoveredPeriod(5.0, 4.0),))), ROUTE, 0)
    seconds = 1e-9 * log.scans[0].stamps_ns
    dark = (seconds >= 5.0) & (seconds < 9.0)
    assert not log.scans[0].reflector[dark].any()
    assert log.scans[0].reflector[~dark].any(axis=1).mean() > 0.9


def test_lost_scans_leave_the_reference() -> None:
    log = virtual_drive(project(Disturbances(dropped_scans=0.3)), ROUTE, 0)
    assert 0.6 < len(log.scans[0].stamps_ns) / len(log.reference_stamps_ns) < 0.8


def test_project_without_a_floor_map_is_an_open_field() -> None:
    log = virtual_drive(replace(project(), floor_map=None), ROUTE, 0)
    assert log.scans[0].reflector.any()
    assert np.isnan(log.scans[0].ranges).any()


def test_progress_ends_at_one_and_may_cancel() -> None:
    seen: list[float] = []
    virtual_drive(project(Disturbances()), ROUTE, 0, progress=lambda done, _: seen.append(done))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def cancel(share: float, _message: str) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        virtual_drive(project(Disturbances()), ROUTE, 0, progress=cancel)


def test_unknown_route_is_an_error_that_lists_the_routes() -> None:
    with pytest.raises(UsageError, match="Out and back"):
        virtual_drive(project(), "Nowhere", 0)


def test_scans_without_the_beams_that_meet_no_reflector_give_the_same_detections() -> None:
    site = hall()
    whole, partial = (virtual_drive(site, ROUTE, 3, options=DriveOptions(whole_scans=whole)) for whole in (True, False))
    assert whole.scans
    assert partial.scans
    assert np.isnan(partial.scans[0].ranges).mean() > 0.5 > np.isnan(whole.scans[0].ranges).mean()
    one, other = (extract_detections(log, LocalizerSetup.of(site)) for log in (whole, partial))
    assert len(one.status) > 100
    for name in ("offsets", "range_bearing", "beams", "status"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
