"""Association near a detection equals a plain search over the whole map; a corrected covariance stays one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from commission.geometry.directions import direction_of
from commission.localization.association import (
    NOBODY,
    Gate,
    associate,
    gate_of,
    likeliest,
)
from commission.localization.consider import Considering, ConsiderModel, ConstantsRoom, innovation_with, seen_with
from commission.localization.estimate import Status
from commission.localization.kalman import correct
from commission.localization.observation import ObservationModel, expect
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, mean_of
from commission.localization.reflector_index import ReflectorIndex, build_index
from commission.localization.scan_rows import ScanRows
from commission.localization.search import Viewpoint, search_radius2, viewpoint, widened
from commission.site.parameters import AssociationParameters
from commission.site.reflectors import Reflector, ReflectorMap
from tests.localization.plain_observation import innovation_covariances, innovations, log_likelihoods, matrix

SEEDS = st.integers(0, 2**32 - 1)


def random_model(rng: np.random.Generator) -> ObservationModel:
    return ObservationModel(*rng.uniform(-1, 1, 3), *np.exp(rng.uniform(-12, -3, 2)), 0.0)


def random_belief(rng: np.random.Generator) -> PoseGaussian:
    """From millimetres to tens of metres, from a milliradian to half a turn, correlated."""
    root = rng.normal(size=(3, 3)) * np.exp(rng.uniform([-7, -7, -7], [2.5, 2.5, 1.0]))[:, np.newaxis]
    P = root @ root.T
    pose = rng.uniform([-5, -5, -3], [25, 25, 3])
    return PoseGaussian(*(float(v) for v in (*pose, P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2])))


def random_index(rng: np.random.Generator) -> ReflectorIndex:
    count = int(rng.integers(0, 60))
    places = rng.uniform(0.0, 20.0, (count, 2))
    if count > 3:
        places[1] = places[0]  # two at one place: the first in the map counts
    sigma = float(rng.choice([0.0, 0.05]))
    sigmas = sigma * rng.uniform(size=count)
    return build_index(
        ReflectorMap(
            tuple(
                Reflector(id=str(i), x=float(x), y=float(y), sigma=float(s))
                for i, ((x, y), s) in enumerate(zip(places, sigmas, strict=True))
            )
        )
    )


def over_all(belief: PoseGaussian, z: np.ndarray, model: ObservationModel, index: ReflectorIndex) -> list[tuple]:
    """Line 4 of Algorithm 3 over the whole map: likelihood, index and d2 of each reflector, the best first."""
    pose, mounting = mean_of(belief), np.array([model.mount_x, model.mount_y, model.mount_theta])
    sigmas, places = (math.sqrt(model.range_variance), math.sqrt(model.bearing_variance)), index.places
    S = innovation_covariances(pose, covariance_of(belief), mounting, places[:, :2], sigmas, np.sqrt(places[:, 2]))
    d2, likelihood = log_likelihoods(innovations(pose, mounting, places[:, :2], z), S)
    scored = zip(likelihood.tolist(), places[:, 3].astype(int).tolist(), d2.tolist(), strict=True)
    return sorted(scored, key=lambda each: (-each[0], each[1]))


@settings(max_examples=400)
@given(SEEDS, st.booleans())
@example(206, True)  # the likeliest reflector is outside the gate and beyond the first search
@example(762, True)
def test_nearby_search_equals_a_plain_search_over_all_reflectors(seed: int, enabled: bool) -> None:
    rng = np.random.default_rng(seed)
    model, belief, index = random_model(rng), random_belief(rng), random_index(rng)
    gate = Gate(enabled, float(rng.choice([0.1, 5.991, 30.0])))
    facing = direction_of(belief.theta)
    view = viewpoint(belief, facing, model)
    for z in rng.uniform([0.0, -math.pi], [25.0, math.pi], (8, 2)):
        best, d2 = likeliest(
            belief,
            facing,
            float(z[0]),
            direction_of(belief.theta + model.mount_theta + float(z[1])),
            direction_of(model.mount_theta + float(z[1])),
            view,
            view,
            model,
            gate,
            index,
            None,
        )
        scored = over_all(belief, z, model, index)
        if not scored:
            assert best == NOBODY
            continue
        likelihood, expected, expected_d2 = scored[0]
        if abs(expected_d2 - gate.d2) < 1e-5 * gate.d2 or not expected_d2 < 1e10:
            continue  # Closer to the gate than differences of 1e-10 tell, or so far that they tell nothing.
        if not enabled or expected_d2 <= gate.d2:
            chosen = int(index.places[best, 3])
            found = next(each for each in scored if each[1] == chosen)
            # Of two at one place the first counts; of two that are as likely but for the oracle's differences, either.
            assert chosen == expected or 0.0 < likelihood - found[0] < 1e-6
            assert d2 == pytest.approx(found[2], rel=1e-4, abs=1e-6)
        else:
            # Rejected by both; which of the unlikely ones is named does not matter.
            assert best == NOBODY or not d2 <= gate.d2


@given(SEEDS)
def test_viewpoint_is_the_place_of_the_scanner_and_its_longest_sigma(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, belief = random_model(rng), random_belief(rng)
    pose, mounting = mean_of(belief), np.array([model.mount_x, model.mount_y, model.mount_theta])
    offset = (matrix(pose) @ matrix(mounting))[:2, 2] - pose[:2]
    # By a small turn of base the scanner moves across its lever.
    lever = np.array([[1.0, 0.0, -offset[1]], [0.0, 1.0, offset[0]]])
    longest = math.sqrt(np.linalg.eigvalsh(lever @ covariance_of(belief) @ lever.T)[1])
    found = viewpoint(belief, direction_of(belief.theta), model)
    assert found == pytest.approx((*offset, longest, math.sqrt(belief.tt)), rel=1e-6, abs=1e-9)


@settings(max_examples=300)
@given(SEEDS)
def test_no_reflector_within_a_squared_distance_lies_beyond_the_radius_that_is_searched(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, belief = random_model(rng), random_belief(rng)
    pose, mounting = mean_of(belief), np.array([model.mount_x, model.mount_y, model.mount_theta])
    sigmas, surveyed = (math.sqrt(model.range_variance), math.sqrt(model.bearing_variance)), float(rng.uniform(0, 0.3))
    z = rng.uniform([-0.2, -math.pi], [25.0, math.pi])
    direction = pose[2] + mounting[2] + z[1]
    point = (matrix(pose) @ matrix(mounting))[:2, 2] + z[0] * np.array([math.cos(direction), math.sin(direction)])
    places = point + rng.normal(size=(40, 2)) * np.exp(rng.uniform(-4, 2, (40, 1)))
    S = innovation_covariances(pose, covariance_of(belief), mounting, places, sigmas, surveyed)
    d2, _ = log_likelihoods(innovations(pose, mounting, places, z), S)
    facing = direction_of(belief.theta)
    view = viewpoint(belief, facing, model)
    for place, bound in zip(places, d2.tolist(), strict=True):
        if bound < 1e6:
            within = search_radius2(math.sqrt(bound * (1.0 + 1e-4)), float(z[0]), view, model, surveyed**2)
            assert math.dist(place, point) ** 2 <= within


@settings(max_examples=300)
@given(SEEDS)
def test_bounds_that_hold_the_constants_hold_any_correlation_of_theirs_with_the_pose(seed: int) -> None:
    """The whole of pose and constants drawn at random: S of every reflector stays below what is searched by."""
    rng = np.random.default_rng(seed)
    sigmas = np.exp(rng.uniform(-8.0, -2.0, 9))
    root = rng.normal(size=(9, 9))
    joint = root @ root.T
    # Correlated with the pose alone: constants are independent of each other.
    joint[3:, 3:] = 0.0
    np.fill_diagonal(joint, np.diag(root @ root.T))
    joint[:3, 3:] *= rng.uniform() / 9.0
    joint[3:, :3] = joint[:3, 3:].T
    scale = sigmas / np.sqrt(np.diag(joint))
    joint = joint * np.outer(scale, scale)
    joint[4, 4] = joint[3, 3]
    joint[6, 6] = joint[5, 5]
    if np.linalg.eigvalsh(joint)[0] <= 0.0:
        return
    P = joint[:3, :3]
    belief = PoseGaussian(*rng.uniform(-3, 3, 3), P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2])
    model = random_model(rng)
    bias, clock = np.exp(rng.uniform(-8.0, -3.0, 2))
    speed = rng.uniform(-1.0, 1.0, 3)
    work = np.zeros((3, 10))
    work[:, 8:10], work[:, 3:6] = joint[:3, 3:5], joint[:3, 5:8]
    known, room = ConsiderModel(joint[5, 5], joint[7, 7], bias**2, clock**2), ConstantsRoom(work[:, :0], work, None)
    given = Considering(known, 0.0, 0.0, *speed, room)
    facing = direction_of(belief.theta)
    view = viewpoint(belief, facing, model)
    wide = widened(view, joint[3, 3], given)
    place = np.array([belief.x, belief.y]) + rng.uniform(-9, 9, 2)
    e = expect(belief.x, belief.y, belief.theta, view.offset_x, view.offset_y, *place, model.mount_theta)
    seen = seen_with(facing, e, joint[3, 3], given, 8)
    v = innovation_with(belief, e, e.range, 0.0, model, seen)
    assert v.s_rr <= wide.position_sigma**2 + model.range_variance * (1.0 + 1e-9)
    bearing = (wide.position_sigma / e.range + wide.heading_sigma) ** 2 + model.bearing_variance
    assert v.schur + v.w * v.w * v.s_rr <= bearing * (1.0 + 1e-9)


def test_radius_that_is_searched_is_no_larger_than_it_must_be_along_a_ray_and_across_it() -> None:
    # A pose known to 30 mm each way and 1 mrad, noise of 40 mm and 3 mrad, a survey of 120 mm: 130 mm along the ray.
    view = Viewpoint(0.0, 0.0, 0.03, 0.001)
    model = ObservationModel(0.0, 0.0, 0.0, 0.04**2, 0.003**2, 0.0)
    near = search_radius2(2.0, 0.2, view, model, 0.12**2)
    # Two sigma of 130 mm reach behind a scanner 200 mm away: any direction counts. 0.26^2 + 0.2 * 0.46 * 4.
    assert near == pytest.approx(0.0676 + 0.368, rel=1e-6)
    far = search_radius2(2.0, 10.0, view, model, 0.12**2)
    # The bearing is seen from 10 m less 260 mm: its sigma is that of 30 mm and of 1 mrad added, of 3 mrad, of 120 mm.
    sigma2 = (0.03 / 9.74 + 0.001) ** 2 + 0.003**2 + (0.12 / 9.74) ** 2
    assert far == pytest.approx(0.0676 + 10.0 * 10.26 * 4.0 * sigma2, rel=1e-6)


UNCERTAIN = PoseGaussian(0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4)
EXACT = PoseGaussian(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def associated(
    detections: np.ndarray,
    index: ReflectorIndex,
    enabled: bool = True,
    belief: PoseGaussian = UNCERTAIN,
) -> tuple[list[int], list[int], list[float]]:
    model = ObservationModel(0.0, 0.0, 0.0, 4e-4, 1.6e-5, 0.0)
    count = len(detections)
    status, entries, d2 = np.zeros(count, np.int8), np.empty(count, np.int64), np.empty(count)
    gate = Gate(enabled, 5.991)
    facing = direction_of(belief.theta)
    aims = np.array([(math.cos(bearing), math.sin(bearing), 0.0) for _, bearing in detections])
    rows = ScanRows(0, count, detections, aims, status, entries, d2)
    associate(belief, facing, rows, model, gate, index, None)
    return status.tolist(), entries.tolist(), d2.tolist()


ONE = build_index(ReflectorMap((Reflector(id="A", x=5.0, y=0.0),)))


def test_of_two_close_reflectors_the_likelier_one_is_taken_on_either_side_of_the_tie() -> None:
    # A pose known exactly, noise of 20 mm and 4 mrad; A is surveyed exactly, B to 50 mm. By hand, straight ahead:
    # S_A = diag(4e-4, 1.6e-5), S_B = diag(2.9e-3, 1.6e-5 + 2.5e-3 / 5.1^2): ln(det S_B / det S_A) = 3.9280.
    # Both are as likely where (r - 5)^2 / 4e-4 = (5.1 - r)^2 / 2.9e-3 + 3.9280, at r = 5.04465 m. There both are inside
    # the gate, and B is nearer in the Mahalanobis sense.
    index = build_index(ReflectorMap((Reflector(id="A", x=5.0, y=0.0), Reflector(id="B", x=5.1, y=0.0, sigma=0.05))))
    for measured, expected in ((5.0444, 0), (5.0449, 1)):
        status, entries, d2 = associated(np.array([[measured, 0.0]]), index, belief=EXACT)
        assert status == [Status.INLIER]
        assert index.places[entries[0], 3] == expected
        by_hand = (measured - 5.0) ** 2 / 4e-4 if expected == 0 else (5.1 - measured) ** 2 / 2.9e-3
        assert d2 == [pytest.approx(by_hand, rel=1e-9)]


def test_of_two_reflectors_at_one_place_the_better_surveyed_is_taken_near_it_and_the_other_far_off() -> None:
    index = build_index(ReflectorMap((Reflector(id="A", x=5.0, y=0.0, sigma=0.03), Reflector(id="B", x=5.0, y=0.0))))
    # S_A = diag(1.3e-3, 1.6e-5 + 9e-4 / 25 = 5.2e-5), S_B = diag(4e-4, 1.6e-5): ln(3.25^2) = 2.3573.
    # Both are as likely at an offset o with o^2 (1 / 4e-4 - 1 / 1.3e-3) = 2.3573: 36.90 mm.
    for offset, expected in ((0.0366, 1), (-0.0366, 1), (0.0372, 0), (-0.0372, 0)):
        _, entries, _ = associated(np.array([[5.0 + offset, 0.0]]), index, belief=EXACT)
        assert index.places[entries[0], 3] == expected


def test_gate_is_open_up_to_its_distance_and_closed_beyond() -> None:
    # 5.991 sigma^2 of 20 mm and 4 mrad, of an exact pose: 48.953 mm of range, or 9.7906 mrad of bearing.
    for dr, db, inside in ((0.04895, 0.0, 1), (0.04896, 0.0, 0), (0.0, -0.00979, 1), (0.0, -0.009792, 0)):
        status, _, _ = associated(np.array([[5.0 + dr, db]]), ONE, belief=EXACT)
        assert status == [Status.INLIER if inside else Status.OUTLIER_ASSOCIATION], (dr, db)


def test_gate_of_the_parameters_is_that_of_two_degrees_of_freedom() -> None:
    # Of a chi-square with two degrees of freedom the quantile is -2 ln(1 - p).
    for probability in (0.5, 0.95, 0.999):
        gate = gate_of(AssociationParameters(gate_probability=probability))
        assert gate[:2] == (True, pytest.approx(-2.0 * math.log(1.0 - probability), rel=1e-9))
    assert not gate_of(AssociationParameters(enabled=False)).enabled


def test_of_two_detections_of_one_reflector_the_nearer_stays() -> None:
    for order in (1, -1):
        status, entries, _ = associated(np.array([[5.0, 0.0], [5.03, 0.0]])[::order], ONE)
        assert status[::order] == [Status.INLIER, Status.OUTLIER_ASSOCIATION]
        assert entries == [0, 0]


def test_of_two_detections_that_are_equally_near_the_first_stays() -> None:
    status, entries, _ = associated(np.array([[5.01, 0.0], [5.01, 0.0]]), ONE)
    assert status == [Status.INLIER, Status.OUTLIER_ASSOCIATION]
    assert entries == [0, 0]


def test_detection_whose_likeliest_reflector_is_outside_its_gate_is_an_outlier_though_another_gate_holds_it() -> None:
    # A is surveyed exactly, B to 500 mm: ln(det S_B / det S_A) = ln(626 * 602) = 12.8. At 5.055 m d2 of A is 7.56:
    # outside of the gate, and still likelier than B, although B's gate holds it.
    index = build_index(ReflectorMap((Reflector(id="A", x=5.0, y=0.0), Reflector(id="B", x=5.1, y=0.0, sigma=0.5))))
    status, entries, d2 = associated(np.array([[5.055, 0.0]]), index, belief=EXACT)
    assert (status, d2) == ([Status.OUTLIER_ASSOCIATION], [pytest.approx(7.5625, rel=1e-9)])
    assert index.places[entries[0], 3] == 0


def test_without_the_filter_both_detections_of_one_reflector_stay_and_far_ones_too() -> None:
    status, entries, d2 = associated(np.array([[5.0, 0.0], [5.03, 0.0], [9.0, 2.0]]), ONE, enabled=False)
    assert status == [Status.INLIER] * 3
    assert entries == [0, 0, 0]
    assert d2[2] > 1e3


def test_gate_rejects_detection_far_from_every_reflector() -> None:
    status, entries, d2 = associated(np.array([[9.0, 2.0]]), ONE)
    assert status == [Status.OUTLIER_ASSOCIATION]
    assert entries == [NOBODY]
    assert math.isnan(d2[0])


@settings(max_examples=300)
@given(SEEDS)
def test_covariance_stays_positive_semi_definite_and_shrinks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, belief = random_model(rng), random_belief(rng)
    for _ in range(20):
        before = covariance_of(belief)
        z, place = rng.uniform([0.1, -math.pi], [25.0, math.pi]), rng.uniform(0.0, 20.0, 2)
        belief = correct(belief, float(z[0]), float(z[1]), float(place[0]), float(place[1]), 0.0, model)
        after = covariance_of(belief)
        # Rounding of the largest element; Joseph form keeps the rest.
        slack = 1e-12 * np.abs(before).max()
        assert np.linalg.eigvalsh(after).min() >= -slack
        assert np.linalg.eigvalsh(before - after).min() >= -1e-9 * np.abs(before).max()
        assert -math.pi <= belief.theta < math.pi
