"""Every curve of the plots equals the study that it comes from, in its unit; every limit its parameter."""

import math
from dataclasses import replace

import numpy as np
import pytest
import viser
from scipy.stats import chi2

from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run.charts import CHARTS, ceiling
from commission.app.run.curves import BINS
from commission.app.run.drives import Drive
from commission.app.run.playback import Playback
from commission.app.run.plots import Plots
from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup
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
    ("2σ of position [mm]", "against the limit [mm]"): lambda e, t: 1000.0 * largest_sigma(e, t),
    ("2σ of position [mm]", "x [mm]"): lambda e, t: 1000.0 * sigma(0)(e, t),
    ("2σ of position [mm]", "y [mm]"): lambda e, t: 1000.0 * sigma(1)(e, t),
    ("2σ of heading [°]", "heading [°]"): lambda e, t: DEGREES * sigma(2)(e, t),
    ("NIS against gate", "largest NIS of a scan's inliers"): lambda e, _t: max(e.d2[e.status == 0], default=math.nan),
    ("NIS against gate", "mean of all detections in 1 s"): None,
    ("Inliers, outliers per scan", "inliers"): inliers,
    ("Inliers, outliers per scan", "outliers"): lambda e, t: len(e.status) - inliers(e, t),
    ("Position error [mm]", "error against reference [mm]"): lambda e, t: (
        1000.0 * math.hypot(e.posterior.mean[0] - t[0], e.posterior.mean[1] - t[1])
    ),
    ("Heading error [°]", "error against reference [°]"): lambda e, t: (
        DEGREES * abs(math.remainder(e.posterior.mean[2] - t[2], 2.0 * math.pi))
    ),
}


@pytest.fixture(scope="module")
def strict(project: Project, drive: Drive) -> RunResult:
    """A gate that rejects some detections, so that no curve is empty."""
    narrow = replace(project, parameters=with_field(project.parameters, "association.gate_probability", 0.6))
    return judged_run(RunInput.of(narrow, drive.log, drive.start))


def test_every_curve_has_its_expectation() -> None:
    assert set(EXPECTED) == set(LINES)


def test_the_nis_of_all_is_the_mean_over_a_second_whatever_the_gate_says(strict: RunResult) -> None:
    values = LINES["NIS against gate", "mean of all detections in 1 s"].values(strict)
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
        ("NIS against gate", float(chi2.ppf(0.6, 2))),
    ],
)
def test_a_limit_is_its_parameter_in_the_unit_of_its_plot(project: Project, title: str, expected: float) -> None:
    parameters = project.parameters
    for key, value in (
        ("supervisor.position_limit", 0.07),
        ("supervisor.heading_limit", 2.5 / DEGREES),
        ("association.gate_probability", 0.6),
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


@pytest.fixture
def server():
    server = start_server("127.0.0.1", 0)
    yield server
    server.stop()


def drawn(plots: Plots, project: Project, playback: Playback) -> list[np.ndarray]:
    """What the first plot holds: axis, x and its pale part, y and its pale part, limit, marks."""
    plots.draw_slowly(view_of(AppState(project=project, saved=project), playback.view(covered=False)))
    return [np.asarray(part) for part in plots._plots[0].data]


def test_what_lies_behind_the_cursor_is_drawn_pale(
    server: viser.ViserServer, project: Project, result: RunResult
) -> None:
    plots, playback = Plots(server.gui), Playback(result)
    playback.seek(0.5 * result.duration)
    axis, lived, coming = drawn(plots, project, playback)[:3]
    half = BINS // 2
    assert axis[-1] == pytest.approx(result.duration)
    assert np.isfinite(lived[:half]).all()
    assert np.isnan(lived[half + 1 :]).all()
    assert np.isnan(coming[: half - 1]).all()
    assert np.isfinite(coming[half + 1 :]).all()
    playback.seek(1e9)
    assert np.isfinite(drawn(plots, project, playback)[1]).all()


@pytest.mark.parametrize("title", ["NIS against gate", "Position error [mm]", "Heading error [°]"])
def test_what_is_unknown_for_a_while_is_a_gap_of_dots_and_not_0(
    server: viser.ViserServer, project: Project, result: RunResult, title: str
) -> None:
    # From a half to three quarters of the drive no detection is accepted and no reference is there.
    unknown = (result.times > 0.5 * result.duration) & (result.times < 0.75 * result.duration)
    nis, errors = result.nis.copy(), result.errors.copy()
    nis[unknown], errors[unknown] = math.nan, math.nan
    gapped = replace(result, nis=nis, errors=errors, position_errors=np.hypot(errors[:, 0], errors[:, 1]))
    plots, playback = Plots(server.gui), Playback(gapped)
    number = [chart.title for chart in CHARTS].index(title)
    for share in (0.7, 1.0):
        playback.seek(share * result.duration)
        plots.draw_slowly(view_of(AppState(project=project, saved=project), playback.view(covered=False)))
        _, lived, coming = (np.asarray(part) for part in plots._plots[number].data[:3])
        gap = slice(BINS // 2 + 1, int(0.7 * BINS) + 1)
        assert np.isnan(lived[gap]).all()
        assert np.isnan(coming[gap]).all()
        assert np.isfinite(lived[: BINS // 2 - 1]).all()
        assert (lived[: BINS // 2 - 1] > 0.0).any()
    for series in plots._plots[number].series[1:3]:
        # uPlot draws a line on across NaN, as a real browser shows; a dot it leaves out.
        assert series["width"] == 0
        assert series["points"]["show"]


def test_a_limit_changes_where_another_segment_begins(
    server: viser.ViserServer, project: Project, result: RunResult
) -> None:
    wider = replace(project, parameters=with_field(project.parameters, "supervisor.position_limit", 0.2))
    cycle = result.cycles // 2
    later = judged_run(result.inputs.with_setup(LocalizerSetup.of(wider), cycle), earlier=result)
    axis, *_, limit, _fail, _coming, _now, edits, _waking = drawn(Plots(server.gui), project, Playback(later))
    assert set(limit.tolist()) == {100.0, 200.0}
    step = axis[np.flatnonzero(np.diff(limit))[0]]
    began = pytest.approx(float(result.times[cycle]), abs=result.duration / BINS)
    assert step == began
    assert axis[np.flatnonzero(edits)].tolist() == [began]


def test_fail_episodes_are_areas_dark_where_they_are_lived(
    server: viser.ViserServer, project: Project, drive: Drive
) -> None:
    tight = replace(project, parameters=with_field(project.parameters, "supervisor.position_limit", 0.03))
    inputs = RunInput.of(tight, drive.log, drive.start).with_cover(15, covered=True).with_cover(75, covered=False)
    playback = Playback(judged_run(inputs))
    (start, end) = playback.view(covered=False).coming_episodes[0]
    plots = Plots(server.gui)
    playback.seek(0.5 * (start + end))
    axis, *_, lived, coming, _now, _edits, _waking = drawn(plots, project, playback)
    assert axis[lived > 0][[0, -1]] == pytest.approx((start, playback.time), abs=2.0 * axis[1])
    assert axis[coming > 0][[0, -1]] == pytest.approx((playback.time, end), abs=2.0 * axis[1])
