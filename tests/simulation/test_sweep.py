"""Sweeps that take time: each beam from the pose of its own time, against motions and rooms worked out by hand."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from commission.simulation.drive import DriveOptions
from commission.simulation.scan import VirtualScanner
from commission.simulation.scenario import virtual_drive
from commission.site.project import Project
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner, StampOf
from tests.simulation.halls import QUIET, corner_reflectors, hall, room

NOBODY = np.empty((0, 3))
ROUTE = "Out and back"
SWEEPING = Scanner(resolution_deg=1.0, rate=8.0, sweep_duration=0.125)
STRAIGHT = Route("Straight", (Segment(control_points=np.array([[2, 3], [4, 3], [6, 3], [8, 3]])),), 0.5)
AT_STAMP = {StampOf.FIRST: 0.0, StampOf.MIDDLE: 0.5, StampOf.LAST: 1.0}


def to_walls(x: np.ndarray, y: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Ranges to the walls of a room of 12 m by 8 m."""
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, 11.95 - x, x - 0.05) / np.abs(np.cos(angles))
        to_y = np.where(np.sin(angles) > 0, 7.95 - y, y - 0.05) / np.abs(np.sin(angles))
    return np.minimum(to_x, to_y)


@pytest.mark.parametrize("stamp_of", list(StampOf))
def test_beams_are_measured_one_after_the_other_about_the_stamp(stamp_of: StampOf) -> None:
    scanner = Scanner(field_of_view_deg=(-20.0, 20.0), resolution_deg=10.0, rate=25.0, sweep_duration=0.04)
    onward = {"first": [0, 10, 20, 30, 40], "middle": [-20, -10, 0, 10, 20], "last": [-40, -30, -20, -10, 0]}
    turns = replace(scanner, stamp_of=stamp_of)
    assert 1e3 * turns.beam_times == pytest.approx(onward[stamp_of], abs=1e-12)
    assert 1e3 * replace(turns, sweep_direction=-1).beam_times == pytest.approx(onward[stamp_of][::-1], abs=1e-12)


def test_a_sweep_of_a_vehicle_at_rest_is_a_scan_of_one_instant() -> None:
    project = Project(floor_map=room(), reflectors=corner_reflectors(), scanners=(Scanner(),))
    virtual, pose, legs = VirtualScanner.of(project, Scanner()), np.array([5.0, 3.0, 0.4]), np.array([[6.0, 3.5, 0.1]])
    ranges, flags = virtual.scan(pose, legs, np.random.default_rng(3))
    poses = np.tile(pose, (Scanner().beam_count, 1))
    swept, swept_flags = virtual.scan(pose, legs, np.random.default_rng(3), beam_poses=poses)
    assert flags.sum() > 3
    assert np.array_equal(flags, swept_flags)
    # The bearing of a beam is summed in another order: float32 ranges on walls at a slant differ in their last bits.
    assert swept == pytest.approx(ranges, abs=2e-6, nan_ok=True)


@pytest.mark.parametrize("upside_down", [False, True])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("stamp_of", list(StampOf))
@pytest.mark.parametrize("duration", [0.04, 0.125])
def test_each_beam_is_cast_from_where_the_vehicle_is_at_its_time(
    duration: float, stamp_of: StampOf, direction: int, upside_down: bool
) -> None:
    scanner = replace(
        QUIET,
        **{"rate": 8.0, "sweep_duration": duration, "stamp_of": stamp_of, "sweep_direction": direction},
        upside_down=upside_down,
        field_of_view_deg=(-120.0, 90.0),
    )
    site = replace(hall(scanner=scanner), reflectors=Project().reflectors, routes=(STRAIGHT,))
    log = virtual_drive(site, STRAIGHT.name, 2, options=DriveOptions(start_sigma=(0.0, 0.0, 0.0)))
    shares = np.arange(421) / 420.0
    seconds = duration * ((shares if direction == 1 else 1.0 - shares) - AT_STAMP[stamp_of])
    bearings = np.radians(-120.0 + 0.5 * np.arange(421)) * (-1.0 if upside_down else 1.0)
    compared = 0
    for number, before, here, after in zip(
        itertools.count(1), *(log.reference_poses[k:] for k in range(3)), strict=False
    ):
        steady = np.abs((here - before) - (after - here)).max() < 1e-9 and after[0] - here[0] > 0.05
        if steady:
            x = here[0] + 0.5 * seconds
            expected = to_walls(x, np.full(421, here[1]), here[2] + bearings)
            # Float32 ranges, and a scan's stamp in whole ns.
            assert log.scans[0].scan(number).ranges == pytest.approx(expected, abs=2e-6)
            compared += 1
    assert compared > 20


