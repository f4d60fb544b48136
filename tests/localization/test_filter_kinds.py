"""Every kind of filter corrects as its paper has it, with and without considered constants, live as over whole runs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from commission.geometry import se2
from commission.geometry.directions import direction_of
from commission.localization.consider import BLOCKS, Considering, ConsiderModel, ConstantsRoom
from commission.localization.filter_kinds import FILTER_KINDS, correct_by, filter_kind
from commission.localization.localizer import Localizer
from commission.localization.observation import ObservationModel
from commission.localization.odometry import odometry_noise, predict
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, mean_of
from commission.localization.whole_run import run
from commission.site.parameters import FilterParameters, OdometryParameters, Parameters
from tests.conftest import few_of
from tests.localization import plain_filters
from tests.localization.drives import Plan, random_drive
from tests.localization.plain_observation import Array, observed
from tests.localization.test_whole_run import assert_same_estimate, setup_of

MOUNTING = np.array([0.4, -0.2, 0.3])
SIGMAS = (0.02, 0.004)
MODEL = ObservationModel(*MOUNTING.tolist(), SIGMAS[0] ** 2, SIGMAS[1] ** 2, 0.0)
R = np.diag(np.square(SIGMAS))
every_kind = pytest.mark.parametrize("kind", FILTER_KINDS)


def belief_of(mean: Array, cov: Array) -> PoseGaussian:
    numbers = (*mean, cov[0, 0], cov[0, 1], cov[0, 2], cov[1, 1], cov[1, 2], cov[2, 2])
    return PoseGaussian(*(float(each) for each in numbers))


KNOWN = ConsiderModel(4e-6, 1e-6, 9e-6, 1e-4)


def corrected(kind: str, belief: PoseGaussian, z: Array, place: Array, constants=(None, 0, 0)):
    aim = direction_of(MODEL.mount_theta + float(z[1]))
    where = (float(place[0]), float(place[1]), 0.0)
    number = filter_kind(FilterParameters(kind=kind))
    return correct_by(number, belief, direction_of(belief.theta), float(z[0]), aim, *where, MODEL, *constants).belief


def drawn(seed: int) -> tuple[Array, Array, Array, Array]:
    """A belief that went astray on its way, the detection of a reflector, and its place."""
    rng = np.random.default_rng(seed)
    spread = np.exp(rng.uniform([-6, -6, -6], [0.5, 0.5, -1.5]))
    root = rng.normal(size=(3, 3)) * spread[:, np.newaxis]
    mean, cov = rng.uniform([-5, -5, -3], [5, 5, 3]), root @ root.T + np.diag(1e-6 * spread**2)
    true = mean + np.linalg.cholesky(cov) @ rng.normal(size=3)
    place = true[:2] + rng.uniform(4.0, 20.0) * np.array(direction_of(float(rng.uniform(-math.pi, math.pi))))
    return mean, cov, observed(true, MOUNTING, place[np.newaxis])[0] + rng.normal(size=2) * SIGMAS, place


@every_kind
@settings(max_examples=100)
@given(seed=st.integers(0, 2**32 - 1))
def test_correction_is_that_of_the_textbook(kind: str, seed: int) -> None:
    mean, cov, z, place = drawn(seed)
    belief = belief_of(mean, cov)
    after = corrected(kind, belief, z, place)
    expected_mean, expected_cov = plain_filters.KINDS[kind](mean, cov, z, place, MOUNTING, R)
    step = np.abs(mean_of(after) - mean)
    # Of a turn by more than this, no two linearizations need lead to the same place.
    assume(step[2] < 2.0)
    # A turn about the origin of the map moves the mean by its way, and carries what is unknown of the heading along.
    sigmas = np.sqrt(np.diag(cov))
    reach = sigmas + sigmas[2] * np.array([step[1], step[0], 0.0])
    off = mean_of(after) - expected_mean
    off[2] = math.remainder(off[2], 2.0 * math.pi)
    # Derivatives by differences are good to 1e-8 or so; a belief may be 10,000 times wider than the noise.
    assert np.abs(off / reach).max() < 1e-4
    assert np.abs((covariance_of(after) - expected_cov) / np.outer(reach, reach)).max() < 1e-5
    assert np.linalg.eigvalsh(covariance_of(after) / np.outer(sigmas, sigmas)).min() > -1e-10


@every_kind
def test_what_agrees_with_the_belief_corrects_it_alike_whatever_the_kind(kind: str) -> None:
    mean, cov = np.array([1.0, 2.0, 0.5]), np.diag([1e-4, 2e-4, 1e-6])
    place = np.array([8.0, 5.0])
    z = observed(mean, MOUNTING, place[np.newaxis])[0]
    own, paper = (corrected(each, belief_of(mean, cov), z, place) for each in (kind, "ekf"))
    assert mean_of(own) == pytest.approx(mean_of(paper), abs=1e-5)
    assert covariance_of(own) == pytest.approx(covariance_of(paper), rel=2e-3, abs=1e-10)


@every_kind
def test_considered_constants_correct_like_schmidts_filter_of_the_whole_state(kind: str) -> None:
    # Constants add to range and bearing by their own Jacobian; with it and the pose's (of a tiny innovation, where all
    # kinds have the same), one dense Kalman filter whose constants have no gain.
    rng = np.random.default_rng(5)
    for _ in range(20):
        mean, place = rng.uniform([-5, -5, -3], [5, 5, 3]), rng.uniform(8.0, 15.0, 2)
        root = rng.normal(size=(3, 3)) * [[1e-3], [1e-3], [1e-4]]
        cov = root @ root.T
        numbers = [[3e-7], [3e-7], [3e-8]] * rng.normal(size=(3, BLOCKS + 2))
        reference = numbers.copy()
        own, papers = (
            Considering(KNOWN, 0.0, 0.0, 0.4, 0.1, 0.2, ConstantsRoom(np.empty((3, 0)), work, None))
            for work in (numbers, reference)
        )
        z = observed(mean, MOUNTING, place[np.newaxis])[0] + 1e-4 * rng.normal(size=2)
        after = corrected(kind, belief_of(mean, cov), z, place, (own, BLOCKS + 2, BLOCKS))
        paper = corrected("ekf", belief_of(mean, cov), z, place, (papers, BLOCKS + 2, BLOCKS))
        assert mean_of(after) == pytest.approx(mean_of(paper), abs=2e-6)
        sigmas = np.sqrt(np.diag(cov))
        off = (covariance_of(after) - covariance_of(paper)) / np.outer(sigmas, sigmas)
        assert np.abs(off).max() < 2e-3
        # Each constant has a 1-sigma of some millimetres or milliradians.
        assert np.abs((numbers - reference) / sigmas[:, np.newaxis]).max() < 1e-5


@every_kind
@pytest.mark.parametrize("consider", few_of((True, False), (True,)), ids=["constants considered", "white noise alone"])
def test_whole_run_equals_the_live_localizer_to_the_last_bit(kind: str, consider: bool) -> None:
    rng = np.random.default_rng(3)
    parameters = Parameters(filter=FilterParameters(kind=kind, consider=consider))
    setup = setup_of(rng, parameters, 2)
    drive = random_drive(setup, rng, Plan(scans=150, scan_offset_ns=7_000_000))
    arrays, localizer = run(drive.log, setup, drive.initial), Localizer(setup, drive.initial)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, arrays.estimate(cycle))
    assert localizer.state == arrays.final
    errors = np.hypot(*(arrays.means - drive.truth)[:, :2].T)
    # As all kinds do where several reflectors are in sight: they differ by the square of the innovations.
    assert 0.002 < math.sqrt(float(np.mean(errors**2))) < 0.03


def test_kinds_differ_and_an_unknown_one_is_refused() -> None:
    rng = np.random.default_rng(3)
    setup = setup_of(rng)
    drive = random_drive(setup, rng, Plan(scans=50))
    ways = [
        run(drive.log, replace(setup, parameters=Parameters(filter=FilterParameters(kind=kind))), drive.initial).means
        for kind in FILTER_KINDS
    ]
    assert len({way.tobytes() for way in ways}) == len(FILTER_KINDS)
    with pytest.raises(ValueError, match=r"filter.kind is 'kalman'; expected 'ekf' or 'ukf' or 'ckf' or 'invariant'"):
        FilterParameters(kind="kalman")


def test_seeing_one_reflector_again_and_again_never_tells_a_turn_about_it() -> None:
    # The variance along the turn about the reflector must not fall: one reflector cannot tell it. With range and
    # bearing of one reflector, a vehicle knows where it is but for that turn.
    mean, place = np.array([0.0, 0.0, 0.0]), np.array([10.0, 3.0])
    cov = np.array([[0.04, 0.0, 0.0], [0.0, 0.5, 0.02], [0.0, 0.02, 0.01]])
    left: dict[str, float] = {}
    for kind in ("ekf", "invariant"):
        rng, belief = np.random.default_rng(1), belief_of(mean, cov)
        true = np.array([0.1, 0.6, 0.08])
        for _ in range(200):
            z = observed(true, MOUNTING, place[np.newaxis])[0] + rng.normal(size=2) * SIGMAS
            belief = corrected(kind, belief, z, place)
        left[kind] = covariance_of(belief)[2, 2]
    # By hand: information of place and heading, of the turn about the reflector alone: 1 / (t^T P^-1 t).
    turn = np.array([3.0, -10.0, 1.0])
    told = 1.0 / (turn @ np.linalg.solve(cov, turn))
    assert left["invariant"] == pytest.approx(told, rel=0.02)
    assert left["ekf"] < 0.9 * told


def test_spread_of_a_long_way_is_that_of_the_motions_that_may_have_happened() -> None:
    # 120 m straight on in steps of one metre: the covariance of the twists of 4,000 drawn ways, about where the vehicle
    # is believed to be. Without the terms of the arc, the variance along the way is less than half of it.
    rng, ways, sigmas = np.random.default_rng(2), 4000, np.array([0.01, 0.003, 0.006])
    parameters = OdometryParameters(
        **dict(zip(("forward_per_sqrt_m", "lateral_per_sqrt_m", "heading_per_sqrt_m"), sigmas.tolist(), strict=True)),
        forward_per_sqrt_s=0.0,
        heading_per_sqrt_s=0.0,
    )
    spread: dict[float, Array] = {}
    for curved in (0.0, 1.0):
        belief = PoseGaussian(*9 * [0.0])
        for _ in range(120):
            belief = predict(belief, 1.0, 0.0, 0.0, 1.0, odometry_noise(parameters)._replace(curved=curved))
        spread[curved] = covariance_of(belief)
    poses, half = np.zeros((ways, 3)), np.array([0.25, 0.0, 0.0])
    for _ in range(240):
        errors = math.sqrt(0.5) * sigmas * rng.normal(size=(ways, 3))
        poses = se2.compose(poses, se2.compose(se2.compose(half, errors), half))
    off = np.column_stack((poses[:, :2] - [120.0, 0.0], poses[:, 2]))
    drawn_spread = np.cov(se2.log(off).T)
    for i in range(3):
        # A variance of 4,000 draws is known to 2.2 %, of a skewed one less well.
        assert spread[1.0][i, i] == pytest.approx(drawn_spread[i, i], rel=0.12)
    assert spread[0.0][0, 0] < 0.7 * drawn_spread[0, 0]
