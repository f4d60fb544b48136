"""The supervisor's rule by rejections: numbers by hand on both sides of its limits, and drives with a slip."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from commission.geometry.angles import difference
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import build_index
from commission.localization.rejection import (
    NO_EVIDENCE,
    Evidence,
    RejectionRule,
    count_detections,
    is_harmless,
    nearest,
    rejection_rule,
    rejects_the_world,
    weigh,
)
from commission.localization.scan_rows import ScanRows
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.parameters import Parameters, SupervisorParameters
from commission.site.records import Detections, Odometry, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.drives import Plan, random_drive, random_map

RULE = RejectionRule(
    enabled=True,
    window_s=1.0,
    long_window_s=1.0,
    fewest=20.0,
    fewest_of_all=20.0,
    reach=1.0,
    turn=0.0,
    harmless=0.0,
    harmless_turn=0.0,
    near_limit=0.4,
    limit=0.62,
    doubtful_position=math.inf,
    doubtful_heading=math.inf,
    confirmations=0.0,
    scans_against=10.0,
)
SECOND = 1_000_000_000


def evidence(accepted: float, near: float, rejected: float) -> Evidence:
    return Evidence(0, accepted, near, accepted, rejected, math.inf, 0.0)


@pytest.mark.parametrize(
    ("accepted", "near", "rejected", "lost"),
    [
        (60.0, 39.0, 39.0, False),  # 39.4 % near
        (60.0, 41.0, 41.0, True),  # 40.6 % near
        (60.0, 0.0, 97.0, False),  # 61.8 % of all
        (60.0, 0.0, 99.0, True),  # 62.3 % of all
        (0.0, 7.0, 7.0, False),  # 7 of at least 20: 35 %
        (0.0, 9.0, 9.0, True),  # 9 of at least 20: 45 %
        (0.0, 0.0, 12.0, False),  # 12 of at least 20: 60 %
        (0.0, 0.0, 13.0, True),  # 65 %
        (0.0, 0.0, 0.0, False),
    ],
)
def test_vehicle_is_lost_beyond_either_limit(accepted: float, near: float, rejected: float, lost: bool) -> None:
    assert rejects_the_world(False, evidence(accepted, near, rejected), RULE) is lost
    assert not rejects_the_world(False, evidence(accepted, near, rejected), RULE._replace(enabled=False))


@pytest.mark.parametrize(
    ("near", "rejected", "lost"),
    [(26.0, 26.0, True), (24.0, 24.0, False), (0.0, 46.0, True), (0.0, 44.0, False)],
)
def test_lost_vehicle_is_believed_again_only_well_below_both_limits(near: float, rejected: float, lost: bool) -> None:
    # Half of the limits: 20 % near (25 of 125), 31 % of all (44.9 of 144.9).
    assert rejects_the_world(True, evidence(100.0, near, rejected), RULE) is lost


@pytest.mark.parametrize(("against", "was_lost", "lost"), [(9.0, False, False), (10.0, False, True), (1.0, True, True)])
def test_vehicle_is_lost_by_scans_in_a_row_that_reject_nearly_all(against: float, was_lost: bool, lost: bool) -> None:
    seen = evidence(1000.0, 0.0, 0.0)._replace(against=against)
    assert rejects_the_world(was_lost, seen, RULE) is lost


@pytest.mark.parametrize(
    ("accepted", "rejected", "before", "after"),
    [
        (0, 3, 4.0, 5.0),
        (0, 2, 4.0, 4.0),  # too few to say
        (1, 4, 4.0, 5.0),  # a quarter
        (1, 3, 4.0, 0.0),
        (1, 0, 4.0, 0.0),
        (0, 0, 4.0, 4.0),
    ],
)
def test_a_scan_speaks_against_the_pose_by_what_it_rejects(
    accepted: int, rejected: int, before: float, after: float
) -> None:
    assert weighed(accepted, rejected, against=before).against == after


@pytest.mark.parametrize(
    ("accepted", "rejected", "contours", "after"),
    [
        (0, 0, -1.0, 5.0),
        (0, 2, -1.0, 5.0),
        (1, 0, -1.0, 0.0),  # reflectors speak for it: the walls have changed
        (1, 4, -1.0, 5.0),
        (0, 0, 1.0, 0.0),
        (0, 3, 1.0, 0.0),
        (0, 0, 0.0, 4.0),
        (0, 0, 0.5, 3.0),  # a corridor: something fits
        (0, 3, 0.5, 5.0),
    ],
)
def test_contours_speak_for_or_against_the_pose_where_reflectors_do_not_speak_for_it(
    accepted: int, rejected: int, contours: float, after: float
) -> None:
    assert weighed(accepted, rejected, contours=contours).against == after


def test_where_contours_match_only_what_is_rejected_near_reflectors_counts() -> None:
    far, near = weighed(0, 4, contours=1.0), weighed(0, 4, contours=1.0, place=(4.5, 0.0))
    assert (far.accepted, far.rejected, far.near_rejected, far.confirmed) == (3.0, 0.0, 0.0, 1.0)
    assert (near.accepted, near.rejected, near.near_rejected, near.confirmed) == (3.0, 4.0, 4.0, 1.0)
    aisle = weighed(0, 4, contours=0.5)
    assert (aisle.accepted, aisle.rejected, aisle.confirmed) == (0.0, 4.0, 0.0)
    assert weighed(0, 0, contours=0.5, variance=100.0).against == 4.0
    doubtful = weighed(0, 4, contours=1.0, variance=100.0)
    assert (doubtful.accepted, doubtful.rejected, doubtful.confirmed, doubtful.against) == (0.0, 4.0, 0.0, 5.0)


@pytest.mark.parametrize(("metres", "counts"), [(0.097, 0.0), (0.103, 1.0)])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_no_turn_excuses_what_is_off_along_the_line_of_sight(metres: float, counts: float, sign: float) -> None:
    # 40 % of 0.1 m and three times a range's sigma of 0.02 m; across it, a turn excuses 0.15 m of the same reflector.
    localizer = lonely(heading_limit=0.055)
    localizer = Localizer(localizer.setup, Belief(0, np.zeros(3), 1e-12 * np.eye(3)))
    localizer.feed(Odometry(0, np.zeros(3)))
    see(localizer, Detections(SECOND, np.array([[5.0 + sign * metres, 0.0]])))
    counted = localizer.state.tracking.evidence
    assert (counted.rejected, counted.near_rejected) == (counts, counts)


def test_what_is_harmless_is_what_some_allowed_error_of_place_and_heading_explains() -> None:
    rng = np.random.default_rng(5)
    rule = RULE._replace(harmless=0.04, harmless_turn=0.02)
    ways = rng.normal(size=(20000, 2))
    ways *= (0.04 * np.sqrt(rng.uniform(0.0, 1.0, 20000)) / np.hypot(*ways.T))[:, np.newaxis]
    turns = np.concatenate((rng.uniform(-0.02, 0.02, 19000), np.full(500, 0.02), np.full(500, -0.02)))
    for qx, qy in rng.uniform(-12.0, 12.0, (20, 2)).tolist():
        explained = 0.9999 * (ways + turns[:, np.newaxis] * (-qy, qx))
        assert all(is_harmless(qx, qy, ex, ey, 0.0, rule) for ex, ey in explained.tolist())
        for ex, ey in rng.uniform(-0.3, 0.3, (40, 2)).tolist():
            # Of all turns, the one that leaves least for the place.
            tried = np.linspace(-0.02, 0.02, 4001)
            left = np.hypot(ex + tried * qy, ey - tried * qx).min()
            if abs(left - 0.04) > 1e-4:
                assert is_harmless(qx, qy, ex, ey, 0.0, rule) == (left < 0.04)


@pytest.mark.parametrize(
    ("ahead", "counted"),
    [
        (0.03, 0.0),  # the limits allow as much
        (0.15, 3.0),
    ],
)
def test_several_that_tell_of_one_displacement_count_though_each_is_harmless(ahead: float, counted: float) -> None:
    places = np.array([(1.0, 9.0), (2.0, -8.0), (-2.0, 9.5)])
    reflectors = tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(places.tolist()))
    setup = LocalizerSetup(reflectors=ReflectorMap(reflectors), scanners=(Scanner(),), parameters=Parameters())
    seen = places - (ahead, 0.0)
    detections = np.column_stack((np.hypot(*seen.T), np.arctan2(seen[:, 1], seen[:, 0])))
    # A turn that is harmless moves each of them as far.
    assert (0.04 + math.radians(1.2) * detections[:, 0] > ahead).all()
    for count, expected in ((3, counted), (1, 0.0)):
        after = rejected(setup, detections[:count])
        assert (after.rejected, after.near_rejected) == (expected, expected)


def test_three_things_beside_one_reflector_tell_of_no_displacement() -> None:
    """At most one of them is the reflector; each is harmless."""
    reflectors = ReflectorMap((Reflector(id="A", x=9.0, y=0.0),))
    setup = LocalizerSetup(reflectors=reflectors, scanners=(Scanner(),), parameters=Parameters())
    seen = np.array([(8.91, -0.20), (8.94, -0.20), (8.925, -0.21)])
    after = rejected(setup, np.column_stack((np.hypot(*seen.T), np.arctan2(seen[:, 1], seen[:, 0]))))
    assert (after.rejected, after.near_rejected) == (0.0, 0.0)


def rejected(setup: LocalizerSetup, detections: FloatArray) -> Evidence:
    """What a scan leaves all of whose detections are rejected, of a vehicle at the origin."""
    status = np.full(len(detections), int(Status.OUTLIER_ASSOCIATION), dtype=np.int8)
    belief = PoseGaussian(0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 1e-6, 0.0, 1e-6)
    rule = rejection_rule(SupervisorParameters())
    counted = count_detections(belief, rows_of(detections, status), setup.observations[0], setup.index, rule)
    return weigh(NO_EVIDENCE, SECOND, belief, counted, 0.0, rule)


def rows_of(detections: FloatArray, status: np.ndarray) -> ScanRows:
    """A scan whose detections have been associated."""
    number = len(detections)
    aims, entries, d2 = np.empty((number, 3)), np.full(number, -1), np.full(number, np.nan)
    return ScanRows(0, number, detections, aims, status, entries, d2)


def weighed(
    accepted: int,
    rejected: int,
    *,
    contours: float = 0.0,
    against: float = 4.0,
    place: tuple[float, float] = (2.0, 1.0),
    variance: float = 1e-6,
) -> Evidence:
    """What one scan leaves, of a vehicle with a single reflector 5 m ahead; `place` is the range and bearing of all."""
    setup = LocalizerSetup(
        reflectors=ReflectorMap((Reflector(id="A", x=5.0, y=0.0),)), scanners=(Scanner(),), parameters=Parameters()
    )
    status = np.array([0] * accepted + [2] * rejected, dtype=np.int8)
    belief = PoseGaussian(0.0, 0.0, 0.0, variance, 0.0, 0.0, variance, 0.0, 1e-6)
    rows, rule = rows_of(np.tile(place, (len(status), 1)), status), RULE._replace(doubtful_position=1.0)
    counted = count_detections(belief, rows, setup.observations[0], setup.index, rule)
    return weigh(NO_EVIDENCE._replace(against=against, confirmed=0.0), SECOND, belief, counted, contours, rule)


def lonely(**supervisor: Any) -> Localizer:
    """One that stands still before a single reflector, 5 m ahead."""
    parameters = dataclasses.replace(Parameters(), supervisor=SupervisorParameters(**supervisor))
    setup = LocalizerSetup(
        reflectors=ReflectorMap((Reflector(id="A", x=5.0, y=0.0),)), scanners=(Scanner(),), parameters=parameters
    )
    localizer = Localizer(setup, Belief(0, np.zeros(3), 1e-6 * np.eye(3)))
    localizer.feed(Odometry(0, np.zeros(3)))
    return localizer


def see(localizer: Localizer, record: Detections | Scan) -> None:
    """Process a scan of a vehicle that has not moved since the record before."""
    localizer.feed(Odometry(record.stamp_ns, np.zeros(3)))
    assert len(localizer.feed(record)) == 1


def aside(metres: float) -> np.ndarray:
    """A detection this far to the left of the only reflector."""
    return np.array([[math.hypot(5.0, metres), math.atan2(metres, 5.0)]])


@pytest.mark.parametrize(
    ("metres", "turn", "near"), [(0.99, 0.0, 1.0), (1.01, 0.0, 0.0), (1.5, 0.1, 1.0), (1.53, 0.1, 0.0)]
)
def test_rejected_detection_is_near_within_reach_and_turn_of_a_reflector(
    metres: float, turn: float, near: float
) -> None:
    # 1 m + 0.1 rad at 5.22 m of range: 1.522 m.
    localizer = lonely(rejection_reach=1.0, rejection_turn=turn)
    see(localizer, Detections(SECOND, aside(metres)))
    counted = localizer.state.tracking.evidence
    assert (counted.rejected, counted.near_rejected) == (1.0, near)
    assert (counted.accepted, counted.near_accepted) == (0.0, 0.0)


@pytest.mark.parametrize(("metres", "counts"), [(0.147, 0.0), (0.153, 1.0)])
def test_rejected_detection_that_an_allowed_error_explains_is_no_sign_of_being_lost(
    metres: float, counts: float
) -> None:
    # 40 % of 0.1 m and of 0.055 rad at 5 m: 0.04 m + 0.11 m.
    localizer = lonely(heading_limit=0.055)
    see(localizer, Detections(SECOND, aside(metres)))
    counted = localizer.state.tracking.evidence
    assert (counted.rejected, counted.near_rejected) == (counts, counts)


@pytest.mark.parametrize(("sigma", "doubtful"), [(0.099, False), (0.103, True)])
def test_belief_beyond_twice_the_limits_must_be_confirmed_by_accepted_detections(sigma: float, doubtful: bool) -> None:
    localizer = lonely(confirmations=3)
    localizer = Localizer(localizer.setup, Belief(0, np.zeros(3), np.diag([sigma**2, 1e-6, 1e-6])))
    localizer.feed(Odometry(0, np.zeros(3)))
    modes, counted = [], []
    for number in range(1, 6):
        stamp = number * SECOND // 25
        localizer.feed(Odometry(stamp, np.zeros(3)))
        (estimate,) = localizer.feed(Detections(stamp, np.array([[5.0, 0.0]])))
        modes.append(estimate.mode)
        counted.append(localizer.state.tracking.evidence.confirmed)
    if doubtful:
        assert counted == [0.0, 1.0, 2.0, 3.0, 4.0]
        assert modes == [Mode.FAIL] * 3 + [Mode.OPERATIONAL] * 2
    else:
        assert counted == [math.inf] * 5
        assert modes[-1] is Mode.OPERATIONAL


def test_zero_confirmations_leave_the_covariance_alone_to_decide() -> None:
    localizer = lonely(confirmations=0)
    localizer = Localizer(localizer.setup, Belief(0, np.zeros(3), np.diag([1.0, 1e-6, 1e-6])))
    localizer.feed(Odometry(0, np.zeros(3)))
    (estimate,) = localizer.feed(Detections(0, np.array([[5.0, 0.0]])))
    assert estimate.mode is Mode.OPERATIONAL


def test_vehicle_whose_odometry_is_missing_for_long_is_confirmed_before_it_drives() -> None:
    localizer = lonely(confirmations=5)
    see(localizer, Detections(SECOND, np.array([[5.0, 0.0]])))
    late = Detections(20 * SECOND, np.array([[5.0, 0.0]]))
    localizer.feed(Odometry(20 * SECOND, np.zeros(3)))
    (estimate,) = localizer.feed(late)
    assert estimate.mode is Mode.FAIL


def test_evidence_is_forgotten_to_a_third_in_a_window_but_not_below_what_it_takes() -> None:
    localizer = lonely(rejection_window=2.0, rejection_long_window=4.0, rejection_evidence=4.0)
    far = np.concatenate((np.tile([[9.0, 1.0]], (30, 1)), np.tile(aside(0.5), (30, 1))))
    see(localizer, Detections(SECOND, far))
    counted = localizer.state.tracking.evidence
    assert (counted.rejected, counted.near_rejected) == (60.0, 30.0)
    see(localizer, Detections(3 * SECOND, np.empty((0, 2))))
    counted = localizer.state.tracking.evidence
    assert (counted.rejected, counted.near_rejected) == pytest.approx((60.0 / math.sqrt(math.e), 30.0 / math.e))
    see(localizer, Detections(60 * SECOND, np.empty((0, 2))))
    # However long ago they were, four are kept in two seconds, and in proportion eight in four.
    counted = localizer.state.tracking.evidence
    assert (counted.rejected, counted.near_rejected) == pytest.approx((8.0, 4.0))


def test_nothing_is_counted_before_the_first_scan() -> None:
    assert lonely().state.tracking.evidence == NO_EVIDENCE._replace(stamp_ns=0)


def test_what_the_detector_filter_rejects_does_not_count() -> None:
    localizer = lonely()
    flags = np.zeros(720, dtype=np.bool_)
    flags[300:340] = True  # 20 degrees wide at 5 m: a wall
    ranges = np.full(720, 5.0, dtype=np.float32)
    see(
        localizer,
        Scan(stamp_ns=SECOND, ranges=ranges, angle_min=-math.pi, angle_increment=math.pi / 360.0, reflector=flags),
    )
    counted = localizer.state.tracking.evidence
    assert (counted.accepted, counted.rejected) == (0.0, 0.0)
    assert counted.stamp_ns == SECOND


@pytest.mark.parametrize("degrees", [3.0, 5.0, 8.0, -5.0])
@pytest.mark.parametrize("seed", range(4))
def test_slip_is_said_within_fifteen_cycles_of_danger(degrees: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    setup = LocalizerSetup(reflectors=random_map(rng, 25), scanners=(Scanner(),), parameters=Parameters())
    drive = random_drive(setup, rng, Plan(scans=200, clutter=1.0, slip=math.radians(degrees)))
    columns = run(drive.log, setup, drive.initial)
    error = columns.means - drive.truth
    distance, heading = np.hypot(error[:, 0], error[:, 1]), np.abs(difference(columns.means[:, 2], drive.truth[:, 2]))
    wrong = (distance > 0.1) | (heading > math.radians(3.0))
    assert np.count_nonzero(wrong & (columns.modes == Mode.OPERATIONAL)) <= 15


@pytest.mark.parametrize("seed", range(6))
def test_drive_without_a_slip_is_never_lost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    setup = LocalizerSetup(reflectors=random_map(rng, 25), scanners=(Scanner(),), parameters=Parameters())
    drive = random_drive(setup, rng, Plan(scans=200, clutter=1.0))
    assert not (run(drive.log, setup, drive.initial).modes == Mode.LOST).any()


def test_output_is_withheld_while_lost_and_the_filter_goes_on() -> None:
    rng = np.random.default_rng(1)
    setup = LocalizerSetup(reflectors=random_map(rng, 25), scanners=(Scanner(),), parameters=Parameters())
    drive = random_drive(setup, rng, Plan(scans=200, clutter=1.0, slip=math.radians(8.0)))
    columns = run(drive.log, setup, drive.initial)
    first = int(np.flatnonzero(columns.modes == Mode.LOST)[0])
    withheld = columns.estimate(first + 5)
    assert withheld.mode is Mode.LOST
    assert withheld.output.stamp_ns == columns.stamps_ns[first - 1]
    assert withheld.posterior.stamp_ns == columns.stamps_ns[first + 5]


def test_the_nearest_reflector_is_that_of_brute_force_and_none_beyond_reach() -> None:
    rng = np.random.default_rng(3)
    reflectors = random_map(rng, 30)
    index = build_index(reflectors)
    for x, y in rng.uniform(-3.0, 23.0, (200, 2)):
        away = min(math.dist((x, y), center) for center in reflectors.centers)
        # Distances of brute force are rounded otherwise in the last bits.
        for reach, found in ((away * (1.0 + 1e-14), away), (away * (1.0 - 1e-14), math.inf), (away + 1.0, away)):
            _, got = nearest(x, y, reach, index)
            assert got == pytest.approx(found, rel=1e-14)


def test_a_reflector_exactly_at_reach_is_near() -> None:
    index = build_index(ReflectorMap((Reflector(id="A", x=3.0, y=4.0),)))
    for reach, found in ((5.0, 5.0), (math.nextafter(5.0, 0.0), math.inf)):
        assert nearest(0.0, 0.0, reach, index)[1] == found
