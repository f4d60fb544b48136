"""The compiled whole run is the live localizer, to the last bit, whatever the rates and kinds of records."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from commission.errors import UsageError
from commission.localization.detection_log import extract_detections
from commission.localization.estimate import Belief, Estimate, Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_at_start
from commission.localization.whole_run import run
from commission.site.parameters import AssociationParameters, FilterParameters, Parameters, SupervisorParameters
from commission.site.record_log import RecordLog
from commission.site.scanner import Scanner
from tests.localization.drives import Plan, random_drive, random_map
from tests.odometry_of import PRECISE

PLANS = {
    "equal stamps": Plan(),
    "scans between odometry": Plan(scan_offset_ns=7_000_000),
    "scans faster than odometry": Plan(odometry_ns=100_000_000, scan_ns=30_000_000),
    "rates that never meet": Plan(odometry_ns=17_000_001, scan_ns=41_000_003, scan_offset_ns=5),
    "raw scans": Plan(scans=30, beams=1440),
    "raw scans between odometry": Plan(scans=30, beams=720, scan_offset_ns=3_000_000),
    "the sensor starts to detect": Plan(scans=30, beams=720, both_after=10),
}


def setup_of(rng: np.random.Generator, parameters: Parameters | None = None, scanners: int = 1) -> LocalizerSetup:
    both = (
        Scanner(mounting=np.array([0.3, 0.1, 0.2])),
        Scanner(name="rear", mounting=np.array([-0.4, -0.2, 2.8]), resolution_deg=0.25, beam_width_deg=0.1),
    )
    return LocalizerSetup(
        reflectors=random_map(rng, 12), scanners=both[:scanners], parameters=parameters or Parameters()
    )


def bits(value: object) -> bytes | list[bytes]:
    """Bytes of a value, so that NaN equals NaN and -0.0 does not equal 0.0."""
    if isinstance(value, Belief):
        return [bits(getattr(value, field.name)) for field in dataclasses.fields(value)]
    return np.asarray(value).tobytes()


def assert_same_estimate(a: Estimate, b: Estimate) -> None:
    for field in dataclasses.fields(Estimate):
        assert bits(getattr(a, field.name)) == bits(getattr(b, field.name)), f"{field.name} at {a.stamp_ns} ns"


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS.keys())
@pytest.mark.parametrize(
    ("filtered", "scanners"), [(True, 1), (False, 1), (True, 2)], ids=["filtered", "unfiltered", "two scanners"]
)
@pytest.mark.parametrize("consider", [True, False], ids=["constants considered", "white noise alone"])
def test_whole_run_equals_live_localizer_to_the_last_bit(
    plan: Plan, filtered: bool, scanners: int, consider: bool
) -> None:
    rng = np.random.default_rng(3)
    parameters = Parameters(
        association=AssociationParameters(enabled=filtered), filter=FilterParameters(consider=consider)
    )
    setup = setup_of(rng, parameters, scanners)
    drive = random_drive(setup, rng, plan)
    arrays = run(drive.log, setup, drive.initial)
    localizer = Localizer(setup, drive.initial)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    assert len(estimates) == len(arrays) > 0
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, arrays.estimate(cycle))
    assert localizer.state == arrays.final
    assert (localizer.state.cross is not None) is consider


def test_withheld_output_of_a_whole_run_is_that_of_the_live_localizer() -> None:
    rng = np.random.default_rng(9)
    limit, noise = SupervisorParameters(position_limit=0.02), FilterParameters(consider=False)
    setup = setup_of(rng, Parameters(supervisor=limit, odometry=PRECISE, filter=noise))
    drive = random_drive(setup, rng, Plan(scans=600, reach=6.0))
    arrays = run(drive.log, setup, drive.initial)
    localizer = Localizer(setup, drive.initial)
    estimates = [estimate for record in drive.log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    # It fails at once, recovers, and fails again.
    assert (estimates[0].mode, np.count_nonzero(np.diff(arrays.modes))) == (Mode.FAIL, 3)
    given = drive.initial
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, arrays.estimate(cycle))
        given = given if estimate.mode is Mode.FAIL else estimate.posterior
        assert bits(estimate.output) == bits(given)


def test_moved_gate_replays_the_filter_over_kept_detections() -> None:
    rng = np.random.default_rng(4)
    setup = setup_of(rng)
    drive = random_drive(setup, rng, Plan(scans=30, beams=1440, clutter=3.0))
    detected = extract_detections(drive.log, setup)
    narrow = dataclasses.replace(setup, parameters=Parameters(association=AssociationParameters(gate_probability=0.1)))
    kept, fresh = run(drive.log, narrow, drive.initial, detected=detected), run(drive.log, narrow, drive.initial)
    assert kept.means.tobytes() == fresh.means.tobytes()
    before = run(drive.log, setup, drive.initial, detected=detected)
    assert kept.counts(Status.INLIER).sum() < before.counts(Status.INLIER).sum()


def test_scans_of_two_scanners_are_localized_with_their_own_mounting() -> None:
    rng = np.random.default_rng(3)
    setup = setup_of(rng, scanners=2)
    drive = random_drive(setup, rng, Plan(scans=60, beams=1440, clutter=0.0))
    columns = run(drive.log, setup, drive.initial)
    assert columns.detected.scanners.tolist() == [0, 1] * 30
    judged = columns.counts(Status.INLIER) + columns.counts(Status.OUTLIER_ASSOCIATION)
    assert columns.counts(Status.INLIER).sum() > 0.9 * judged.sum()
    swapped = dataclasses.replace(
        setup,
        scanners=tuple(
            dataclasses.replace(scanner, mounting=other.mounting)
            for scanner, other in zip(setup.scanners, reversed(setup.scanners), strict=True)
        ),
    )
    wrong = run(drive.log, swapped, drive.initial)
    assert wrong.counts(Status.INLIER).sum() < 0.3 * judged.sum()


def test_the_order_of_scanners_in_log_and_setup_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    setup = setup_of(rng, scanners=2)
    drive = random_drive(setup, rng, Plan(scans=20, beams=720))
    turned = dataclasses.replace(setup, scanners=tuple(reversed(setup.scanners)))
    one, other = (run(drive.log, each, drive.initial) for each in (setup, turned))
    assert bits(one.means) == bits(other.means)
    assert one.detected.scanners.tolist() == [1 - index for index in other.detected.scanners.tolist()]


def test_a_scanner_that_the_setup_does_not_have_is_refused_by_name() -> None:
    rng = np.random.default_rng(3)
    setup = setup_of(rng, scanners=2)
    drive = random_drive(setup, rng, Plan(scans=4))
    other = dataclasses.replace(
        setup, scanners=(setup.scanners[0], dataclasses.replace(setup.scanners[1], name="left"))
    )
    with pytest.raises(UsageError, match="scanner 'rear' is none of the project's; expected scanner, left"):
        run(drive.log, other, drive.initial)


def test_extraction_on_all_cores_gives_the_same_detections() -> None:
    rng = np.random.default_rng(5)
    setup = setup_of(rng, scanners=2)
    log = random_drive(setup, rng, Plan(scans=30, beams=1440, clutter=3.0)).log
    serial, parallel = extract_detections(log, setup), extract_detections(log, setup, parallel=True)
    for field in dataclasses.fields(serial):
        assert bits(getattr(serial, field.name)) == bits(getattr(parallel, field.name)), field.name


def test_summaries_count_what_the_estimates_hold() -> None:
    rng = np.random.default_rng(6)
    setup = setup_of(rng)
    drive = random_drive(setup, rng, Plan(clutter=3.0))
    arrays = run(drive.log, setup, drive.initial)
    estimates = [arrays.estimate(k) for k in range(len(arrays))]
    for status in Status:
        assert arrays.counts(status).tolist() == [estimate.count(status) for estimate in estimates]
    np.testing.assert_array_equal(arrays.points_map(), np.concatenate([e.points_map for e in estimates]))


def test_log_without_scans_or_records_gives_no_cycles() -> None:
    setup = setup_of(np.random.default_rng(7))
    initial = Belief(5, np.array([1.0, 2.0, 0.5]), np.eye(3))
    empty = run(RecordLog(odometry_stamps_ns=np.empty(0, np.int64), displacements=np.empty((0, 3))), setup, initial)
    assert len(empty) == 0
    assert empty.final == state_at_start(initial)
    moved = run(
        RecordLog(odometry_stamps_ns=np.array([0, 10]), displacements=np.array([[0.0, 0, 0], [1.0, 0, 0]])),
        setup,
        initial,
    )
    assert len(moved) == 0
    np.testing.assert_allclose(moved.final.tracking.belief[:2], [1.0 + np.cos(0.5), 2.0 + np.sin(0.5)])
