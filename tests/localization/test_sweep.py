"""Detections brought to the stamp of their scan, against geometry by hand; live is the whole run at every duration."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.localization.estimate import Belief
from commission.localization.localizer import Localizer
from commission.localization.observation import range_bearing
from commission.localization.odometry import AT_REST, NOT_YET
from commission.localization.run_columns import RunSegment
from commission.localization.setup import LocalizerSetup
from commission.localization.sweep import AT_ONCE, Sweep, bring_to_stamp, sweep_of
from commission.localization.whole_run import run, run_segments
from commission.site.parameters import AssociationParameters, ObservationParameters, Parameters
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Record
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner, StampOf
from tests.localization.drives import Plan, random_drive, random_map
from tests.localization.test_whole_run import assert_same_estimate

FRONT = Scanner(mounting=np.array([0.3, 0.1, 0.2]), rate=8.0, field_of_view_deg=(-100.0, 120.0))
REAR = Scanner(name="rear", mounting=np.array([-0.4, -0.2, 2.8]), rate=8.0)
SPEED, TURN_RATE = 1.1, 0.6


def settled(scanner: Scanner, measured: np.ndarray, bias: float = 0.0) -> np.ndarray:
    """Detections of a scan of a vehicle that drives an arc at a constant speed."""
    parameters = Parameters(observation=ObservationParameters(range_bias=bias))
    setup = LocalizerSetup(
        reflectors=random_map(np.random.default_rng(0), 3), scanners=(scanner,), parameters=parameters
    )
    motion = AT_REST._replace(started=True, trend_x=SPEED, trend_theta=TURN_RATE)
    found = np.full(measured.shape, np.nan)
    measured.setflags(write=False)
    sweep = Sweep(*setup.sweep_rows[0].tolist()) if len(setup.sweep_rows) else AT_ONCE
    bring_to_stamp(motion, NOT_YET, 0, len(measured), measured, sweep, setup.observations[0], found)
    return found


@pytest.mark.parametrize("upside_down", [False, True])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("stamp_of", "share_at_stamp"), [("first", 0.0), ("middle", 0.5), ("last", 1.0)])
@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_a_point_is_where_the_scanner_would_have_seen_it_at_the_stamp(
    upside_down: bool, direction: int, stamp_of: str, share_at_stamp: float, offset: float
) -> None:
    timed = replace(FRONT, sweep_duration=0.125, sweep_direction=direction, stamp_of=StampOf(stamp_of))
    scanner = replace(timed, upside_down=upside_down, clock_offset=offset)
    points = np.array([[6.0, 2.0], [-1.0, 5.0], [3.0, -4.0], [9.0, 9.0]])
    measured, expected = [], range_bearing(np.zeros(3), scanner.mounting, points)
    for point in points:
        # The time depends on the bearing and the bearing on the time: twenty rounds settle to the last bits.
        seconds = 0.0
        for _ in range(20):
            angle = TURN_RATE * seconds
            pose = [SPEED * math.sin(angle) / TURN_RATE, SPEED * (1.0 - math.cos(angle)) / TURN_RATE, angle]
            (seen,) = range_bearing(pose, scanner.mounting, [point])
            reported = -seen[1] if upside_down else seen[1]
            along = (reported - math.radians(-100.0)) / math.radians(220.0)
            share = along if direction > 0 else 1.0 - along
            seconds = 0.125 * (share - share_at_stamp) - offset
        measured.append((seen[0] + 0.02, reported))
    assert settled(scanner, np.array(measured), bias=0.02) == pytest.approx(expected + np.array([0.02, 0.0]), abs=1e-12)


def test_a_scan_of_one_instant_is_left_as_it_is_and_a_sweep_at_rest_is_mirrored_alone() -> None:
    measured = np.array([[4.0, 0.7], [5.0, -1.1]])
    assert sweep_of(FRONT) == AT_ONCE
    assert settled(FRONT, measured).tobytes() == measured.tobytes()
    hanging = settled(replace(FRONT, upside_down=True), measured)
    assert hanging.tobytes() == (measured * (1.0, -1.0)).tobytes()


def test_a_setup_without_sweeps_copies_no_detection() -> None:
    rng = np.random.default_rng(1)
    setup = LocalizerSetup(reflectors=random_map(rng, 12), scanners=(FRONT,), parameters=Parameters())
    drive = random_drive(setup, rng, Plan(scans=5))
    found = run(drive.log, setup, drive.initial)
    assert found.range_bearing is found.detected.range_bearing


def sweeping(duration: float, stamp_of: StampOf, scanners: int) -> tuple[Scanner, ...]:
    """Scanners of which the first sweeps."""
    first = replace(FRONT, sweep_duration=duration, stamp_of=stamp_of, clock_offset=0.01, field_of_view_deg=(-170, 170))
    return (first, REAR)[:scanners]


@pytest.mark.parametrize("scanners", [1, 2])
@pytest.mark.parametrize("duration", [0.0, 0.04, 0.125])
@pytest.mark.parametrize("stamp_of", list(StampOf))
@pytest.mark.parametrize(
    "plan",
    [Plan(), Plan(scans=40, odometry_ns=17_000_001, scan_ns=41_000_003, scan_offset_ns=5), Plan(scans=20, beams=720)],
    ids=["equal stamps", "rates that never meet", "raw scans"],
)
def test_live_is_the_whole_run_to_the_last_bit_at_every_duration(
    scanners: int, duration: float, stamp_of: StampOf, plan: Plan
) -> None:
    rng = np.random.default_rng(5)
    setup = LocalizerSetup(
        reflectors=random_map(rng, 12), scanners=sweeping(duration, stamp_of, scanners), parameters=Parameters()
    )
    drive = random_drive(setup, rng, plan)
    columns = run(drive.log, setup, drive.initial)
    localizer = Localizer(setup, drive.initial)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    assert len(estimates) == len(columns) > 0
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, columns.estimate(cycle))
    assert localizer.state == columns.final
    moved = np.any(columns.range_bearing != columns.detected.range_bearing, axis=1)
    of = np.repeat(columns.detected.scanners, np.diff(columns.offsets))
    assert np.count_nonzero(moved[of == 0]) > 0
    assert not moved[of == 1].any()


def test_an_earlier_run_is_taken_over_with_the_detections_at_their_stamps() -> None:
    rng = np.random.default_rng(6)
    setup = LocalizerSetup(
        reflectors=random_map(rng, 12), scanners=sweeping(0.125, StampOf.LAST, 1), parameters=Parameters()
    )
    drive = random_drive(setup, rng, Plan(scans=60))
    other = replace(setup, scanners=(FRONT,))
    earlier = run(drive.log, setup, drive.initial)
    segments = (RunSegment(0, setup), RunSegment(30, other))
    fresh = run_segments(drive.log, segments, drive.initial)
    taken = run_segments(drive.log, segments, drive.initial, earlier=earlier)
    assert taken.range_bearing.tobytes() == fresh.range_bearing.tobytes()
    assert taken.means.tobytes() == fresh.means.tobytes()
    first = int(fresh.offsets[30])
    assert np.array_equal(fresh.range_bearing[first:], fresh.detected.range_bearing[first:])
    assert not np.array_equal(fresh.range_bearing[:first], fresh.detected.range_bearing[:first])


def test_motion_of_a_vehicle_is_the_twist_that_odometry_tells() -> None:
    step = se2.exp(np.array([SPEED, 0.0, TURN_RATE]) * 0.05)
    setup = LocalizerSetup(
        reflectors=random_map(np.random.default_rng(0), 3), scanners=(FRONT,), parameters=Parameters()
    )
    rng = np.random.default_rng(2)
    drive = random_drive(setup, rng, Plan(scans=3))
    localizer = Localizer(setup, drive.initial)

    for index in range(4):
        localizer.feed(Odometry(50_000_000 * index, step if index else np.zeros(3)))
    motion = localizer.state.tracking.motion
    assert (motion.trend_x, motion.trend_y, motion.trend_theta) == pytest.approx((SPEED, 0.0, TURN_RATE), abs=1e-12)


TURNING = 0.5
SWEEP = 0.04 * 275.0 / 360.0
"""Time that 275 degrees take at 25 turns per second [s]: 30.6 ms, in which 0.5 rad/s turn a vehicle by 15.3 mrad."""
WIDE = Scanner(rate=25.0, field_of_view_deg=(-137.5, 137.5), resolution_deg=0.5)


def error_of_heading(scanner: Scanner) -> float:
    """Mean error of the heading [rad] of a vehicle that turns on the spot and sees reflectors by its last beams."""
    around = np.radians(np.arange(0, 360, 3))
    places = 12.0 * np.stack([np.cos(around), np.sin(around)], axis=1)
    reflectors = ReflectorMap(tuple(Reflector(id=str(i), x=x, y=y) for i, (x, y) in enumerate(places.tolist())))
    setup = LocalizerSetup(
        reflectors=reflectors,
        scanners=(scanner,),
        parameters=Parameters(association=AssociationParameters(enabled=False)),
    )
    records: list[Record] = [Odometry(0, np.zeros(3))]
    for k in range(1, 201):
        stamp_ns = k * 20_000_000
        records.append(Odometry(stamp_ns, np.array([0.0, 0.0, TURNING * 0.02])))
        if k % 2 == 0:
            # The last beam, 30.6 ms after the stamp: the reflectors within 10 degrees before it.
            heading = TURNING * stamp_ns * 1e-9
            bearings = around - heading
            late = wrap(bearings - TURNING * SWEEP)
            seen = late[(late > math.radians(127.5)) & (late < math.radians(137.5))]
            records.append(Detections(stamp_ns, np.stack([np.full(len(seen), 12.0), seen], axis=1)))
    start = Belief(0, np.zeros(3), np.diag([1e-3, 1e-3, 1e-3]) ** 2)
    columns = run(RecordLog.collect(records), setup, start)
    truth = TURNING * columns.stamps_ns * 1e-9
    return float(np.mean(wrap(columns.means[50:, 2] - truth[50:])))


def test_a_neglected_sweep_turns_the_estimate_by_15_mrad_and_a_corrected_one_does_not() -> None:
    """25 scans/s, 275 degrees, 0.5 rad/s: 0.5 x 30.6 ms = 15.3 mrad; the default bearing sigma is 4 mrad."""
    swept = replace(WIDE, sweep_duration=SWEEP)
    assert TURNING * SWEEP == pytest.approx(0.0153, abs=5e-5)
    # What is seen later lies farther to the right: the estimate takes itself for turned to the left.
    assert error_of_heading(WIDE) == pytest.approx(TURNING * SWEEP, abs=1e-3)
    # The reflectors are up to 10 degrees before the last beam, a thirtieth of the sweep: 0.5 mrad at most.
    assert abs(error_of_heading(swept)) < 6e-4
