"""Temporary landmarks against textbooks: Taubin's eigenvalues, a plain EKF-SLAM, finite differences, a moved hall."""

# pyright: basic

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy.linalg import eig

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.localization.contour import ContourScan
from commission.localization.corners import CornerRule, corner_of
from commission.localization.estimate import Belief
from commission.localization.growing_run import GrowingRun
from commission.localization.observation import observation_model
from commission.localization.odometry import AT_REST, NOT_YET
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reels import ReelRule, Sighting, arc_angle, cut_into_segments, reel_of, taubin_circle
from commission.localization.setup import LocalizerSetup
from commission.localization.sweep import AT_ONCE
from commission.localization.temporary import MOST_SEEN, ScanGoods, sightings_of
from commission.localization.temporary_joint import (
    add_landmark,
    carry_landmarks,
    correct_jointly,
    drop_landmark,
    innovation_of,
    jacobian_of,
    pose_in,
    put_pose,
)
from commission.localization.temporary_life import look_for_missing
from commission.localization.temporary_memory import MISSES, POSE, SEEN_NS, landmarks_in, memory_of
from commission.localization.temporary_model import temporary_model
from commission.localization.whole_run import run, run_segments
from commission.site.disturbances import Reel
from commission.site.parameters import FilterParameters, ObservationParameters, TemporaryParameters
from commission.site.scanner import Scanner
from tests.localization.plain_slam import PlainSlam
from tests.paper_warehouse import SCANNER, yard

RULE = ReelRule(8, 0.3, 0.9, 0.04, 1.4, 3.5, 0.01)
CORNER = CornerRule(True, 0.25, 2.0, 0.04, 0.15, 0.01)
ON = TemporaryParameters(enabled=True)


def arc(radius: float, angle: float, count: int, center=(6.0, 2.0)) -> np.ndarray:
    """Points of a circle on the side that faces the origin, in the order of their beams."""
    towards = math.atan2(-center[1], -center[0])
    at = towards + np.linspace(0.5 * angle, -0.5 * angle, count)
    return np.array(center) + radius * np.stack((np.cos(at), np.sin(at)), axis=1)


def plain_taubin(points: np.ndarray) -> tuple[float, float, float]:
    """Taubin 1991 by the generalized eigenvalues of scatter and gradients of (x^2 + y^2, x, y, 1)."""
    mean = points.mean(axis=0)
    x, y = (points - mean).T
    z = x * x + y * y
    rows = np.stack((z, x, y, np.ones(len(x))), axis=1)
    scatter = rows.T @ rows / len(x)
    # f = A z + B x + C y + D has the squared gradient 4 A^2 z + 4 A B x + 4 A C y + B^2 + C^2.
    gradients = np.zeros((4, 4))
    gradients[0, 0] = 4.0 * z.mean()
    gradients[0, 1] = gradients[1, 0] = 2.0 * x.mean()
    gradients[0, 2] = gradients[2, 0] = 2.0 * y.mean()
    gradients[1, 1] = gradients[2, 2] = 1.0
    solved = eig(scatter, gradients)
    values, vectors = np.real(np.asarray(solved[0])), np.real(np.asarray(solved[1]))
    usable = np.where(np.isfinite(values) & (values > -1e-12), values, np.inf)
    a, b, c, d = vectors[:, int(np.argmin(usable))]
    cx, cy = -b / (2.0 * a), -c / (2.0 * a)
    return cx + mean[0], cy + mean[1], math.sqrt(cx * cx + cy * cy - d / a)


def kasa(points: np.ndarray) -> float:
    """Radius of the algebraic fit, for comparison."""
    x, y = points.T
    cx, cy, d = np.linalg.lstsq(np.stack((2 * x, 2 * y, np.ones(len(x))), axis=1), x * x + y * y, rcond=None)[0]
    return math.sqrt(d + cx * cx + cy * cy)


