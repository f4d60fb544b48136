"""What comes from a blind sector is ignored, by the live localizer and by the whole run alike."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.estimate import Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.parameters import Parameters
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Record, Scan

from .drives import Plan, random_drive, random_map
from .test_whole_run import assert_same_estimate, setup_of

SECTORS = ((-100.0, -35.0), (20.0, 60.0))


def blinded(setup: LocalizerSetup) -> LocalizerSetup:
    scanners = tuple(replace(scanner, blind_sectors_deg=SECTORS) for scanner in setup.scanners)
    return replace(setup, scanners=scanners)


def is_blind(bearing: float) -> bool:
    return any(low <= math.degrees(bearing) <= high for low, high in SECTORS)


def censored(record: Record) -> Record:
    """A record without what comes from the sectors, beam by beam."""
    if not isinstance(record, Scan):
        return record
    ranges, flags = record.ranges.copy(), np.array(record.reflector)
    for beam in range(len(ranges)):
        bearing = record.angle_min + beam * record.angle_increment
        if any(low - 1e-6 <= math.degrees(bearing) <= high + 1e-6 for low, high in SECTORS):
            ranges[beam], flags[beam] = np.nan, False
    return replace(record, ranges=ranges, reflector=flags)


@pytest.mark.parametrize("upside_down", [False, True], ids=["upright", "upside down"])
def test_scans_are_localized_as_if_nothing_came_back_from_blind_sectors(upside_down: bool) -> None:
    rng = np.random.default_rng(3)
    setup = setup_of(rng, scanners=2)
    setup = replace(setup, scanners=tuple(replace(each, upside_down=upside_down) for each in setup.scanners))
    drive = random_drive(setup, rng, Plan(scans=25, beams=1440, clutter=2.0))
    records = list(drive.log.records())
    expected = run(RecordLog.collect(map(censored, records), drive.log.scanners), setup, drive.initial)
    found = run(drive.log, blinded(setup), drive.initial)
    for name in ("means", "covariances", "status", "range_bearing", "beams"):
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name
    everything = run(drive.log, setup, drive.initial)
    assert 0 < len(found.status) < len(everything.status)
    live = Localizer(blinded(setup), drive.initial)
    estimates = [estimate for record in records for estimate in live.feed(record)] + list(live.flush())
    assert len(estimates) == len(found)
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, found.estimate(cycle))


def test_reflectors_that_the_sensor_reports_from_a_blind_sector_are_outliers_of_the_detector() -> None:
    rng = np.random.default_rng(4)
    setup = setup_of(rng)
    drive = random_drive(setup, rng, Plan(scans=25))
    found = run(drive.log, blinded(setup), drive.initial)
    blind = [is_blind(bearing) for bearing in found.range_bearing[:, 1].tolist()]
    assert 0 < sum(blind) < len(blind)
    assert ((found.status == Status.OUTLIER_DETECTOR) == blind).all()
    live = Localizer(blinded(setup), drive.initial)
    estimates = [e for record in drive.log.records() for e in live.feed(record)] + list(live.flush())
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, found.estimate(cycle))


def test_other_blind_sectors_detect_anew() -> None:
    setup = setup_of(np.random.default_rng(5))
    assert setup.detects_like(setup)
    assert not blinded(setup).detects_like(setup)


def test_detections_alone_on_the_edge_of_a_sector_are_judged_on_both_sides() -> None:
    """A sector from 20 to 60 deg: 19.9 deg is seen, 20.1 is not."""
    setup = blinded(
        LocalizerSetup(
            reflectors=random_map(np.random.default_rng(6), 5),
            scanners=setup_of(np.random.default_rng(6)).scanners,
            parameters=Parameters(),
        )
    )
    seen = np.array(
        [[5.0, math.radians(19.9)], [5.0, math.radians(20.1)], [5.0, math.radians(59.9)], [5.0, math.radians(60.1)]]
    )
    drive = random_drive(setup, np.random.default_rng(7), Plan(scans=2))
    odometry = [record for record in drive.log.records() if not isinstance(record, Detections)]
    log = RecordLog.collect([*odometry, Detections(drive.log.first_ns, seen)])
    rejected = run(log, setup, drive.initial).status == Status.OUTLIER_DETECTOR
    assert rejected.tolist() == [False, True, True, False]
