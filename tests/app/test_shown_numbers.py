"""Every number that the page writes equals the study that it comes from, in the unit that stands beside it.

One table for badge, numbers of the newest cycle, time line, the numbers and tracks along a route, legend and readings
of the heatmap, and the rankings. Numbers that are typed are in `test_shown_inputs`, the plots of a run in
`run/test_charts`. What is expected is taken from beliefs, covariances and stamps, or written by hand; factors are
written here.
"""

from __future__ import annotations

import html
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from commission.app.base.conditions import Conditions
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.coverage.heat_legend import heat_scale, reading_table
from commission.app.coverage.scale import FIRST, QUANTITIES, Scale
from commission.app.coverage.settings import BY_TAGS, Figure
from commission.app.coverage.view import FloorReading, HeatView
from commission.app.coverage.words import value_text
from commission.app.failures.failure_panel import ranking_table
from commission.app.failures.view import FailureView
from commission.app.prediction import chart as chart_module
from commission.app.prediction.chart import chart
from commission.app.prediction.route_panel import RoutePanel
from commission.app.prediction.view import RiskView, RouteView, route_view
from commission.app.run.badge import badge_text
from commission.app.run.charts import CHARTS
from commission.app.run.now_panel import MOST_REJECTED, rejected_by_beams
from commission.app.run.now_panel import rows as now_rows
from commission.app.run.playback import Playback
from commission.app.run.time_line import TimeLine, strip
from commission.app.run.view import RunView
from commission.localization.estimate import Mode, Status
from commission.planning.coverage import Lattice
from commission.planning.dependence import Dependence, Failure, RouteDependence
from commission.planning.dilution import Measurement
from commission.planning.error_budget import PredictedErrors
from commission.planning.route_prediction import PerMetre
from commission.site.disturbances import ScannerError
from commission.site.fields import with_field
from commission.site.project import Project
from commission.site.stations import Station
from commission.site.truth import TruePlace, TrueWheels, Truth
from commission.studies.prediction import PredictionInput
from commission.studies.prediction import prediction as predicted
from commission.studies.run import RunInput, RunResult, judged_run

DEGREES = 180.0 / math.pi
LIMITS = {"supervisor.position_limit": 0.087, "supervisor.heading_limit": 0.061}
"""Limits that no other number is equal to: 87 mm, 3.5 degrees."""


def numbers(text: str) -> list[str]:
    """The numbers in a text, as they are written; names of sigmas are none."""
    plain = html.unescape(re.sub(r"<[^>]*>", " ", text))
    return re.findall(r"-?\d+(?:\.\d+)?", re.sub(r"[12]σ", "", plain))


def assert_reads(text: str, *expected: float) -> None:
    """The text has these numbers and no others, each with the decimals that it is written with."""
    found = numbers(text)
    assert len(found) == len(expected), (text, expected)
    for written, number in zip(found, expected, strict=True):
        decimals = len(written.partition(".")[2])
        assert written == f"{round(number, decimals) + 0.0:.{decimals}f}", (text, expected)


def with_limits(project: Project) -> Project:
    parameters = project.parameters
    for key, value in LIMITS.items():
        parameters = with_field(parameters, key, value)
    return replace(project, parameters=parameters)


@dataclass(frozen=True)
class At:
    """The page at one cycle of a run, and what is known of that cycle."""

    run: RunView
    covariance: np.ndarray
    mean: np.ndarray
    truth: np.ndarray
    d2: np.ndarray
    status: np.ndarray


@pytest.fixture(scope="module")
def site(project: Project) -> Project:
    """A gate that rejects some detections, limits that nothing else equals, and a station on the way."""
    limited = with_limits(project)
    parameters = with_field(limited.parameters, "association.gate_probability", 0.6)
    dock = Station(name="Dock", x=2.3, y=2.0, required_accuracy=0.043)
    return replace(limited, parameters=parameters, stations=(dock,))


@pytest.fixture(scope="module")
def judged(site: Project, drive: Any) -> RunResult:
    return judged_run(RunInput.of(site, drive.log, drive.start))


