"""A recording that cannot be what it says is named, with what it probably is; a sound one is passed in silence."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from commission.errors import JobCancelled
from commission.site.record_log import RecordLog
from commission.site.recorded_mounting import RecordedMounting
from commission.site.recorded_sweep import RecordedSweep
from commission.studies.plausibility import Finding, PlausibilityInput, plausibility
from commission.studies.recording_overview import channels
from commission.studies.start import start_of
from tests.studies.recorded import PROJECT, SECOND, drive, pose_at, scan_log


def judged(log: RecordLog) -> tuple[Finding, ...]:
    return plausibility(PlausibilityInput.of(PROJECT, log))


def only(log: RecordLog) -> Finding:
    (finding,) = judged(log)
    return finding


def with_scans(**scans: Any) -> RecordLog:
    log = drive(20.0)
    return dataclasses.replace(
        log,
        scans=(scan_log(**scans),),
        detection_stamps_ns=log.detection_stamps_ns[:0],
        detection_offsets=np.zeros(1, np.int64),
        range_bearing=np.empty((0, 2)),
    )


MIXED = np.tile(np.where(np.arange(720) % 60 == 0, 0.9, 0.1), (200, 1))


def test_sound_recordings_pass_in_silence() -> None:
    assert judged(drive()) == ()
    assert judged(with_scans(intensities=MIXED)) == ()
    # Recorders often keep each second scan only.
    assert judged(with_scans(intensities=MIXED[:100], rate=5.0)) == ()


def test_poses_in_the_odometry_are_told_with_the_speed_that_they_would_be() -> None:
    log = drive()
    finding = only(dataclasses.replace(log, displacements=pose_at(log.odometry_stamps_ns * 1e-9)))
    # The oval reaches 15 m from the origin: 15 m in 20 ms.
    assert "m/s" in finding.found
    assert "poses" in finding.probably


def test_velocities_in_the_odometry_are_told() -> None:
    log = drive()
    assert "velocities" in only(dataclasses.replace(log, displacements=log.displacements * 50.0)).probably


def test_rows_that_were_stamped_as_they_arrived_are_no_velocities() -> None:
    log = drive()
    stamps = log.odometry_stamps_ns.copy()
    # In the first quarter, five rows come at once every tenth of a second, 30 us apart.
    busy = len(stamps) // 20 * 5
    stamps[:busy] += 30_000 * (np.arange(busy) % 5) - (stamps[:busy] - stamps[0]) % 100_000_000
    assert np.all(np.diff(stamps) > 0)

    assert judged(dataclasses.replace(log, odometry_stamps_ns=stamps)) == ()
    told = channels(dataclasses.replace(log, odometry_stamps_ns=stamps))[0].values
    fastest = float(told.split("speed up to ")[1].split(" m/s")[0])
    true = float(np.hypot(*log.displacements[1:, :2].T).max() / 0.02)
    # Over two tenths of a second, at whose ends one burst more or less may lie.
    assert true <= fastest <= 1.6 * true


def test_millimetres_and_degrees_in_the_odometry_are_told() -> None:
    log = drive()
    assert "millimetres" in only(dataclasses.replace(log, displacements=log.displacements * (1e3, 1e3, 1.0))).probably
    turning = log.displacements.copy()
    turning[:, 2] = np.degrees(turning[:, 2] * 3.0)
    assert "degrees" in only(dataclasses.replace(log, displacements=turning)).probably


@pytest.mark.parametrize(("unit", "divisor"), [("microseconds", 1_000), ("milliseconds", 1_000_000)])
def test_stamps_in_another_unit_are_told_for_each_kind_of_record(unit: str, divisor: int) -> None:
    log = drive()
    findings = judged(
        dataclasses.replace(
            log,
            odometry_stamps_ns=log.odometry_stamps_ns // divisor,
            detection_stamps_ns=log.detection_stamps_ns // divisor,
            reference_stamps_ns=log.reference_stamps_ns // divisor,
        )
    )
    assert [finding.probably for finding in findings] == [f"the stamps are in {unit}"] * 3


def test_clocks_that_do_not_overlap_are_told_with_the_shift() -> None:
    log = drive()
    finding = only(dataclasses.replace(log, detection_stamps_ns=log.detection_stamps_ns + 1_700_000_000 * SECOND))
    assert "two clocks" in finding.probably
    assert "-1700000000.100 s" in finding.remedy


def test_odometry_that_ends_or_pauses_while_scans_go_on_is_told() -> None:
    log = drive()
    early = log.odometry_stamps_ns < 40 * SECOND
    cut = dataclasses.replace(
        log, odometry_stamps_ns=log.odometry_stamps_ns[early], displacements=log.displacements[early]
    )
    assert "the odometry ends at 40.0 s, and scans go on to 59.9 s" in only(cut).found
    there = (log.odometry_stamps_ns < 20 * SECOND) | (log.odometry_stamps_ns > 22 * SECOND)
    paused = dataclasses.replace(
        log, odometry_stamps_ns=log.odometry_stamps_ns[there], displacements=log.displacements[there]
    )
    assert "pauses from 20.0 s to 22.0 s" in only(paused).found


@pytest.mark.parametrize(("pause_ns", "told"), [(900_000_000, False), (1_100_000_000, True)])
def test_pause_of_the_odometry_is_told_from_one_second_on(pause_ns: int, told: bool) -> None:
    log = drive()
    gone = (log.odometry_stamps_ns > 20 * SECOND) & (log.odometry_stamps_ns < 20 * SECOND + pause_ns)
    paused = dataclasses.replace(
        log, odometry_stamps_ns=log.odometry_stamps_ns[~gone], displacements=log.displacements[~gone]
    )
    assert bool(judged(paused)) is told


def test_bearings_in_degrees_and_ranges_in_millimetres_are_told() -> None:
    log = drive()
    assert (
        "in degrees" in only(dataclasses.replace(log, range_bearing=np.degrees(log.range_bearing) * (0.02, 1))).probably
    )
    assert "in millimetres" in only(dataclasses.replace(log, range_bearing=log.range_bearing * (1000.0, 1))).probably


@pytest.mark.parametrize("ranges", [5000.0, 40.0])
def test_ranges_of_scans_beyond_the_scanner_are_told(ranges: float) -> None:
    finding = only(with_scans(intensities=MIXED, ranges=ranges))
    assert ("in millimetres" if ranges > 1000.0 else "another scanner") in finding.probably


def test_threshold_that_all_or_no_beams_reach_is_told_with_the_intensities() -> None:
    bright = only(with_scans(intensities=60.0 + 100.0 * MIXED))
    assert (
        bright.found
        == "100 % of the beams of the scans reach detector.intensity_threshold 0.5 (intensities are 70 to 150)"
    )
    assert "no beam of the scans reaches" in only(with_scans(intensities=0.1 * MIXED)).found


def test_step_and_rate_of_another_scanner_are_told() -> None:
    assert "0.25 deg apart" in only(with_scans(intensities=MIXED, step_deg=0.25)).found
    assert "25 times a second" in only(with_scans(intensities=MIXED, rate=25.0)).found


def test_reference_in_degrees_is_told_and_one_that_was_never_wrapped_is_not() -> None:
    log = drive(120.0)
    assert np.abs(log.reference_poses[:, 2]).max() > 2.0 * math.pi
    assert judged(log) == ()
    degrees = log.reference_poses * (1.0, 1.0, 180.0 / math.pi)
    assert "in degrees" in only(dataclasses.replace(log, reference_poses=degrees)).probably
    # What starts there does not begin where nobody is.
    started = [
        start_of(PROJECT, dataclasses.replace(log, reference_poses=p)).belief.mean
        for p in (degrees, log.reference_poses)
    ]
    np.testing.assert_allclose(started[0], started[1], atol=1e-9)


def test_scans_of_which_no_beam_has_a_range_are_told() -> None:
    log = with_scans(intensities=MIXED)
    nothing = dataclasses.replace(log.scans[0].block(0, 200), ranges=np.full((200, 720), np.inf, np.float32))
    assert "no beam of the scans has a range" in only(dataclasses.replace(log, scans=(nothing,))).found


def test_recording_in_which_nothing_is_seen_and_nothing_moves_is_told() -> None:
    found = judged(RecordLog(odometry_stamps_ns=np.empty(0, np.int64), displacements=np.empty((0, 3))))

    assert [each.found for each in found] == [
        "the recording holds no scan and no detection",
        "the recording holds no odometry",
    ]
    assert "--channel scan=TOPIC" in found[0].remedy
    assert "--channel odometry=TOPIC" in found[1].remedy


def test_scans_whose_intensities_are_no_numbers_are_told() -> None:
    (finding,) = judged(with_scans(intensities=np.full_like(MIXED, np.nan)))
    assert finding.found == "no beam of the scans has an intensity that is a number"


def test_study_can_be_cancelled() -> None:
    def cancel(_fraction: float, _message: str = "") -> None:
        raise JobCancelled("stopped")

    with pytest.raises(JobCancelled):
        plausibility(PlausibilityInput.of(PROJECT, drive(1.0)), cancel)


def two_scanners(front: np.ndarray, rear: np.ndarray) -> RecordLog:
    """A recording of two scanners with intensities of their own; each has a scan every 0.1 s."""
    log = with_scans(intensities=MIXED)
    scans = tuple(
        dataclasses.replace(scan_log(intensities=values), scanner=index) for index, values in enumerate((front, rear))
    )
    return dataclasses.replace(log, scans=scans, scanners=("front", "rear"))


def test_without_a_project_nothing_is_said_to_be_another_scanner_than_its() -> None:
    log = dataclasses.replace(with_scans(intensities=MIXED[:, ::4], step_deg=2.0), scanners=("left",))
    assert any("another scanner" in each.probably for each in judged(log))
    assert plausibility(PlausibilityInput.alone(log)) == ()
    assert plausibility(PlausibilityInput.alone(two_scanners(MIXED, MIXED))) == ()


def test_without_a_project_millimetres_are_told_all_the_same() -> None:
    log = with_scans(intensities=MIXED, ranges=5000.0)
    (finding,) = plausibility(PlausibilityInput.alone(log))
    assert finding.probably == "they are in millimetres"


def test_a_scanner_that_falls_silent_is_told_with_its_name_and_when() -> None:
    found = plausibility(PlausibilityInput.alone(two_scanners(MIXED, MIXED[:50])))
    assert [each.found for each in found] == ["the scans of rear end at 4.9 s of 19.9 s"]
    # Up to a second and five scans nothing is said.
    assert plausibility(PlausibilityInput.alone(two_scanners(MIXED, MIXED[:186]))) == ()
    assert len(plausibility(PlausibilityInput.alone(two_scanners(MIXED, MIXED[:184])))) == 1


def test_odometry_that_ends_is_told_with_several_scanners_too() -> None:
    log = two_scanners(MIXED, MIXED)
    kept = log.odometry_stamps_ns < 8 * SECOND
    cut = dataclasses.replace(
        log, odometry_stamps_ns=log.odometry_stamps_ns[kept], displacements=log.displacements[kept]
    )
    (finding,) = plausibility(PlausibilityInput.alone(cut))
    assert "the odometry ends at 8.0 s, and scans go on" in finding.found


def test_a_single_record_tells_of_no_clock() -> None:
    log = with_scans(intensities=MIXED)
    made_up = dataclasses.replace(
        log, odometry_stamps_ns=log.odometry_stamps_ns[:1] - 10 * SECOND, displacements=log.displacements[:1]
    )
    assert [each.found for each in plausibility(PlausibilityInput.alone(made_up))] == [
        "the recording holds no odometry"
    ]


def test_what_is_told_of_intensities_names_the_scanner() -> None:
    (finding,) = plausibility(PlausibilityInput.alone(two_scanners(MIXED, MIXED * 0.1)))
    assert finding.found.startswith("no beam of the scans of rear reaches")


@pytest.mark.parametrize(
    ("x", "heading", "upside_down", "told"),
    [(0.02, 0.01, False, 0), (0.05, 0.0, False, 1), (0.0, 0.03, False, 1), (0.0, 0.0, True, 1)],
)
def test_a_mounting_of_the_recording_that_is_not_the_project_s_is_told(
    x: float, heading: float, upside_down: bool, told: int
) -> None:
    said = RecordedMounting(
        scanner="scanner", base="base_link", x=x, y=0.0, heading=heading, upside_down=upside_down, lean=0.0
    )
    found = judged(dataclasses.replace(drive(), mountings=(said,)))
    assert [each.found.startswith("scanner is mounted at [") for each in found] == [True] * told


@pytest.mark.parametrize(
    ("duration", "direction", "told"),
    [
        (0.020, 1, ""),
        (0.0215, 1, ""),
        (0.0225, 1, "takes 22.5 ms from the first to the last beam, counter-clockwise, by its time_increment"),
        (0.020, -1, "takes 20 ms from the first to the last beam, clockwise, by its time_increment; the project says"),
        (0.150, 1, "takes 150 ms from beam to beam by its time_increment, and the next one comes after 100 ms"),
    ],
)
def test_a_sweep_of_the_recording_that_is_not_the_project_s_or_cannot_be_is_told(
    duration: float, direction: int, told: str
) -> None:
    scanner = dataclasses.replace(PROJECT.scanners[0], sweep_duration=0.020)
    project = dataclasses.replace(PROJECT, scanners=(scanner,))
    said = RecordedSweep(scanner="scanner", duration=duration, direction=direction)
    log = dataclasses.replace(with_scans(intensities=MIXED), sweeps=(said,))

    found = [each.found for each in plausibility(PlausibilityInput.of(project, log)) if "time_increment" in each.found]

    assert [told in each for each in found] == [True] * bool(told)
