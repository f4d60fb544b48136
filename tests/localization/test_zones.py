"""Zones: which kinds of observation correct the pose where the vehicle is, live and over whole runs."""

# pyright: basic

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.localization.contour import ACCEPTED, USE
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.localization.zones import kinds_at, zone_rows
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.parameters import HELD_LEVEL, Parameters, SupervisorParameters, TagParameters
from commission.site.records import Detections, Odometry, Scan
from commission.site.zones import ObservationKind, Zone
from commission.studies.integrity import protection
from tests.localization.drives import Plan, random_drive
from tests.localization.test_contour import ON, SWEEPING, project_of
from tests.localization.test_tags import NEAR, STANDING, assert_the_same, grown, mixed
from tests.localization.test_whole_run import assert_same_estimate, setup_of

EVERYWHERE = ((-100.0, -100.0), (100.0, -100.0), (100.0, 100.0), (-100.0, 100.0))
REFLECTORS, CONTOURS, TAGS = ObservationKind
STAR = ((0.0, 2.0), (1.0, 0.5), (2.5, 0.0), (1.0, -0.5), (0.0, -2.0), (-1.0, -0.5), (-2.5, 0.0), (-1.0, 0.5))


def zone(outline, *kinds, name="A"):
    return Zone(name=name, outline=outline, kinds=kinds)


def turns_around(outline, x, y):
    """How often an outline goes around a point: the sum of the angles under which its edges are seen, in turns."""
    angles = [math.atan2(by - y, bx - x) for bx, by in outline]
    steps = [math.remainder(b - a, 2.0 * math.pi) for a, b in zip(angles, angles[1:] + angles[:1], strict=True)]
    return round(sum(steps) / (2.0 * math.pi))


def test_inside_is_where_the_outline_goes_around_the_place():
    rng = np.random.default_rng(1)
    rows = zone_rows([zone(STAR, CONTOURS)])
    inside = 0
    for x, y in rng.uniform(-3.0, 3.0, (2000, 2)).tolist():
        here = kinds_at(rows, x, y)
        is_inside = turns_around(STAR, x, y) != 0
        inside += is_inside
        assert tuple(here) == ((False, True, False) if is_inside else (True, True, True))
    assert 200 < inside < 1000


def test_the_first_of_zones_that_overlap_counts_and_a_border_is_in_exactly_one():
    left = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    right = ((1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0))
    both = zone_rows([zone(left, REFLECTORS), zone(right, CONTOURS, name="B")])
    assert tuple(kinds_at(both, 1.0, 0.5)) in {(True, False, False), (False, True, False)}
    assert tuple(kinds_at(both, 2.1, 0.5)) == (True, True, True)
    overlapping = zone_rows([zone(left, REFLECTORS, TAGS), zone(EVERYWHERE, CONTOURS, name="B")])
    assert tuple(kinds_at(overlapping, 0.5, 0.5)) == (True, False, True)
    assert tuple(kinds_at(overlapping, 5.0, 0.5)) == (False, True, False)
    assert tuple(kinds_at(zone_rows(()), 5.0, 0.5)) == (True, True, True)


@pytest.mark.parametrize("beams", [0, 720], ids=["detections", "raw scans"])
def test_where_reflectors_do_not_count_the_pose_is_that_of_a_drive_on_which_none_was_seen(beams):
    rng = np.random.default_rng(3)
    plain = setup_of(rng)
    drive = random_drive(plain, rng, Plan(scans=60, beams=beams))
    # A straight drive: the first half of it lies on one side of a line through its middle.
    (ax, ay), (bx, by) = drive.truth[0, :2], drive.truth[-1, :2]
    middle, along = (
        np.array(((ax + bx) / 2, (ay + by) / 2)),
        np.array((bx - ax, by - ay)) / math.hypot(bx - ax, by - ay),
    )
    across = np.array((-along[1], along[0]))
    corners = [middle + 50.0 * across, middle - 50.0 * across, middle - 50.0 * across + 90.0 * along]
    corners.append(middle + 50.0 * across + 90.0 * along)
    zones = (zone(tuple(map(tuple, np.array(corners).tolist())), CONTOURS, TAGS),)
    setup = dataclasses.replace(plain, zones=zones)
    columns = run(drive.log, setup, drive.initial)
    without = run(drive.log, plain, drive.initial)
    there = np.array([kinds_at(setup.zone_rows, *mean[:2]).reflectors for mean in columns.priors.rows().means])
    first = int(np.flatnonzero(~there)[0])
    assert 10 < first < 50
    assert there[:first].all()
    assert not there[first:].any()
    assert columns.means[:first].tobytes() == without.means[:first].tobytes()
    # The oracle: the same records without anything that could be detected from there on.
    records = []
    for record in drive.log.records():
        if isinstance(record, Odometry) or record.stamp_ns < columns.stamps_ns[first]:
            records.append(record)
        elif isinstance(record, Detections):
            records.append(dataclasses.replace(record, range_bearing=np.empty((0, 2))))
        elif isinstance(record, Scan):
            records.append(dataclasses.replace(record, ranges=np.full_like(record.ranges, np.nan)))
    blind = dataclasses.replace(drive, records=records)
    expected = run(blind.log, plain, drive.initial)
    assert columns.means.tobytes() == expected.means.tobytes()
    assert columns.covariances.tobytes() == expected.covariances.tobytes()
    levels, without = protection(columns), protection(expected)
    assert levels.position.tobytes() == without.position.tobytes()
    assert np.isfinite(levels.position[first:]).any()
    # Reflectors testify all the same: they are associated, and accepted.
    rows = slice(int(columns.offsets[first]), None)
    assert (columns.status[rows] == Status.INLIER).mean() > 0.5
    assert np.isfinite(columns.d2[rows]).mean() > 0.5
    localizer = Localizer(setup, drive.initial)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    for cycle, estimate in enumerate([*estimates, *localizer.flush()]):
        assert_same_estimate(estimate, columns.estimate(cycle))
    assert localizer.state == columns.final