@pytest.fixture(scope="module")
def at(judged: RunResult, drive: Any) -> At:
    """The cycle, of the middle of the drive, whose 2-sigma differs most from that of the cycle before."""
    cycle = 30 + int(np.argmax(np.abs(np.diff(judged.columns.covariances[29:60, 0, 0]))))
    playback = Playback(judged)
    playback.seek(float(judged.times[cycle]) + 1e-6)
    run = playback.view(covered=False)
    assert run.newest == cycle
    columns = judged.columns
    rows = slice(int(columns.offsets[cycle]), int(columns.offsets[cycle + 1]))
    references = dict(zip(drive.log.reference_stamps_ns.tolist(), drive.log.reference_poses, strict=True))
    return At(
        run=run,
        covariance=columns.covariances[cycle],
        mean=columns.means[cycle],
        truth=references[int(columns.stamps_ns[cycle])],
        d2=columns.d2[rows],
        status=columns.status[rows],
    )


def two_sigma(at: At, axis: int) -> float:
    return 2.0 * math.sqrt(at.covariance[axis, axis])


def largest_two_sigma(at: At) -> float:
    return 2.0 * math.sqrt(np.linalg.svd(at.covariance[:2, :2])[1].max())


def error(at: At) -> float:
    return math.hypot(at.mean[0] - at.truth[0], at.mean[1] - at.truth[1])


GATE = -2.0 * math.log(1.0 - 0.6)
NOW: dict[str, Callable[[At], tuple[float, ...]]] = {
    "Fail episodes so far": lambda at: (0.0,),
    "Position x, y": lambda at: (at.mean[0], at.mean[1]),
    "Heading": lambda at: (DEGREES * at.mean[2],),
    "2σ position / limit": lambda at: (1000.0 * largest_two_sigma(at), 87.0),
    "2σ along x, along y": lambda at: (1000.0 * two_sigma(at, 0), 1000.0 * two_sigma(at, 1)),
    "2σ heading / limit": lambda at: (DEGREES * two_sigma(at, 2), DEGREES * 0.061),
    "Inliers": lambda at: (float(np.sum(at.status == 0)),),
    "Outliers: beams, gate": lambda at: (float(np.sum(at.status == 1)), float(np.sum(at.status == 2))),
    "Largest NIS / gate": lambda at: (max(at.d2[at.status == 0]), GATE),
    "NIS of all / expected, 1 s": lambda at: (at.run.result.recent.nis[at.run.newest], 2.0),
    "Rejected, 1 s": lambda at: (100.0 * at.run.result.recent.rejected[at.run.newest],),
    "Cycle time": lambda at: (at.run.result.microseconds_per_cycle,),
    "Position error": lambda at: (1000.0 * error(at),),
}
"""Numbers of each row of the newest cycle."""
UNITS_NOW = {
    **{"Position x, y": "m", "Heading": "°", "2σ position / limit": "mm", "2σ along x, along y": "mm"},
    "2σ heading / limit": "°",
    **{"Cycle time": "µs, mean of the drive", "Position error": "mm"},
}


TRUE = {
    "True wheels": "along 10.0 mm/√m, across 3.0 mm/√m, heading 0.34 °/√m, turning 0.57 °/√rad, "
    "along, in time 0.5 mm/√s, heading, in time 0.01 °/√s, all too small 0.250 %, alone too small -0.100 %, "
    "alone too small 0.125 %, farther apart 2.000 %",
    "True scanner": "mounting x off by 3.0 mm, turned by 1.00°, range bias -5.5 mm, clock late by 4.0 ms",
    "True reflectors": "2 off, 3.5 mm RMS, 4.0 mm at most (B)",
}
"""What the page tells of the truth below."""
WORLD = Truth(
    wheels=TrueWheels(forward_scale=0.0025, wheel_scales=(-0.001, 0.00125), separation_scale=0.02),
    scanners=(
        ScannerError(scanner="scanner", mounting=(0.003, 0.0, 0.017453), range_bias=-0.0055, clock_offset=0.004),
    ),
    # 3 and 4 mm: together 5 / sqrt(2).
    reflectors=(TruePlace(id="A", dx=0.003, dy=0.0), TruePlace(id="B", dx=0.0, dy=-0.004)),
)


