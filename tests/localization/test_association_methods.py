"""Every way to associate, by one battery: by hand where rivals meet, joint compatibility against all assignments."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.stats import chi2

from commission.geometry.directions import direction_of
from commission.localization.association import NOBODY, associate, gate_of
from commission.localization.estimate import Status
from commission.localization.joint import CLEAR
from commission.localization.localizer import Localizer
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, mean_of
from commission.localization.reflector_index import ReflectorIndex, build_index
from commission.localization.scan_rows import ScanRows
from commission.localization.whole_run import run
from commission.site.parameters import (
    ASSOCIATION_METHODS,
    FILTER_KINDS,
    AssociationParameters,
    FilterParameters,
    Parameters,
)
from commission.site.reflectors import Reflector, ReflectorMap
from tests.localization.drives import Plan, random_drive
from tests.localization.plain_observation import innovations, jacobians, observed
from tests.localization.test_whole_run import assert_same_estimate, setup_of

MODEL = ObservationModel(0.3, 0.1, 0.2, 4e-4, 1.6e-5, 0.0)
MOUNTING = np.array([0.3, 0.1, 0.2])
SCAN_BY_SCAN = tuple(method for method in ASSOCIATION_METHODS if method != "several_scans")
"""Those of one scan alone; the others: `test_several_scans`."""
every_method = pytest.mark.parametrize("method", SCAN_BY_SCAN)
SURE = PoseGaussian(0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 1e-6, 0.0, 1e-8)


def mapped(*places: tuple[float, float]) -> ReflectorIndex:
    return build_index(ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(places))))


def associated(
    method: str, index: ReflectorIndex, detections: np.ndarray, belief: PoseGaussian = SURE, kind: int | None = None
) -> tuple[list[int], np.ndarray]:
    """Reflector of each detection, -1 where it is rejected, and d2."""
    count = len(detections)
    parameters = AssociationParameters(method=method, gate_probability=0.99)
    status, entries, d2 = np.zeros(count, np.int8), np.empty(count, np.int64), np.empty(count)
    aims = np.array([(*direction_of(MODEL.mount_theta + float(bearing)), 0.0) for _, bearing in detections])
    rows = ScanRows(0, count, detections, aims.reshape(count, 3), status, entries, d2)
    gate = gate_of(parameters, kind)
    facing = direction_of(belief.theta)
    associate(belief, facing, rows, MODEL, gate, index, None)
    named = [
        int(index.places[e, 3]) if e != NOBODY and s == Status.INLIER else -1
        for e, s in zip(entries, status, strict=True)
    ]
    return named, d2


def seen(*points: tuple[float, float], pose: np.ndarray | None = None) -> np.ndarray:
    return observed(np.zeros(3) if pose is None else pose, MOUNTING, np.array(points, dtype=np.float64))


@every_method
def test_reflectors_far_apart_are_each_told_and_what_is_none_is_rejected(method: str) -> None:
    index = mapped((5.0, 0.0), (0.0, 6.0), (-4.0, -3.0))
    scan = seen((0.01, 6.0), (5.0, 0.01), (2.0, 2.0), (-4.0, -3.01))
    assert associated(method, index, scan)[0] == [1, 0, -1, 2]
    assert associated(method, index, np.empty((0, 2)))[0] == []


def test_two_detections_of_one_reflector() -> None:
    # Straight ahead at 4.7 m, 20 mm noise: 10 and 30 mm beside it, d2 of 0.25 and 2.25: odds of e to 1 alone.
    index, near = mapped((5.0, 0.1)), seen((5.01, 0.1), (5.03, 0.1))
    found = {method: associated(method, index, near)[0] for method in SCAN_BY_SCAN}
    assert found == {"nearest": [0, 0], "exclusive": [0, -1], "careful": [-1, -1], "joint": [0, -1]}
    # 50 mm beside it the second is inside the gate and clearly the lesser: d2 of 6.25 more.
    clear = seen((5.0, 0.1), (5.0 + 0.02 * math.sqrt(CLEAR + 0.5), 0.1))
    assert associated("careful", index, clear)[0] == [0, -1]
    assert associated("careful", index, seen((5.0, 0.1), (5.0 + 0.02 * math.sqrt(CLEAR - 0.5), 0.1)))[0] == [-1, -1]


def test_two_reflectors_of_one_detection() -> None:
    # 60 mm apart along the ray; the detection 20 mm from the first: 1 and 4 of d2.
    index = mapped((5.0, 0.1), (5.06, 0.1))
    found = {method: associated(method, index, seen((5.02, 0.1)))[0] for method in SCAN_BY_SCAN}
    assert found == {"nearest": [0], "exclusive": [0], "careful": [-1], "joint": [0]}
    assert associated("careful", index, seen((5.0, 0.1)))[0] == [0]
    # Both are seen: each has its own, for those that look at more than one.
    both = seen((5.028, 0.1), (5.06, 0.1))
    assert associated("joint", index, both)[0] == [0, 1]


def test_joint_takes_the_shift_that_all_detections_share() -> None:
    # The vehicle is turned by 60 mrad, and a neighbor stands 90 mrad beside the first reflector, as far from the
    # scanner. One detection alone is nearer to the neighbor; three others say which way the vehicle is turned.
    belief = PoseGaussian(0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 1e-4, 0.0, 2.5e-3)
    index = mapped((10.0, 0.0), (9.9697, 0.8722), (0.0, 10.0), (-10.0, 0.0), (0.0, -10.0))
    turned = np.array([0.0, 0.0, -0.06])
    scan = seen((10.0, 0.0), (0.0, 10.0), (-10.0, 0.0), (0.0, -10.0), pose=turned)
    assert associated("joint", index, scan, belief)[0] == [0, 2, 3, 4]
    assert associated("nearest", index, scan, belief)[0][0] == 1


def plain_joint(index: ReflectorIndex, scan: np.ndarray, belief: PoseGaussian) -> tuple[int, float]:
    """Most pairs that fit jointly, and their D2: every assignment is tried, S of all pairs at once."""
    P, pose, count = covariance_of(belief), mean_of(belief), len(scan)
    places = index.places[:, :2]
    v = np.array([innovations(pose, MOUNTING, places, z) for z in scan])
    H, R = jacobians(pose, MOUNTING, places), np.diag([MODEL.range_variance, MODEL.bearing_variance])
    alone = np.array([[x @ np.linalg.solve(h @ P @ h.T + R, x) for x, h in zip(row, H, strict=True)] for row in v])
    gates = [chi2.ppf(0.99, 2 * n) if n else 0.0 for n in range(count + 1)]
    best = (0, 0.0)
    choices = [[*np.flatnonzero(row <= gates[1]).tolist(), -1] for row in alone]
    for chosen in itertools.product(*choices):
        pairs = [(i, j) for i, j in enumerate(chosen) if j >= 0]
        if len({j for _, j in pairs}) < len(pairs) or not pairs:
            continue
        rows = np.vstack([H[j] for _, j in pairs])
        S = rows @ P @ rows.T + np.kron(np.eye(len(pairs)), R)
        stacked = np.concatenate([v[i, j] for i, j in pairs])
        d2 = float(stacked @ np.linalg.solve(S, stacked))
        if d2 <= gates[len(pairs)] and (len(pairs) > best[0] or (len(pairs) == best[0] and d2 < best[1])):
            best = (len(pairs), d2)
    return best


def test_joint_compatibility_is_that_of_all_assignments() -> None:
    rng, together = np.random.default_rng(7), 0
    for _ in range(40):
        places = [tuple(place) for place in rng.uniform(-8.0, 8.0, (8, 2))]
        places += [(x + dx, y + dy) for (x, y), (dx, dy) in zip(places[:3], rng.normal(0.0, 0.3, (3, 2)), strict=True)]
        index = mapped(*places)
        sigmas = np.array([0.1, 0.1, 0.03])
        belief = PoseGaussian(0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 9e-4)
        pose = rng.normal(size=3) * sigmas
        scan = np.vstack((observed(pose, MOUNTING, np.array(places[1:5])), rng.uniform([1, -3], [9, 3], (1, 2))))
        scan += rng.normal(size=scan.shape) * [0.02, 0.004]
        # Ones in the middle of the map would be linearized differently by their derivatives.
        named, _ = associated("joint", index, scan, belief)
        count, d2 = plain_joint(index, scan, belief)
        assert sum(each >= 0 for each in named) == count
        pairs = [(i, j) for i, j in enumerate(named) if j >= 0]
        together += len(pairs) > 2
        order = {int(original): row for row, original in enumerate(index.places[:, 3])}
        rows = [order[j] for _, j in pairs]
        H = np.vstack([jacobians(np.zeros(3), MOUNTING, index.places[[r], :2])[0] for r in rows] or [np.zeros((0, 3))])
        R = np.diag([MODEL.range_variance, MODEL.bearing_variance])
        v = [
            innovations(np.zeros(3), MOUNTING, index.places[[r], :2], scan[i])[0]
            for (i, _), r in zip(pairs, rows, strict=True)
        ]
        S = H @ covariance_of(belief) @ H.T + np.kron(np.eye(len(pairs)), R)
        if pairs:
            assert float(np.concatenate(v) @ np.linalg.solve(S, np.concatenate(v))) == pytest.approx(d2, rel=1e-6)
    assert together > 20


@every_method
def test_a_crowd_of_detections_and_reflectors_takes_bounded_time_and_no_reflector_twice(method: str) -> None:
    rng = np.random.default_rng(3)
    places = [tuple(place) for place in rng.normal((6.0, 0.0), 0.2, (40, 2))]
    scan = observed(np.zeros(3), MOUNTING, np.array(places[:20])) + rng.normal(size=(20, 2)) * [0.02, 0.004]
    belief = PoseGaussian(0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 1e-3)
    named, _ = associated(method, mapped(*places), scan, belief)
    accepted = [each for each in named if each >= 0]
    assert method == "nearest" or len(set(accepted)) == len(accepted)


@pytest.mark.parametrize(
    ("method", "kind"),
    [
        *itertools.product(SCAN_BY_SCAN, FILTER_KINDS),
        *(pytest.param("several_scans", kind, marks=pytest.mark.with_all_seeds) for kind in ("ekf", "invariant")),
    ],
)
def test_whole_run_equals_the_live_localizer_to_the_last_bit(method: str, kind: str) -> None:
    rng = np.random.default_rng(4)
    parameters = Parameters(association=AssociationParameters(method=method), filter=FilterParameters(kind=kind))
    setup = setup_of(rng, parameters)
    drive = random_drive(setup, rng, Plan(scans=60, clutter=2.0))
    arrays, localizer = run(drive.log, setup, drive.initial), Localizer(setup, drive.initial)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, arrays.estimate(cycle))
    assert localizer.state == arrays.final
    errors = np.hypot(*(arrays.means - drive.truth)[:, :2].T)
    assert math.sqrt(float(np.mean(errors**2))) < 0.03
