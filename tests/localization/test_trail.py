"""Vehicles whose scans see one or two things: found by the way as a whole, or not at all; against poses led plainly."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.geometry import se2
from commission.localization.contradiction import contradiction
from commission.localization.estimate import Mode
from commission.localization.hypotheses import each_place_once, hypotheses_of
from commission.localization.localizer import Localizer
from commission.localization.observation import range_bearing
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.search_map import search_map
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, state_unlocated
from commission.localization.trail import lengthened, no_trail
from commission.localization.trail_fit import MET, Trail, follow, in_view
from commission.localization.whole_run import run, state_before
from commission.site.parameters import ObservationParameters, Parameters, SupervisorParameters
from commission.site.records import Detections
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.drives import Drive, Plan, random_drive, random_map
from tests.localization.plain_trail import PlainPose

CAMERA = Scanner(mounting=np.array([0.2, 0.1, 0.05]), field_of_view_deg=(-30.0, 30.0), range=(0.1, 9.0))
PLAN = Plan(scans=120, odometry_ns=50_000_000, scan_ns=200_000_000, speed=1.0, reach=9.0, clutter=1.5)


def setup_of(seed: int, count: int = 25) -> LocalizerSetup:
    parameters = Parameters(
        observation=ObservationParameters(range_sigma=0.05, bearing_sigma=0.02),
        supervisor=SupervisorParameters(position_limit=0.5, heading_limit=0.2),
    )
    return LocalizerSetup(
        reflectors=random_map(np.random.default_rng(seed), count), scanners=(CAMERA,), parameters=parameters
    )


def sparse_drive(setup: LocalizerSetup, seed: int, plan: Plan = PLAN) -> Drive:
    """A drive of which two of the detections before the vehicle are left at most, a fifth of them false."""
    drive = random_drive(setup, np.random.default_rng(seed), plan)
    seen = [
        dataclasses.replace(each, range_bearing=each.range_bearing[np.abs(each.range_bearing[:, 1]) < 0.52][:2])
        if isinstance(each, Detections)
        else each
        for each in drive.records
    ]
    return dataclasses.replace(drive, records=seen)


def unlocated(setup: LocalizerSetup) -> FilterState:
    return state_unlocated(0, search_map(setup).anywhere)


def off(columns, drive: Drive) -> np.ndarray:
    return np.hypot(*(columns.means[:, :2] - drive.truth[:, :2]).T)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_vehicle_that_sees_two_things_at_most_is_found_by_its_way(seed: int) -> None:
    setup = setup_of(seed)
    drive = sparse_drive(setup, seed)
    assert np.diff(drive.log.detection_offsets).max() == 2
    columns = run(drive.log, setup, unlocated(setup))
    located = int(np.flatnonzero(columns.modes != Mode.INITIALIZING)[0])
    assert (off(columns, drive)[located:] < 0.5).all()
    # Before it is found the page draws where it may be.
    moment = columns.search(located - 1)
    assert moment is not None
    best = hypotheses_of(moment)[0]
    assert math.hypot(*(best.pose[:2] - drive.truth[located - 1, :2])) < 0.5
    assert best.probability > 0.9


def test_what_two_things_at_a_time_show_of_another_map_is_never_found() -> None:
    for seed in range(2):
        setup = setup_of(seed)
        columns = run(sparse_drive(setup_of(seed + 10), seed).log, setup, unlocated(setup))
        assert (columns.modes == Mode.INITIALIZING).all(), seed


def test_live_resumed_and_whole_run_agree_to_the_last_bit_while_it_is_searched_by_its_way() -> None:
    setup = setup_of(1)
    drive = sparse_drive(setup, 1, dataclasses.replace(PLAN, scans=70, scan_offset_ns=7_000_000))
    whole, localizer, states = run(drive.log, setup, unlocated(setup)), Localizer(setup, unlocated(setup)), []
    for record in drive.log.records():
        localizer.push(record)
        while localizer.pull() is not None:
            states.append(localizer.state)
    for _ in localizer.flush():
        states.append(localizer.state)
    assert localizer.state == whole.final
    by_way = [cycle for cycle, state in enumerate(states) if state.search and len(state.search.explained)]
    assert by_way
    for cycle in by_way[:: max(len(by_way) // 3, 1)]:
        assert state_before(whole, drive.log, cycle + 1) == states[cycle]


def trail_of(drive: Drive) -> Trail:
    """The whole drive as a trail, odometry being the truth moved by a little."""
    trail, log, pose = no_trail(), drive.log, np.zeros(3)
    for k, stamp in enumerate(log.detection_stamps_ns.tolist()):
        row = np.zeros(8)
        pose = se2.compose(se2.inverse(drive.truth[0]), drive.truth[k]) + 0.002 * np.array([k, -k, 0.2 * k])
        row[0], row[1:4], row[4:6] = stamp * 1e-9, pose, (1e-4 * k, 4e-5 * k)
        seen = log.range_bearing[int(log.detection_offsets[k]) : int(log.detection_offsets[k + 1])]
        trail = lengthened(trail, row, seen)
    return trail


@pytest.mark.parametrize("forth", [True, False])
@pytest.mark.parametrize("shift", [0.0, 0.25, 3.0])
def test_a_pose_is_led_along_as_a_plain_filter_with_matrices_leads_it(forth: bool, shift: float) -> None:
    setup = setup_of(3)
    # Slowly, so that scans count in part, or fast.
    drive = sparse_drive(setup, 3, dataclasses.replace(PLAN, scans=30, speed=0.3 if forth else 1.0))
    trail, around = trail_of(drive), search_map(setup)
    begin = drive.truth[0 if forth else -1] + np.array([shift, -0.5 * shift, 0.1 * shift])
    p = np.diag((0.09, 0.09, 0.0225))
    led = follow(
        PoseGaussian(*begin, 0.09, 0.0, 0.0, 0.09, 0.0, 0.0225),
        forth,
        trail,
        around.models,
        around.eyes,
        8.0,
        around.crowd,
        around.reflectors,
        np.zeros((0, MET)),
    )
    plain = PlainPose(begin, p, setup, 8.0)
    plain.lead(trail, forth=forth)
    np.testing.assert_allclose(led.pose[:3], plain.mean, atol=1e-8)
    upper = plain.p[np.triu_indices(3)]
    np.testing.assert_allclose(led.pose[3:], upper, rtol=1e-6, atol=1e-12)
    assert (led.evidence, led.share, led.places) == pytest.approx(plain.told(), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("off", "beside_least"), [(0.0, 0), (0.25, 2)])
def test_a_pose_contradicts_the_reflectors_that_what_it_sees_of_them_lies_beside(off: float, beside_least: int) -> None:
    setup = setup_of(3)
    drive = sparse_drive(setup, 3, dataclasses.replace(PLAN, scans=60))
    places = [
        dataclasses.replace(each, x=each.x + (off if k % 3 == 0 else 0.0))
        for k, each in enumerate(setup.reflectors.reflectors)
    ]
    setup = dataclasses.replace(setup, reflectors=ReflectorMap(tuple(places)))
    trail, around = trail_of(drive), search_map(setup)
    assert around.harmless == 0.125
    pose = PoseGaussian(*drive.truth[-1], 0.02**2, 0.0, 0.0, 0.02**2, 0.0, 0.01**2)
    found = contradiction(pose, trail, around._replace(harmless=0.0))
    longest = float(trail.seen[:, 0].max())
    plain = PlainPose(drive.truth[-1], np.diag((0.02**2, 0.02**2, 0.01**2)), setup, longest)
    plain.lead(trail, forth=False)
    met, beside, misfit = plain.beside()
    assert (found.met, found.contradicted) == (met, beside)
    # A rival that lies at the edge of the gate, outside of the circle that is looked at, is left out: some 1e-4 of it.
    assert found.misfit == pytest.approx(misfit, rel=1e-3, abs=1e-12)
    assert met > 8
    assert beside_least <= beside <= 4 * (off > 0.0)
    assert (found.misfit > 0.05**2) == (off > 0.0)
    # What moves nobody by a part of the supervisor's limit is no contradiction.
    assert contradiction(pose, trail, around._replace(harmless=0.4)).contradicted == 0


def test_a_pose_found_among_things_beside_their_places_is_less_sure() -> None:
    setup, rng = setup_of(1), np.random.default_rng(0)
    drive = sparse_drive(setup, 1)
    beside = [
        dataclasses.replace(each, x=each.x + dx, y=each.y + dy)
        for each, (dx, dy) in zip(setup.reflectors.reflectors, rng.normal(0.0, 0.15, (25, 2)).tolist(), strict=True)
    ]
    sigmas, errors = [], []
    for reflectors in (setup.reflectors, ReflectorMap(tuple(beside))):
        told = dataclasses.replace(setup, reflectors=reflectors)
        columns = run(drive.log, told, unlocated(told))
        located = int(np.flatnonzero(columns.modes != Mode.INITIALIZING)[0])
        covariance, error = columns.covariances[located, :2, :2], (columns.means - drive.truth)[located, :2]
        sigmas.append(math.sqrt(np.linalg.eigvalsh(covariance)[-1]))
        errors.append(error @ np.linalg.solve(covariance, error))
    assert sigmas[1] > 1.2 * sigmas[0]
    # Chi-square of two degrees of freedom, 99 %.
    assert max(errors) < 9.2


def test_a_trail_keeps_the_newest_of_the_way_and_no_scan_that_saw_nothing() -> None:
    trail = no_trail()
    for k in range(400):
        trail = lengthened(trail, np.array([k, 0.1 * k, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), np.full((k % 3, 2), float(k)))
    # 15 m at most, 0.1 m apart; a third of them saw nothing.
    assert trail.scans[0, 1] == pytest.approx(39.9 - 14.9, abs=0.21)
    assert (np.diff(trail.scans[:, 7], prepend=0) == np.where(trail.scans[:, 0] % 3 == 1, 1, 2)).all()
    assert trail.seen[0, 0] == trail.scans[0, 0]
    assert trail.seen[-1, 0] == trail.scans[-1, 0]
    assert trail.scans[-1, 7] == len(trail.seen)


def test_reflectors_in_view_are_those_whose_bearing_and_range_are_within_the_limits() -> None:
    setup, rng = setup_of(5, count=200), np.random.default_rng(5)
    around, model = search_map(setup), setup.observations[0]
    for case in range(60):
        first, width = rng.uniform(-math.pi, math.pi), (rng.uniform(0.1, math.pi), rng.uniform(math.pi, 6.2))[case % 2]
        nearest, farthest, longest = rng.uniform(0.1, 2.0), rng.uniform(5.0, 20.0), rng.uniform(5.0, 20.0)
        width = 2.0 * math.pi if case % 10 == 9 else width
        # The second one is of another scanner.
        eyes = np.array([(0, first, width, nearest, farthest), (1, -math.pi, 2.0 * math.pi, 0.0, 99.0)])
        pose = PoseGaussian(*rng.uniform(-8.0, 8.0, 2), rng.uniform(-9.0, 9.0), 1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
        view = range_bearing(np.array(pose[:3]), CAMERA.mounting, around.reflectors.places[:, :2])
        turned = np.mod(view[:, 1] - first, 2.0 * math.pi)
        near = (view[:, 0] >= nearest) & (view[:, 0] <= min(farthest, longest))
        expected = max(1, int(np.sum(near & (turned <= width))))
        assert in_view(pose, model, 0, eyes, longest, around.reflectors.places) == expected, case


def test_poses_of_one_place_are_led_along_once_the_likeliest_of_them() -> None:
    rng = np.random.default_rng(7)
    poses = np.column_stack((rng.uniform(0.0, 1.5, (400, 2)), rng.uniform(-math.pi, math.pi, 400)))
    for part in (1.0, 0.25):
        plain: list[int] = []
        for row, (x, y, theta) in enumerate(poses):
            apart = [math.hypot(x - poses[k, 0], y - poses[k, 1]) for k in plain]
            turns = [abs(math.remainder(theta - poses[k, 2], 2.0 * math.pi)) for k in plain]
            if not any(a < 0.4 * part and t < 0.15 * part for a, t in zip(apart, turns, strict=True)):
                plain.append(row)
        assert each_place_once(poses, 400, part).tolist() == plain
        assert each_place_once(poses, 7, part).tolist() == plain[:7]
    assert each_place_once(poses[:0], 5).tolist() == []