def test_what_is_true_in_a_virtual_drive_is_told_in_the_units_of_its_fields(at: At) -> None:
    inputs = at.run.result.inputs
    of = replace(at.run, result=replace(at.run.result, inputs=replace(inputs, log=replace(inputs.log, truth=WORLD))))
    assert {label: text for label, text in now_rows(of) if label in TRUE} == TRUE
    recorded = replace(of, result=replace(of.result, inputs=replace(inputs, log=replace(inputs.log, truth=None))))
    assert not TRUE.keys() & dict(now_rows(recorded)).keys()


def test_every_row_of_the_newest_cycle_is_expected(at: At) -> None:
    assert {label for label, _ in now_rows(at.run)} == {*NOW, "Mode", *TRUE}


@pytest.mark.parametrize("label", NOW)
def test_a_number_of_the_newest_cycle_is_that_of_its_study(at: At, label: str) -> None:
    text = dict(now_rows(at.run))[label]
    assert_reads(text, *NOW[label](at))
    assert text.endswith(UNITS_NOW.get(label, ""))


def test_outliers_are_those_of_the_detector_and_those_of_the_gate(at: At) -> None:
    assert at.run.estimate is not None
    # Two inliers, one cluster with too many beams, three outside of their gates.
    status = np.array([2, 0, 1, 2, 0, 2], dtype=np.int8)
    shown = dict(now_rows(replace(at.run, estimate=replace(at.run.estimate, status=status))))
    assert_reads(shown["Inliers"], 2.0)
    assert_reads(shown["Outliers: beams, gate"], 1.0, 3.0)
    counted = replace(at.run.result, counts=np.array([[2, 1, 3], [5, 0, 4]]))
    (inliers, outliers) = next(chart.lines for chart in CHARTS if chart.title == "Inliers, outliers per scan")
    assert inliers.values(counted).tolist() == [2.0, 5.0]
    assert outliers.values(counted).tolist() == [4.0, 4.0]


def test_a_rejected_cluster_is_explained_by_its_beams_and_those_with_which_it_would_pass(at: At) -> None:
    assert at.run.estimate is not None
    one = Status.OUTLIER_DETECTOR
    estimate = replace(
        at.run.estimate,
        status=np.array([0, one, one, one], dtype=np.int8),
        measured=np.array([[1.0, 0.0], [4.0, -0.5], [2.31, math.radians(14.0)], [3.0, 0.0]]),
        beams=np.array([4, 1, 9, 0]),
        expected_beams=np.array([4.0, 2.3, 4.2, math.nan]),
    )
    detector = at.run.segment.setup.parameters.detector
    # Steps of 0.5 degrees, beams 0.25 degrees wide with a noise of 0.05: a post of 40 mm takes up 1.984 degrees at
    # 2.31 m, 1.146 at 4 m. Those whose middle meets it for certain, and those that may touch it.
    low, high = 3 - detector.min_model_error, 4 + detector.max_model_error
    assert rejected_by_beams(replace(at.run, estimate=estimate))[0] == (
        "Cluster at 2.31 m, 14°",
        f"9 beams, expected {max(low, 1)} to {high}: rejected",
    )
    # One beam may be too few or not, as the tolerances say; the sensor's own detections have no beams to explain.
    assert [where for where, _ in rejected_by_beams(replace(at.run, estimate=estimate))] == [
        "Cluster at 2.31 m, 14°",
        "Cluster at 4.00 m, -29°",
    ]


