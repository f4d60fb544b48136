"""Contours as an observation kind: rows, gate, considered errors, degenerate halls, and live = whole run."""

# pyright: basic

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.geometry import se2
from commission.localization.consider import ConsiderModel
from commission.localization.contour import (
    ACCEPTED,
    COLUMNS,
    MATCHED,
    NIS,
    POINTS,
    REJECTED,
    ROWS,
    SIGMA,
    UNMATCHED,
    USE,
    ContourModel,
    ContourScan,
    contour_model,
    observe_contours,
    scan_points,
)
from commission.localization.estimate import Belief
from commission.localization.localizer import Localizer
from commission.localization.observation import ObservationModel
from commission.localization.odometry import AT_REST, NOT_YET, NextOdometry
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, from_belief, mean_of
from commission.localization.pose_rows import PoseRows, corrected_by_rows, nis_of_rows, told_directions
from commission.localization.run_columns import RunSegment
from commission.localization.setup import LocalizerSetup
from commission.localization.sweep import AT_ONCE, sweep_of
from commission.localization.wall_depth import AS_DRAWN
from commission.localization.whole_run import run, run_segments, state_before
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.floor_map import FloorMap
from commission.site.parameters import ContourParameters, FilterParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner, StampOf
from tests.conftest import few_of
from tests.localization.contour_halls import corridor, room, scan_from

ON = ContourParameters(enabled=True, beam_sigma=0.01)
EXACT = dataclasses.replace(ON, map_sigma=0.0, map_heading_sigma=0.0)
FULL_TURN = Scanner(field_of_view_deg=(-180.0, 180.0), resolution_deg=0.25)
NOTHING_KNOWN = ConsiderModel(0.0, 0.0, 0.0, 0.0)
TRUTH = np.array((4.0, 3.6, 0.4))


def bits(belief: Belief) -> tuple[bytes, bytes]:
    return belief.mean.tobytes(), belief.covariance.tobytes()


def modelled(floor: FloorMap, scanners: tuple[Scanner, ...], given: ContourParameters) -> ContourModel:
    model = contour_model(floor, scanners, given)
    assert model is not None
    return model


def belief_at(pose, sigmas) -> PoseGaussian:
    return from_belief(Belief(0, np.array(pose, dtype=np.float64), np.diag(np.square(sigmas))))


def observed(floor: FloorMap, belief: PoseGaussian, ranges, *, given=EXACT, cross=None, walls=AS_DRAWN):
    """What one scan of a full turn at the base makes of a belief, and the figures."""
    model = modelled(floor, (FULL_TURN,), given)
    scan = ContourScan(
        np.where(np.isfinite(ranges), ranges, np.nan).astype(np.float32),
        -math.pi,
        2.0 * math.pi / len(ranges),
        0,
        ObservationModel(0.0, 0.0, 0.0, 1.0, 1.0, 0.0),
        AT_ONCE,
    )
    figures, busy = np.zeros(COLUMNS), None if cross is None else np.zeros(1, np.int64)
    after = observe_contours(
        belief, scan, model, AT_REST, NOT_YET, 0.0, walls, 0, NOTHING_KNOWN, cross, busy, figures, False, False
    )
    return after, figures


def noisy(floor, pose=TRUTH, *, sigma=0.01, seed=0):
    ranges, _ = scan_from(floor, pose)
    return ranges + sigma * np.random.default_rng(seed).standard_normal(len(ranges))


def test_a_match_corrects_like_equations_5_to_9():
    rng = np.random.default_rng(0)
    for _ in range(50):
        root = rng.standard_normal((3, 3)) * (0.1, 0.1, 0.02)
        P, noise = root @ root.T + 1e-6 * np.eye(3), np.diag(rng.uniform(1e-5, 1e-3, 3))
        mean, seen = np.array((3.0, -2.0, 0.3)), np.array((3.05, -2.1, 0.28))
        belief = from_belief(Belief(0, mean, P))
        rows = PoseRows(seen - mean, np.eye(3), np.diag(noise).copy(), np.zeros((3, 2)))
        W = P @ np.linalg.inv(P + noise)
        after = corrected_by_rows(belief, np.zeros((3, 2)), np.zeros(2), rows, np.empty((3, 3)))
        assert mean_of(after) == pytest.approx(mean + W @ (seen - mean), abs=1e-12)
        assert covariance_of(after) == pytest.approx((np.eye(3) - W) @ P, abs=1e-12)
        innovation = seen - mean
        nis = nis_of_rows(belief, np.zeros((3, 2)), np.zeros(2), rows)
        assert nis == pytest.approx(innovation @ np.linalg.solve(P + noise, innovation), rel=1e-9)