def test_a_supervisor_by_protection_levels_reckons_with_no_reflector_where_none_corrects():
    rng = np.random.default_rng(3)
    parameters = Parameters(supervisor=SupervisorParameters(held=HELD_LEVEL))
    setup = dataclasses.replace(setup_of(rng, parameters), zones=(zone(EVERYWHERE, CONTOURS),))
    drive = random_drive(setup, rng, Plan(scans=40))
    columns = run(drive.log, setup, drive.initial)
    records = [
        dataclasses.replace(each, range_bearing=np.empty((0, 2))) if isinstance(each, Detections) else each
        for each in drive.records
    ]
    blind = dataclasses.replace(drive, records=records)
    unseen = run(blind.log, dataclasses.replace(setup, zones=()), drive.initial)
    assert np.isfinite(columns.levels).all()
    assert columns.levels.tobytes() == unseen.levels.tobytes()
    live = grown(drive.log, setup, drive.initial)
    assert live.levels.tobytes() == columns.levels.tobytes()


def test_reflectors_that_do_not_correct_tell_of_a_vehicle_that_stands_elsewhere():
    rng = np.random.default_rng(5)
    setup = dataclasses.replace(setup_of(rng), zones=(zone(EVERYWHERE, CONTOURS),))
    drive = random_drive(setup, rng, Plan(scans=200, slip=math.radians(8.0), clutter=0.0))
    modes = run(drive.log, setup, drive.initial).modes
    assert (modes == Mode.LOST).any(), "a slip of 8 degrees contradicts every reflector"


def test_contours_are_looked_at_where_they_count_live_and_over_whole_runs():
    project = project_of(reflectors=3, contours=ON, scanners=(SWEEPING,))
    log, start = virtual_drive(project, "Through", seed=1), start_of(project, "Through")
    initial = Belief(0, start.pose, np.diag(start.sigmas**2))
    everywhere = run(log, LocalizerSetup.of(project), initial)
    x, y = everywhere.means[len(everywhere) // 2, :2].tolist()
    box = ((x - 0.7, y - 5.0), (x + 0.7, y - 5.0), (x + 0.7, y + 5.0), (x - 0.7, y + 5.0))
    setup = LocalizerSetup.of(dataclasses.replace(project, zones=(zone(box, REFLECTORS),)))
    columns, localizer = run(log, setup, initial), Localizer(setup, initial)
    inside = np.abs(columns.priors.rows().means[:, 0] - x) < 0.7
    assert 5 < inside.sum() < len(columns) - 5
    assert not columns.contours[inside].any()
    assert (columns.contours[~inside, USE] == ACCEPTED).mean() > 0.9
    estimates = [estimate for record in log.records() for estimate in localizer.feed(record)]
    for cycle, estimate in enumerate([*estimates, *localizer.flush()]):
        assert_same_estimate(estimate, columns.estimate(cycle))
    assert localizer.state == columns.final


def test_where_tags_do_not_count_the_pose_is_that_of_a_drive_that_looks_at_none():
    log, setup = mixed(), dataclasses.replace(STANDING, zones=(zone(EVERYWHERE, REFLECTORS),))
    columns = run(log, setup, NEAR)
    assert_the_same(columns, grown(log, setup, NEAR))
    assert len(columns.tags)
    assert not columns.tags.any()
    blind = dataclasses.replace(STANDING.parameters, tag=TagParameters(enabled=False))
    expected = run(log, dataclasses.replace(STANDING, parameters=blind), NEAR)
    seen = np.isin(columns.stamps_ns, expected.stamps_ns) & ~columns.detected.tags.is_frame
    mine, other = columns.means[seen], expected.means[np.isin(expected.stamps_ns, columns.stamps_ns[seen])]
    assert mine[-1] == pytest.approx(other[-1], abs=1e-9)
    there = run(log, STANDING, NEAR)
    assert not np.allclose(there.means[-1], columns.means[-1], atol=1e-6)
