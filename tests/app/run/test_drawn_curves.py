"""What the plots are sent: every extreme, gaps as gaps, thresholds and axes; what a browser may ask for."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Action
from commission.app.base.carrier import as_text
from commission.app.base.effects import SendFile
from commission.app.base.state import AppState
from commission.app.editing.actions import SelectReflectors
from commission.app.run import actions
from commission.app.run.asked import action_of
from commission.app.run.charts import BY_TITLE, CHARTS, SHOWN_FIRST, ceiling
from commission.app.run.curve_table import curve_table
from commission.app.run.drawn_curves import axis_of, drawn, values_at
from commission.app.run.effects import MakeCurves
from commission.app.run.state import PlotWindow
from commission.geometry.arrays import read_only
from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup
from commission.localization.tag_frames import TagCycles
from commission.site.fields import with_field
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.studies.run import RunResult, judged_run
from tests.app.asking import ME, OTHER, after, joined

COUNTS = BY_TITLE["Inliers, outliers per scan"]
NIS = BY_TITLE["NIS of all detections"]
ERROR = BY_TITLE["Position error [mm]"]


def numbers(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<f4").astype(float)


def message(run: RunResult, *charts, span=None):
    """What the script reads."""
    return json.loads(as_text(drawn(run, charts or CHARTS, span or (0.0, run.duration))))


def long_run(result: RunResult, cycles: int = 31 * 1200) -> RunResult:
    """A drive in which each scan sees four reflectors, but for 30 in every 31, which see none."""
    counts = np.zeros((cycles, 3), np.int32)
    counts[::31, Status.INLIER] = 4
    return replace(result, times=read_only(np.arange(cycles) * 0.1), counts=read_only(counts), duration=0.1 * cycles)


def test_thirty_blind_scans_in_thirty_one_are_seen_over_the_whole_drive(result: RunResult) -> None:
    sent = message(long_run(result), COUNTS)["charts"][0]["lines"][0]
    low, high = numbers(sent["low"]), numbers(sent["high"])
    assert len(low) <= 1202
    assert (low[1:-1] == 0.0).all()
    assert np.mean(high[1:-1] == 4.0) > 0.95


def test_a_few_cycles_are_sent_one_by_one_and_the_smallest_only_once(result: RunResult) -> None:
    sent = message(result, COUNTS)
    line = sent["charts"][0]["lines"][0]
    assert line["high"] == ""
    np.testing.assert_array_equal(numbers(line["low"]), result.counts[:, Status.INLIER])
    np.testing.assert_allclose(numbers(sent["times"]), result.times, atol=1e-5)


def with_frames(result: RunResult) -> RunResult:
    """The same drive, of which the first two cycles and every third one are frames of a camera that saw no tag."""
    is_frame = np.arange(result.cycles) % 3 == 0
    is_frame[1] = True
    nothing = np.zeros(result.cycles + 1, np.int64)
    tags = TagCycles(
        is_frame=is_frame,
        offsets=nothing,
        sightings=np.empty((0, 6)),
        ids=np.empty(0, str),
        numbers=np.cumsum(is_frame) - is_frame,
    )
    columns = replace(result.columns, detected=replace(result.columns.detected, tags=tags))
    counts = np.where(is_frame[:, np.newaxis], 0, result.counts)
    return replace(result, columns=columns, counts=read_only(counts.astype(np.int32)))


def test_frames_of_a_camera_are_no_scans_without_inliers(result: RunResult) -> None:
    mixed = with_frames(result)
    line = COUNTS.lines[0]
    sent = numbers(message(mixed, COUNTS)["charts"][0]["lines"][0]["low"])
    counted = result.counts[:, Status.INLIER].astype(float)
    assert np.isnan(sent[:2]).all(), "nothing is known before the first scan"
    for cycle in range(2, result.cycles):
        last = cycle - 1 if cycle % 3 == 0 else cycle
        assert sent[cycle] == counted[last]
        assert values_at(mixed, [COUNTS], cycle)[0][0] == [counted[last], counted[last]]
    assert values_at(mixed, [COUNTS], 1)[0][0] is None
    # A table says of a frame that it is no scan, and a span that begins with one goes on from the scan before it.
    assert np.isnan(line.values(mixed)[::3]).all() and np.isfinite(line.values(mixed)[2::3]).all()
    begin = float(result.times[31])
    zoomed = numbers(message(mixed, COUNTS, span=(begin, begin + 1.0))["charts"][0]["lines"][0]["low"])
    assert zoomed[0] == counted[29]


def test_what_is_unknown_for_a_while_is_unknown_there_and_not_0(result: RunResult) -> None:
    unknown = (result.times > 0.5 * result.duration) & (result.times < 0.75 * result.duration)
    gapped = replace(result, position_errors=np.where(unknown, math.nan, result.position_errors))
    low = numbers(message(gapped, ERROR)["charts"][0]["lines"][0]["low"])
    np.testing.assert_array_equal(np.isnan(low), unknown | np.isnan(result.position_errors))


def test_a_gap_in_the_scans_is_a_gap_in_every_curve(result: RunResult) -> None:
    at = result.cycles // 2
    times = result.times.copy()
    times[at:] += 5.0
    paused = replace(result, times=read_only(times), duration=result.duration + 5.0)
    sent = message(paused)
    assert np.flatnonzero(np.isnan(numbers(sent["times"]))).tolist() == [at]
    for chart in sent["charts"]:
        for line in chart["lines"]:
            assert len(numbers(line["low"])) == result.cycles + 1
            assert math.isnan(numbers(line["low"])[at])


def test_the_nis_of_every_detection_lies_between_what_is_drawn(result: RunResult) -> None:
    line = message(result, NIS)["charts"][0]["lines"][0]
    low, high = numbers(line["low"]), numbers(line["high"])
    assert line["bars"]
    for cycle in range(result.cycles):
        estimate = result.columns.estimate(cycle)
        near = estimate.d2[(estimate.status != Status.OUTLIER_DETECTOR) & np.isfinite(estimate.d2)]
        expected = (near.min(), near.max()) if len(near) else (math.nan, math.nan)
        np.testing.assert_allclose((low[cycle], high[cycle]), expected, rtol=1e-6)


def test_a_zoom_sends_its_span_and_one_cycle_beyond_each_end(result: RunResult) -> None:
    span = (1.05, 2.05)
    sent = message(result, span=span)
    assert sent["span"] == list(span)
    times = numbers(sent["times"]) + span[0]
    inside = result.times[(result.times >= span[0]) & (result.times <= span[1])]
    assert len(times) == len(inside) + 2
    np.testing.assert_allclose(times[1:-1], inside, atol=1e-6)
    # The detections are those of the same cycles.
    low = numbers(sent["charts"][2]["lines"][0]["low"])
    whole = numbers(message(result)["charts"][2]["lines"][0]["low"])
    first = int(np.searchsorted(result.times, inside[0])) - 1
    np.testing.assert_array_equal(low, whole[first : first + len(low)])


def test_a_limit_changes_where_another_segment_begins(project: Project, result: RunResult) -> None:
    wider = replace(project, parameters=with_field(project.parameters, "supervisor.position_limit", 0.2))
    cycle = result.cycles // 2
    later = judged_run(result.inputs.with_setup(LocalizerSetup.of(wider), cycle), earlier=result)
    chart = message(later)["charts"][0]
    assert chart["limits"][0]["steps"] == [[0.0, 100.0], [pytest.approx(result.times[cycle]), 200.0]]
    assert chart["axis"] == pytest.approx([1.0, 600.0])


def test_an_axis_holds_its_limits_and_whatever_is_larger() -> None:
    parameters = [Parameters()]
    position, _, nis, counts = CHARTS[:4]
    assert axis_of(position, parameters, 20.0) == pytest.approx((1.0, 300.0))
    assert axis_of(position, parameters, 4321.0) == (1.0, 5000.0)
    assert axis_of(counts, parameters, math.nan) == (0.0, 5.0)
    assert axis_of(counts, parameters, 37.0) == (0.0, 50.0)
    low, high = axis_of(nis, parameters, math.nan)
    assert low == 0.01
    assert high == pytest.approx(59.9, abs=0.1)
    assert ceiling(4.0) == 5.0


def test_values_at_the_cursor_are_those_of_its_cycle(result: RunResult) -> None:
    shown = values_at(result, CHARTS, 20)
    estimate = result.columns.estimate(20)
    assert shown[3][0] == [estimate.count(Status.INLIER)] * 2
    assert shown[2][0] == [pytest.approx(estimate.d2.min()), pytest.approx(estimate.d2.max())]
    assert shown[0][1] == [pytest.approx(2000.0 * math.sqrt(estimate.posterior.covariance[0, 0]))] * 2
    assert values_at(result, CHARTS, -1) == [[None] * len(chart.lines_of(result)) for chart in CHARTS]


def test_a_table_has_the_rows_and_curves_that_are_shown(result: RunResult) -> None:
    charts = [BY_TITLE["2σ of position [mm]"], NIS]
    begin, end = float(result.times[10]), float(result.times[29])
    rows = list(csv.DictReader(io.StringIO(curve_table(result, charts, (begin, end)).decode())))
    names = [
        "position_two_sigma_mm",
        "x_two_sigma_mm",
        "y_two_sigma_mm",
        "nis_lowest",
        "nis_highest",
        "nis_mean_of_1_s",
    ]
    assert list(rows[0]) == ["stamp_ns", "time", *names]
    assert [int(row["stamp_ns"]) for row in rows] == result.columns.stamps_ns[10:30].tolist()
    for cycle, row in zip(range(10, 30), rows, strict=True):
        d2 = result.columns.estimate(cycle).d2
        assert float(row["nis_highest"]) == pytest.approx(d2.max(), rel=1e-5)
        assert float(row["nis_lowest"]) == pytest.approx(d2.min(), rel=1e-5)
        assert float(row["position_two_sigma_mm"]) == pytest.approx(1000 * result.position_two_sigma[cycle], rel=1e-5)
    nothing = curve_table(result, charts, (1e6, 2e6)).decode()
    assert nothing.count("\n") == 1


def test_what_is_unknown_is_an_empty_cell(result: RunResult) -> None:
    errors = result.position_errors.copy()
    errors[3] = math.nan
    written = curve_table(replace(result, position_errors=errors), [ERROR], (0.0, result.duration))
    assert list(csv.DictReader(io.StringIO(written.decode())))[3]["position_error_mm"] == ""


def test_each_browser_zooms_and_chooses_for_itself(project: Project) -> None:
    state = joined(AppState(project=project, saved=project))
    state = after(state, actions.ShowSpan((1.0, 2.5)), actions.ShowCharts((NIS.title, COUNTS.title))).state
    assert state.of_browser(ME, PlotWindow) == PlotWindow(span=(1.0, 2.5), titles=(NIS.title, COUNTS.title))
    assert state.of_browser(OTHER, PlotWindow) == PlotWindow(span=None, titles=SHOWN_FIRST)
    assert after(state, actions.SaveCurves()).effects == (MakeCurves(state.of_browser(ME, PlotWindow)),)
    assert after(state, actions.ShowSpan(None)).state.of_browser(ME, PlotWindow).span is None
    assert after(state, actions.CurvesMade("curves.csv", b"a")).effects == (SendFile("curves.csv", b"a"),)


def test_plots_keep_their_order_however_they_are_chosen(project: Project) -> None:
    state = joined(AppState(project=project, saved=project))
    chosen = after(state, actions.ShowCharts((COUNTS.title, NIS.title))).state
    assert chosen.of_browser(ME, PlotWindow).titles == (NIS.title, COUNTS.title)


def test_a_span_that_is_too_short_to_draw_is_shown_wider(project: Project) -> None:
    state = joined(AppState(project=project, saved=project))
    span = after(state, actions.ShowSpan((3.0, 3.001))).state.of_browser(ME, PlotWindow).span
    assert span == pytest.approx((2.9955, 3.0055))


@pytest.mark.parametrize("span", [(-1.0, 2.0), (2.0, 2.0), (3.0, 1.0), (0.0, math.inf), (math.nan, 1.0)])
def test_a_span_that_is_none_is_refused(project: Project, span: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="the plots are to show"):
        after(joined(AppState(project=project, saved=project)), actions.ShowSpan(span))


@pytest.mark.parametrize("titles", [(), ("Weather",), (NIS.title, "Weather")])
def test_plots_that_do_not_exist_are_refused(project: Project, titles: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="expected one or more of 2σ"):
        after(joined(AppState(project=project, saved=project)), actions.ShowCharts(titles))


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ('{"n":1,"do":"at","time":2.5}', actions.Seek(2.5)),
        ('{"n":2,"do":"zoom","span":[1,2]}', actions.ShowSpan((1.0, 2.0))),
        ('{"n":3,"do":"zoom","span":null}', actions.ShowSpan(None)),
        ('{"n":4,"do":"charts","titles":["a"]}', actions.ShowCharts(("a",))),
        ('{"n":5,"do":"table"}', actions.SaveCurves()),
        ('{"n":6,"do":"reflector","id":"R1"}', SelectReflectors(("R1",), fly=True)),
        ('{"n":7,"do":"color","figure":"nis"}', actions.ColorReflectors("nis")),
    ],
)
def test_what_the_script_says_is_an_action(text: str, meant: Action) -> None:
    assert action_of(text) == meant


@pytest.mark.parametrize(
    "text",
    [
        "",
        "seek",
        '{"do":"at","time":1}',
        '{"n":1,"do":"at","time":-1}',
        '{"n":1,"do":"at","time":NaN}',
        '{"n":1,"do":"at","time":"1"}',
        '{"n":1,"do":"erase"}',
        '{"n":1,"do":"table","more":1}',
        '{"n":1,"do":"zoom"}',
    ],
)
def test_whatever_else_is_written_there_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected what their script says"):
        action_of(text)
