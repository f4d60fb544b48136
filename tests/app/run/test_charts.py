"""Every curve of the plots equals the study that it comes from, in its unit; every limit its parameter."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from commission.app.run.charts import CHARTS, ceiling
from commission.app.run.drives import Drive
from commission.localization.estimate import Status
from commission.site.fields import with_field
from commission.site.project import Project
from commission.studies.run import RunInput, RunResult, judged_run

LINES = {(chart.title, line.label): line for chart in CHARTS for line in chart.lines}
DEGREES = 180.0 / math.pi


def sigma(axis):
    return lambda estimate, _truth: 2.0 * math.sqrt(estimate.posterior.covariance[axis, axis])


def inliers(estimate, _truth):
    return float((estimate.status == Status.INLIER).sum())


def largest_sigma(estimate, _truth):
    return 2.0 * math.sqrt(np.linalg.svd(estimate.posterior.covariance[:2, :2])[1].max())


EXPECTED = {
    ("2σ of position [mm]", "largest"): lambda e, t: 1000.0 * largest_sigma(e, t),
    ("2σ of position [mm]", "x"): lambda e, t: 1000.0 * sigma(0)(e, t),
    ("2σ of position [mm]", "y"): lambda e, t: 1000.0 * sigma(1)(e, t),
    ("2σ of heading [°]", "heading"): lambda e, t: DEGREES * sigma(2)(e, t),
    ("2σ of position [mm]", "protection level"): lambda e, t: 1000.0 * e.levels[0],
    ("2σ of heading [°]", "protection level"): lambda e, t: DEGREES * e.levels[1],
    ("NIS of all detections", "each"): None,
    ("NIS of all detections", "mean of 1 s"): None,
    ("Inliers, outliers per scan", "inliers"): inliers,
    ("Inliers, outliers per scan", "outliers"): lambda e, t: len(e.status) - inliers(e, t),
    ("Rejected by the gate [%]", "share of 1 s"): None,
    ("Position error [mm]", "to reference"): lambda e, t: (
        1000.0 * math.hypot(e.posterior.mean[0] - t[0], e.posterior.mean[1] - t[1])
    ),
    ("Heading error [°]", "to reference"): lambda e, t: (
        DEGREES * abs(math.remainder(e.posterior.mean[2] - t[2], 2.0 * math.pi))
    ),
}


@pytest.fixture(scope="module")
def strict(project: Project, drive: Drive) -> RunResult:
    """A gate that rejects some detections, and a supervisor by protection level, so that no curve is empty."""
    parameters = with_field(project.parameters, "association.gate_probability", 0.6)
    narrow = replace(project, parameters=with_field(parameters, "supervisor.held", "protection_level"))
    return judged_run(RunInput.of(narrow, drive.log, drive.start))


def test_every_curve_has_its_expectation() -> None:
    assert set(EXPECTED) == set(LINES)


def test_the_nis_of_all_is_the_mean_over_a_second_whatever_the_gate_says(strict: RunResult) -> None:
    values = LINES["NIS of all detections", "mean of 1 s"].values(strict)
    estimates = [strict.columns.estimate(cycle) for cycle in range(strict.cycles)]
    expected = []
    for newest in estimates:
        last = [e for e in estimates if newest.stamp_ns - 10**9 < e.stamp_ns <= newest.stamp_ns]
        distances = np.concatenate([e.d2[e.status != Status.OUTLIER_DETECTOR] for e in last])
        distances = distances[np.isfinite(distances)]
        expected.append(distances.mean() if len(distances) else math.nan)
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    # What the gate rejects counts, too: there is some.
    assert (strict.columns.status == Status.OUTLIER_ASSOCIATION).any()


def test_the_share_of_the_rejected_is_that_of_a_second_in_percent(strict: RunResult) -> None:
    values = LINES["Rejected by the gate [%]", "share of 1 s"].values(strict)
    newest = strict.cycles - 1
    last = strict.columns.stamps_ns > strict.columns.stamps_ns[newest] - 10**9
    of = np.repeat(last, np.diff(strict.columns.offsets))
    outliers, inliers = (
        np.count_nonzero(of & (strict.columns.status == each)) for each in (Status.OUTLIER_ASSOCIATION, Status.INLIER)
    )
    assert values[newest] == pytest.approx(100.0 * outliers / (outliers + inliers))


def test_the_nis_of_each_is_that_of_all_near_a_reflector_accepted_or_not(strict: RunResult) -> None:
    line = LINES["NIS of all detections", "each"]
    assert line.of_detections
    expected = [
        d2 if status != Status.OUTLIER_DETECTOR else math.nan
        for cycle in range(strict.cycles)
        for d2, status in zip(strict.columns.estimate(cycle).d2, strict.columns.estimate(cycle).status, strict=True)
    ]
    np.testing.assert_array_equal(line.values(strict), expected)
    np.testing.assert_array_equal(line.values(strict, slice(10, 30)), expected[10:30])
    # What the detector did not pass has none, even where a distance stands in its row.
    status = strict.columns.status.copy()
    status[[3, 7]] = Status.OUTLIER_DETECTOR
    passed = replace(strict, columns=replace(strict.columns, status=status))
    assert np.flatnonzero(np.isnan(line.values(passed, slice(0, 10)))).tolist() == [3, 7]
    assert np.isfinite(strict.columns.d2[:10]).all()


@pytest.mark.parametrize("name", [name for name, expected in EXPECTED.items() if expected], ids=" ".join)
def test_a_curve_is_its_quantity_in_its_unit_cycle_by_cycle(strict: RunResult, drive: Drive, name) -> None:
    truth = dict(zip(drive.log.reference_stamps_ns.tolist(), drive.log.reference_poses, strict=True))
    values = LINES[name].values(strict)
    expected = [
        EXPECTED[name](estimate, truth[estimate.stamp_ns])
        for estimate in map(strict.columns.estimate, range(strict.cycles))
    ]
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    assert np.nanmax(values) > 0.0


@pytest.mark.parametrize(
    ("title", "expected"),
    [
        ("2σ of position [mm]", 70.0),
        ("2σ of heading [°]", 2.5),
        ("NIS of all detections", float(chi2.ppf(0.6, 2))),
        ("Rejected by the gate [%]", 65.0),
    ],
)
def test_a_limit_is_its_parameter_in_the_unit_of_its_plot(project: Project, title: str, expected: float) -> None:
    parameters = project.parameters
    for key, value in (
        ("supervisor.position_limit", 0.07),
        ("supervisor.heading_limit", 2.5 / DEGREES),
        ("association.gate_probability", 0.6),
        ("supervisor.rejection_limit", 0.65),
    ):
        parameters = with_field(parameters, key, value)
    (chart,) = (chart for chart in CHARTS if chart.title == title)
    assert chart.limits[0].value(parameters) == pytest.approx(expected, rel=1e-12)
    low, high = chart.span(parameters)
    assert low < expected < high


@pytest.mark.parametrize(
    ("value", "expected"),
    [(1.0, 1.0), (1.01, 2.0), (2.0, 2.0), (37.0, 50.0), (0.011, 0.02), (600.0, 1000.0)],
)
def test_an_axis_ends_at_the_next_round_number(value: float, expected: float) -> None:
    assert ceiling(value) == pytest.approx(expected, rel=1e-12)