def test_considered_constants_correct_like_schmidts_filter_of_the_whole_state():
    rng = np.random.default_rng(1)
    for _ in range(30):
        root = rng.standard_normal((5, 5)) * (0.1, 0.1, 0.02, 0.03, 0.03)
        whole = root @ root.T + 1e-6 * np.eye(5)
        whole[3:, 3:] = np.diag(np.diag(whole)[3:]) + np.eye(2) * 0.01
        H, J, v = rng.standard_normal((2, 3)), rng.standard_normal((2, 2)), rng.uniform(1e-4, 1e-3, 2)
        cross, considered = whole[:3, 3:].copy(), np.diag(whole)[3:].copy()
        residuals, transition = rng.standard_normal(2) * 0.01, np.empty((3, 3))
        belief = from_belief(Belief(0, np.zeros(3), whole[:3, :3]))
        after = corrected_by_rows(belief, cross, considered, PoseRows(residuals, H, v, J), transition)
        mean, full, A = np.zeros(5), whole.copy(), np.eye(3)
        for k in range(2):
            row = np.concatenate((H[k], J[k]))
            gain = full @ row / (row @ full @ row + v[k])
            gain[3:] = 0.0
            mean += gain * (residuals[k] - H[k] @ mean[:3])
            joseph = np.eye(5) - np.outer(gain, row)
            full = joseph @ full @ joseph.T + v[k] * np.outer(gain, gain)
            A = joseph[:3, :3] @ A
        assert mean_of(after) == pytest.approx(mean[:3], abs=1e-12)
        assert covariance_of(after) == pytest.approx(full[:3, :3], abs=1e-12)
        assert cross == pytest.approx(full[:3, 3:], abs=1e-12)
        assert transition == pytest.approx(A, abs=1e-12)


def test_directions_that_fewer_beams_tell_get_no_information():
    second = np.diag((100.0, 1.9, 40.0))
    beams, jacobians = told_directions(second, 5.0, 2.0)
    assert sorted(beams.tolist()) == [40.0, 100.0]
    assert np.abs(jacobians[:, 1]).max() == 0.0
    assert np.abs(jacobians[:, 2]).max() == 5.0
    assert len(told_directions(second, 5.0, 1.8)[0]) == 3


@pytest.mark.parametrize("yaw", [0.0, 0.3])
def test_a_corridor_says_nothing_of_the_place_along_it(yaw):
    floor = corridor(yaw=yaw)
    truth = se2.compose(floor.origin, (30.0, 1.2, 0.2))
    belief = belief_at(np.add(truth, (0.02, 0.02, 0.005)), (0.05, 0.05, 0.02))
    after, figures = observed(floor, belief, noisy(floor, truth))
    assert (figures[USE], figures[ROWS]) == (ACCEPTED, 2)
    along, across = np.array((math.cos(yaw), math.sin(yaw))), np.array((-math.sin(yaw), math.cos(yaw)))
    covariance = covariance_of(after)[:2, :2]
    # To a few hundredths of its information nothing is gained along it: not "little", nothing.
    assert along @ covariance @ along == pytest.approx(0.05**2, rel=0.02)
    assert across @ covariance @ across < 0.003**2
    moved = mean_of(after)[:2] - mean_of(belief)[:2]
    assert abs(along @ moved) < 2e-3
    assert abs(across @ (mean_of(after)[:2] - truth[:2])) < 3e-3


def test_a_round_hall_says_nothing_of_the_heading():
    radius, resolution = 6.0, 0.02
    side = round(2.4 * radius / resolution)
    places = (np.arange(side) + 0.5) * resolution - 1.2 * radius
    away = np.hypot(*np.meshgrid(places, places))
    cells = np.where((away > radius) & (away < radius + 0.2), 100, 0).astype(np.int8)
    floor = FloorMap(cells, resolution, np.array((-1.2 * radius, -1.2 * radius, 0.0)))
    given = dataclasses.replace(EXACT, largest_error=0.5)
    after, figures = observed(
        floor, belief_at((0.02, 0.0, 0.1), (0.05, 0.05, 0.02)), noisy(floor, np.zeros(3)), given=given
    )
    assert (figures[USE], figures[ROWS]) == (ACCEPTED, 2)
    assert covariance_of(after)[2, 2] == pytest.approx(0.02**2, rel=1e-3)


@pytest.mark.parametrize("slope", [0.2, 0.5, 0.785])
def test_a_corridor_aslant_to_the_cells_says_nothing_of_the_place_along_it(slope):
    resolution, side = 0.05, 800
    places = (np.arange(side) + 0.5) * resolution - 20.0
    x, y = np.meshgrid(places, places)
    across = np.abs(y * math.cos(slope) - x * math.sin(slope))
    floor = FloorMap(
        np.where((across > 1.0) & (across < 1.2), 100, 0).astype(np.int8), resolution, np.array((-20.0, -20.0, 0.0))
    )
    truth = np.array((0.1, 0.05, slope))
    after, figures = observed(floor, belief_at(truth, (0.05, 0.05, 0.02)), noisy(floor, truth))
    assert (figures[USE], figures[ROWS]) == (ACCEPTED, 2)
    along = np.array((math.cos(slope), math.sin(slope)))
    assert along @ covariance_of(after)[:2, :2] @ along == pytest.approx(0.05**2, rel=0.05)