def test_of_many_rejected_clusters_the_nearest_are_explained_and_the_rest_is_counted(at: At) -> None:
    assert at.run.estimate is not None
    count = MOST_REJECTED + 3
    estimate = replace(
        at.run.estimate,
        status=np.full(count, Status.OUTLIER_DETECTOR, dtype=np.int8),
        measured=np.column_stack((np.arange(count, 0, -1.0), np.zeros(count))),
        beams=np.full(count, 40),
        expected_beams=np.full(count, 2.0),
    )
    shown = rejected_by_beams(replace(at.run, estimate=estimate))
    assert [where for where, _ in shown] == [
        *(f"Cluster at {k}.00 m, 0°" for k in range(1, MOST_REJECTED + 1)),
        "Rejected by beams",
    ]
    assert shown[-1][1] == "and 3 more"
    assert rejected_by_beams(replace(at.run, estimate=None)) == []


def test_the_badge_shows_the_largest_sigma_in_any_direction_and_both_limits(at: At, site: Project) -> None:
    word, beside, _ = badge_text(view_of(AppState(project=site, saved=site), at.run))
    assert word == "OPERATIONAL"
    assert_reads(
        beside.replace("&nbsp;", " "), 1000.0 * largest_two_sigma(at), 87.0, DEGREES * two_sigma(at, 2), DEGREES * 0.061
    )
    assert re.search(r"/ 87 mm.*°<", beside)
    # Behind each stands a bar: how much of the limit that is.
    shares = [float(share) for share in re.findall(r"width:(\d+)%", beside)]
    assert shares == pytest.approx([100.0 * largest_two_sigma(at) / 0.087, 100.0 * two_sigma(at, 2) / 0.061], abs=0.51)


@pytest.fixture(scope="module")
def failing(site: Project, drive: Any) -> RunResult:
    """A run with covered reflectors and tight limits: it fails, and recovers."""
    tight = replace(site, parameters=with_field(site.parameters, "supervisor.position_limit", 0.03))
    inputs = RunInput.of(tight, drive.log, drive.start).with_cover(15, covered=True).with_cover(75, covered=False)
    return judged_run(inputs)


def test_the_badge_counts_the_seconds_since_the_vehicle_failed(failing: RunResult, site: Project) -> None:
    modes, times = failing.columns.modes, failing.times
    first = int(np.flatnonzero(modes != Mode.OPERATIONAL)[0])
    later = int(np.searchsorted(times, times[first] + 2.6))
    assert (modes[first : later + 1] != Mode.OPERATIONAL).all()
    playback = Playback(failing)
    playback.seek(float(times[later]))
    word, _, _ = badge_text(view_of(AppState(project=site, saved=site), playback.view(covered=False)))
    assert re.sub(r"\d+", "", word) == f"{Mode(int(modes[later])).name}  s"
    assert_reads(word, float(times[later] - times[first]))


def test_the_time_line_draws_each_episode_where_it_lies(failing: RunResult) -> None:
    modes, stamps = failing.columns.modes, failing.columns.stamps_ns
    failed = np.flatnonzero(np.diff(np.concatenate(([False], modes != Mode.OPERATIONAL, [False]))))
    first_ns = failing.inputs.log.first_ns
    playback = Playback(failing)
    playback.seek(1e9)
    run = playback.view(covered=False)
    rects = re.findall(r"<rect x='([\d.]+)' y='0' width='([\d.]+)' height='8' fill='[^']+' opacity='1.0'/>", strip(run))
    starts, ends = failed[::2], np.minimum(failed[1::2], len(stamps) - 1)
    assert len(rects) == len(starts) > 0
    duration_ns = failing.inputs.log.last_ns - first_ns
    for (x, width), start, end in zip(rects, starts, ends, strict=True):
        assert float(x) == pytest.approx(100.0 * (stamps[start] - first_ns) / duration_ns, abs=0.006)
        expected = max(0.3, 100.0 * (stamps[end] - stamps[start]) / duration_ns)
        assert float(width) == pytest.approx(expected, abs=0.006)


