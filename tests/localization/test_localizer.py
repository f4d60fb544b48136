"""The localizer against an independent plain one, against statistics, and against the whole hall being moved."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import chi2

from commission.errors import SourceError
from commission.geometry import se2
from commission.geometry.angles import difference
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.parameters import (
    AssociationParameters,
    FilterParameters,
    ObservationParameters,
    OdometryParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, ReferencePose, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from tests.localization.drives import Drive, Plan, random_drive, random_map
from tests.localization.plain_localizer import PlainLocalizer

MOUNTING = np.array([0.3, 0.1, 0.2])
WHITE = FilterParameters(consider=False)
"""White noise alone, as the plain localizer has it; `test_consider` has one with constants."""
INITIAL = Belief(0, np.array([0.0, 0.0, 0.0]), np.diag([1e-4, 1e-4, 1e-4]))


def one_reflector(parameters: Parameters | None = None) -> LocalizerSetup:
    return LocalizerSetup(
        reflectors=ReflectorMap((Reflector(id="A", x=2.0, y=0.0),)),
        scanners=(Scanner(),),
        parameters=parameters or Parameters(),
    )


def with_close_neighbors(rng: np.random.Generator, reflectors: ReflectorMap) -> ReflectorMap:
    """The same map with a neighbor some centimetres beside each reflector, each surveyed to another accuracy.

    Only then det S decides which of two a detection belongs to.
    """
    every = []
    for reflector in reflectors.reflectors:
        own, other = rng.uniform(0.0, 0.06, 2)
        dx, dy = rng.normal(0.0, 0.08, 2)
        neighbor = dataclasses.replace(reflector, id=f"{reflector.id}'", x=reflector.x + dx, y=reflector.y + dy)
        every += [dataclasses.replace(reflector, sigma=own), dataclasses.replace(neighbor, sigma=other)]
    return ReflectorMap(tuple(every))


@pytest.mark.parametrize(
    ("plan", "parameters"),
    [
        (Plan(scans=40, clutter=1.0), Parameters()),
        (Plan(scans=40, scan_offset_ns=7_000_000), Parameters(observation=ObservationParameters(range_bias=0.03))),
        (Plan(scans=40, odometry_ns=100_000_000, scan_ns=30_000_000), Parameters()),
        (Plan(scans=40, clutter=1.0), Parameters(association=AssociationParameters(enabled=False))),
        (Plan(scans=40, reach=3.0), Parameters(supervisor=SupervisorParameters(position_limit=0.03))),
        (Plan(scans=40, clutter=5.0), Parameters(odometry=OdometryParameters(forward_per_sqrt_s=0.3))),
        (Plan(scans=80, clutter=1.0, slip=0.1), Parameters(supervisor=SupervisorParameters(rejection_window=0.2))),
    ],
    ids=["clutter", "between odometry", "fast scans", "no association filter", "few in reach", "uncertain", "slip"],
)
def test_localizer_agrees_with_the_plain_one(plan: Plan, parameters: Parameters) -> None:
    rng = np.random.default_rng(11)
    parameters = dataclasses.replace(parameters, filter=WHITE)
    setup = LocalizerSetup(
        reflectors=with_close_neighbors(rng, random_map(rng, 12)),
        scanners=(Scanner(mounting=MOUNTING),),
        parameters=parameters,
    )
    drive = random_drive(setup, rng, plan)
    whole = run(drive.log, setup, drive.initial)
    plain = PlainLocalizer(setup.reflectors, setup.scanners[0], parameters, drive.initial).run(drive.log)
    assert len(plain) == len(whole)
    # A lost vehicle is found again; the plain one does not search.
    again = np.flatnonzero((whole.modes[:-1] == Mode.LOST) & (whole.modes[1:] != Mode.LOST))
    count = int(again[0]) + 1 if len(again) else len(whole)
    assert count >= 40
    plain, rows = plain[:count], slice(0, int(whole.offsets[count]))
    # The plain one differentiates numerically: 1e-10 of relative error, which the gain passes on.
    assert_close(whole.means[:count], np.array([cycle["mean"] for cycle in plain]), 1e-8)
    np.testing.assert_allclose(whole.covariances[:count], [cycle["cov"] for cycle in plain], rtol=1e-6, atol=1e-12)
    priors = whole.priors.rows()
    assert_close(priors.means[:count], np.array([cycle["prior_mean"] for cycle in plain]), 1e-8)
    np.testing.assert_allclose(
        priors.covariances[:count], [cycle["prior_cov"] for cycle in plain], rtol=1e-6, atol=1e-12
    )
    assert [Mode(mode).name.lower() for mode in whole.modes[:count]] == [cycle["mode"] for cycle in plain]
    kept = [status == "inlier" for cycle in plain for status in cycle["status"]]
    inlier = whole.status[rows] == Status.INLIER
    assert inlier.tolist() == kept
    chosen = np.array([j for cycle in plain for j in cycle["chosen"]])
    d2 = np.array([value for cycle in plain for value in cycle["d2"]])
    np.testing.assert_array_equal(whole.reflector[rows][inlier], chosen[inlier])
    np.testing.assert_allclose(whole.d2[rows][inlier], d2[inlier], rtol=1e-5, atol=1e-6)


def assert_close(means: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    np.testing.assert_allclose(means[:, :2], expected[:, :2], atol=tolerance, rtol=0)
    np.testing.assert_allclose(difference(means[:, 2], expected[:, 2]), 0.0, atol=tolerance)


@pytest.mark.parametrize(
    "plan",
    [Plan(scans=100, clutter=0.0), Plan(scans=100, clutter=0.0, scan_offset_ns=9_000_000)],
    ids=["equal stamps", "scans between odometry"],
)
def test_pose_errors_and_innovations_are_as_large_as_the_filter_says(plan: Plan) -> None:
    # The gate is wide open, so that it cuts no tail off.
    parameters = Parameters(association=AssociationParameters(gate_probability=0.9999), filter=WHITE)
    nees, nis, count = 0.0, 0.0, 0
    drives = 40
    for seed in range(drives):
        rng = np.random.default_rng(seed)
        setup = LocalizerSetup(
            reflectors=random_map(rng, 5), scanners=(Scanner(mounting=MOUNTING),), parameters=parameters
        )
        drive = random_drive(setup, rng, plan)
        arrays = run(drive.log, setup, drive.initial)
        error = arrays.means[-1] - drive.truth[-1]
        error[2] = math.remainder(error[2], 2.0 * math.pi)
        nees += error @ np.linalg.solve(arrays.covariances[-1], error)
        nis += arrays.d2[arrays.status == Status.INLIER].sum()
        count += arrays.counts(Status.INLIER).sum()
    low, high = chi2.ppf([0.001, 0.999], 3 * drives)
    assert low < nees < high
    # Detections of one scan share the error of the prior, so the sum of NIS spreads more than a chi-square: 5 %.
    assert nis / count == pytest.approx(2.0, rel=0.05)


def moved(drive: Drive, setup: LocalizerSetup, T: np.ndarray) -> tuple[LocalizerSetup, Belief]:
    """The same hall and initial belief, expressed in a map frame that is somewhere else."""
    centers = se2.transform_points(T, setup.reflectors.centers)
    reflectors = ReflectorMap(
        tuple(
            dataclasses.replace(reflector, x=float(x), y=float(y))
            for reflector, (x, y) in zip(setup.reflectors.reflectors, centers, strict=True)
        )
    )
    G = block(T)
    initial = Belief(0, se2.compose(T, drive.initial.mean), G @ drive.initial.covariance @ G.T)
    return LocalizerSetup(reflectors=reflectors, scanners=setup.scanners, parameters=setup.parameters), initial


def block(T: np.ndarray) -> np.ndarray:
    c, s = math.cos(T[2]), math.sin(T[2])
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("T", [(100.0, -50.0, 0.0), (0.0, 0.0, 2.5), (-30.0, 7.0, -3.1)])
def test_nothing_changes_when_the_whole_hall_is_moved_or_turned(T: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(21)
    setup = LocalizerSetup(
        reflectors=random_map(rng, 12), scanners=(Scanner(mounting=MOUNTING),), parameters=Parameters()
    )
    drive = random_drive(setup, rng, Plan(clutter=1.0))
    here = run(drive.log, setup, drive.initial)
    pose = np.array(T)
    there = run(drive.log, *moved(drive, setup, pose))
    # Coordinates of 100 m round to 1e-14; 300 steps add up.
    assert_close(there.means, se2.compose(pose, here.means), 1e-10)
    np.testing.assert_allclose(there.covariances, block(pose) @ here.covariances @ block(pose).T, rtol=1e-7, atol=1e-14)
    np.testing.assert_array_equal(there.status, here.status)
    inlier = here.status == Status.INLIER
    np.testing.assert_array_equal(there.reflector[inlier], here.reflector[inlier])


def test_record_older_than_the_one_before_is_refused() -> None:
    localizer = Localizer(one_reflector(), INITIAL)
    localizer.feed(Odometry(10, np.zeros(3)))
    with pytest.raises(SourceError, match="3 ns before the record that came before it; expected ascending stamps"):
        localizer.feed(Detections(7, np.empty((0, 2))))


def test_first_odometry_record_only_starts_the_clock() -> None:
    localizer = Localizer(one_reflector(), INITIAL)
    assert localizer.feed(Odometry(10, np.array([1.0, 0.0, 0.0]))) == ()
    np.testing.assert_array_equal(localizer.belief.mean, INITIAL.mean)
    np.testing.assert_array_equal(localizer.belief.covariance, INITIAL.covariance)


def test_reference_pose_is_never_used() -> None:
    localizer = Localizer(one_reflector(), INITIAL)
    assert localizer.feed(ReferencePose(0, np.array([9.0, 9.0, 1.0]))) == ()
    np.testing.assert_array_equal(localizer.belief.mean, INITIAL.mean)


def test_detections_of_the_sensor_win_over_its_scans() -> None:
    localizer = Localizer(one_reflector(), INITIAL)
    scan = Scan(
        stamp_ns=0,
        ranges=np.full(3, 1.96, np.float32),
        angle_min=-0.01,
        angle_increment=0.01,
        intensities=None,
        reflector=np.array([True, True, True]),
    )
    assert len(localizer.feed(scan)) == 1
    assert len(localizer.feed(Detections(1, np.array([[2.0, 0.0]])))) == 1
    assert localizer.feed(dataclasses.replace(scan, stamp_ns=2)) == ()


def test_output_is_withheld_in_fail_mode_while_the_filter_goes_on() -> None:
    parameters = Parameters(odometry=OdometryParameters(forward_per_sqrt_s=0.05, heading_per_sqrt_s=0.0))
    localizer = Localizer(one_reflector(parameters), INITIAL)
    seen = np.array([[2.0, 0.0]])
    outputs, modes = [], []
    for k in range(60):
        localizer.feed(Odometry(k * 100_000_000, np.zeros(3)))
        covered = 10 <= k < 40
        (estimate,) = localizer.feed(Detections(k * 100_000_000, seen[:0] if covered else seen))
        outputs.append(estimate.output)
        modes.append(estimate.mode)
        assert estimate.posterior.stamp_ns == k * 100_000_000
    assert modes[9] is Mode.OPERATIONAL
    first = modes.index(Mode.FAIL)
    # 2-sigma of x: 0.1 m after one second without reflectors.
    assert 10 < first <= 21
    assert modes[39] is Mode.FAIL
    assert outputs[39].stamp_ns == outputs[first - 1].stamp_ns == (first - 1) * 100_000_000
    assert outputs[39].covariance.tolist() == outputs[first - 1].covariance.tolist()
    assert modes[-1] is Mode.OPERATIONAL
    assert outputs[-1].stamp_ns == 59 * 100_000_000


def test_changed_parameters_act_on_the_next_scan_and_keep_the_state() -> None:
    localizer = Localizer(one_reflector(), INITIAL)
    localizer.feed(Odometry(0, np.zeros(3)))
    before = localizer.belief
    localizer.replace_setup(one_reflector(Parameters(association=AssociationParameters(gate_probability=0.5))))
    np.testing.assert_array_equal(localizer.belief.covariance, before.covariance)
    (estimate,) = localizer.feed(Detections(0, np.array([[2.0, 0.0]])))
    assert estimate.gate == pytest.approx(2.0 * math.log(2.0))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_each_scanner_is_believed_by_its_own_noise_or_else_that_of_the_filter(order: tuple[int, int]) -> None:
    front = Scanner(name="front")
    rear = Scanner(name="rear", detection_range_sigma=0.05, detection_bearing_sigma_deg=math.degrees(0.03))
    parameters = Parameters(observation=ObservationParameters(range_sigma=0.02, bearing_sigma=0.004), filter=WHITE)
    reflectors = ReflectorMap((Reflector(id="A", x=2.0, y=0.0),))
    localizer = Localizer(LocalizerSetup(reflectors=reflectors, scanners=(front, rear), parameters=parameters), INITIAL)
    by_range, by_bearing = np.array([[-1.0, 0.0, 0.0]]), np.array([[0.0, -0.5, -1.0]])
    expected = np.linalg.inv(INITIAL.covariance)
    for scanner in order:
        (estimate,) = localizer.feed(Detections(0, np.array([[2.0, 0.0]]), scanner))
        range_sigma, bearing_sigma = ((0.02, 0.004), (0.05, 0.03))[scanner]
        expected += by_range.T @ by_range / range_sigma**2 + by_bearing.T @ by_bearing / bearing_sigma**2
        np.testing.assert_allclose(estimate.posterior.covariance, np.linalg.inv(expected), rtol=1e-9, atol=1e-18)


NOTHING = np.empty((0, 2))
STEP = np.array([0.1, 0.0, 0.0])


def driven(setup: LocalizerSetup | None = None) -> Localizer:
    """A localizer of a vehicle that has driven 0.1 m in the 100 ns between its two odometry records."""
    localizer = Localizer(setup or one_reflector(), INITIAL)
    localizer.feed(Odometry(0, np.zeros(3)))
    localizer.feed(Odometry(100, STEP))
    return localizer


def test_a_scan_waits_for_the_odometry_that_follows_it_and_is_met_on_the_way() -> None:
    localizer = driven()
    assert localizer.feed(Detections(150, NOTHING)) == ()
    assert localizer.feed(Detections(175, NOTHING)) == ()
    assert [record.stamp_ns for record in localizer.waiting] == [150, 175]
    first, second = localizer.feed(Odometry(200, 3.0 * STEP))
    assert first.prior.mean[0] == pytest.approx(0.1 + 0.15), "interpolated, not at the speed of the record before"
    assert second.prior.mean[0] == pytest.approx(0.1 + 0.225)
    assert localizer.belief.mean[0] == pytest.approx(0.4)
    assert localizer.waiting == ()


@pytest.mark.parametrize(("stamp", "waits"), [(250, True), (251, False)])
def test_a_scan_waits_for_one_interval_of_odometry(stamp: int, waits: bool) -> None:
    localizer = driven()
    localizer.feed(Detections(150, NOTHING))
    estimates = localizer.feed(ReferencePose(stamp, np.zeros(3)))
    assert (estimates == ()) is waits
    whole = estimates + localizer.flush()
    assert [estimate.prior.mean[0] for estimate in whole] == [pytest.approx(0.15)], "it goes on at its speed"


@pytest.mark.parametrize(("stamp", "met"), [(250, 0.25), (251, 0.3)])
def test_odometry_too_late_for_a_live_scan_is_not_used_for_it_afterwards_either(stamp: int, met: float) -> None:
    rest = STEP * (stamp - 100) / 100.0
    records = [Odometry(0, np.zeros(3)), Odometry(100, 2.0 * STEP), Detections(150, NOTHING), Odometry(stamp, rest)]
    columns = run(RecordLog.collect(records), one_reflector(), INITIAL)
    assert columns.priors.rows().means[0, 0] == pytest.approx(met), (
        "0.1 m per 100 ns by the later record, 0.2 m by the one before"
    )


def test_a_scan_at_the_stamp_of_odometry_does_not_wait() -> None:
    assert len(driven().feed(Detections(100, NOTHING))) == 1


def test_a_scan_before_any_odometry_does_not_wait() -> None:
    assert len(Localizer(one_reflector(), INITIAL).feed(Detections(100, NOTHING))) == 1


def test_a_scan_without_odometry_in_time_goes_on_for_one_interval_at_most() -> None:
    localizer = driven()
    localizer.feed(Detections(990, NOTHING))
    (late,) = localizer.flush()
    assert late.prior.mean[0] == pytest.approx(0.2)
    localizer.feed(Odometry(1000, 9.0 * STEP))
    assert localizer.belief.mean[0] == pytest.approx(1.0)


def test_records_older_than_what_was_flushed_are_refused() -> None:
    localizer = driven()
    localizer.feed(Detections(150, NOTHING))
    localizer.flush()
    with pytest.raises(SourceError, match="1 ns before"):
        localizer.feed(Odometry(149, STEP))
    localizer.feed(Odometry(150, STEP))


def test_map_without_reflectors_makes_every_detection_an_outlier() -> None:
    setup = LocalizerSetup(reflectors=ReflectorMap(), scanners=(Scanner(),), parameters=Parameters())
    log = RecordLog.collect([Odometry(0, np.zeros(3)), Detections(0, np.array([[2.0, 0.0]]))])
    arrays = run(log, setup, INITIAL)
    assert arrays.status.tolist() == [Status.OUTLIER_ASSOCIATION]
    assert arrays.reflector.tolist() == [-1]
    assert np.isnan(arrays.d2).all()