@pytest.mark.parametrize("angle", [0.6, 1.5, 2.8, 6.0])
def test_the_circle_is_that_of_the_eigenvalues(angle):
    rng = np.random.default_rng(round(10 * angle))
    for _ in range(20):
        points = arc(rng.uniform(0.2, 2.0), angle, 25, rng.uniform(-9.0, 9.0, 2)) + rng.normal(0.0, 0.01, (25, 2))
        circle = taubin_circle(points)
        np.testing.assert_allclose((circle.x, circle.y, circle.radius), plain_taubin(points), rtol=0.0, atol=1e-6)


def test_the_circle_of_exact_points_is_exact_and_points_on_a_line_have_none():
    circle = taubin_circle(arc(0.6, 1.5, 12))
    np.testing.assert_allclose((circle.found, circle.x, circle.y, circle.radius), (True, 6.0, 2.0, 0.6), atol=1e-9)
    for line in (np.stack((np.linspace(0, 1, 9), np.ones(9)), axis=1), np.ones((5, 2)), np.ones((2, 2))):
        assert not reel_of(np.repeat(line, 2, axis=0), 0.0, 0.0, RULE).found


def test_short_arcs_are_hardly_biased_where_the_algebraic_fit_is():
    """20 beams on a reel of 0.6 m with 5 mm of noise: mean radius over 400 arcs, in millimetres from the truth."""
    rng, bias = np.random.default_rng(3), {}
    for angle in (1.0, 1.57, 2.6):
        noisy = [arc(0.6, angle, 20) + rng.normal(0.0, 0.005, (20, 2)) for _ in range(400)]
        mine = 1e3 * (np.mean([taubin_circle(each).radius for each in noisy]) - 0.6)
        bias[angle] = (mine, 1e3 * (np.mean([kasa(each) for each in noisy]) - 0.6))
    assert abs(bias[1.0][0]) < 5.0, "57 degrees: Taubin's is off by less than its 1-sigma"
    assert abs(bias[1.57][0]) < 1.5 and abs(bias[2.6][0]) < 0.5
    assert -bias[1.0][1] > 10.0 and abs(bias[1.57][1]) > 3.0 * abs(bias[1.57][0])


def test_each_test_of_a_reel_rejects_on_its_side_of_the_limit():
    good = arc(0.6, 2.0, 20)
    assert reel_of(good, 0.0, 0.0, RULE).found
    assert not reel_of(good[:7], 0.0, 0.0, RULE).found, "too few points"
    for radius, found in ((0.29, False), (0.31, True), (0.89, True), (0.91, False)):
        assert reel_of(arc(radius, 2.0, 20), 0.0, 0.0, RULE).found is found
    for angle, found in ((1.39, False), (1.41, True), (3.49, True), (3.51, False)):
        assert reel_of(arc(0.6, angle, 20), 0.0, 0.0, RULE).found is found
        assert arc_angle(arc(0.6, angle, 20), 6.0, 2.0) == pytest.approx(angle, abs=1e-9)
    zigzag = good + np.where(np.arange(20) % 2, 1.0, -1.0)[:, np.newaxis] * (good - (6.0, 2.0)) / 0.6 * 0.045
    assert not reel_of(zigzag, 0.0, 0.0, RULE).found, "residual above 40 mm"
    assert reel_of(zigzag, 0.0, 0.0, RULE._replace(largest_residual=0.05)).found
    hollow = np.array((6.0, 2.0)) - (good - (6.0, 2.0))
    assert not reel_of(hollow, 0.0, 0.0, RULE).found, "concave"