def test_the_covariance_of_a_match_is_what_many_matches_scatter():
    floor, wide, nees = room(), (0.05, 0.05, 0.02), []
    for seed in range(200):
        after, figures = observed(floor, belief_at(TRUTH, wide), noisy(floor, seed=seed))
        error = mean_of(after) - TRUTH
        # At corners beams show more than their noise, which the covariance then reckons with.
        assert 0.01 <= figures[SIGMA] < 0.013
        nees.append(error @ np.linalg.solve(covariance_of(after), error) * (figures[SIGMA] / 0.01) ** 2)
    # Chi-square with 600 degrees of freedom is within 15 % in 99 of 100 cases. Noise lies along beams, and less of it
    # across a wall that they meet aslant: the covariance reckons with all of it.
    assert 0.6 < np.mean(nees) / 3.0 < 1.15


def test_a_match_far_from_the_belief_is_rejected_and_one_near_it_accepted():
    floor = room()
    for off, use in ((0.02, ACCEPTED), (0.06, REJECTED)):
        belief = belief_at(np.add(TRUTH, (off, 0.0, 0.0)), (0.01, 0.01, 0.005))
        after, figures = observed(floor, belief, noisy(floor))
        assert figures[USE] == use
        assert (after == belief) is (use == REJECTED)
        # Three degrees of freedom, 0.999.
        assert bool(figures[NIS] > 16.266) is (use == REJECTED)


def test_a_scan_on_things_that_the_map_lacks_is_not_used():
    floor, belief = room(), belief_at(TRUTH, (0.01, 0.01, 0.005))
    ranges = np.where(np.arange(1440) % 10 < 2, noisy(floor), 0.5)
    after, figures = observed(floor, belief, ranges)
    assert figures[USE] == UNMATCHED
    assert figures[MATCHED] < 0.3 * figures[POINTS]
    assert after == belief
    allowed = dataclasses.replace(EXACT, least_matched=0.1)
    assert observed(floor, belief, ranges, given=allowed)[1][USE] == ACCEPTED


def test_the_error_of_a_map_does_not_average_out():
    floor, given = room(), dataclasses.replace(ON, map_sigma=0.02, map_heading_sigma=0.004)
    belief, cross = belief_at(TRUTH, (0.05, 0.05, 0.02)), np.zeros((3, 8))
    for seed in range(50):
        belief, figures = observed(floor, belief, noisy(floor, seed=seed), given=given, cross=cross)
        assert figures[USE] == ACCEPTED
    sigmas = np.sqrt(np.diag(covariance_of(belief)))
    # What the start knew counts as well: 1 / (1 / 20^2 + 1 / 50^2) is 18.6 mm.
    assert sigmas == pytest.approx((0.0186, 0.0186, 0.0039), rel=0.03)


def test_points_of_a_sweep_are_brought_to_the_stamp_of_the_scan():
    floor = room()
    scanner = dataclasses.replace(
        FULL_TURN, mounting=np.array((0.5, -0.2, 0.3)), sweep_duration=0.04, stamp_of=StampOf.LAST, upside_down=True
    )
    twist, model = np.array((1.0, 0.1, 0.8)), modelled(floor, (scanner,), EXACT)
    T_base_points = np.array(((2.0, 1.0), (-1.5, 2.2), (0.3, -3.0)))
    beams, ranges = np.array((30, 700, 1300)), np.full(1440, np.nan, dtype=np.float32)
    bearings = scanner.angle_min + scanner.angle_increment * beams
    # By hand: the point that beam i meets, from where the scanner was at its time.
    points = []
    for beam, bearing in zip(beams, bearings, strict=True):
        ranges[beam] = 3.0
        at = se2.compose(se2.exp(scanner.beam_times[beam] * twist), scanner.mounting)
        points.append(se2.transform_points(at, [[3.0 * math.cos(-bearing), 3.0 * math.sin(-bearing)]])[0])
    after_ns = 10_000_000
    following = NextOdometry(True, after_ns, *se2.exp(0.01 * twist).tolist())
    motion = AT_REST._replace(started=True)
    written = np.empty((1440, 2))
    scan = ContourScan(
        ranges,
        scanner.angle_min,
        scanner.angle_increment,
        0,
        ObservationModel(0.5, -0.2, 0.3, 1.0, 1.0, 0.0),
        sweep_of(scanner),
    )
    count = scan_points(scan, model, motion, following, written)
    assert count == len(T_base_points)
    assert written[:count] * floor.resolution == pytest.approx(np.array(points), abs=1e-9)


