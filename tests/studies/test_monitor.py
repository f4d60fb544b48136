"""Drives through halls whose reflectors have changed since the survey: each change is named, and nothing else."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.localization.detection_log import extract_detections
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.uncertainty import Uncertainty
from commission.studies.diagnosis import Diagnosis
from commission.studies.map_correction import corrected, why_not
from commission.studies.map_findings import MapFault
from commission.studies.metrics import reference_at
from commission.studies.monitor import MonitorInput, diagnosed_drive, monitor
from commission.studies.moved_reflector import change_point
from commission.studies.start import Start, StartOrigin
from tests.acceptance.eight import eight
from tests.planning.driven import QUICK

MOVED = np.array([0.06, 0.0])


@functools.cache
def site() -> Project:
    """The laboratory, and a figure of eight."""
    project = load_project(bundled_folder("maps") / "laboratory")
    return replace(project, routes=(eight(1),), uncertainty=Uncertainty(survey=0.003))


def hall(**changes: object) -> ReflectorMap:
    """The reflectors as they stand now: some elsewhere, gone (None), or added."""
    standing = [each for each in site().reflectors.reflectors if changes.get(each.id, "") is not None]
    moved = [
        replace(each, x=each.x + MOVED[0], y=each.y + MOVED[1]) if each.id in changes else each for each in standing
    ]
    added = [
        Reflector(id=name, x=place[0], y=place[1])  # type: ignore[index]
        for name, place in changes.items()
        if isinstance(place, tuple)
    ]
    return ReflectorMap((*moved, *added))


def driven(reflectors: ReflectorMap, seed: int) -> RecordLog:
    """A drive through a hall that the project knows nothing of."""
    project = site()
    disturbances = project.disturbances.undisturbed()
    return virtual_drive(
        replace(project, reflectors=reflectors, disturbances=disturbances), "Eight", seed, options=QUICK
    )


def begin() -> Start:
    start = start_of(site(), "Eight")
    return Start(Belief(0, start.pose, np.diag(start.sigmas**2)), StartOrigin.DRIVE)


def spoiled(log: RecordLog, place: tuple[float, float], kept: float) -> RecordLog:
    """The detections of a drive, of those of one reflector only a share."""
    found = extract_detections(log, LocalizerSetup.of(site()))
    poses = reference_at(found.stamps_ns, log.reference_stamps_ns, log.reference_poses)
    cycle = np.repeat(np.arange(len(found)), np.diff(found.offsets))
    mounting = site().scanners[0].mounting
    heading = poses[cycle, 2]
    c, s = np.cos(heading), np.sin(heading)
    x = poses[cycle, 0] + c * mounting[0] - s * mounting[1]
    y = poses[cycle, 1] + s * mounting[0] + c * mounting[1]
    bearing = heading + mounting[2] + found.range_bearing[:, 1]
    x, y = x + found.range_bearing[:, 0] * np.cos(bearing), y + found.range_bearing[:, 0] * np.sin(bearing)
    is_its = np.hypot(x - place[0], y - place[1]) < 0.5
    passes = (found.status == 0) & (~is_its | (np.random.default_rng(3).random(len(cycle)) < kept))
    counts = np.bincount(cycle[passes], minlength=len(found))
    return replace(
        log,
        scans=(),
        detection_stamps_ns=found.stamps_ns,
        detection_offsets=np.concatenate(([0], np.cumsum(counts))),
        range_bearing=found.range_bearing[passes],
        detection_scanners=found.scanners,
    )


@functools.cache
def clean() -> Diagnosis:
    return diagnosed_drive(site(), driven(site().reflectors, 1), begin())


@functools.cache
def changed() -> Diagnosis:
    """L1 moved by 6 cm, L3 gone, something new at 8, 2 m."""
    log = driven(hall(L1=True, L3=None, new=(8.0, 2.0)), 2)
    return diagnosed_drive(site(), log, begin())


def test_what_has_changed_between_two_drives_is_named_with_its_drive_and_corrected() -> None:
    found = monitor(MonitorInput(names=("monday", "friday"), diagnoses=(clean(), changed())))
    by_id = {each.id: each for each in found.findings}
    assert {(each.id, each.fault) for each in found.findings} == {
        ("L1", MapFault.MOVED),
        ("L3", MapFault.MISSING),
        ("new-1", MapFault.NEW),
    }
    assert all(each.since == "friday" for each in found.findings)
    first = site().reflectors.reflectors[0]
    assert first.id == "L1"
    moved = by_id["L1"]
    assert moved.before == (first.x, first.y)
    assert moved.after is not None
    assert np.allclose(moved.after, np.array([first.x, first.y]) + MOVED, atol=0.012)
    assert "L1 has moved by" in moved.text
    # The others, from which it is seen, were surveyed to 3 mm.
    assert 0.003 < moved.sigma < 0.006
    assert [each.drive for each in moved.evidence] == ["monday", "friday"]
    assert by_id["new-1"].after == pytest.approx((8.0, 2.0), abs=0.03)
    # The map is made anew from what was found; what is new only where that is asked for.
    after = corrected(site().reflectors, found.findings)
    ids = [each.id for each in after.reflectors]
    assert ids == [each.id for each in site().reflectors.reflectors if each.id != "L3"]
    assert after.reflectors[0].sigma == pytest.approx(moved.sigma, abs=1e-4)
    assert why_not(after, moved) == "the map has it there by now"
    assert (after.reflectors[0].x, after.reflectors[0].y) == pytest.approx(moved.after, abs=1e-4)
    assert corrected(site().reflectors, found.findings, add_new=True).reflectors[-1].id == "new-1"
    locked = ReflectorMap(tuple(replace(each, locked=True) for each in site().reflectors.reflectors))
    assert corrected(locked, found.findings) == locked


def test_nothing_is_named_where_nothing_has_changed_or_it_is_back_again() -> None:
    assert monitor(MonitorInput(names=("monday",), diagnoses=(clean(),))).findings == ()
    both = MonitorInput(names=("friday", "monday"), diagnoses=(changed(), clean()))
    assert monitor(both).findings == ()


def test_a_dirty_reflector_is_named_with_its_shares() -> None:
    second = site().reflectors.reflectors[1]
    log = spoiled(driven(site().reflectors, 4), (second.x, second.y), 0.25)
    (finding,) = monitor(MonitorInput(names=("today",), diagnoses=(diagnosed_drive(site(), log, begin()),))).findings
    assert (finding.id, finding.fault) == (second.id, MapFault.DIRTY)
    (evidence,) = finding.evidence
    assert evidence.seen < 0.4 * evidence.expected
    assert f"seen in {evidence.seen} of {evidence.expected} scans" in finding.text
    assert corrected(site().reflectors, [finding]) == site().reflectors


def test_a_reflector_that_is_moved_during_the_drive_is_named_with_the_time() -> None:
    before, after = driven(site().reflectors, 5), driven(hall(L1=True), 5)
    half = int(before.scans[0].stamps_ns[len(before.scans[0]) // 2])
    ahead, behind = before.scans[0], after.scans[0]
    ranges = np.where((ahead.stamps_ns < half)[:, np.newaxis], ahead.ranges, behind.ranges)
    flags = np.where((ahead.stamps_ns < half)[:, np.newaxis], ahead.reflector, behind.reflector)  # type: ignore[arg-type]
    log = replace(before, scans=(replace(ahead, ranges=ranges, reflector=flags),))
    (finding,) = monitor(MonitorInput(names=("today",), diagnoses=(diagnosed_drive(site(), log, begin()),))).findings
    assert (finding.id, finding.fault) == ("L1", MapFault.MOVED)
    assert finding.before is not None
    assert finding.after is not None
    assert np.allclose(np.subtract(finding.after, finding.before), MOVED, atol=0.015)
    told = float(finding.since.removeprefix("today, ").removesuffix(" s"))
    assert told == pytest.approx(half * 1e-9, abs=3.0)


def test_the_cumulative_sum_finds_a_change_where_it_is_and_none_in_noise() -> None:
    rng = np.random.default_rng(0)
    alarms = 0
    for _ in range(200):
        noise = rng.normal(0.0, 1.0, 300)
        # A shift of three sigma, as it would be looked for: 3 (x - 1.5).
        alarms += change_point(3.0 * (noise - 1.5)) is not None
        noise[200:] += 3.0
        began = change_point(3.0 * (noise - 1.5))
        assert began is None or began < 200 or abs(began - 200) <= 3
    # By Wald's bound a run of 300 passes by chance in less than 300 exp(-8) = 10 % of the cases.
    assert alarms <= 20