def test_a_corner_is_where_its_sides_meet_and_points_outwards():
    def corner(turn: float, opening: float = 0.5 * math.pi, side: float = 0.8) -> np.ndarray:
        """Sighting from the origin, at (5, 1), its two sides leading away from there."""
        ways = np.linspace(0.0, side, 15)
        a, b = turn + 0.5 * opening, turn - 0.5 * opening
        first = ways[::-1, np.newaxis] * (math.cos(a), math.sin(a))
        second = ways[1:, np.newaxis] * (math.cos(b), math.sin(b))
        return np.array((5.0, 1.0)) + np.concatenate((first, second))

    seen = corner_of(corner(0.3), 0.0, 0.0, CORNER)
    np.testing.assert_allclose((seen.found, seen.x, seen.y), (True, 5.0, 1.0), atol=1e-9)
    assert abs(wrap(np.array(seen.shape - 0.3 - math.pi))) < 1e-9
    for off, found in ((0.14, True), (0.16, False), (-0.14, True), (-0.16, False)):
        assert corner_of(corner(0.3, 0.5 * math.pi + off), 0.0, 0.0, CORNER).found is found
    for side, found in ((0.24, False), (0.26, True), (1.99, True), (2.01, False)):
        assert corner_of(corner(0.3, side=side), 0.0, 0.0, CORNER).found is found
    assert not corner_of(corner(0.3 + math.pi), 0.0, 0.0, CORNER).found, "concave"
    assert not corner_of(corner(0.3)[:6], 0.0, 0.0, CORNER).found, "too few points"
    assert not corner_of(corner(0.3), 0.0, 0.0, CORNER._replace(enabled=False)).found
    rng = np.random.default_rng(1)
    rough = corner(0.3) + rng.normal(0.0, 0.06, (29, 2))
    assert not corner_of(rough, 0.0, 0.0, CORNER).found, "sides rougher than 40 mm"


def test_places_are_as_uncertain_as_they_scatter():
    """NEES of centers and of corners over 600 scans with the noise that is said: 1 within three of its own sigma."""
    rng, sides = np.random.default_rng(5), np.linspace(0.0, 0.8, 15)
    square = np.concatenate((sides[::-1, np.newaxis] * (0.6, 0.8), sides[1:, np.newaxis] * (0.8, -0.6)))
    for truth, exact, see in (
        ((6.0, 2.0), arc(0.6, 2.4, 25), lambda p: reel_of(p, 0.0, 0.0, RULE)),
        ((5.0, 1.0), np.array((5.0, 1.0)) + square, lambda p: corner_of(p, 0.0, 0.0, CORNER)),
    ):
        nees = []
        for _ in range(600):
            seen = see(exact + rng.normal(0.0, 0.01, exact.shape))
            off = np.array((seen.x, seen.y)) - truth
            nees.append(off @ np.linalg.solve(((seen.xx, seen.xy), (seen.xy, seen.yy)), off) / 2.0)
        # The fit takes the larger of what is said and what is seen, and a corner's cut goes by its noise.
        assert 0.75 < np.mean(nees) < 1.15


def test_two_reels_that_touch_are_two():
    bearings = np.radians(np.arange(-20.0, 20.0, 0.4))
    ahead = np.stack((np.cos(bearings), np.sin(bearings)), axis=1)
    ranges = np.full(len(bearings), np.inf)
    for center in ((6.0, 0.6), (6.0, -0.6)):
        along, across = ahead @ center, ahead[:, 0] * center[1] - ahead[:, 1] * center[0]
        ranges = np.minimum(
            ranges, np.where(np.abs(across) < 0.6, along - np.sqrt(np.maximum(0.36 - across**2, 0)), np.inf)
        )
    points = (ranges[:, np.newaxis] * ahead)[np.isfinite(ranges)]
    points = points + np.random.default_rng(4).normal(0.0, 0.01, points.shape)
    starts = np.empty(len(points) + 1, np.int64)
    pieces = cut_into_segments(points, len(points), 0.3, 0.0, 0.0, starts)
    found = [reel_of(points[a:b], 0.0, 0.0, RULE) for a, b in itertools.pairwise(starts[: pieces + 1])]
    assert sorted(round(each.y, 1) for each in found if each.found) == [-0.6, 0.6]


def gaussian(mean, P) -> PoseGaussian:
    x, y, theta = mean[:3]
    return PoseGaussian(x, y, theta, P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2])


