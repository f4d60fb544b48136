"""Errors against a reference that measures an antenna by a late clock, in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry.arrays import read_only
from commission.site.record_log import RecordLog
from commission.site.reference_mount import BASE, ReferenceMount
from commission.studies.run import RunInput, RunResult, judge, judged_run
from commission.studies.start import start_of
from tests.studies.recorded import PROJECT, drive, pose_at, start
from tests.studies.test_run import hall, standing_still

MOUNT = ReferenceMount(antenna=(1.2, -0.4), clock_offset=0.2)
STAMPS = np.arange(0, 600) * 100_000_000


def measured(*, headings: bool) -> RecordLog:
    """A drive on an oval whose reference measures a point in front on the right, and stamps it 0.2 s late."""
    poses = pose_at(STAMPS * 1e-9)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    places = poses[:, :2] + np.stack((1.2 * c + 0.4 * s, 1.2 * s - 0.4 * c), axis=1)
    theta = poses[:, 2] if headings else np.full(len(poses), math.nan)
    return replace(
        drive(),
        reference_stamps_ns=STAMPS + 200_000_000,
        reference_poses=np.column_stack((places, theta)),
        reference_mount=MOUNT,
    )


def run_over(log: RecordLog) -> RunResult:
    inputs = RunInput.of(PROJECT, log, start_of(PROJECT, drive(), start().mean, np.sqrt(np.diag(start().covariance))))
    return judged_run(inputs)


@pytest.mark.parametrize("headings", [True, False], ids=["with headings", "places alone"])
def test_errors_are_those_against_base_or_of_the_antennas_place(headings: bool) -> None:
    result = run_over(measured(headings=headings))
    means, truth = result.columns.means, pose_at(result.times)
    base = means - truth
    turned = np.remainder(base[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    expected = base[:, :2]
    if not headings:
        # Places of the antenna by the estimate and by the truth.
        arms = [
            np.stack((1.2 * np.cos(h) + 0.4 * np.sin(h), 1.2 * np.sin(h) - 0.4 * np.cos(h)), axis=1)
            for h in (means[:, 2], truth[:, 2])
        ]
        expected = expected + arms[0] - arms[1]
    known = np.isfinite(result.errors[:, 0])
    assert known.sum() > 590
    # Stamps of scans are those of the reference; rounding of the interpolated places alone.
    np.testing.assert_allclose(result.errors[known, :2], expected[known], atol=1e-9)
    if headings:
        np.testing.assert_allclose(result.errors[known, 2], turned[known], atol=1e-9)
    else:
        assert np.isnan(result.errors[:, 2]).all()
    assert result.statistics is not None
    assert result.statistics.compared == known.sum()


def test_without_the_mount_the_same_reference_is_off_by_its_arm_and_its_delay() -> None:
    result = run_over(replace(measured(headings=True), reference_mount=BASE))
    assert result.statistics is not None
    # 1.26 m of arm, and what is driven in 0.2 s.
    assert result.statistics.position_median == pytest.approx(math.hypot(1.2, 0.4), abs=0.3)


def test_consistency_of_places_is_that_of_the_antenna() -> None:
    # A standing vehicle whose reference is a point 2 m in front, whose place is known: 10 mrad off in heading.
    project = hall()
    log = RecordLog.collect(standing_still(3, reference=False))
    places = np.tile([2.0 * math.cos(0.01), 2.0 * math.sin(0.01), math.nan], (3, 1))
    log = replace(
        log,
        reference_stamps_ns=np.arange(3) * 100_000_000,
        reference_poses=places,
        reference_mount=ReferenceMount(antenna=(2.0, 0.0)),
    )
    inputs = RunInput.of(project, log, start_of(project, log, (0.0, 0.0, 0.0)))
    run = judged_run(inputs).columns
    covariance = np.diag([1e-4, 1e-4, 4e-6])
    still = replace(run, means=read_only(np.zeros((3, 3))), covariances=read_only(np.tile(covariance, (3, 1, 1))))
    found = judge(inputs, still, 1.0).statistics
    # Of the antenna's place: y has 1e-4 + 2^2 4e-6 m^2; the error is 2 sin(0.01) across and 2 (cos(0.01) - 1) along.
    along, across = 2.0 * (1.0 - math.cos(0.01)), 2.0 * math.sin(0.01)
    expected = (along**2 / 1e-4 + across**2 / 1.16e-4) / 2.0
    assert found is not None
    assert found.anees_position == pytest.approx(expected, rel=1e-6)
    assert found.position_max == pytest.approx(math.hypot(along, across), rel=1e-9)


def test_a_drive_starts_at_the_base_of_its_first_reference_pose() -> None:
    log = replace(drive(), **references())
    found = start_of(PROJECT, log)
    np.testing.assert_allclose(found.belief.mean, [4.0, 2.5, 0.0], atol=1e-12)


def references() -> dict[str, object]:
    """One reference pose of an antenna in front on the left."""
    return {
        "reference_stamps_ns": np.array([0]),
        "reference_poses": np.array([[5.0, 3.0, 0.0]]),
        "reference_mount": ReferenceMount(antenna=(1.0, 0.5)),
    }
