"""Association near a detection equals a search over the whole map; the correction keeps a covariance a covariance."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from commission.localization.association import NOBODY, Gate, associate, likeliest, score, viewpoint
from commission.localization.estimate import Status
from commission.localization.kalman import correct
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian, covariance_of
from commission.localization.reflector_index import ReflectorIndex, build_index
from commission.site.reflectors import Reflector, ReflectorMap

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


def over_all(belief: PoseGaussian, z: np.ndarray, model: ObservationModel, index: ReflectorIndex) -> tuple[int, float]:
    """Line 4 of Algorithm 3, reflector by reflector in the order of the map."""
    view = viewpoint(belief, model)
    best, best_d2, best_cost = NOBODY, math.nan, math.inf
    for entry in np.argsort(index.places[:, 3]):
        x, y, variance = (float(v) for v in index.places[entry, :3])
        d2, cost = score(belief, float(z[0]), float(z[1]), x, y, variance, view, model)
        if cost < best_cost:
            best, best_d2, best_cost = int(entry), d2, cost
    return best, best_d2


@settings(max_examples=400)
@given(SEEDS, st.booleans())
def test_nearby_search_equals_search_over_all_reflectors(seed: int, enabled: bool) -> None:
    rng = np.random.default_rng(seed)
    model, belief, index = random_model(rng), random_belief(rng), random_index(rng)
    gate = Gate(enabled, float(rng.choice([0.1, 5.991, 30.0])))
    view = viewpoint(belief, model)
    for z in rng.uniform([0.0, -math.pi], [25.0, math.pi], (8, 2)):
        best, d2 = likeliest(
            belief, float(z[0]), float(z[1]), view, model, gate, index.cells, index.places, index.offsets
        )
        expected, expected_d2 = over_all(belief, z, model, index)
        if not enabled or expected_d2 <= gate.d2:
            assert best == expected
            np.testing.assert_equal(d2, expected_d2)
        else:
            # Rejected by both; which of the unlikely ones is named does not matter.
            assert best == NOBODY or not d2 <= gate.d2


def associated(
    detections: np.ndarray, index: ReflectorIndex, enabled: bool = True
) -> tuple[list[int], list[int], list[float]]:
    belief = PoseGaussian(0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4)
    model = ObservationModel(0.0, 0.0, 0.0, 4e-4, 1.6e-5, 0.0)
    count = len(detections)
    status, entries, d2 = np.zeros(count, np.int8), np.empty(count, np.int64), np.empty(count)
    gate = Gate(enabled, 5.991)
    associate(belief, 0, count, detections, model, gate, index.cells, index.places, index.offsets, status, entries, d2)
    return status.tolist(), entries.tolist(), d2.tolist()


ONE = build_index(ReflectorMap((Reflector(id="A", x=5.0, y=0.0),)))


def test_of_two_detections_of_one_reflector_the_nearer_stays() -> None:
    for order in (1, -1):
        status, entries, _ = associated(np.array([[5.0, 0.0], [5.03, 0.0]])[::order], ONE)
        assert status[::order] == [Status.INLIER, Status.OUTLIER_ASSOCIATION]
        assert entries == [0, 0]


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