def test_a_drive_with_landmarks_is_that_of_a_plain_ekf_slam():
    """200 steps of odometry, a reflector now and then, sightings, births and losses, in an order drawn from a seed."""
    rng = np.random.default_rng(11)
    plain = PlainSlam((1.0, 2.0, 0.5), np.diag((0.01, 0.02, 0.001)))
    memory, belief = memory_of(None, 12), gaussian(plain.mean, plain.P)
    put_pose(memory, belief)
    for _ in range(200):
        moved, Q = rng.normal(0.0, 0.2, 3), np.diag(rng.uniform(1e-5, 1e-3, 3))
        F = np.array(((1.0, 0.0, -moved[1]), (0.0, 1.0, moved[0]), (0.0, 0.0, 1.0)))
        mean, P = plain.mean[:3] + moved, F @ plain.P[:3, :3] @ F.T + Q
        prior = posterior = gaussian((mean[0], mean[1], wrap(mean[2])), P)
        plain.predict(moved, Q)
        if rng.random() < 0.4:
            # A row that tells of the pose alone, as a reflector does.
            H, residual, variance = rng.normal(size=(1, 3)), rng.normal(0.0, 0.05, 1), np.array([[0.01]])
            S = H @ P @ H.T + variance
            K = P @ H.T / S
            after = np.array(prior[:3]) + (K @ residual)
            posterior = gaussian((after[0], after[1], wrap(after[2])), (np.eye(3) - K @ H) @ P)
            plain.correct(residual, np.hstack((H, np.zeros((1, len(plain.mean) - 3)))), variance)
        assert carry_landmarks(memory, prior, posterior, False)
        put_pose(memory, posterior)
        for k in range((len(plain.mean) - 3) // 2):
            if rng.random() < 0.3:
                z, R = rng.normal(0.0, 3.0, 2), np.diag(rng.uniform(1e-4, 1e-2, 2)) + 2e-5
                seen = Sighting(True, z[0], z[1], R[0, 0], R[0, 1], R[1, 1], 0.6)
                v = innovation_of(memory, k, seen)
                correct_jointly(memory, k, v, False)
                assert v.nis == pytest.approx(plain.sight(k, z, R), rel=1e-6)
        count = (len(plain.mean) - 3) // 2
        if count < 12 and rng.random() < 0.3:
            z, R = rng.normal(0.0, 5.0, 2), np.array(((2e-4, 5e-5), (5e-5, 1e-4)))
            assert add_landmark(memory, Sighting(True, z[0], z[1], R[0, 0], R[0, 1], R[1, 1], 0.6)) == count
            plain.add(z, R)
        elif count and rng.random() < 0.1:
            k = int(rng.integers(count))
            drop_landmark(memory, k)
            plain.drop(k)
        n = len(plain.mean)
        found = np.tril(memory.covariance[:n, :n])
        found += np.tril(found, -1).T
        scale = np.sqrt(np.diag(plain.P))
        np.testing.assert_allclose(memory.mean[:n], plain.mean, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(
            found / np.outer(scale, scale), plain.P / np.outer(scale, scale), rtol=0.0, atol=1e-6
        )
    assert len(plain.mean) > 15 and min(np.linalg.eigvalsh(found)) > 0.0


def test_the_jacobian_is_that_of_finite_differences():
    rng = np.random.default_rng(2)
    for _ in range(20):
        memory = memory_of(None, 3)
        memory.counts[0] = 3
        memory.mean[:] = rng.uniform(-5.0, 5.0, 9)
        memory.mean[2] = rng.uniform(-3.0, 3.0)
        for slot in range(3):
            _, _, H = jacobian_of(memory, slot)
            for column, index in enumerate((0, 1, 2, 3 + 2 * slot, 4 + 2 * slot)):
                sides = []
                for step in (1e-6, -1e-6):
                    other = memory._replace(mean=memory.mean.copy())
                    other.mean[index] += step
                    sides.append(np.array(jacobian_of(other, slot)[:2]))
                np.testing.assert_allclose((sides[0] - sides[1]) / 2e-6, H[:, column], atol=1e-7)


@pytest.fixture(scope="module")
def driven():
    return yard(1)


def setup_of(driven, *, kind: str = "ekf", **changes) -> LocalizerSetup:
    own = TemporaryParameters(enabled=True, **changes)
    parameters = dataclasses.replace(driven.project.parameters, temporary=own, filter=FilterParameters(kind=kind))
    return dataclasses.replace(LocalizerSetup.of(driven.project), parameters=parameters)


def errors(columns, log) -> np.ndarray:
    """(K, 3) estimate less truth [m, m, rad]."""
    off = columns.means - log.reference_poses[np.searchsorted(log.reference_stamps_ns, columns.stamps_ns)]
    off[:, 2] = wrap(off[:, 2])
    return off


def same(one, other) -> bool:
    return all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes()
        for name in ("means", "covariances", "modes", "temporary", "status", "d2")
    )


def test_a_live_localizer_remembers_the_same_landmarks_to_the_last_bit(driven):
    setup = setup_of(driven)
    whole = run(driven.log, setup, driven.start)
    live = GrowingRun(setup, driven.start)
    for record in driven.log.records():
        live.feed(record)
    live.flush()
    assert same(live.columns(), whole)
    assert live.columns().final == whole.final and whole.final.temporary is not None
    assert len(whole.final.temporary) >= 6
    np.testing.assert_array_equal(np.array(whole.estimate(40).temporary), whole.temporary[40])
    # What is changed on the way is gone over from there, to the last bit.
    fewer = dataclasses.replace(whole.segments[0], first=60, setup=setup_of(driven, most=4))
    segments = (whole.segments[0], fewer)
    resumed = run_segments(driven.log, segments, driven.start, earlier=whole)
    assert same(resumed, run_segments(driven.log, segments, driven.start))
    assert resumed.final.temporary is not None and len(resumed.final.temporary) == 4


def test_without_the_kind_nothing_is_remembered_and_nothing_changes(driven):
    off = run(driven.log, LocalizerSetup.of(driven.project), driven.start)
    none = run(driven.log, setup_of(driven, most=0), driven.start)
    assert off.temporary.shape == (0, 9) and off.final.temporary is None
    assert none.means.tobytes() == off.means.tobytes() and none.covariances.tobytes() == off.covariances.tobytes()
    with_them = run(driven.log, setup_of(driven), driven.start)
    assert with_them.covariances[-1, 2, 2] < 0.5 * off.covariances[-1, 2, 2]


def test_a_hall_that_is_moved_and_turned_gives_the_same_drive_in_it(driven):
    """Rounding of other coordinates is all that differs; sightings are in base and do not know the hall."""
    T = np.array((-40.0, 25.0, 2.0))
    posts = [
        dataclasses.replace(r, x=x, y=y)
        for r, (x, y) in zip(
            driven.project.reflectors.reflectors,
            se2.transform_points(T, driven.project.reflectors.centers).tolist(),
            strict=True,
        )
    ]
    setup = setup_of(driven)
    moved = dataclasses.replace(setup, reflectors=dataclasses.replace(setup.reflectors, reflectors=tuple(posts)))
    c, s = math.cos(T[2]), math.sin(T[2])
    turned = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    start = Belief(0, se2.compose(T, driven.start.mean), turned @ driven.start.covariance @ turned.T)
    here, there = run(driven.log, setup, driven.start), run(driven.log, moved, start)
    off = there.means - se2.compose(T, here.means)
    off[:, 2] = wrap(off[:, 2])
    assert np.abs(off).max() < 1e-6
    np.testing.assert_allclose(there.temporary, here.temporary, rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(turned @ here.covariances @ turned.T, there.covariances, rtol=0.0, atol=1e-9)


@pytest.mark.with_all_seeds
def test_the_invariant_filter_remembers_them_as_well(driven):
    ekf, invariant = (run(driven.log, setup_of(driven, kind=kind), driven.start) for kind in ("ekf", "invariant"))
    assert np.abs(errors(invariant, driven.log) - errors(ekf, driven.log)).max() < 0.02
    assert invariant.covariances[-1, 2, 2] == pytest.approx(ekf.covariances[-1, 2, 2], rel=0.3)


def test_reels_that_are_carried_break_nothing():
    """Slower and faster than a gate, all in sight: each begins to move once it is a landmark, two of nine at a time."""
    standing = [(10.0, -3.5), (13.0, 3.5), (16.0, -3.5), (16.0, 3.5), (19.0, 3.5)]
    moving = [(9.0, 3.5, 0.02), (12.0, -3.5, 0.1), (14.5, -3.5, 0.4), (18.0, -3.5, 1.5)]
    goods = [Reel(x=x, y=y) for x, y in standing]
    goods += [Reel(x=x, y=y, carried=4.0, to_x=x + 20.0, to_y=y, speed=speed) for x, y, speed in moving]
    for seed in (1, 2):
        here = yard(seed, tuple(goods))
        columns = run(here.log, setup_of(here), here.start)
        off = errors(columns, here.log)
        sigmas = np.sqrt(columns.covariances[:, (0, 1, 2), (0, 1, 2)])
        assert np.abs(off / sigmas).max() < 4.0, "the truth stays inside of what the filter believes"
        assert columns.temporary[:, 5].sum() > 0, "some were forgotten"


def test_a_reel_that_vanishes_is_forgotten_and_one_that_is_hidden_is_not():
    gone = tuple(Reel(x=x, y=y, vanishes=6.0 if y > 4.0 else 0.0) for x in (10.0, 13.0, 16.0) for y in (-3.5, 3.5, 5.5))
    here = yard(1, gone)
    columns = run(here.log, setup_of(here), here.start)
    known = columns.final.temporary
    assert known is not None
    assert (known.places_map[:, 1] < 4.5).all(), "nothing is left of what is gone"
    assert (np.diff(known.marks[:, SEEN_NS]) != 0).any() or len(known) > 3


@pytest.mark.parametrize(("blind", "misses"), [((), 1), ((-20.0, 20.0), 0), ((20.0, 60.0), 1)])
def test_a_landmark_behind_the_vehicle_itself_is_not_missed(blind, misses):
    scanner = Scanner(field_of_view_deg=(-90.0, 90.0), blind_sectors_deg=(blind,) if blind else ())
    model, memory = temporary_model((scanner,), ON), memory_of(None, 4)
    put_pose(memory, PoseGaussian(0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4))
    add_landmark(memory, Sighting(True, 5.0, 0.0, 1e-4, 0.0, 1e-4, 0.6))
    # A beam that the vehicle stops comes back as nothing, like one that meets nothing.
    scan = scan_of(np.full(scanner.beam_count, np.nan), scanner)
    look_for_missing(memory, np.zeros(4, np.bool_), model, scan)
    assert memory.marks[0, MISSES] == misses


def scan_of(ranges: np.ndarray, scanner: Scanner) -> ContourScan:
    mount = observation_model(scanner, ObservationParameters())
    ranges = np.asarray(ranges, dtype=np.float32)
    return ContourScan(ranges, scanner.angle_min, scanner.angle_increment, 0, mount, AT_ONCE, len(ranges))


@pytest.mark.parametrize(
    "ranges",
    [[], [5.0], np.full(541, np.nan), np.full(541, 5.0), 3.0 / np.cos(np.linspace(-1.4, 1.4, 541)), np.full(541, 0.0)],
    ids=["no beam", "one beam", "no echo", "a round wall", "a straight wall", "too near"],
)
def test_of_a_scan_without_goods_nothing_is_seen(ranges):
    model = temporary_model((SCANNER,), ON)
    assert model is not None
    found = ScanGoods(np.empty(MOST_SEEN, np.int64), np.empty((MOST_SEEN, 6)))
    assert sightings_of(scan_of(ranges, SCANNER), model, AT_REST, NOT_YET, found) == 0


def test_what_is_remembered_goes_through_its_value_unchanged_and_of_too_many_the_last_seen_stay():
    memory = memory_of(None, 4)
    put_pose(memory, PoseGaussian(0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4))
    for k in range(4):
        add_landmark(memory, Sighting(True, 3.0 + k, 1.0, 1e-4, 0.0, 1e-4, 0.6))
        memory.marks[k, SEEN_NS] = (30, 10, 40, 20)[k]
    value = landmarks_in(memory)
    assert landmarks_in(memory_of(value, 4)) == landmarks_in(memory_of(value, 9)) == value
    fewer = landmarks_in(memory_of(value, 2))
    assert value is not None and fewer is not None
    np.testing.assert_array_equal(fewer.places_map[:, 0], (3.0, 5.0))
    np.testing.assert_array_equal(fewer.place_covariances, value.place_covariances[[0, 2]])
    assert landmarks_in(memory_of(None, 4)) is None
    assert pose_in(memory).xx == 1e-4 and POSE == 3