def test_blind_sectors_and_ranges_out_of_reach_are_no_points():
    scanner = dataclasses.replace(FULL_TURN, blind_sectors_deg=((10.0, 20.0),), range=(0.5, 10.0))
    ranges = np.full(1440, 5.0, dtype=np.float32)
    ranges[:10], ranges[10:20], ranges[20:30] = 0.4, 10.1, np.nan
    scan = ContourScan(
        ranges, scanner.angle_min, scanner.angle_increment, 0, ObservationModel(0.0, 0.0, 0.0, 1.0, 1.0, 0.0), AT_ONCE
    )
    count = scan_points(scan, modelled(room(), (scanner,), EXACT), AT_REST, NOT_YET, np.empty((1440, 2)))
    assert count == 1440 - 30 - 41


def project_of(*, reflectors: int, contours: ContourParameters, scanners: tuple[Scanner, ...]) -> Project:
    """A small room with up to three reflectors and a straight route through it."""
    known = tuple(Reflector(id=name, x=x, y=y) for name, x, y in (("A", 2.5, 5.5), ("B", 7.5, 2.5), ("C", 8.8, 6.5)))
    segment = Segment(control_points=np.array(((3.0, 3.0), (4.0, 3.2), (5.5, 4.2), (6.5, 4.5))), degree=3)
    return Project(
        floor_map=room(),
        reflectors=ReflectorMap(known[:reflectors]),
        routes=(Route("Through", speed=0.8, segments=(segment,)),),
        scanners=scanners,
        parameters=Parameters(contour=contours),
    )


SWEEPING = Scanner(name="front", resolution_deg=0.5, sweep_duration=0.03, rate=10.0)
REAR = Scanner(name="rear", mounting=np.array((-0.3, 0.1, 3.0)), resolution_deg=1.0, rate=10.0)


@pytest.mark.parametrize("consider", few_of((True, False), (True,)), ids=["constants considered", "white noise alone"])
@pytest.mark.parametrize("scanners", [(SWEEPING,), (SWEEPING, REAR)], ids=["one scanner", "two scanners"])
def test_whole_run_with_contours_equals_the_live_localizer_to_the_last_bit(scanners, consider):
    project = project_of(reflectors=3, contours=ON, scanners=scanners)
    project = dataclasses.replace(
        project, parameters=dataclasses.replace(project.parameters, filter=FilterParameters(consider=consider))
    )
    log, start = virtual_drive(project, "Through", seed=1), start_of(project, "Through")
    initial, setup = Belief(0, start.pose, np.diag(start.sigmas**2)), LocalizerSetup.of(project)
    columns, localizer = run(log, setup, initial), Localizer(setup, initial)
    estimates = [estimate for record in log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    assert (columns.contours[:, USE] == ACCEPTED).mean() > 0.9
    for cycle, estimate in enumerate(estimates):
        assert bits(estimate.posterior) == bits(columns.estimate(cycle).posterior)
        assert estimate.contours is not None
        assert estimate.contours.tobytes() == columns.contours[cycle].tobytes()
        assert estimate.mode == columns.modes[cycle]
    assert localizer.state == columns.final
    half = state_before(columns, log, len(columns) // 2)
    assert half.tracking.belief == from_belief(columns.estimate(len(columns) // 2 - 1).posterior)


def test_contours_switched_on_along_the_way_count_from_there_on():
    project = project_of(reflectors=3, contours=ON, scanners=(SWEEPING,))
    log, start = virtual_drive(project, "Through", seed=2), start_of(project, "Through")
    initial, on = Belief(0, start.pose, np.diag(start.sigmas**2)), LocalizerSetup.of(project)
    off = dataclasses.replace(on, parameters=Parameters())
    plain = run(log, off, initial)
    assert plain.contours.shape == (0, COLUMNS)
    assert plain.estimate(3).contours is None
    mixed = run_segments(log, (RunSegment(0, off), RunSegment(20, on)), initial, earlier=plain)
    assert mixed.means[:20].tobytes() == plain.means[:20].tobytes()
    assert not mixed.contours[:20].any()
    assert (mixed.contours[20:, USE] == ACCEPTED).all()
    again = run_segments(log, (RunSegment(0, off), RunSegment(20, on)), initial)
    assert again.means.tobytes() == mixed.means.tobytes()
    assert again.contours.tobytes() == mixed.contours.tobytes()


def test_without_a_floor_map_contours_are_not_looked_at():
    project = project_of(reflectors=3, contours=ON, scanners=(SWEEPING,))
    assert LocalizerSetup.of(project).contour is not None
    assert LocalizerSetup.of(dataclasses.replace(project, floor_map=None)).contour is None