def test_a_turning_vehicle_sees_a_wall_from_the_heading_of_each_beam() -> None:
    virtual = VirtualScanner.of(Project(floor_map=room(), scanners=(QUIET,)), QUIET)
    count = QUIET.beam_count
    poses = np.column_stack([np.linspace(5.0, 5.1, count), np.linspace(3.0, 2.9, count), np.linspace(0.3, 0.4, count)])
    ranges, _ = virtual.scan(poses[0], NOBODY, np.random.default_rng(0), beam_poses=poses)
    bearings = QUIET.angle_min + QUIET.angle_increment * np.arange(count)
    # Ranges are float32.
    assert ranges == pytest.approx(to_walls(poses[:, 0], poses[:, 1], poses[:, 2] + bearings), abs=2e-6)


def test_an_upside_down_scanner_reports_the_mirrored_scan() -> None:
    right = replace(QUIET, field_of_view_deg=(-60.0, 100.0))
    left = replace(QUIET, field_of_view_deg=(-100.0, 60.0), upside_down=True)
    pose = np.array([5.0, 3.0, math.radians(20.0)])
    scans = []
    for scanner in (right, left):
        project = Project(floor_map=room(), reflectors=corner_reflectors(), scanners=(scanner,))
        scans.append(VirtualScanner.of(project, scanner).scan(pose, NOBODY, np.random.default_rng(0)))
    (ranges, flags), (mirrored, mirrored_flags) = scans
    assert flags.any()
    assert np.array_equal(ranges, mirrored[::-1])
    assert np.array_equal(flags, mirrored_flags[::-1])


def test_noise_upside_down_belongs_to_the_beam_that_was_drawn_for() -> None:
    noisy = replace(QUIET, range_sigma=0.01, field_of_view_deg=(-60.0, 60.0))
    pose = np.array([5.0, 3.0, 0.3])
    errors = []
    for scanner in (noisy, replace(noisy, upside_down=True)):
        quiet = replace(scanner, range_sigma=0.0)
        project = Project(floor_map=room(), scanners=(scanner,))
        measured, true = (
            VirtualScanner.of(project, each).scan(pose, NOBODY, np.random.default_rng(5))[0]
            for each in (scanner, quiet)
        )
        errors.append(measured - true)
    assert errors[0] == pytest.approx(errors[1], abs=2e-6)


def test_in_a_mirror_symmetric_room_a_scanner_upside_down_sees_the_same_with_all_its_noise() -> None:
    noisy = replace(QUIET, range_sigma=0.01, bearing_sigma_deg=0.3)
    scans = []
    for scanner in (noisy, replace(noisy, upside_down=True)):
        project = Project(floor_map=room(), reflectors=corner_reflectors(), scanners=(scanner,))
        pose = np.array([5.0, 4.0, 0.0])
        scans.append(VirtualScanner.of(project, scanner).scan(pose, NOBODY, np.random.default_rng(5)))
    # A ray at a reflector's edge or a cell's corner may round to either side; no other beam differs.
    same = np.abs(scans[0][0] - scans[1][0]) < 2e-6
    assert np.count_nonzero(~same) <= 2
    assert np.count_nonzero(scans[0][1] != scans[1][1]) <= 2


def test_a_scanner_whose_clock_is_ahead_stamps_its_scans_later() -> None:
    ahead = replace(SWEEPING, sweep_duration=0.0, clock_offset=0.02)
    on_time, late = (virtual_drive(hall(scanner=each), ROUTE, 1) for each in (replace(ahead, clock_offset=0.0), ahead))
    assert np.array_equal(late.scans[0].stamps_ns, on_time.scans[0].stamps_ns + 20_000_000)
    assert np.array_equal(late.scans[0].ranges, on_time.scans[0].ranges, equal_nan=True)


def test_a_sweep_changes_neither_the_motion_nor_what_is_drawn_for_odometry() -> None:
    swept, instant = (
        virtual_drive(hall(scanner=each), ROUTE, 1) for each in (SWEEPING, replace(SWEEPING, sweep_duration=0.0))
    )
    assert np.array_equal(swept.displacements, instant.displacements)
    assert np.array_equal(swept.reference_poses, instant.reference_poses)
    assert not np.array_equal(swept.scans[0].ranges, instant.scans[0].ranges, equal_nan=True)