def test_the_clock_and_the_slider_show_the_cursor_and_the_length_of_the_drive(judged: RunResult, site: Project) -> None:
    server = start_server("127.0.0.1", 0)
    try:
        line, playback = TimeLine(server.gui, lambda _action: None, 1.0), Playback(judged)
        playback.seek(4.27)
        line.draw_slowly(view_of(AppState(project=site, saved=site), playback.view(covered=False)))
        log = judged.inputs.log
        duration = (log.last_ns - log.first_ns) / 1e9
        assert line._slider.max == pytest.approx(duration)
        assert line._slider.value == pytest.approx(4.27)
        assert f"<b>00:04</b> / 00:{math.floor(duration):02d} " in line._clock.content
    finally:
        server.stop()


@pytest.fixture(scope="module")
def expected_route(site: Project) -> RouteView:
    return route_view(predicted(PredictionInput.of(site, site.routes[0].name)), outdated=False)


def worst_of(route: RouteView, values: np.ndarray) -> np.ndarray:
    """The largest (or, of what is seen, handed over negative) of each metre."""
    metre = np.floor(route.prediction.drive.metres).astype(int)
    return np.array([values[metre == m].max() for m in range(metre[-1] + 1)])


def along_axes(squares: np.ndarray, axes: slice) -> np.ndarray:
    return 2.0 * np.sqrt(np.diagonal(squares, axis1=-2, axis2=-1)[..., axes].max(axis=-1))


def in_any_direction(squares: np.ndarray, axes: slice) -> np.ndarray:
    return 2.0 * np.sqrt(np.linalg.norm(squares[..., axes, axes], 2, axis=(-2, -1)))


def sigma_along(route: RouteView, axes: slice) -> np.ndarray:
    return in_any_direction(route.prediction.covariances, axes)


def error_along(site: Project, axes: slice) -> np.ndarray:
    return in_any_direction(errors_of(site).squares, axes)


def errors_of(site: Project) -> PredictedErrors:
    return predicted(PredictionInput.of(site, site.routes[0].name)).errors


XY, HEADING = slice(0, 2), slice(2, 3)
SAID = ("2σ of position, as the filter says [mm]", "2σ of heading, as the filter says [°]")
COME_FROM = ("Error of position, 2σ by source [mm]", "Error of heading, 2σ by source [°]")


def test_the_numbers_along_a_route_are_those_of_its_prediction(expected_route: RouteView, site: Project) -> None:
    route, prediction = expected_route, expected_route.prediction
    shown = dict(re.findall(r"<tr[^>]*><td>(.*?)</td><td>(.*?)</td></tr>", chart(route, None)))
    contributed = in_any_direction(errors_of(site).parts, XY)
    table = {
        "Length": (prediction.drive.metres[-1],),
        "Worst 2σ position / limit": (1000.0 * sigma_along(route, XY).max(), 87.0),
        "Worst 2σ heading / limit": (DEGREES * sigma_along(route, HEADING).max(), DEGREES * 0.061),
        "Error, 2σ position": (1000.0 * error_along(site, XY).max(),),
        "Error, 2σ heading": (DEGREES * error_along(site, HEADING).max(),),
        **{
            f"… by {source} alone": (1000.0 * contributed[:, number].max(),)
            for number, source in enumerate(("noise", "map", "mounting", "range", "clock"))
        },
        "Fewest reflectors seen": (float(prediction.seen.min()),),
        "Longest on odometry": (prediction.on_odometry.max(),),
        "Supervisor stops": (),
    }
    (dock,) = (label for label in shown if label.startswith("Dock"))
    assert set(shown) == {*table, dock}
    for label, expected in table.items():
        assert_reads(shown[label], *expected)
    there = np.hypot(*(prediction.drive.poses[:, :2] - (2.3, 2.0)).T) <= 0.2
    own, squares = along_axes(prediction.covariances, XY), errors_of(site).squares
    both = np.maximum(own, along_axes(squares, XY))
    scan = np.flatnonzero(there)[along_axes(squares, XY)[there].argmax()]
    axis = int(np.argmax(np.diagonal(squares[scan, :2, :2])))
    by_source = 2000.0 * np.sqrt(errors_of(site).parts[scan, :, axis, axis])
    assert_reads(shown[dock], 1000.0 * both[there].max(), 43.0, *by_source)
    assert_reads(dock, prediction.drive.metres[np.flatnonzero(there)[0]])


def test_the_tracks_along_a_route_are_those_of_its_prediction(
    expected_route: RouteView, site: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: dict[str, Any] = {}
    for name in ("limited", "plain", "stacked"):
        monkeypatch.setattr(chart_module, name, lambda track, _axis: drawn.setdefault(track.title, track) and "")
    route, prediction = expected_route, expected_route.prediction
    chart(route, None)
    position, heading = drawn[SAID[0]], drawn[SAID[1]]
    np.testing.assert_allclose(position.levels, 1000.0 * worst_of(route, sigma_along(route, XY)))
    np.testing.assert_allclose(heading.levels, DEGREES * worst_of(route, sigma_along(route, HEADING)))
    np.testing.assert_allclose(position.errors, 1000.0 * worst_of(route, error_along(site, XY)))
    np.testing.assert_allclose(heading.errors, DEGREES * worst_of(route, error_along(site, HEADING)))
    assert (position.limit, heading.limit) == (pytest.approx(87.0), pytest.approx(DEGREES * 0.061))
    seen = -worst_of(route, -prediction.seen.astype(float))
    np.testing.assert_array_equal(drawn["Fewest reflectors seen"].levels, seen)
    np.testing.assert_allclose(
        drawn["On odometry alone [m]"].levels, worst_of(route, prediction.on_odometry), atol=1e-12
    )
    for title, axes, unit, limit in zip(COME_FROM, (XY, HEADING), (1000.0, DEGREES), (0.087, 0.061), strict=True):
        np.testing.assert_allclose(drawn[title].levels, unit * worst_of(route, error_along(site, axes)))
        assert drawn[title].limit == pytest.approx(unit * limit)
        np.testing.assert_allclose(drawn[title].shares.sum(axis=1), 1.0)
    assert set(drawn) == {*SAID, *COME_FROM, "Fewest reflectors seen", "On odometry alone [m]"}


def test_a_bar_of_several_metres_shows_the_worst_of_them(
    expected_route: RouteView, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: dict[str, Any] = {}
    for name in ("limited", "plain", "stacked"):
        monkeypatch.setattr(chart_module, name, lambda track, _axis: drawn.setdefault(track.title, track) and "")
    # 300 metres in at most 120 bars: three to a bar.
    rng = np.random.default_rng(3)
    sigmas, errors, alone = rng.uniform(0.01, 0.1, (300, 3)), rng.uniform(0.01, 0.1, (300, 2)), rng.uniform(0, 9, 300)
    position, shares = rng.uniform(0.1, 0.2, 300), rng.dirichlet(np.ones(5), 300)
    seen = rng.integers(2, 9, 300)
    metres = PerMetre(
        np.arange(300), np.arange(300), sigmas, np.zeros((300, 3)), seen, alone, np.zeros(300, bool), position
    )
    chances = rng.uniform(0.0, 0.5, 300)
    risk = RiskView(reflector="A", neighbor="B", chance=0.5, metres=(3,), points=np.zeros((1, 2)), worst=(1.0, 2.0))
    chart(
        replace(
            expected_route,
            **{"metres": metres, "errors": errors, "limit_shares": alone, "risk": chances, "risks": (risk,)},
            position_shares=shares,
            heading_shares=shares[::-1],
        ),
        None,
    )
    groups = [slice(first, first + 3) for first in range(0, 300, 3)]
    # A bar is divided as the metre is that it has its height from.
    for title, which, given, unit in zip(COME_FROM, (0, 1), (shares, shares[::-1]), (1000.0, DEGREES), strict=True):
        track = drawn.pop(title)
        assert track.levels == pytest.approx([unit * errors[g, which].max() for g in groups])
        worst = [given[g][errors[g, which].argmax()] for g in groups]
        np.testing.assert_array_equal(track.shares, worst)
    bars = {title: track.levels.tolist() for title, track in drawn.items()}
    assert bars == {
        SAID[0]: pytest.approx([1000.0 * position[g].max() for g in groups]),
        SAID[1]: pytest.approx([DEGREES * sigmas[g, 2].max() for g in groups]),
        "Fewest reflectors seen": [seen[g].min() for g in groups],
        "On odometry alone [m]": pytest.approx([alone[g].max() for g in groups]),
        "Chance of a wrong association [%]": pytest.approx([100.0 * chances[g].max() for g in groups]),
    }


def test_a_wrong_association_is_told_in_percent_at_its_metres(expected_route: RouteView, site: Project) -> None:
    risk = RiskView(
        reflector="A", neighbor="B", chance=0.237, metres=(3, 4, 9), points=np.zeros((1, 2)), worst=(1.0, 2.0)
    )
    chances = np.linspace(0.0, 0.4, len(expected_route.metres.metre))
    route = replace(expected_route, risks=(risk,), risk=chances)
    server = start_server("127.0.0.1", 0)
    drawn: dict[str, Any] = {}
    try:
        panel = RoutePanel(server.gui, lambda _action: None, server.gui.add_folder("Route"))
        panel._rows.show = lambda lines: drawn.update(lines=lines)
        panel.draw_slowly(view_of(AppState(project=site, saved=site), route))
    finally:
        server.stop()
    ((text, _color),) = drawn["lines"]
    assert text == "A taken for B: 24 % at worst, 3 to 5 m, 9 to 10 m"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(chart_module, "plain", lambda track, _axis: drawn.setdefault(track.title, track) and "")
        chart(route, None)
    np.testing.assert_allclose(drawn["Chance of a wrong association [%]"].levels, 100.0 * chances)


FIGURES = {
    Figure.VISIBLE: (3.0, "3"),
    Figure.POSITION_SIGMA: (0.0123, "12.3 mm"),
    Figure.HEADING_SIGMA: (0.0123, "0.705°"),
    Figure.TOTAL_SIGMA: (0.0123, "12.3 mm"),
    Figure.CONTOUR_POSITION: (0.0023, "2.3 mm"),
    Figure.CONTOUR_HEADING: (0.0123, "0.705°"),
    Figure.TAG_POSITION: (0.0229, "22.9 mm"),
    Figure.TAG_HEADING: (0.0123, "0.705°"),
    Figure.REELS: (4.0, "4"),
    Figure.POSITION_DOP: (1.23, "1.23"),
    Figure.HEADING_DOP: (0.456, "0.456"),
    Figure.EXPECTED_VISIBLE: (2.5, "2.5"),
    Figure.TWO_OR_MORE: (0.99999, "99.9 %"),
    Figure.THREE_OR_MORE: (0.5, "50.0 %"),
}
"""Of each figure of the heatmap a value of the study, and what is read."""


@pytest.mark.parametrize("figure", FIGURES)
def test_a_figure_of_the_floor_is_read_in_its_unit(figure: Figure, site: Project) -> None:
    value, expected = FIGURES[figure]
    assert value_text(figure, value, Measurement.RANGE_BEARING) == expected
    state = AppState(project=site, saved=site).with_part(Conditions(blocked_per_m=0.1))
    table = reading_table(FloorReading((1.234, 5.678), {figure: value}, on_floor=True), state)
    assert f"<td>{expected}</td>" in table
    assert "1.23, 5.68 m" in table


def test_what_the_error_at_a_place_comes_from_is_read_with_the_largest_first(site: Project) -> None:
    reading = FloorReading((1.0, 2.0), {Figure.TOTAL_SIGMA: 0.0123}, True, (0.2, 0.1, 0.05, 0.15, 0.5))
    table = reading_table(reading, AppState(project=site, saved=site))
    assert "clock 50 %, noise 20 %, range 15 %, map 10 %, mounting 5 %" in table
    assert "of its square" not in reading_table(replace(reading, shares=()), AppState(project=site, saved=site))


def test_every_figure_of_the_floor_is_expected() -> None:
    assert set(FIGURES) == set(QUANTITIES)


@pytest.mark.parametrize(
    ("figure", "bounds", "values"),
    [
        # A class begins at its bound: 10 mm and 20 mm, half a degree and one, nine tenths and 99 %.
        (Figure.POSITION_SIGMA, (10.0, 20.0), [0.00999, 0.01001, 0.01999, 0.02001]),
        (Figure.HEADING_SIGMA, (0.5, 1.0), [0.49 / DEGREES, 0.51 / DEGREES, 0.99 / DEGREES, 1.01 / DEGREES]),
        (Figure.TWO_OR_MORE, (90.0, 99.0), [0.8999, 0.9001, 0.9899, 0.9901]),
        (Figure.POSITION_DOP, (1.0, 2.0), [0.99, 1.01, 1.99, 2.01]),
    ],
)
def test_a_color_begins_at_the_bound_that_its_legend_names(
    figure: Figure, bounds: tuple[float, float], values: list[float]
) -> None:
    classes = Scale(figure, bounds).classes(np.array(values), np.ones(4, dtype=np.bool_))
    assert classes.tolist() == [FIRST, FIRST + 1, FIRST + 1, FIRST + 2]


@pytest.mark.parametrize(
    ("figure", "bounds", "limit"),
    [
        (Figure.POSITION_SIGMA, (10.0, 20.0), (87.0, 43.5)),
        (Figure.HEADING_SIGMA, (0.5, 1.0), (DEGREES * 0.061, 0.5 * DEGREES * 0.061)),
        (Figure.TAG_POSITION, (10.0, 20.0), (87.0, 43.5)),
        (Figure.TAG_HEADING, (0.5, 1.0), (DEGREES * 0.061, 0.5 * DEGREES * 0.061)),
    ],
)
def test_the_legend_names_bounds_shares_and_the_limit_of_two_sigma_and_of_one(
    site: Project, figure: Figure, bounds: tuple[float, float], limit: tuple[float, float]
) -> None:
    heat = HeatView(
        lattice=Lattice(x=0.0, y=0.0, spacing=1.0, rows=1, columns=4),
        scale=Scale(figure, bounds),
        classes=np.full((1, 4), FIRST, np.uint8),
        shares=np.array([0.123, 0.5, 0.25, 0.127]),
        outdated=False,
    )
    shown = heat_scale(heat, AppState(project=site, saved=site))
    assert f"{'no tag in sight' if figure in BY_TAGS else 'no fix'}: 12.3 % of the floor" in shown
    text = [each for each in re.split(r"<[^>]*>", shown) if each]
    for number in (*(f"{bound:g}" for bound in bounds), "50", "25", "13"):
        assert number in text
    (note,) = (each for each in text if each.startswith("limit of 2σ"))
    assert_reads(note.replace("2σ", " ").replace("1σ", " "), *limit)


def test_a_ranking_tells_failing_metres_and_two_sigma_as_a_share_of_the_limit() -> None:
    parts = (RouteDependence("Loop", np.array([3, 4, 9]), 1.237), RouteDependence("Dock", np.array([0]), 0.4))
    first = Dependence(5, Failure.BLOCKED, parts)
    second = Dependence(2, Failure.BLOCKED, (RouteDependence("Loop", np.empty(0, np.int64), 0.456),))
    view = FailureView(
        ranking=(first, second),
        names=("R6", "R3"),
        fallen=(),
        fallen_places=np.empty((0, 2)),
        failed="R6",
        chosen=first,
        place=(0.0, 0.0),
        failing=(),
        outdated=False,
    )
    shown = ranking_table(view)
    rows = dict(re.findall(r"<tr[^>]*><td>(R\d)</td><td>(.*?)</td></tr>", shown))
    # The metres of both routes together; the load of the worse one.
    assert rows == {"R6": "4 m; 124 %", "R3": "0 m; 46 %"}
    assert "Loop: 3 to 5 m, 9 to 10 m<br>Dock: 0 to 1 m" in shown
